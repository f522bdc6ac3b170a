//! How often are frames of a camera identified, with which errors? Frames are drawn star by star.
//!
//!     cargo run --release --features build --example trials -- FOV_DEG V_LIMIT BUDGET_BYTES FRAMES
#![allow(
    clippy::disallowed_methods,
    reason = "tests may differ in the last bit"
)]

#[path = "../tests/sky/mod.rs"]
mod sky;

use nalgebra::{Matrix3, Vector3};
use starpipe_flight::{Budget, Catalog, Image, Sky, Spot, Status, Tracker, build, limiting_v_mag};
use std::time::Instant;

fn main() {
    let arguments: Vec<f64> = std::env::args()
        .skip(1)
        .map(|text| text.parse().expect("a number"))
        .collect();
    let [fov_deg, v_limit, budget_bytes, frames] = arguments[..] else {
        panic!("FOV_DEG V_LIMIT BUDGET_BYTES FRAMES");
    };
    let stars = sky::stars();
    let plan = build::Plan {
        fov_deg: [fov_deg, fov_deg],
        v_limit,
        epoch_year: 2000.0,
        budget_bytes: budget_bytes as usize,
    };
    let bytes = build::catalog(&stars, &plan).expect("a catalogue");
    let catalog = Catalog::new(&bytes).expect("what was made is read");
    let config = sky::config(fov_deg);
    let mut block = vec![0_u64; Tracker::words(&config, &catalog).expect("a configuration")];
    println!(
        "{} stars, {} triangles, {} bytes; block {} bytes; limit V {:.2}",
        catalog.len(),
        catalog.triangles(),
        bytes.len(),
        8 * block.len(),
        limiting_v_mag(&config)
    );
    let mut tracker = Tracker::new(&mut block, config, catalog).expect("a tracker");
    let (mut found, mut wrong, mut nees, mut worst) = (0, 0, 0.0, starpipe_flight::Work::default());
    let mut axis = [0.0; 3];
    let (mut detect_s, mut lost_s, mut stars_found) = (0.0, 0.0, 0);
    for frame in 0..frames as u64 {
        let mut rng = sky::rng(frame);
        let attitude = sky::any_attitude(&mut rng);
        let scene = sky::Scene {
            config: &config,
            stars: &stars,
            attitude,
            rate_rad_s: Vector3::zeros(),
            velocity_km_s: Vector3::new(20.0, -15.0, 8.0),
            years: 26.0,
        };
        let pixels = scene.image(&mut rng);
        let image = Image::of_16_bits(&pixels, [1024, 1024], 1024).expect("an image");
        let mut spots = [Spot::default(); 64];
        let start = Instant::now();
        let count = tracker
            .detect(&image, &mut spots)
            .expect("an image of the camera");
        detect_s += start.elapsed().as_secs_f64();
        stars_found += count;
        let place = Sky {
            year: 2026.0,
            velocity_km_s: [20.0, -15.0, 8.0],
        };
        let start = Instant::now();
        let result = tracker.lost(&spots[..count], &place, &Budget::default());
        lost_s += start.elapsed().as_secs_f64();
        let work = tracker.work();
        worst.candidates = worst.candidates.max(work.candidates);
        worst.attitudes = worst.attitudes.max(work.attitudes);
        worst.triangles = worst.triangles.max(work.triangles);
        if result.status != Status::FOUND {
            if frame < 30 {
                println!(
                    "frame {frame}: {:?}, {count} spots, {work:?}",
                    result.status
                );
            }
            continue;
        }
        let error = sky::error_rad(&scene.attitude, result.quaternion);
        if error.norm() > 1e-3 {
            wrong += 1;
            println!("frame {frame} is wrong: {result:?}");
            continue;
        }
        found += 1;
        let covariance = Matrix3::from_fn(|row, column| result.covariance_rad2[row][column]);
        nees +=
            (error.transpose() * covariance.try_inverse().expect("a covariance") * error)[0] / 3.0;
        for part in 0..3 {
            axis[part] += error[part].powi(2) / covariance[(part, part)];
        }
    }
    let of_found = |sum: f64| sum / f64::from(found.max(1));
    println!(
        "{found} of {frames} found, {wrong} wrong; NEES {:.2}, by axis {:.2?}; {:.1} spots; detection {:.1} ms, search {:.3} ms; most {worst:?}",
        of_found(nees),
        axis.map(of_found),
        stars_found as f64 / frames,
        1e3 * detect_s / frames,
        1e3 * lost_s / frames
    );
}
