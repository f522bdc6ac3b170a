//! What a prediction costs, and what it adds to a frame: `cargo bench --bench sensitivity`

#![allow(
    clippy::unwrap_used,
    reason = "a benchmark that cannot go on should stop"
)]
#![allow(missing_docs, reason = "criterion makes public functions")]

use criterion::{Criterion, criterion_group, criterion_main};
use starpipe::catalog::Catalog;
use starpipe::coords::{Rotation, UnitVector};
use starpipe::sensitivity::{Budget, Detector, Rule, Scenario};
use starpipe::sensor::Preset;
use starpipe::simulate::{Pointing, frame_of_sky, square_pixel_camera};
use std::hint::black_box;

fn prediction(criterion: &mut Criterion) {
    let scenario = Scenario::of(Preset::Experiment1);
    let budget = Budget::new(&scenario);
    criterion.bench_function("budget", |b| b.iter(|| Budget::new(black_box(&scenario))));
    for (name, rule) in [
        ("completeness/peak_pixel", Rule::PeakPixel),
        ("completeness/matched_filter", Rule::MatchedFilter),
    ] {
        criterion.bench_function(name, |b| {
            b.iter(|| Detector::new(rule, black_box(&scenario), &budget));
        });
    }
}

fn simulation(criterion: &mut Criterion) {
    let scenario = Scenario::of(Preset::Experiment2);
    let boresight = UnitVector::from_ra_dec(296.8f64.to_radians(), 41.4f64.to_radians());
    let pointing = Pointing {
        camera: square_pixel_camera(&scenario.sensor),
        icrs_to_camera: Rotation::looking_at(&boresight, 0.0),
        years_since_j2000: 0.0,
    };
    let stars = Catalog::built_in().stars();
    criterion.bench_function("frame_of_sky/752x582", |b| {
        b.iter(|| frame_of_sky(&scenario, &pointing, stars, black_box(1)).unwrap());
    });
}

criterion_group!(benches, prediction, simulation);
criterion_main!(benches);
