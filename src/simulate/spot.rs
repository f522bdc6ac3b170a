//! The light of a star on its pixels.

use crate::coords::PixelPoint;
use crate::sensitivity::Scenario;
use crate::statistics::{normal_cdf, normal_density};
use std::ops::Range;

/// Beyond so many standard deviations there is less than 10⁻¹⁴ of the light.
const REACH_SIGMAS: f64 = 8.0;
/// A smear shorter than this, in standard deviations, changes no pixel by 10⁻⁷ of its light, and is none.
const LEAST_SMEAR: f64 = 1e-3;

/// A Gaussian, smeared evenly along the rows, integrated over the pixels.
#[derive(Debug, Clone)]
pub(super) struct Spot {
    sigma_px: f64,
    /// Along x.
    smear_px: f64,
    /// Room for the parts of the light in the columns of one star.
    columns: Vec<f64>,
}

impl Spot {
    pub(super) fn of(scenario: &Scenario) -> Self {
        Self {
            sigma_px: scenario.sensor.spot_sigma_px,
            smear_px: scenario.conditions.motion_px,
            columns: Vec::new(),
        }
    }

    /// How far from its middle a star's light reaches, in pixels.
    pub(super) fn reach_px(&self) -> f64 {
        REACH_SIGMAS * self.sigma_px + self.smear_px / 2.0
    }

    /// Adds the light of a star at `position` to `expected_e`: row-major, `width` to a row.
    pub(super) fn add(
        &mut self,
        expected_e: &mut [f64],
        width: usize,
        position: &PixelPoint,
        electrons: f64,
    ) {
        let reach_y_px = REACH_SIGMAS * self.sigma_px;
        let columns = pixels_within(position.x, self.reach_px(), width);
        let rows = pixels_within(position.y, reach_y_px, expected_e.len() / width);
        let mut shares = std::mem::take(&mut self.columns);
        shares.clear();
        shares.extend(columns.clone().map(|x| {
            let offset_px = x as f64 - position.x;
            share(offset_px, self.sigma_px, self.smear_px)
        }));
        for y in rows {
            let row_e = electrons * share(y as f64 - position.y, self.sigma_px, 0.0);
            let row = &mut expected_e[y * width..][columns.clone()];
            for (pixel, share) in row.iter_mut().zip(&shares) {
                *pixel += row_e * share;
            }
        }
        self.columns = shares;
    }
}

/// The pixels on a side of `side` whose centre is not farther than `reach_px` and a half from `at`.
fn pixels_within(at: f64, reach_px: f64, side: usize) -> Range<usize> {
    let bound = |pixel: f64| pixel.clamp(0.0, side as f64) as usize;
    let first = bound((at - reach_px).round());
    first..bound((at + reach_px).round() + 1.0).max(first)
}

/// The part of the light, along one axis, in a pixel whose centre is `offset_px` from the spot's.
fn share(offset_px: f64, sigma_px: f64, smear_px: f64) -> f64 {
    let between = |integral: &dyn Fn(f64) -> f64| {
        integral((offset_px + 0.5) / sigma_px) - integral((offset_px - 0.5) / sigma_px)
    };
    let smear = smear_px / sigma_px;
    if smear < LEAST_SMEAR {
        return between(&normal_cdf);
    }
    let smeared = |z: f64| {
        (integrated_cumulative(z + smear / 2.0) - integrated_cumulative(z - smear / 2.0)) / smear
    };
    between(&smeared)
}

/// The integral of Φ from −∞ to z: z Φ(z) + φ(z).
fn integrated_cumulative(z: f64) -> f64 {
    z * normal_cdf(z) + normal_density(z)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The pixels of a spot on an empty frame.
    fn drawn(sigma_px: f64, smear_px: f64, at: (f64, f64)) -> Vec<f64> {
        let mut spot = Spot {
            sigma_px,
            smear_px,
            columns: Vec::new(),
        };
        let mut pixels = vec![0.0; SIDE * SIDE];
        spot.add(&mut pixels, SIDE, &PixelPoint::new(at.0, at.1), 1.0);
        pixels
    }

    const SIDE: usize = 64;

    /// Mean and variance along x and y of light that adds up to 1.
    fn moments(pixels: &[f64]) -> [(f64, f64); 2] {
        let coordinate = |axis: usize, i: usize| [i % SIDE, i / SIDE][axis] as f64;
        [0, 1].map(|axis| {
            let sum = |f: &dyn Fn(f64) -> f64| -> f64 {
                let terms = pixels.iter().enumerate();
                terms.map(|(i, light)| light * f(coordinate(axis, i))).sum()
            };
            let mean = sum(&|x| x);
            (mean, sum(&|x| (x - mean).powi(2)))
        })
    }

    #[test]
    fn no_light_is_lost_and_its_middle_and_width_are_those_asked_for() {
        for (sigma, smear) in [
            (0.7, 0.0),
            (1.16, 0.0),
            (1.16, 0.01),
            (1.0, 2.0),
            (1.5, 7.3),
        ] {
            let pixels = drawn(sigma, smear, (31.3, 30.8));
            assert!((pixels.iter().sum::<f64>() - 1.0).abs() < 1e-12);
            let [(x, var_x), (y, var_y)] = moments(&pixels);
            assert!(
                (x - 31.3).abs() < 1e-3 && (y - 30.8).abs() < 1e-3,
                "{x} {y}"
            );
            // A pixel adds 1/12, as a smear adds its length squared over 12; below σ = 1 the sampling shows.
            let expected_y = sigma * sigma + 1.0 / 12.0;
            let expected_x = expected_y + smear * smear / 12.0;
            assert!(
                (var_x - expected_x).abs() < 5e-3,
                "{sigma} {smear}: {var_x}"
            );
            assert!(
                (var_y - expected_y).abs() < 5e-3,
                "{sigma} {smear}: {var_y}"
            );
        }
    }

    #[test]
    fn a_smear_is_the_mean_of_spots_along_the_way() {
        let (sigma, smear) = (0.9, 3.0);
        let steps = 20_000;
        for offset in [0.0, 0.4, 1.7, -2.6] {
            let at = |step: i32| (f64::from(step) + 0.5) / f64::from(steps) - 0.5;
            let shares = (0..steps).map(|step| share(offset - smear * at(step), sigma, 0.0));
            let mean = shares.sum::<f64>() / f64::from(steps);
            assert!((share(offset, sigma, smear) - mean).abs() < 1e-8);
        }
    }

    #[test]
    fn a_ninth_of_the_light_is_on_the_middle_pixel_at_sigma_1_16() {
        let share = drawn(1.16, 0.0, (30.0, 30.0))[30 * SIDE + 30];
        assert!((share * 9.0 - 1.0).abs() < 0.01, "{share}");
    }

    #[test]
    fn light_beyond_the_edge_is_left_out() {
        let half = drawn(1.0, 0.0, (-0.5, 20.0)).iter().sum::<f64>();
        assert!((half - 0.5).abs() < 1e-12);
        assert!(
            drawn(1.0, 2.0, (-40.0, 20.0))
                .iter()
                .all(|light| *light == 0.0)
        );
        assert!(
            drawn(1.0, 2.0, (20.0, 1e9))
                .iter()
                .all(|light| *light == 0.0)
        );
    }
}
