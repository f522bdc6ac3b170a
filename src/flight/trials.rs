//! How often are frames identified with a catalogue, and how often wrongly?
//!
//! A frame here is a list of places: stars of the whole catalogue, also those that are fainter than the exported ones,
//! with errors of place and brightness. The camera is an ideal pinhole of 1024 × 1024 pixels.

use super::export::flown;
use crate::base::format::counted;
use crate::catalog::Catalog;
use nalgebra::{Matrix3, Quaternion, UnitQuaternion};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use starpipe_flight::{Budget, Camera, Config, Error, Sensor, Sky, Spot, Status, Tracker, Work};

const SIDE_PX: u32 = 1024;
/// Error of a star's place on each axis, in pixels.
const PLACE_SIGMA_PX: f64 = 0.1;
/// Error of a star's brightness.
const BRIGHTNESS_SIGMA_MAG: f64 = 0.15;
/// The camera sees stars this much fainter than the exported ones.
const DEEPER_MAG: f64 = 0.5;
/// Most stars of a frame.
const MAX_STARS: usize = 64;
/// An attitude that is off by more, in radians, is wrong.
const WRONG_RAD: f64 = 2e-3;

/// What trials with one field of view found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trials {
    /// Field of view, in degrees.
    pub fov_deg: f64,
    /// Frames.
    pub frames: usize,
    /// Those that were identified, and rightly.
    pub identified: usize,
    /// Those that were identified, and wrongly.
    pub wrong: usize,
    /// Mean number of stars.
    pub mean_stars: f64,
    /// Most triangles that were compared in a frame.
    pub most_candidates: u32,
    /// Most attitudes that were tried in a frame.
    pub most_attitudes: u32,
    /// Bytes of memory that the tracker needs.
    pub memory_bytes: usize,
}

impl Trials {
    /// Tries frames of random attitudes with the catalogue in `exported`.
    ///
    /// # Errors
    /// `exported` is no catalogue, or not for this field of view.
    pub fn run(
        catalog: &Catalog,
        exported: &[u8],
        fov_deg: f64,
        frames: usize,
        seed: u64,
    ) -> Result<Self, Error> {
        let read = starpipe_flight::Catalog::new(exported)?;
        let seen = Sight::new(catalog, read.v_limit() + DEEPER_MAG);
        let config = config(fov_deg);
        let mut block = vec![0; Tracker::words(&config, &read)?];
        let memory_bytes = block.len() * size_of::<u64>();
        let mut tracker = Tracker::new(&mut block, config, read)?;
        let mut trials = Self {
            fov_deg,
            frames,
            identified: 0,
            wrong: 0,
            mean_stars: 0.0,
            most_candidates: 0,
            most_attitudes: 0,
            memory_bytes,
        };
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        for _ in 0..frames {
            let attitude = any_attitude(&mut random);
            let spots = seen.spots(&attitude, &config.camera, &mut random);
            let sky = Sky {
                year: read.epoch_year(),
                velocity_km_s: [0.0; 3],
            };
            let found = tracker.lost(&spots, &sky, &Budget::default());
            trials.add(tracker.work(), spots.len());
            if found.status == Status::FOUND {
                let [w, x, y, z] = found.quaternion;
                let found = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
                let off = (found.to_rotation_matrix().matrix() - attitude).norm();
                if off < WRONG_RAD {
                    trials.identified += 1;
                } else {
                    trials.wrong += 1;
                }
            }
        }
        Ok(trials)
    }

    fn add(&mut self, work: &Work, stars: usize) {
        self.mean_stars += stars as f64 / self.frames as f64;
        self.most_candidates = self.most_candidates.max(work.candidates);
        self.most_attitudes = self.most_attitudes.max(work.attitudes);
    }

    /// In words, in a line.
    pub fn to_text(&self) -> String {
        let share = 100.0 * self.identified as f64 / self.frames.max(1) as f64;
        format!(
            "{:5.1}°: {share:6.2} % of {} identified, {} wrong; {:.0} stars in a frame; at most {} triangles compared, {} \
             tried; memory {} bytes",
            self.fov_deg,
            counted(self.frames, "frame"),
            self.wrong,
            self.mean_stars,
            self.most_candidates,
            self.most_attitudes,
            self.memory_bytes
        )
    }
}

