//! The limiting magnitude of a star sensor, and which of its parameters is worth improving:
//! `cargo run --release --no-default-features --features built-in-catalog --example limiting_magnitude`

use starpipe::camera::data_sheet::Preset;
use starpipe::predict::{Extinction, Prediction, Scenario, ScenarioError};

/// What to change of a scenario, and how it is called.
type Change = (&'static str, fn(&mut Scenario));

const CHANGES: [Change; 4] = [
    ("twice the aperture", |s| s.camera.aperture_mm *= 2.0),
    ("twice the exposure", |s| s.conditions.exposure_s *= 2.0),
    ("half the read noise", |s| s.camera.read_noise_e *= 0.5),
    ("half the spot size", |s| s.camera.spot_sigma_px *= 0.5),
];

fn main() -> Result<(), ScenarioError> {
    // A star tracker in space, where there is no atmosphere.
    let mut scenario = Scenario::of(Preset::NanosatTracker);
    scenario.conditions.extinction = Extinction::MagPerAirmass(0.0);
    let prediction = Prediction::new(&scenario)?;
    println!(
        "{}: V {:.2} by its brightest pixel",
        prediction.camera, prediction.limit_vmag
    );
    // The matched filter sees all pixels of a star, and so goes fainter.
    if let Some(limit_vmag) = prediction.detector.limit50_vmag {
        println!("starpipe finds half of the stars of V {limit_vmag:.2}");
    }
    for (name, change) in CHANGES {
        let mut changed = scenario.clone();
        change(&mut changed);
        let gain_mag = Prediction::new(&changed)?.limit_vmag - prediction.limit_vmag;
        println!("  {name}: {gain_mag:+.2} mag");
    }
    Ok(())
}
