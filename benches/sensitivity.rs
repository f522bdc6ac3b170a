//! Time of a prediction, alone and as part of a frame: `cargo bench --bench sensitivity`

#![allow(
    clippy::unwrap_used,
    reason = "a benchmark that cannot go on should stop"
)]
#![allow(missing_docs, reason = "criterion makes public functions")]

use criterion::{Criterion, criterion_group, criterion_main};
use starpipe::base::coords::{Rotation, UnitVector};
use starpipe::camera::data_sheet::Preset;
use starpipe::catalog::Catalog;
use starpipe::ephemeris::places::StarPlaces;
use starpipe::lab::simulate::{Pointing, Scene, Simulator};
use starpipe::predict::{Budget, Detector, Rule, Scenario};
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
        icrs_to_camera: Rotation::looking_at(&boresight, 0.0),
        places: StarPlaces::default(),
    };
    let stars = Catalog::built_in().stars();
    let simulator = Simulator::new(&scenario, &Scene::default(), stars).unwrap();
    criterion.bench_function("simulate/752x582", |b| {
        b.iter(|| simulator.frame(&pointing, black_box(1)).unwrap());
    });
    let mut patterned = scenario.clone();
    patterned.camera.imperfections.response_sigma = 0.01;
    patterned.camera.imperfections.vignetting = 0.3;
    let simulator = Simulator::new(&patterned, &Scene::default(), stars).unwrap();
    criterion.bench_function("simulate/752x582_uneven", |b| {
        b.iter(|| simulator.frame(&pointing, black_box(1)).unwrap());
    });
}

criterion_group!(benches, prediction, simulation);
criterion_main!(benches);
