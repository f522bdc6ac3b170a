//! Simulated frames of a camera that turns.

use nalgebra::Vector3;
use starpipe::base::coords::{Camera, Icrs, Rotation, UnitVector};
use starpipe::camera::data_sheet::{DataSheet, Preset};
use starpipe::catalog::Catalog;
use starpipe::ephemeris::places::StarPlaces;
use starpipe::frame::Frame;
use starpipe::lab::simulate::{Pointing, Scene, Simulator};
use starpipe::predict::Scenario;

/// Time from frame to frame, in seconds.
pub const INTERVAL_S: f64 = 0.1;
/// Exposure, in seconds.
pub const EXPOSURE_S: f64 = 0.02;

/// A camera of 640 × 480 pixels and 20°: the nanosat tracker with its pixels binned.
fn scenario() -> Scenario {
    let camera = DataSheet {
        width_px: 640,
        height_px: 480,
        pitch_x_um: 8.8,
        pitch_y_um: 8.8,
        spot_sigma_px: 0.9,
        peak_share: None,
        ..Preset::NanosatTracker.data_sheet()
    };
    let mut scenario = Scenario::new(camera);
    scenario.conditions.exposure_s = EXPOSURE_S;
    scenario
}

/// The attitude of frame `number` of a camera that turns at `rate_deg_s` about its own axes.
pub fn attitude(rate_deg_s: Vector3<f64>, number: u32) -> Rotation<Icrs, Camera> {
    let turn = -rate_deg_s.map(f64::to_radians) * (INTERVAL_S * f64::from(number));
    Rotation::looking_at(&UnitVector::from_ra_dec(1.4, 0.1), 0.3).then_turn(turn)
}

/// A frame at an attitude, of a camera that turns.
pub fn frame(at: Rotation<Icrs, Camera>, rate_deg_s: Vector3<f64>, seed: u64) -> Frame<'static> {
    let mut scene = Scene::default();
    scene.rate_x_deg_s = rate_deg_s.x;
    scene.rate_y_deg_s = rate_deg_s.y;
    scene.rate_z_deg_s = rate_deg_s.z;
    scene.faintest_vmag = Some(8.0);
    let stars = Catalog::built_in().stars();
    let simulator = Simulator::new(&scenario(), &scene, stars).expect("a valid camera");
    let pointing = Pointing {
        icrs_to_camera: at,
        places: StarPlaces::default(),
    };
    simulator.frame(&pointing, seed).expect("a frame").0
}

/// A frame without light.
pub fn dark(seed: u64) -> Frame<'static> {
    let simulator = Simulator::new(&scenario(), &Scene::default(), &[]).expect("a valid camera");
    simulator.dark(seed).expect("a frame")
}
