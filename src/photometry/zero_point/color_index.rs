//! The ratio of the light behind two filters, by the color of what shines.

use super::relation::{Relation, Term};
use super::standard::{REFERENCE_BV_MAG, StandardStar};
use crate::base::statistics::Estimate;
use nalgebra::{Matrix3, Vector3};

/// −2.5 log10 of the ratio: Z + k (B−V − 0.6) + q (B−V − 0.6)².
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ColorIndex {
    coefficients: [f64; 3],
    covariance: Matrix3<f64>,
}

impl ColorIndex {
    /// That of stars whose instrumental magnitude is V less the ratio in magnitudes. `None` where they tell no
    /// color.
    pub fn fit(stars: &[StandardStar]) -> Option<Self> {
        /// A color is told if k is so many of its standard errors.
        const MIN_SIGMAS: f64 = 10.0;
        let fit = Relation::fit(stars, &[Term::Color, Term::ColorOfSecondOrder])?;
        let per_mag = fit.estimate(1);
        (per_mag.value.abs() > MIN_SIGMAS * per_mag.sigma).then(|| Self {
            coefficients: [0, 1, 2].map(|term| fit.estimate(term).value),
            covariance: Matrix3::from_fn(|row, column| fit.covariance(row, column)),
        })
    }

    /// B−V of light with this ratio, in magnitudes; `None` where no star is like it.
    pub fn bv_mag(&self, ratio_mag: f64) -> Option<Estimate> {
        const ROUNDS: usize = 20;
        /// Colors of stars, from the reference on.
        const MIN_MAG: f64 = -1.0;
        const MAX_MAG: f64 = 1.4;
        let [zero, per_mag, curve] = self.coefficients;
        let mut off_mag = 0.0;
        for _ in 0..ROUNDS {
            let rest = ratio_mag - zero - off_mag * (per_mag + off_mag * curve);
            off_mag += rest / (per_mag + 2.0 * off_mag * curve);
        }
        if !(MIN_MAG..MAX_MAG).contains(&off_mag) {
            return None;
        }
        let row = Vector3::new(1.0, off_mag, off_mag * off_mag);
        let variance = row.dot(&(self.covariance * row));
        Some(Estimate {
            value: REFERENCE_BV_MAG + off_mag,
            sigma: variance.max(0.0).sqrt() / (per_mag + 2.0 * off_mag * curve).abs(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_color_of_light_is_that_of_the_stars_with_its_ratio() {
        let ratio_mag = |bv_mag: f64| 0.3 + 0.9 * (bv_mag - 0.6) - 0.1 * (bv_mag - 0.6).powi(2);
        let star = |number: usize| {
            let bv_mag = -0.2 + 0.02 * number as f64;
            let v_mag = 2.0 + 0.03 * number as f64;
            let noise_mag = 0.05 * ((number * 7919 % 101) as f64 / 50.0 - 1.0);
            StandardStar {
                v_mag,
                bv_mag: Some(bv_mag),
                instrumental_mag: v_mag - ratio_mag(bv_mag) - noise_mag,
                sigma_mag: 0.02,
                off_centre_sq: 0.0,
            }
        };
        let stars: Vec<StandardStar> = (0..90).map(star).collect();
        let index = ColorIndex::fit(&stars).unwrap();
        for bv_mag in [0.3, 0.64, 1.1] {
            let found = index.bv_mag(ratio_mag(bv_mag)).unwrap();
            let off_mag = found.value - bv_mag;
            assert!(
                off_mag.abs() < 4.0 * found.sigma && found.sigma < 0.02,
                "{found:?}"
            );
        }
        assert_eq!(index.bv_mag(9.0), None);
        assert_eq!(ColorIndex::fit(&stars[..12]), None);
    }
}