fn config(fov_deg: f64) -> Config {
    let half_px = 0.5 * f64::from(SIDE_PX);
    let centre_px = half_px - 0.5;
    Config {
        camera: Camera {
            width_px: SIDE_PX,
            height_px: SIDE_PX,
            focal_length_px: half_px / libm::tan(0.5 * fov_deg.to_radians()),
            center_px: [centre_px, centre_px],
            ..Camera::default()
        },
        sensor: Sensor {
            exposure_s: 1.0,
            gain_e_per_adu: 1.0,
            saturation_adu: f64::INFINITY,
            ..Sensor::default()
        },
        spot_sigma_px: 1.0,
        detection_sigma: 5.0,
        position_floor_px: 0.0,
        scale_error: 1e-3,
        max_log10_false_alarm: -7.0,
        max_stars: MAX_STARS as u32,
    }
}

/// The stars that the camera sees, the brightest first.
struct Sight {
    stars: Vec<starpipe_flight::Star>,
}

impl Sight {
    fn new(catalog: &Catalog, v_limit: f64) -> Self {
        let stars = catalog.stars().iter().enumerate();
        let stars = stars.map(|(index, star)| flown(index, star));
        Self {
            stars: stars.filter(|star| star.v_mag <= v_limit).collect(),
        }
    }

    /// The spots of a frame, the brightest first.
    fn spots(
        &self,
        attitude: &Matrix3<f64>,
        camera: &Camera,
        random: &mut ChaCha8Rng,
    ) -> Vec<Spot> {
        let mut normal = || random.sample::<f64, _>(StandardNormal);
        let side_px = f64::from(SIDE_PX);
        let mut spots = Vec::new();
        for star in &self.stars {
            let seen = attitude * star.direction;
            if seen.z <= 0.0 {
                continue;
            }
            let place = [0, 1]
                .map(|axis| camera.center_px[axis] + camera.focal_length_px * seen[axis] / seen.z);
            if place.iter().all(|at| (-0.5..side_px - 0.5).contains(at)) {
                let mag = star.v_mag + BRIGHTNESS_SIGMA_MAG * normal();
                spots.push(Spot {
                    x_px: place[0] + PLACE_SIGMA_PX * normal(),
                    y_px: place[1] + PLACE_SIGMA_PX * normal(),
                    sigma_px: PLACE_SIGMA_PX,
                    flux_adu: libm::pow(10.0, -0.4 * (mag - 12.0)) as f32,
                    snr: 20.0,
                });
            }
        }
        spots.sort_by(|a, b| b.flux_adu.total_cmp(&a.flux_adu));
        spots.truncate(MAX_STARS);
        spots
    }
}

/// An attitude with any direction and roll, each as probable.
fn any_attitude(random: &mut ChaCha8Rng) -> Matrix3<f64> {
    let parts = [(); 4].map(|()| random.sample::<f64, _>(StandardNormal));
    let [w, x, y, z] = parts;
    let turn = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
    *turn.to_rotation_matrix().matrix()
}

#[cfg(test)]
mod tests {
    use super::super::export;
    use super::*;

    #[test]
    fn an_exported_catalog_identifies_frames_and_none_wrongly() {
        let catalog = Catalog::built_in();
        let exported = export(catalog, [15.0, 20.0], 5.5, 1_000_000).unwrap();
        assert!(exported.len() <= 1_000_000);
        for fov_deg in [15.0, 20.0] {
            let trials = Trials::run(catalog, &exported, fov_deg, 100, 7).unwrap();
            assert!(trials.identified >= 90 && trials.wrong == 0, "{trials:?}");
            assert_eq!(
                trials,
                Trials::run(catalog, &exported, fov_deg, 100, 7).unwrap()
            );
        }
        assert_eq!(
            Trials::run(catalog, &exported, 5.0, 1, 7).unwrap_err(),
            Error::Config
        );
    }
}
