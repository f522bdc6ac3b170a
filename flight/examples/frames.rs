//! Draws images of a turning camera, makes a catalogue for it, and writes both to a folder; then finds and follows the
//! attitude, as `capi/example/track.c` does in C.
//!
//!     cargo run --release --features build --example frames -- FOLDER

#[path = "../tests/sky/mod.rs"]
mod sky;

use nalgebra::{Rotation3, Vector3};
use starpipe_flight::{Budget, Camera, Catalog, Config, Image, Sky, Spot, Status, Tracker, build};
use std::fs;
use std::path::PathBuf;

const IMAGES: usize = 12;
const INTERVAL_S: f64 = 0.25;

fn main() -> std::io::Result<()> {
    let folder = PathBuf::from(std::env::args().nth(1).expect("a folder"));
    let stars = sky::stars();
    let plan = build::Plan {
        fov_deg: [12.0, 20.0],
        v_limit: 6.0,
        epoch_year: 2000.0,
        budget_bytes: 2_000_000,
    };
    let catalog = build::catalog(&stars, &plan).expect("a catalogue");
    fs::write(folder.join("catalog.bin"), &catalog)?;
    let config = sky::config(16.0);
    let config = Config {
        camera: Camera {
            focal_length_px: 3640.0,
            ..config.camera
        },
        ..config
    };
    let rate_rad_s = Vector3::new(0.2, -0.15, 0.1).map(f64::to_radians);
    let velocity_km_s = [20.0, -15.0, 8.0];
    let mut rng = sky::rng(11);
    let mut attitude = sky::any_attitude(&mut rng);
    let mut images = Vec::new();
    for _ in 0..IMAGES {
        let velocity_km_s = velocity_km_s.into();
        let scene = sky::Scene {
            config: &config,
            stars: &stars,
            attitude,
            rate_rad_s,
            velocity_km_s,
            years: 26.0,
        };
        images.push(scene.image(&mut rng));
        attitude = Rotation3::new(-rate_rad_s * INTERVAL_S).matrix() * attitude;
    }
    let bytes: Vec<u8> = images
        .iter()
        .flatten()
        .flat_map(|level| level.to_ne_bytes())
        .collect();
    fs::write(folder.join("images.bin"), bytes)?;
    follow(
        &images,
        config,
        Catalog::new(&catalog).expect("a catalogue"),
        &Sky {
            year: 2026.0,
            velocity_km_s,
        },
    );
    Ok(())
}

fn follow(images: &[Vec<u16>], config: Config, catalog: Catalog, sky: &Sky) {
    let mut block = vec![0; Tracker::words(&config, &catalog).expect("a configuration")];
    let mut tracker = Tracker::new(&mut block, config, catalog).expect("a tracker");
    for (number, pixels) in images.iter().enumerate() {
        let image = Image::of_16_bits(pixels, [1024, 1024], 1024).expect("an image");
        let time_s = INTERVAL_S * number as f64;
        let mut attitude = tracker
            .track(&image, time_s, sky)
            .expect("an image of the camera");
        let mut way = "tracked";
        if attitude.status != Status::FOUND {
            way = "lost";
            let mut spots = [Spot::default(); 64];
            let count = tracker
                .detect(&image, &mut spots)
                .expect("an image of the camera");
            attitude = tracker.lost(&spots[..count], sky, &Budget::default());
            tracker.start(&attitude, time_s);
        }
        let bits = |value: f64| format!("{:016x}", value.to_bits());
        let quaternion = attitude.quaternion.map(bits).join(" ");
        let variances = [0, 1, 2]
            .map(|axis| bits(attitude.covariance_rad2[axis][axis]))
            .join(" ");
        println!(
            "{number} {way} {}, {} stars: {quaternion}, {variances}",
            attitude.status.text(),
            attitude.stars
        );
    }
}
