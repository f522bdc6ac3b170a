//! Time of a tracked frame, from pixels in memory to the attitude with 30 stars: one frame again and
//! again, which the caches hold; 60 frames, which take 74 MB and come from memory; and frames whose
//! stars are smeared by a turn during the exposure.

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::Vector3;
use starpipe::base::coords::{Rotation, UnitVector};
use starpipe::camera::data_sheet::{DataSheet, Preset};
use starpipe::ephemeris::places::StarPlaces;
use starpipe::frame::Frame;
use starpipe::identify::IndexedCatalog;
use starpipe::lab::simulate::{Pointing, Scene, Simulator};
use starpipe::predict::Scenario;
use starpipe::solve::Context;
use starpipe::track::{Mode, Tracker};
use std::hint::black_box;

const INTERVAL_S: f64 = 0.1;
const EXPOSURE_S: f64 = 0.05;

/// The nanosat tracker with its pixels binned four by four.
fn camera() -> DataSheet {
    DataSheet {
        width_px: 640,
        height_px: 480,
        pitch_x_um: 8.8,
        pitch_y_um: 8.8,
        spot_sigma_px: 0.9,
        peak_share: None,
        ..Preset::NanosatTracker.data_sheet()
    }
}

/// Frames of a camera that swings by `swing_deg` about all of its axes, within as many frames as
/// there are: their sequence can be repeated without a jump.
fn sequence(swing_deg: f64, count: u32, indexed: &IndexedCatalog) -> Vec<Frame<'static>> {
    let start = Rotation::looking_at(&UnitVector::from_ra_dec(1.4, 0.1), 0.3);
    let axis = Vector3::new(0.6, 0.64, 0.48);
    let mut scenario = Scenario::new(camera());
    scenario.conditions.exposure_s = EXPOSURE_S;
    let frame = |number: u32| {
        let phase = std::f64::consts::TAU * f64::from(number) / f64::from(count);
        let per_s = std::f64::consts::TAU / (f64::from(count) * INTERVAL_S);
        let rate_deg_s = axis * (swing_deg * phase.cos() * per_s);
        let mut scene = Scene::default();
        scene.rate_x_deg_s = rate_deg_s.x;
        scene.rate_y_deg_s = rate_deg_s.y;
        scene.rate_z_deg_s = rate_deg_s.z;
        scene.faintest_vmag = Some(9.0);
        let simulator = Simulator::new(&scenario, &scene, indexed.stars());
        let turn = -axis * (swing_deg * phase.sin()).to_radians();
        let pointing = Pointing {
            icrs_to_camera: start.then_turn(turn),
            places: StarPlaces::default(),
        };
        let made = simulator.and_then(|simulator| simulator.frame(&pointing, u64::from(number)));
        made.expect("a valid camera").0
    };
    (0..count).map(frame).collect()
}

fn bench(criterion: &mut Criterion) {
    let indexed = IndexedCatalog::built_in();
    let mut group = criterion.benchmark_group("track");
    for (name, swing_deg, count) in [
        ("30 stars, frame in the cache", 0.0, 1),
        ("30 stars, frames in memory", 0.02, 60),
        ("30 stars, smeared", 1.5, 60),
    ] {
        let frames = sequence(swing_deg, count, &indexed);
        let mut context = Context::new(&indexed);
        context.priors.exposure_s = Some(EXPOSURE_S);
        let mut tracker = Tracker::new(context);
        let (mut number, mut frame) = (0u32, 0);
        let mut next = |tracker: &mut Tracker, frame: &Frame| {
            number += 1;
            let time_s = INTERVAL_S * f64::from(number);
            tracker.process_frame(frame, Some(time_s)).expect("a frame")
        };
        group.bench_function(name, |bencher| {
            bencher.iter_custom(|count| {
                let mut total = std::time::Duration::ZERO;
                for _ in 0..count {
                    let start = std::time::Instant::now();
                    let track = black_box(next(&mut tracker, black_box(&frames[frame])));
                    let took = start.elapsed();
                    frame = (frame + 1) % frames.len();
                    // The first two frames are solved in full.
                    if track.mode == Mode::Tracked {
                        total += took;
                    } else {
                        assert!(track.attitude.is_some());
                    }
                }
                total
            });
        });
    }
    group.finish();
}

criterion_group!(track_benches, bench);
criterion_main!(track_benches);
