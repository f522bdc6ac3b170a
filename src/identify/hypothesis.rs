//! A hypothesis about pointing and scale, and the catalogue stars that it predicts in the frame.

use crate::base::coords::{Camera, Icrs, Rotation};
use crate::base::units::RAD_PER_DEG;
use crate::camera::CameraModel;
use crate::identify::field::{ObservedStar, Photometry, StarField};
use crate::identify::index::IndexedCatalog;
use crate::identify::predict::{PredictedStar, PredictionDepth, SkyView, Surroundings};
use std::ops::Range;

/// Predicted stars for each observed one, where the zero point of the magnitudes is unknown.
const PREDICTED_PER_OBSERVED: f64 = 1.5;
/// Predicted stars in addition, so that a few missing ones do no harm in sparse fields.
const PREDICTED_EXTRA: usize = 5;
/// Where the zero point is known, the prediction reaches the magnitude that this fraction of the
/// observed stars exceed (a few outliers do not count), …
const FAINT_FRACTION: f64 = 0.95;
/// … and this much deeper, for colors and for luck at the threshold.
const FAINT_ROOM_MAG: f64 = 1.5;

/// A camera and an attitude that may be the true ones.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hypothesis {
    /// The camera.
    pub camera: CameraModel,
    /// The attitude.
    pub icrs_to_camera: Rotation<Icrs, Camera>,
    /// Number of parameters fitted to the stars.
    pub parameters: usize,
    /// Number of stars that they were fitted to.
    pub fitted_stars: usize,
    /// Johnson V minus observed magnitude.
    pub zero_point_mag: f64,
}

/// A star field, and the catalogue to identify it with.
#[derive(Clone, Copy)]
pub struct Problem<'a> {
    /// The observed stars.
    pub field: &'a StarField,
    /// The catalogue.
    pub sky: &'a IndexedCatalog<'a>,
    /// Number of brighter detections that `field` leaves out. Predictions reach so much deeper, as
    /// these may be stars.
    pub brighter: usize,
}

impl<'a> Problem<'a> {
    /// All stars that were observed.
    pub fn new(field: &'a StarField, sky: &'a IndexedCatalog<'a>) -> Self {
        Self {
            field,
            sky,
            brighter: 0,
        }
    }
}

impl Hypothesis {
    /// Fills `predicted` with the catalogue stars in the frame, as many as `observed` needs,
    /// brightest first.
    pub fn predict(
        &self,
        problem: Problem,
        observed: &[ObservedStar],
        around: &mut Surroundings,
        predicted: &mut Vec<PredictedStar>,
    ) {
        self.predict_to(problem, observed, f64::NEG_INFINITY, around, predicted);
    }

    /// Fills `predicted` with all catalogue stars that may be observed stars, once the zero point
    /// is known: down to the faint observed stars, and at least as many as their number needs.
    pub fn predict_all(
        &self,
        problem: Problem,
        around: &mut Surroundings,
        predicted: &mut Vec<PredictedStar>,
    ) {
        let observed = &problem.field.stars;
        let faint = (observed.len() as f64 * FAINT_FRACTION) as usize;
        let limit = observed.get(faint).map_or(f64::NEG_INFINITY, |star| {
            star.mag + self.zero_point_mag + FAINT_ROOM_MAG
        });
        self.predict_to(problem, observed, limit, around, predicted);
    }

    /// Fills `predicted` with the catalogue stars in the frame, brightest first, to this depth or
    /// deeper.
    pub fn predict_at_least(
        &self,
        Problem { field, sky, .. }: Problem,
        least: PredictionDepth,
        around: &mut Surroundings,
        predicted: &mut Vec<PredictedStar>,
    ) {
        let likely_v_mag = sky.magnitude_of_density(self.per_sq_deg(least.count));
        around.stars_at_least(&self.view(field), sky, least, likely_v_mag, predicted);
    }

    /// As [`Self::predict`], and at least down to `limit_v_mag`.
    fn predict_to(
        &self,
        problem: Problem,
        observed: &[ObservedStar],
        limit_v_mag: f64,
        around: &mut Surroundings,
        predicted: &mut Vec<PredictedStar>,
    ) {
        let Problem {
            field,
            sky,
            brighter,
        } = problem;
        match field.photometry {
            Photometry::JohnsonV => {
                let faintest = observed.iter().map(|s| s.mag).fold(f64::MIN, f64::max);
                let limit = faintest + field.photometry.tolerance_mag();
                around.stars_to(&self.view(field), sky, limit.max(limit_v_mag), predicted);
            }
            Photometry::Instrumental => {
                let count = (observed.len() + brighter) as f64 * PREDICTED_PER_OBSERVED;
                let count = count.ceil() as usize + PREDICTED_EXTRA;
                let least = PredictionDepth {
                    count,
                    v_mag: limit_v_mag,
                };
                self.predict_at_least(problem, least, around, predicted);
            }
        }
    }

    fn view(&self, field: &StarField) -> SkyView<'_> {
        SkyView {
            camera: &self.camera,
            icrs_to_camera: &self.icrs_to_camera,
            places: field.places,
        }
    }

    /// Updates the positions of the stars to those of this hypothesis.
    pub fn predict_again(&self, predicted: &mut [PredictedStar]) {
        for star in predicted {
            let direction = self.icrs_to_camera.apply(&star.direction);
            star.pixel = self.camera.pixel_of(&direction).unwrap_or(star.pixel);
        }
    }

    /// Density of `count` stars in the frame, per square degree.
    fn per_sq_deg(&self, count: usize) -> f64 {
        count as f64 * RAD_PER_DEG.powi(2) / self.camera.solid_angle_sr()
    }

    /// The magnitude difference in units of the tolerance; `None` beyond it. No star is too bright
    /// for a saturated one.
    pub fn mag_difference(
        &self,
        observed: &ObservedStar,
        predicted: &PredictedStar,
        photometry: Photometry,
    ) -> Option<f64> {
        let difference = f64::from(predicted.v_mag) - observed.mag - self.zero_point_mag;
        if observed.is_saturated && difference < 0.0 {
            return Some(0.0);
        }
        let relative = difference.abs() / photometry.tolerance_mag();
        (relative <= 1.0).then_some(relative)
    }

    /// The range of `predicted` (brightest first) with the brightness of `star` within a tolerance.
    pub fn alike(
        &self,
        star: &ObservedStar,
        predicted: &[PredictedStar],
        tolerance_mag: f64,
    ) -> Range<usize> {
        let v_mag = star.mag + self.zero_point_mag;
        let v_mag_of = |p: &PredictedStar| f64::from(p.v_mag);
        let from = predicted.partition_point(|p| v_mag_of(p) < v_mag - tolerance_mag);
        let to = predicted.partition_point(|p| v_mag_of(p) <= v_mag + tolerance_mag);
        from..to
    }
}
