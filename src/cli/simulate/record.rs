//! What is printed for each simulated frame.

use super::generator::{GeneratedFrame, Generator};
use serde::Serialize;
use starpipe::base::coords::{Camera, Icrs, Rotation};
use starpipe::base::units::DEG_PER_RAD;
use starpipe::lab::simulate::TrueStar;
use std::path::Path;

/// The printed facts of a frame.
#[derive(Debug, Serialize)]
pub(super) struct SimulationRecord {
    frame: String,
    /// The table of what is on it, if it has one.
    truth: Option<String>,
    number: u64,
    seed: u64,
    width: usize,
    height: usize,
    exposure_s: f64,
    date: Option<String>,
    attitude: Option<AttitudeRecord>,
    focal_length_px: f64,
    fov_x_deg: Option<f64>,
    mirrored: bool,
    predicted_limit_vmag: f64,
    stars_above_limit: Option<usize>,
    background_e: Option<f64>,
    motion_px: Option<[f64; 2]>,
}

#[derive(Debug, Serialize)]
struct AttitudeRecord {
    ra_deg: f64,
    dec_deg: f64,
    up_pa_deg: f64,
    quaternion: [f64; 4],
}

impl SimulationRecord {
    /// The record of `simulated`, which was written to `path` and its table to `truth_path`.
    pub(super) fn new(
        generator: &Generator,
        simulated: &GeneratedFrame,
        path: &Path,
        truth_path: Option<&Path>,
    ) -> Self {
        let truth = simulated.truth.as_ref();
        let camera = generator.simulator.camera();
        let light = generator.simulator.light();
        let is_bright = |star: &&TrueStar| light.vmag_of(star.electrons) <= generator.limit_vmag;
        Self {
            frame: path.display().to_string(),
            truth: truth_path.map(|path| path.display().to_string()),
            number: simulated.number,
            seed: simulated.seed,
            width: simulated.frame.width,
            height: simulated.frame.height,
            exposure_s: generator.setup.scenario.conditions.exposure_s,
            date: generator.date.map(|date| date.to_iso()),
            attitude: simulated
                .attitude()
                .as_ref()
                .map(AttitudeRecord::from_rotation),
            focal_length_px: camera.central_focal_length_px(),
            fov_x_deg: camera.fov_x_rad().map(|fov_rad| fov_rad * DEG_PER_RAD),
            mirrored: camera.mirrored,
            predicted_limit_vmag: generator.limit_vmag,
            stars_above_limit: truth.map(|truth| truth.stars.iter().filter(is_bright).count()),
            background_e: truth.map(|truth| truth.background_e),
            motion_px: truth.map(|truth| truth.motion_px),
        }
    }

    /// One line for people.
    pub(super) fn to_text(&self) -> String {
        let mut text = self.frame.clone();
        if let Some(attitude) = &self.attitude {
            text += &format!(
                "  RA {:.4}° Dec {:+.4}°, up at {:.3}°",
                attitude.ra_deg, attitude.dec_deg, attitude.up_pa_deg
            );
        }
        if let Some(stars) = self.stars_above_limit {
            text += &format!(
                ", {stars} stars of V {:.2} or brighter",
                self.predicted_limit_vmag
            );
        }
        text + "\n"
    }
}

impl AttitudeRecord {
    fn from_rotation(icrs_to_camera: &Rotation<Icrs, Camera>) -> Self {
        let (boresight, up_pa_rad) = icrs_to_camera.boresight_and_up();
        let (ra_rad, dec_rad) = boresight.to_ra_dec();
        Self {
            ra_deg: ra_rad * DEG_PER_RAD,
            dec_deg: dec_rad * DEG_PER_RAD,
            up_pa_deg: up_pa_rad * DEG_PER_RAD,
            quaternion: icrs_to_camera.to_quaternion(),
        }
    }
}
