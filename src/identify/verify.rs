//! Is a hypothesis about pointing and scale true? The probability that chance does as well, and what agrees.
//!
//! hypothesis (camera, attitude) → catalogue stars in the frame → nearest observed star of each → false-alarm probability
//!
//! Were the hypothesis wrong, each observed star would lie within r of a predicted one with the probability
//! p = ρπr², ρ being the density of predicted stars around it. The number of stars that do so is then at
//! most binomial (Hoeffding 1956: unequal probabilities make the tail thinner), and the probability of as
//! many as were found or more, times the number of hypotheses and radii tried, bounds the number of
//! equally good answers that chance alone would have given (an a-contrario test: Desolneux, Moisan & Morel
//! 2000, IJCV 40, 7). The three stars of the triangle that the hypothesis came from agree because it was
//! looked for, and say nothing; every two parameters fitted beyond pointing, roll and scale use up another star.

use super::{ObservedStar, Photometry, Sky, StarField, StarMatch};
use crate::attitude::POSE_PARAMETERS;
use crate::camera::CameraModel;
use crate::catalog::sky_grid::GridStar;
use crate::coords::{Camera, Icrs, PixelPoint, Rotation, UnitVector};
use crate::units::RAD_PER_DEG;
use std::f64::consts::PI;

/// Observed stars that are tested, the brightest.
pub const TESTED_STARS: usize = 60;
/// Where the zero point of the magnitudes is unknown: catalogue stars predicted for each observed one.
const PREDICTED_PER_OBSERVED: f64 = 1.5;
/// And so many more, so that a few missing ones do no harm in sparse fields.
const PREDICTED_EXTRA: usize = 5;
/// Stars that agree by construction.
const TRIANGLE_STARS: usize = 3;
/// Radii of agreement tried, in units of the frame's diagonal.
const RADII: [f64; 6] = [0.0008, 0.0014, 0.0025, 0.0045, 0.008, 0.014];
/// No radius is below this many pixels.
const MIN_RADIUS_PX: f64 = 0.7;
/// Radius of the neighbourhood whose density of predicted stars counts, in units of the radius of agreement.
const NEIGHBOURHOOD: f64 = 8.0;

/// Stars predicted so far outside the frame, in units of its diagonal, may still be seen on it.
const MARGIN: f64 = 0.01;

/// Lenses shift stars by no more than so much of the frame's half diagonal.
const UNDISTORTED_MARGIN: f64 = 0.1;

/// A catalogue star where the hypothesis puts it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PredictedStar {
    /// Its place in the frame.
    pub pixel: PixelPoint,
    /// Its direction at the time of the frame.
    pub direction: UnitVector<Icrs>,
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
    /// What must be added to the observed magnitudes to make them V.
    pub zero_point_mag: f64,
}

/// How deep to predict.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Depth {
    /// So many of the brightest stars in the frame.
    Count(usize),
    /// All stars in the frame to this V magnitude.
    Magnitude(f64),
}

impl Depth {
    /// The depth that the observed stars, brightest first, ask for.
    pub fn of(observed: &[ObservedStar], photometry: Photometry) -> Self {
        match photometry {
            Photometry::JohnsonV => {
                let faintest = observed.iter().map(|s| s.mag).fold(f64::MIN, f64::max);
                Self::Magnitude(faintest + photometry.tolerance_mag())
            }
            Photometry::Instrumental => {
                let count = observed.len() as f64 * PREDICTED_PER_OBSERVED;
                Self::Count(count.ceil() as usize + PREDICTED_EXTRA)
            }
        }
    }
}

impl Hypothesis {
    /// The catalogue stars in the frame to the depth that `observed` asks for, brightest first.
    pub fn predict(
        &self,
        sky: &Sky,
        field: &StarField,
        observed: &[ObservedStar],
    ) -> Vec<PredictedStar> {
        let (wanted, mut limit) = match Depth::of(observed, field.photometry) {
            Depth::Magnitude(limit) => (0, limit),
            Depth::Count(count) => (count, sky.magnitude_of_density(self.per_sq_deg(count))),
        };
        loop {
            let mut predicted = self.predict_to(sky, limit, field.years_since_j2000);
            if predicted.len() >= wanted || limit > sky.faintest_v_mag() {
                if wanted > 0 {
                    predicted.truncate(wanted);
                }
                return predicted;
            }
            limit += 0.7;
        }
    }

