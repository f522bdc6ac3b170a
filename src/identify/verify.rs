//! Is a hypothesis about pointing and scale true? The probability that chance does as well, and what agrees.
//!
//! hypothesis (camera, attitude) → catalogue stars in the frame → nearest observed star of each → false-alarm probability
//!
//! Were the hypothesis wrong, each observed star would lie within r of a predicted one with the probability
//! p = ρπr², ρ being the density of predicted stars around it. The number of stars that do so is then at
//! most binomial (Hoeffding 1956: unequal probabilities make the tail thinner), and the probability of as
//! many as were found or more, times the number of hypotheses and radii tried, bounds the number of
//! equally good answers that chance alone would have given (an a-contrario test: Desolneux, Moisan & Morel
//! 2000, IJCV 40, 7). Stars that the camera's parameters were fitted to count only so far as they exceed
//! what the fit needs: two parameters use up one star.

use super::{ObservedStar, Sky, StarField, StarMatch};
use crate::camera::CameraModel;
use crate::coords::{Camera, Icrs, PixelPoint, Rotation, UnitVector};
use crate::units::RAD_PER_DEG;
use std::f64::consts::PI;

/// Observed stars that are tested, the brightest.
pub const TESTED_STARS: usize = 60;
/// Catalogue stars predicted for each observed one.
const PREDICTED_PER_OBSERVED: f64 = 1.5;
/// And so many more, so that a few missing ones do no harm in sparse fields.
const PREDICTED_EXTRA: usize = 5;
/// Radii of agreement tried, in units of the frame's diagonal.
const RADII: [f64; 4] = [0.0008, 0.002, 0.005, 0.0125];
/// No radius is below this many pixels.
const MIN_RADIUS_PX: f64 = 0.7;
/// Radius of the neighbourhood whose density of predicted stars counts, in units of the radius of agreement.
const NEIGHBOURHOOD: f64 = 8.0;

/// A catalogue star where the hypothesis puts it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PredictedStar {
    /// Its place in the frame.
    pub pixel: PixelPoint,
    /// V magnitude.
    pub v_mag: f32,
    /// Index into the catalogue's stars.
    pub catalog: usize,
}

/// Where the camera is supposed to look.
#[derive(Debug, Clone, PartialEq)]
pub struct Hypothesis {
    /// The camera.
    pub camera: CameraModel,
    /// The attitude.
    pub icrs_to_camera: Rotation<Icrs, Camera>,
    /// Parameters that were fitted to the stars.
    pub parameters: usize,
}

impl Hypothesis {
    /// The brightest `wanted` catalogue stars in the frame, brightest first.
    pub fn predict(&self, sky: &Sky, wanted: usize) -> Vec<PredictedStar> {
        let radius_rad = self.camera.radius_rad() * 1.02;
        let centre = self.icrs_to_camera.inverse().apply(&UnitVector::BORESIGHT);
        let mut limit = sky.magnitude_of_density(
            wanted as f64 / (self.camera.fov_x_rad() * self.camera.fov_y_rad()) * RAD_PER_DEG.powi(2),
        );
        let mut predicted = Vec::new();
        loop {
            predicted.clear();
            sky.grid
                .for_each_within(&centre, radius_rad, limit as f32, |star| {
                    let direction = &sky.stars()[star.catalog as usize].direction;
                    let pixel = self.camera.pixel_of(&self.icrs_to_camera.apply(direction));
                    if let Some(pixel) = pixel.filter(|p| self.camera.contains(p)) {
                        predicted.push(PredictedStar {
                            pixel,
                            v_mag: star.v_mag,
                            catalog: star.catalog as usize,
                        });
                    }
                });
            if predicted.len() >= wanted || limit > sky.faintest_v_mag() {
                break;
            }
            limit += 0.7;
        }
        predicted.sort_unstable_by_key(|star| star.catalog);
        predicted.truncate(wanted);
        predicted
    }
}

/// How many catalogue stars to predict for so many observed ones.
pub fn predicted_count(observed: usize) -> usize {
    (observed as f64 * PREDICTED_PER_OBSERVED).ceil() as usize + PREDICTED_EXTRA
}

/// Pairs observed and predicted stars that lie within `radius_px` of each other, the closest first, each star once.
/// In the order of the observed stars.
pub fn pair_up(
    observed: &[ObservedStar],
    predicted: &[PredictedStar],
    radius_px: f64,
) -> Vec<StarMatch> {
    let mut by_x: Vec<usize> = (0..predicted.len()).collect();
    by_x.sort_unstable_by(|&a, &b| predicted[a].pixel.x.total_cmp(&predicted[b].pixel.x));
    let mut close: Vec<(f64, usize, usize)> = Vec::new();
    for (o, star) in observed.iter().enumerate() {
        let first = by_x.partition_point(|&p| predicted[p].pixel.x < star.position.x - radius_px);
        for &p in &by_x[first..] {
            let pixel = &predicted[p].pixel;
            if pixel.x > star.position.x + radius_px {
                break;
            }
            let distance = pixel.distance_to(&star.position);
            if distance <= radius_px {
                close.push((distance, o, p));
            }
        }
    }
    close.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let mut observed_taken = vec![false; observed.len()];
    let mut predicted_taken = vec![false; predicted.len()];
    let mut pairs = Vec::new();
    for (distance, o, p) in close {
        if !observed_taken[o] && !predicted_taken[p] {
            observed_taken[o] = true;
            predicted_taken[p] = true;
            pairs.push(StarMatch {
                observed: o,
                catalog: predicted[p].catalog,
                residual_px: distance,
            });
        }
    }
    pairs.sort_unstable_by_key(|pair| pair.observed);
    pairs
}

