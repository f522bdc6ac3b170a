//! How likely does a right answer miss so many of the brightest stars in the frame?
//!
//! Clouds, trees and walls hide stars, and so do swarms of false detections. But where the camera
//! points elsewhere, next to none of the brightest stars are seen, however many faint ones agree
//! with detections by chance.

use crate::base::statistics::median;
use crate::identify::hypothesis::{Hypothesis, Problem};
use crate::identify::pairing::Pair;
use crate::identify::predict::{PredictedStar, PredictionDepth, Surroundings};

/// Number of stars that are looked for, the brightest.
const BRIGHTEST: usize = 40;
/// Probability that one of them is seen, under a right answer with much in the way.
const P_SEEN: f64 = 0.5;
/// Least distance within which a star counts as seen, in pixels.
const MIN_RADIUS_PX: f64 = 3.0;

/// Looks for the brightest stars. Its buffers are reused.
#[derive(Debug, Default)]
pub struct Unseen {
    predicted: Vec<PredictedStar>,
    v_mags: Vec<f32>,
}

impl Unseen {
    /// log10 of the probability that no more of the brightest stars in the frame are seen than there
    /// are. The `named` stars are: those fainter than half of them may be too faint to be seen.
    pub fn log10(
        &mut self,
        hypothesis: &Hypothesis,
        problem: Problem,
        named: &[Pair],
        around: &mut Surroundings,
    ) -> f64 {
        let Self { predicted, v_mags } = self;
        v_mags.clear();
        v_mags.extend(named.iter().map(|pair| pair.v_mag));
        if v_mags.is_empty() {
            return 0.0;
        }
        let faintest = median(v_mags);
        hypothesis.predict_at_least(problem, depth_of(BRIGHTEST), around, predicted);
        let residuals = named.iter().map(|pair| pair.residual_px);
        let radius_px = residuals.fold(MIN_RADIUS_PX, f64::max);
        let field = problem.field;
        let tolerance_mag = field.photometry.tolerance_mag();
        let is_seen = |star: &PredictedStar| {
            let faintest_mag = f64::from(star.v_mag) - hypothesis.zero_point_mag + tolerance_mag;
            named.iter().any(|pair| pair.star == star.star)
                || field.stars.iter().any(|observed| {
                    observed.mag <= faintest_mag
                        && observed.position.distance_to(&star.pixel) <= radius_px
                })
        };
        let in_frame = predicted
            .iter()
            .filter(|star| hypothesis.camera.contains(&star.pixel) && field.shows_sky(&star.pixel));
        let bright = in_frame
            .take(BRIGHTEST)
            .take_while(|star| star.v_mag <= faintest);
        let (mut expected, mut seen) = (0, 0);
        for star in bright {
            expected += 1;
            seen += usize::from(is_seen(star));
        }
        log10_at_most(seen, expected)
    }
}

/// The depth of so many stars.
fn depth_of(count: usize) -> PredictionDepth {
    PredictionDepth {
        count,
        v_mag: f64::NEG_INFINITY,
    }
}

/// log10 of the probability of at most so many of `expected` stars.
fn log10_at_most(seen: usize, expected: usize) -> f64 {
    let mut term = (1.0 - P_SEEN).powi(expected as i32);
    let mut sum = term;
    for k in 0..seen {
        term *= (expected - k) as f64 / (k + 1) as f64 * P_SEEN / (1.0 - P_SEEN);
        sum += term;
    }
    libm::log10(sum.min(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::coords::{Rotation, UnitVector};
    use crate::camera::CameraModel;
    use crate::catalog::Catalog;
    use crate::identify::field::StarField;
    use crate::identify::fit::POSE_PARAMETERS;
    use crate::identify::index::IndexedCatalog;

    #[test]
    fn bright_stars_that_are_not_seen_speak_against_an_answer() {
        let catalog = Catalog::built_in().limited_to(6.5);
        let sky = IndexedCatalog::build(&catalog, &|_| ());
        let hypothesis = Hypothesis {
            camera: CameraModel::pinhole(1000.0, 1000.0, 1000.0, false),
            icrs_to_camera: Rotation::looking_at(&UnitVector::from_ra_dec(3.0, 0.3), 0.3),
            parameters: POSE_PARAMETERS,
            fitted_stars: 0,
            zero_point_mag: 20.0,
        };
        let (mut around, mut predicted) = (Surroundings::default(), Vec::new());
        let empty = StarField::of_places([1000.0; 2], &[]);
        let of_empty = Problem::new(&empty, &sky);
        hypothesis.predict_at_least(of_empty, depth_of(150), &mut around, &mut predicted);
        predicted.retain(|star| hypothesis.camera.contains(&star.pixel));
        let mut log10_without = |hidden: usize| {
            let seen = &predicted[hidden..];
            let places: Vec<_> = seen
                .iter()
                .map(|star| (star.pixel.x, star.pixel.y))
                .collect();
            let mut field = StarField::of_places([1000.0; 2], &places);
            for (observed, star) in field.stars.iter_mut().zip(seen) {
                observed.mag = f64::from(star.v_mag) - hypothesis.zero_point_mag;
            }
            let named = seen.iter().enumerate().map(|(observed, star)| Pair {
                observed,
                star: star.star,
                v_mag: star.v_mag,
                direction: star.direction,
                light_sigma_px: 0.0,
                residual_px: 0.0,
                p_chance: 0.0,
            });
            let named: Vec<Pair> = named.collect();
            let problem = Problem::new(&field, &sky);
            Unseen::default().log10(&hypothesis, problem, &named, &mut around)
        };
        assert_eq!(log10_without(0), 0.0);
        assert!(log10_without(10) > -0.01);
        let [few, none] = [35, 60].map(&mut log10_without);
        assert!(few < -5.0 && none < few, "{few} {none}");
    }

    #[test]
    fn the_probability_is_that_of_the_binomial_distribution() {
        assert_eq!(log10_at_most(20, 20), 0.0);
        assert!((log10_at_most(0, 10) - 0.5_f64.powi(10).log10()).abs() < 1e-12);
        // 1 + 4 + 6 of 16.
        assert!((log10_at_most(2, 4) - (11.0_f64 / 16.0).log10()).abs() < 1e-12);
    }
}
