//! The stars on a frame: positions and magnitudes.

use super::camera::Pointing;
use super::poisson::poisson;
use super::scene::Scene;
use super::sky::SimulatedSky;
use super::strays::place;
use super::truth::TrueStar;
use crate::base::coords::UnitVector;
use crate::camera::CameraModel;
use crate::catalog::{Star, StarIndex};
use crate::predict::StarLight;
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::PI;

/// Draws the stars of a frame.
pub(super) struct StarSampler<'a> {
    pub(super) camera: &'a CameraModel,
    pub(super) scene: &'a Scene,
    pub(super) light: &'a StarLight,
    pub(super) sky: &'a SimulatedSky<'a>,
}

impl StarSampler<'_> {
    /// The catalogue stars whose light reaches the frame, followed by false ones.
    pub(super) fn on_frame(
        &self,
        pointing: &Pointing,
        stars: &[Star],
        reach_px: f64,
        random: &mut ChaCha8Rng,
    ) -> Vec<TrueStar> {
        let mut all = self.of_catalog(pointing, stars, reach_px, random);
        all.extend(self.false_ones(random));
        for (number, star) in all.iter_mut().enumerate() {
            star.number = number;
        }
        all
    }

    fn of_catalog(
        &self,
        pointing: &Pointing,
        stars: &[Star],
        reach_px: f64,
        random: &mut ChaCha8Rng,
    ) -> Vec<TrueStar> {
        /// Largest shift of a place: Barnard's Star in 200 years, and refraction at the horizon.
        const SHIFT_ROOM_RAD: f64 = 0.02;
        let boresight = pointing
            .icrs_to_camera
            .inverse()
            .apply(&UnitVector::BORESIGHT);
        // Margin for light from outside, and for apparent places.
        let margin_rad = 2.0 * reach_px / self.camera.focal_length_px() + SHIFT_ROOM_RAD;
        let least_cosine = libm::cos((self.camera.radius_rad() + margin_rad).min(PI));
        let is_near = |star: &Star| star.direction.dot(&boresight) > least_cosine;
        let near = stars.iter().enumerate().filter(|(_, star)| is_near(star));
        near.filter_map(|(catalog, star)| {
            let direction = pointing.places.of(star);
            let direction = pointing.icrs_to_camera.apply(&direction);
            let position = self.camera.pixel_of(&direction)?;
            if !self.camera.nearly_contains(&position, reach_px) {
                return None;
            }
            let is_missing = random.random::<f64>() < self.scene.missing;
            let deviate: f64 = StandardNormal.sample(random);
            let v_mag = f64::from(star.v_mag) + self.scene.vmag_sigma * deviate;
            let is_too_faint = self
                .scene
                .faintest_vmag
                .is_some_and(|faintest| v_mag > faintest);
            let bv_mag = star.bv_mag.map(f64::from);
            let electrons = self.light.electrons(v_mag, bv_mag) * self.sky.transmission(&position);
            (!is_missing && !is_too_faint).then_some(TrueStar {
                number: 0,
                catalog: Some(StarIndex::new(catalog)),
                position,
                v_mag,
                electrons,
            })
        })
        .collect()
    }

    /// False stars at random positions, with the magnitude distribution of the sky.
    fn false_ones(&self, random: &mut ChaCha8Rng) -> Vec<TrueStar> {
        /// Slope of log₁₀ star counts per magnitude.
        const COUNTS: f64 = 0.5;
        let limit = self.light.budget().limit_vmag;
        let faintest = self.scene.false_star_vmag.unwrap_or(limit);
        let count = poisson(self.scene.false_stars, random) as usize;
        let mut star = |_| {
            let position = place(self.camera, random);
            let brighter = libm::log10(1.0 - random.random::<f64>()) / COUNTS;
            let v_mag = faintest + brighter;
            TrueStar {
                number: 0,
                catalog: None,
                position,
                v_mag,
                electrons: self.light.electrons(v_mag, None) * self.sky.transmission(&position),
            }
        };
        (0..count).map(&mut star).collect()
    }
}