    /// The same stars where this hypothesis puts them.
    pub fn predict_again(&self, predicted: &mut [PredictedStar]) {
        for star in predicted {
            let direction = self.icrs_to_camera.apply(&star.direction);
            if let Some(pixel) = self.camera.pixel_of(&direction) {
                star.pixel = pixel;
            }
        }
    }

    /// The density of so many stars in the frame.
    fn per_sq_deg(&self, count: usize) -> f64 {
        count as f64 * RAD_PER_DEG.powi(2) / (self.camera.fov_x_rad() * self.camera.fov_y_rad())
    }

    fn predict_to(&self, sky: &Sky, faintest_v_mag: f64, years: f64) -> Vec<PredictedStar> {
        let margin_px = MARGIN * self.camera.width_px.hypot(self.camera.height_px);
        let radius_rad = self.camera.radius_rad() * (1.0 + 2.0 * MARGIN);
        let centre = self.icrs_to_camera.inverse().apply(&UnitVector::BORESIGHT);
        // The cone is rounder than the frame: most of what it holds beside it needs no closer look.
        let nearly_px = margin_px + UNDISTORTED_MARGIN * self.camera.radius_px();
        let pinhole = CameraModel {
            distortion: None,
            ..self.camera.clone()
        };
        let mut predicted = Vec::new();
        let mut look = |star: &GridStar| {
            let direction = sky.stars()[star.catalog as usize].direction_at(years);
            let in_camera = self.icrs_to_camera.apply(&direction);
            let near = |p: &PixelPoint| self.camera.nearly_contains(p, nearly_px);
            let inside = |p: &PixelPoint| self.camera.nearly_contains(p, margin_px);
            let undistorted = pinhole.pixel_of(&in_camera).filter(near);
            let pixel = undistorted.and_then(|_| self.camera.pixel_of(&in_camera));
            if let Some(pixel) = pixel.filter(inside) {
                predicted.push(PredictedStar {
                    pixel,
                    direction,
                    v_mag: star.v_mag,
                    catalog: star.catalog as usize,
                });
            }
        };
        sky.grid
            .for_each_within(&centre, radius_rad, faintest_v_mag as f32, &mut look);
        predicted.sort_unstable_by_key(|star| star.catalog);
        predicted
    }

    /// Pairs observed and predicted stars of about the same brightness that lie within `radius_px` of each
    /// other, the most alike in place and brightness first, each star once; in the order of the observed stars.
    pub fn pair_up(
        &self,
        observed: &[ObservedStar],
        predicted: &[PredictedStar],
        photometry: Photometry,
        radius_px: f64,
    ) -> Vec<StarMatch> {
        pair_up(observed, predicted, radius_px, |o, p| {
            self.mag_difference(o, p, photometry)
        })
    }

    /// The difference in brightness in units of what is tolerated; `None` if it is more.
    fn mag_difference(
        &self,
        observed: &ObservedStar,
        predicted: &PredictedStar,
        photometry: Photometry,
    ) -> Option<f64> {
        let difference = f64::from(predicted.v_mag) - observed.mag - self.zero_point_mag;
        let relative = difference.abs() / photometry.tolerance_mag();
        (relative <= 1.0).then_some(relative)
    }

    /// log10 of the expected number of hypotheses as good as this one among `hypotheses` that chance alone
    /// would give: the false-alarm probability where it is small.
    pub fn log10_false_alarm(&self, field: &StarField, sky: &Sky, hypotheses: u64) -> f64 {
        let observed = field.brightest(TESTED_STARS);
        let predicted = self.predict(sky, field, observed);
        let diagonal_px = field.width_px.hypot(field.height_px);
        let used_up = TRIANGLE_STARS + (self.parameters - POSE_PARAMETERS).div_ceil(2);
        let neighbours = self.squared_distances(field, observed, &predicted);
        let best = RADII
            .iter()
            .map(|share| {
                let radius_px = (share * diagonal_px).max(MIN_RADIUS_PX);
                let hits = self.pair_up(observed, &predicted, field.photometry, radius_px);
                log10_binomial_tail(
                    observed.len().saturating_sub(used_up),
                    hits.len().saturating_sub(used_up),
                    mean_chance(field, &neighbours, radius_px),
                )
            })
            .fold(0.0, f64::min);
        (best + (search_weight(hypotheses) * RADII.len() as f64).log10()).min(0.0)
    }

