//! Satellite trails and cosmic rays.

use super::poisson::poisson;
use super::scene::Scene;
use crate::base::coords::PixelPoint;
use crate::camera::CameraModel;
use crate::camera::data_sheet::DataSheet;
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::TAU;

/// The trail of a satellite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trail {
    /// Start.
    pub from: PixelPoint,
    /// End.
    pub to: PixelPoint,
}

impl Trail {
    /// Length, in pixels.
    pub fn length_px(&self) -> f64 {
        self.from.distance_to(&self.to)
    }

    /// The point at a fraction `part` of its length.
    pub fn at(&self, part: f64) -> PixelPoint {
        let along = |from: f64, to: f64| from + part * (to - from);
        PixelPoint::new(along(self.from.x, self.to.x), along(self.from.y, self.to.y))
    }
}

/// The trails on a frame: each crosses a random position on it in the middle of the exposure.
pub(super) fn trails(
    scene: &Scene,
    camera: &CameraModel,
    exposure_s: f64,
    random: &mut ChaCha8Rng,
) -> Vec<Trail> {
    let length_px = camera.focal_length_px() * (scene.trail_rate_deg_s * exposure_s).to_radians();
    let count = poisson(scene.trails, random) as usize;
    let mut trail = |_| {
        let middle = place(camera, random);
        let (sin, cos) = libm::sincos(random.random_range(0.0..TAU));
        let end = |part: f64| {
            PixelPoint::new(
                middle.x + part * length_px * cos,
                middle.y + part * length_px * sin,
            )
        };
        Trail {
            from: end(-0.5),
            to: end(0.5),
        }
    };
    (0..count).map(&mut trail).collect()
}

/// A random position on the frame.
pub(super) fn place(camera: &CameraModel, random: &mut ChaCha8Rng) -> PixelPoint {
    let mut along = |side: f64| random.random_range(-0.5..side - 0.5);
    PixelPoint::new(along(camera.width_px), along(camera.height_px))
}

/// The path of a cosmic ray through the detector.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CosmicRay {
    /// Entry point.
    pub from: PixelPoint,
    /// Exit point.
    pub to: PixelPoint,
    /// Charge along the path.
    pub electrons: f64,
}

/// Mean number of cosmic rays on the detector in an exposure.
pub(super) fn mean_cosmic_rays(scene: &Scene, sheet: &DataSheet, exposure_s: f64) -> f64 {
    const CM2_PER_UM2: f64 = 1e-8;
    let pixels = sheet.width_px as f64 * sheet.height_px as f64;
    let area_cm2 = pixels * sheet.pitch_x_um * sheet.pitch_y_um * CM2_PER_UM2;
    scene.cosmic_rays_cm2_s * area_cm2 * exposure_s
}

/// The cosmic rays on the detector in an exposure, from all directions of a half space.
pub(super) fn cosmic_rays(
    scene: &Scene,
    sheet: &DataSheet,
    camera: &CameraModel,
    exposure_s: f64,
    random: &mut ChaCha8Rng,
) -> Vec<CosmicRay> {
    /// Longest path of a particle, in depths of the layer, for one almost parallel to it.
    const LONGEST_WAY: f64 = 100.0;
    /// Standard deviation of the logarithm of the charge per micrometre.
    const CHARGE_SPREAD: f64 = 0.3;
    let mean = mean_cosmic_rays(scene, sheet, exposure_s);
    let count = poisson(mean, random) as usize;
    let depth_um = sheet.imperfections.depth_um;
    let mut ray = |_| {
        let from = place(camera, random);
        // The flux through a plane is proportional to the cosine of the angle: the square of the
        // cosine is uniform.
        let cosine: f64 = random.random::<f64>().sqrt();
        let way_um = depth_um * (1.0 / cosine).min(LONGEST_WAY);
        let along_um = (way_um * way_um - depth_um * depth_um).max(0.0).sqrt();
        let (sin, cos) = libm::sincos(random.random_range(0.0..TAU));
        let deviate: f64 = StandardNormal.sample(random);
        let spread = libm::exp(CHARGE_SPREAD * deviate - 0.5 * CHARGE_SPREAD * CHARGE_SPREAD);
        CosmicRay {
            from,
            to: PixelPoint::new(
                from.x + along_um * cos / sheet.pitch_x_um,
                from.y + along_um * sin / sheet.pitch_y_um,
            ),
            electrons: (scene.cosmic_ray_e_um * way_um * spread).round(),
        }
    };
    (0..count).map(&mut ray).collect()
}

impl CosmicRay {
    /// Calls `put` with the column and row of points along the path, and the charge of each step.
    pub(super) fn along(&self, mut put: impl FnMut(i64, i64, f64)) {
        /// Step along the path of a particle, in pixels.
        const STEP_PX: f64 = 0.25;
        let trail = Trail {
            from: self.from,
            to: self.to,
        };
        let steps = (trail.length_px() / STEP_PX).ceil().max(1.0);
        for step in 0..steps as usize {
            let point = trail.at((step as f64 + 0.5) / steps);
            put(
                point.x.round() as i64,
                point.y.round() as i64,
                self.electrons / steps,
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::data_sheet::Preset;
    use crate::lab::simulate::camera_of;
    use rand::SeedableRng;

    #[test]
    fn as_many_rays_hit_as_the_rate_says_and_leave_their_charge() {
        let sheet = Preset::Imx174.data_sheet();
        let camera = camera_of(&sheet);
        let scene = Scene {
            cosmic_rays_cm2_s: 100.0,
            ..Scene::default()
        };
        let mut random = ChaCha8Rng::seed_from_u64(2);
        let rays = cosmic_rays(&scene, &sheet, &camera, 10.0, &mut random);
        // 1936 · 1216 pixels of 5.86 µm: 0.808 cm², 808 rays; five standard errors.
        assert!((rays.len() as f64 - 808.0).abs() < 143.0, "{}", rays.len());
        let mean_e = rays.iter().map(|ray| ray.electrons).sum::<f64>() / rays.len() as f64;
        // The mean of 1/cos is 2, over a layer of 10 µm: 1600 electrons; its spread is wide.
        assert!((1400.0..1900.0).contains(&mean_e), "{mean_e}");
        let mut sum = 0.0;
        rays[0].along(|_, _, electrons| sum += electrons);
        assert!((sum - rays[0].electrons).abs() < 1e-6);
    }

    #[test]
    fn a_trail_is_as_long_as_the_satellite_moves() {
        let sheet = Preset::Imx174.data_sheet();
        let camera = camera_of(&sheet);
        let scene = Scene {
            trails: 5.0,
            ..Scene::default()
        };
        let trails = trails(&scene, &camera, 0.2, &mut ChaCha8Rng::seed_from_u64(3));
        assert!((1..15).contains(&trails.len()));
        // 0.1° at 35 mm and 5.86 µm: 10.4 px.
        assert!(trails.iter().all(|t| (t.length_px() - 10.42).abs() < 0.01));
    }
}
