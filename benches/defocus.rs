//! One grid point of each defocus study: `cargo bench --bench defocus`

#![allow(
    clippy::unwrap_used,
    reason = "a benchmark that cannot go on should stop"
)]
#![allow(missing_docs, reason = "criterion makes public functions")]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use starpipe::Interrupt;
use starpipe::camera::data_sheet::Preset;
use starpipe::lab::defocus::{Centroiding, EnergyStudy, PeakStudy};
use starpipe::predict::Scenario;
use std::hint::black_box;

fn points(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("defocus");
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let peak = PeakStudy::default();
    group.throughput(Throughput::Elements(peak.trials as u64));
    group.bench_function("peak", |b| {
        b.iter(|| peak.measure(black_box(1.0), 1e-3, &mut random));
    });
    group.bench_function("closed form", |b| {
        b.iter(|| peak.expected(black_box(1.0), 1e-3))
    });
    let energy = EnergyStudy {
        scenario: Scenario::of(Preset::NanosatTracker),
        v_mag: 4.0,
        centroiding: Centroiding::GaussianFit,
        half_window_px: peak.half_window_px,
        trials: 400,
    };
    group.throughput(Throughput::Elements(energy.trials as u64));
    group.bench_function("energy", |b| {
        b.iter(|| {
            energy
                .measure(black_box(1.0), 5.0, &mut random, &Interrupt::default())
                .unwrap()
        });
    });
    group.finish();
}

criterion_group!(benches, points);
criterion_main!(benches);