    /// For each observed star, the squared distances in px² of the predicted stars of about its brightness.
    fn squared_distances(
        &self,
        field: &StarField,
        observed: &[ObservedStar],
        predicted: &[PredictedStar],
    ) -> Vec<Vec<f64>> {
        let of_star = |star: &ObservedStar| {
            let alike =
                |p: &&PredictedStar| self.mag_difference(star, p, field.photometry).is_some();
            let squared = |p: &PredictedStar| {
                (p.pixel.x - star.position.x).powi(2) + (p.pixel.y - star.position.y).powi(2)
            };
            predicted.iter().filter(alike).map(squared).collect()
        };
        observed.iter().map(of_star).collect()
    }
}

/// The mean over the observed stars of the probability that chance puts a predicted star of about the same
/// brightness within `radius_px`; `neighbours` are the squared distances of such stars from each.
fn mean_chance(field: &StarField, neighbours: &[Vec<f64>], radius_px: f64) -> f64 {
    let frame_px = field.width_px * field.height_px;
    let reach_sq = (NEIGHBOURHOOD * radius_px).powi(2);
    let chance = |distances_sq: &Vec<f64>| {
        let near = distances_sq.iter().filter(|&&d| d <= reach_sq).count() as f64;
        // Less the one that may be its match: what counts is how many others chance could have put there.
        let crowd_per_px = (near - 1.0) / (PI * reach_sq);
        let per_px = (distances_sq.len() as f64 / frame_px).max(crowd_per_px);
        (per_px * PI * radius_px * radius_px).min(1.0)
    };
    neighbours.iter().map(chance).sum::<f64>() / neighbours.len().max(1) as f64
}

/// Pairs what lies within `radius_px` and whose `mag_difference` is tolerable, the most alike first, each star once.
fn pair_up(
    observed: &[ObservedStar],
    predicted: &[PredictedStar],
    radius_px: f64,
    mag_difference: impl Fn(&ObservedStar, &PredictedStar) -> Option<f64>,
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
            let apart = pixel.distance_to(&star.position) / radius_px;
            if apart <= 1.0
                && let Some(difference) = mag_difference(star, &predicted[p])
            {
                close.push((apart * apart + difference * difference, o, p));
            }
        }
    }
    close.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let mut observed_taken = vec![false; observed.len()];
    let mut predicted_taken = vec![false; predicted.len()];
    let mut pairs = Vec::new();
    for (_, o, p) in close {
        if !observed_taken[o] && !predicted_taken[p] {
            observed_taken[o] = true;
            predicted_taken[p] = true;
            pairs.push(StarMatch {
                observed: o,
                catalog: predicted[p].catalog,
                residual_px: predicted[p].pixel.distance_to(&observed[o].position),
            });
        }
    }
    pairs.sort_unstable_by_key(|pair| pair.observed);
    pairs
}

/// What the chance of one hypothesis is multiplied by when it is the last of so many.
///
/// The weights' inverses add up to less than two however long the search goes on, so that the probability
/// that any hypothesis at all of a search passes by chance is bounded, and not only that of one.
fn search_weight(hypotheses: u64) -> f64 {
    let count = hypotheses.max(1) as f64;
    count * (1.0 + count.ln()).powi(2)
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
        assert!((log10_binomial_tail(60, 50, 0.01) + 89.166).abs() < 0.002);
        assert_eq!(log10_binomial_tail(3, 4, 0.1), f64::NEG_INFINITY);
    }

    #[test]
    fn a_search_without_end_has_a_bounded_chance() {
        let sum: f64 = (1..1_000_000).map(|n| 1.0 / search_weight(n)).sum();
        assert!(sum < 2.0, "{sum}");
        assert_eq!(search_weight(0), 1.0);
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
            direction: UnitVector::from_ra_dec(0.0, 0.0),
            v_mag: 0.0,
            catalog: x as usize,
        });
        let pairs = pair_up(&observed, &predicted, 4.0, |_, _| Some(0.0));
        let found: Vec<(usize, usize)> = pairs.iter().map(|p| (p.observed, p.catalog)).collect();
        assert_eq!(found, [(0, 10), (1, 12)]);
    }
}