/// log10 of the expected number of hypotheses as good as this one among `hypotheses` that chance alone would
/// give: the false-alarm probability where it is small.
pub fn log10_false_alarm(
    field: &StarField,
    predicted: &[PredictedStar],
    parameters: usize,
    hypotheses: u64,
) -> f64 {
    let observed = &field.stars[..field.stars.len().min(TESTED_STARS)];
    let diagonal_px = field.width_px.hypot(field.height_px);
    let used_up = parameters.div_ceil(2);
    let best = RADII
        .iter()
        .map(|share| {
            let radius_px = (share * diagonal_px).max(MIN_RADIUS_PX);
            let hits = pair_up(observed, predicted, radius_px).len();
            let chance = mean_chance(field, observed, predicted, radius_px);
            log10_binomial_tail(
                observed.len().saturating_sub(used_up),
                hits.saturating_sub(used_up),
                chance,
            )
        })
        .fold(0.0, f64::min);
    best + (hypotheses.max(1) as f64 * RADII.len() as f64).log10()
}

/// The mean over the observed stars of the probability that chance puts a predicted star within `radius_px`.
fn mean_chance(
    field: &StarField,
    observed: &[ObservedStar],
    predicted: &[PredictedStar],
    radius_px: f64,
) -> f64 {
    let global_per_px = predicted.len() as f64 / (field.width_px * field.height_px);
    let reach_px = NEIGHBOURHOOD * radius_px;
    let neighbourhood_px = PI * reach_px * reach_px;
    let sum: f64 = observed
        .iter()
        .map(|star| {
            let around = predicted
                .iter()
                .filter(|p| p.pixel.distance_to(&star.position) <= reach_px)
                .count();
            let local_per_px = around as f64 / neighbourhood_px;
            (local_per_px.max(global_per_px) * PI * radius_px * radius_px).min(1.0)
        })
        .sum();
    sum / observed.len().max(1) as f64
}

/// log10 of the probability of `hits` or more successes in `trials` at `chance` each.
pub fn log10_binomial_tail(trials: usize, hits: usize, chance: f64) -> f64 {
    if hits == 0 || chance >= 1.0 {
        return 0.0;
    }
    if hits > trials || chance <= 0.0 {
        return f64::NEG_INFINITY;
    }
    let (log_p, log_q) = (chance.ln(), (-chance).ln_1p());
    let mut log_term = hits as f64 * log_p + (trials - hits) as f64 * log_q;
    for i in 0..hits {
        log_term += ((trials - i) as f64).ln() - ((i + 1) as f64).ln();
    }
    // The terms after the first, relative to it.
    let odds = chance / (1.0 - chance);
    let (mut ratio, mut sum) = (1.0, 1.0);
    for k in hits..trials {
        ratio *= (trials - k) as f64 / (k + 1) as f64 * odds;
        sum += ratio;
        if ratio < 1e-12 * sum {
            break;
        }
    }
    ((log_term + sum.ln()) / std::f64::consts::LN_10).min(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_binomial_tail_is_right_where_it_can_be_summed() {
        assert_eq!(log10_binomial_tail(10, 0, 0.3), 0.0);
        assert!((log10_binomial_tail(1, 1, 0.01) + 2.0).abs() < 1e-12);
        // 1 − 0.9³ for one or more of three.
        assert!((log10_binomial_tail(3, 1, 0.1) - 0.271f64.log10()).abs() < 1e-12);
        // Two or three of three: 3·0.1²·0.9 + 0.1³.
        assert!((log10_binomial_tail(3, 2, 0.1) - 0.028f64.log10()).abs() < 1e-12);
        assert!((log10_binomial_tail(60, 50, 0.01) + 89.9).abs() < 0.1);
        assert_eq!(log10_binomial_tail(3, 4, 0.1), f64::NEG_INFINITY);
    }

    #[test]
    fn each_star_is_paired_once_with_its_closest() {
        let observed = [(10.0, 10.0), (13.0, 10.0), (50.0, 50.0)].map(|(x, y)| ObservedStar {
            position: PixelPoint::new(x, y),
            sigma_px: 0.1,
            mag: 0.0,
        });
        let predicted = [(12.5, 10.0), (10.0, 11.0), (90.0, 50.0)].map(|(x, y)| PredictedStar {
            pixel: PixelPoint::new(x, y),
            v_mag: 0.0,
            catalog: x as usize,
        });
        let pairs = pair_up(&observed, &predicted, 4.0);
        let found: Vec<(usize, usize)> = pairs.iter().map(|p| (p.observed, p.catalog)).collect();
        assert_eq!(found, [(0, 10), (1, 12)]);
    }
}
