//! The relation for the stars in clear air, fitted among stars that clouds dim.

use super::candidate::ClearSkyStar;
use super::mixture::{CloudMix, StarErrors, StarMembership, clear_stars, errors_of, least_clear};
use super::relation::{UNKNOWNS, Unknowns, experience};
use crate::base::least_squares::LinearFit;
use crate::base::statistics::Estimate;
use nalgebra::SMatrix;

type Covariance = SMatrix<f64, UNKNOWNS, UNKNOWNS>;

/// Stars for which a larger error is expected are left out: they are brightened by being detected. A choice
/// by the error that they have would prefer those that noise makes brighter.
/// Where they are too few, fainter ones count.
const LARGEST_SIGMAS_MAG: [f64; 3] = [0.1, 0.25, 0.6];

/// Shares of the stars that are above the relation at first.
const ABOVE: [f64; 4] = [0.1, 0.3, 0.5, 0.7];

/// A fit to stars in clear air.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RelationFit {
    pub unknowns: Unknowns,
    pub covariance: Covariance,
}

/// A fit to stars in clear air, among others.
pub(super) struct ClearFit {
    pub fit: RelationFit,
    pub errors: StarErrors,
    /// Number of stars in clear air.
    pub stars: usize,
    clouds: CloudMix,
}

impl ClearFit {
    /// The fit to the stars that are not dimmed. `None` if they are too few.
    pub fn fit(candidates: &[ClearSkyStar], is_flat: bool) -> Option<Self> {
        let fitted = |largest_mag| Self::to_brighter(candidates, largest_mag, is_flat, &ABOVE);
        LARGEST_SIGMAS_MAG.into_iter().find_map(fitted)
    }

    /// The fit to all of them, from fewer heights.
    pub fn to_all(candidates: &[ClearSkyStar], is_flat: bool) -> Option<Self> {
        let heights = [ABOVE[0], ABOVE[2]];
        Self::to_brighter(candidates, f64::INFINITY, is_flat, &heights)
    }

    /// The fit to those that have at most this expected error.
    ///
    /// Clear stars and those behind clouds are told apart by expectation and maximization, from several
    /// heights of the relation: the likeliest one counts.
    fn to_brighter(
        candidates: &[ClearSkyStar],
        largest_mag: f64,
        is_flat: bool,
        heights: &[f64],
    ) -> Option<Self> {
        let highest = RelationFit::first(candidates, largest_mag, is_flat, ABOVE[0])?;
        let counting = |star: &&ClearSkyStar| star.counts(&highest.unknowns, largest_mag);
        let common: Vec<&ClearSkyStar> = candidates.iter().filter(counting).collect();
        let from = |above: &f64| Self::from(candidates, largest_mag, is_flat, *above);
        let fits = heights.iter().filter_map(from);
        let rated = fits.map(|fit| (fit.ln_posterior(&common, is_flat), fit));
        let (_, best) = rated.max_by(|a, b| a.0.total_cmp(&b.0))?;
        Some(best)
    }

    /// From the height of the relation at which this share of the stars is above it.
    fn from(
        candidates: &[ClearSkyStar],
        largest_mag: f64,
        is_flat: bool,
        above: f64,
    ) -> Option<Self> {
        const ROUNDS: usize = 50;
        const SETTLED_MAG: f64 = 1e-4;
        let mut fitted = Self {
            fit: RelationFit::first(candidates, largest_mag, is_flat, above)?,
            errors: StarErrors {
                scale: 1.0,
                scatter_mag: 0.2,
            },
            stars: 0,
            clouds: CloudMix::usual(),
        };
        for _ in 0..ROUNDS {
            let Self { fit, errors, .. } = &fitted;
            let counting = candidates
                .iter()
                .filter(|star| star.counts(&fit.unknowns, largest_mag));
            let stars: Vec<(&ClearSkyStar, StarMembership)> = counting
                .map(|star| (star, star.kind(&fit.unknowns, errors, &fitted.clouds)))
                .collect();
            let clear = clear_stars(&stars);
            if clear < least_clear(stars.len()) {
                return None;
            }
            let mut next = RelationFit::of(&stars, fit, errors, is_flat)?;
            let next_errors = errors_of(&stars, candidates, &next.unknowns);
            let changed_mag = (next_errors.scatter_mag - errors.scatter_mag).abs();
            let moved_mag = (next.unknowns - fit.unknowns).amax();
            next.covariance *= next.scatter_over_errors(&stars, &next_errors).max(1.0);
            fitted = Self {
                fit: next,
                errors: next_errors,
                stars: clear.round() as usize,
                clouds: CloudMix::estimate(&stars),
            };
            if changed_mag.max(moved_mag) < SETTLED_MAG {
                break;
            }
        }
        Some(fitted)
    }

    /// Logarithm of the likelihood of `stars` and of the unknowns by experience.
    pub fn ln_posterior(&self, stars: &[&ClearSkyStar], is_flat: bool) -> f64 {
        let of_star = |star: &&ClearSkyStar| {
            let kind = star.kind(&self.fit.unknowns, &self.errors, &self.clouds);
            kind.ln_likelihood
        };
        let known = experience(is_flat).into_iter();
        let off = known
            .zip(&self.fit.unknowns)
            .map(|(known, value)| -0.5 * ((value - known.value) / known.sigma).powi(2));
        stars.iter().map(of_star).sum::<f64>() + off.sum::<f64>()
    }
}

impl RelationFit {
    /// The relation of experience, so high that this share of the stars is above it.
    fn first(stars: &[ClearSkyStar], largest_mag: f64, is_flat: bool, share: f64) -> Option<Self> {
        let mut fit = Self {
            unknowns: Unknowns::from(experience(is_flat).map(|known| known.value)),
            covariance: Covariance::zeros(),
        };
        let bright = stars.iter().filter(|star| star.sigma_mag < largest_mag);
        let mut above: Vec<f64> = bright
            .map(|star| star.residual_mag(&fit.unknowns))
            .collect();
        above.sort_unstable_by(|a, b| b.total_cmp(a));
        fit.unknowns[0] += above.get((share * above.len() as f64) as usize)?;
        Some(fit)
    }

    /// The fit to `stars`, by what they are and the errors that they have by the fit `before`.
    fn of(
        stars: &[(&ClearSkyStar, StarMembership)],
        before: &Self,
        errors: &StarErrors,
        is_flat: bool,
    ) -> Option<Self> {
        /// Least information of a star, over what it has if it is known to be clear.
        const MIN: f64 = 0.1;
        let known = experience(is_flat);
        let mut fit = LinearFit::new();
        for (unknown, Estimate { value, sigma }) in known.into_iter().enumerate() {
            fit.matrix[(unknown, unknown)] += sigma.powi(-2);
            fit.vector[unknown] += value * sigma.powi(-2);
        }
        let mut information = fit.matrix;
        for (star, kind) in stars {
            let variance = errors
                .actual_sigma_mag(star.expected_sigma_mag(&before.unknowns))
                .powi(2);
            let square = star.row * star.row.transpose() * (kind.clear / variance);
            fit.add(
                &star.row,
                kind.clear / variance,
                kind.clear * star.offset_mag / variance,
            );
            // What is lost as it may be behind clouds (Louis 1982, J. R. Stat. Soc. B 44, 226).
            let lost = (1.0 - kind.clear) * star.residual_mag(&before.unknowns).powi(2) / variance;
            information += square * (1.0 - lost).max(MIN);
        }
        Some(Self {
            unknowns: fit.solve()?,
            covariance: information.cholesky()?.inverse(),
        })
    }

    /// Mean of the squared residuals of its stars over their variances, for the number of unknowns.
    fn scatter_over_errors(
        &self,
        stars: &[(&ClearSkyStar, StarMembership)],
        errors: &StarErrors,
    ) -> f64 {
        let square = |(star, kind): &(&ClearSkyStar, StarMembership)| {
            let sigma_mag = errors.actual_sigma_mag(star.expected_sigma_mag(&self.unknowns));
            kind.clear * (star.residual_mag(&self.unknowns) / sigma_mag).powi(2)
        };
        let sum: f64 = stars.iter().map(square).sum();
        sum / (clear_stars(stars) - UNKNOWNS as f64).max(1.0)
    }

    /// The variance of a sum of the unknowns.
    pub fn variance(&self, row: &Unknowns) -> f64 {
        row.dot(&(self.covariance * row)).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::super::relation::row_of;
    use super::*;
    use crate::base::coords::UnitVector;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    const ZERO_POINT_MAG: f64 = 9.0;
    const SIGMA_MAG: f64 = 0.04;

    /// The fit to 200 stars that clouds dim by this.
    fn fitted(cloud_mag: impl Fn(usize) -> f64) -> ClearFit {
        let mut random = ChaCha8Rng::seed_from_u64(2);
        let candidate = |index: usize| {
            let noise_mag = SIGMA_MAG * random.sample::<f64, _>(StandardNormal);
            let off_mag = random.random_range(-2.0..2.0);
            ClearSkyStar {
                row: Unknowns::from(row_of(None, 0.0, Some(0.6), off_mag)),
                offset_mag: ZERO_POINT_MAG - cloud_mag(index) + noise_mag,
                sigma_mag: SIGMA_MAG,
                air_sigma_mag: 0.0,
                direction: UnitVector::from_ra_dec(0.1 * index as f64, 0.0),
                neighbor: index.is_multiple_of(2).then_some(index + 1),
            }
        };
        let candidates: Vec<ClearSkyStar> = (0..200).map(candidate).collect();
        ClearFit::fit(&candidates, true).expect("there are enough stars")
    }

    fn assert_right(fitted: &ClearFit, clear: usize) {
        let off_mag = fitted.fit.unknowns[0] - ZERO_POINT_MAG;
        let is_clear = fitted.stars.abs_diff(clear) <= clear / 10;
        assert!(
            off_mag.abs() < 0.02 && is_clear,
            "{off_mag} {}",
            fitted.stars
        );
    }

    #[test]
    fn an_even_cloud_over_most_of_the_sky_is_no_clear_air() {
        assert_right(&fitted(|index| if index % 5 == 0 { 0.0 } else { 0.5 }), 40);
    }

    #[test]
    fn clouds_of_any_thickness_are_told_from_clear_air() {
        let cloud_mag = |index| {
            if index % 2 == 0 {
                0.0
            } else {
                0.3 + 0.02 * index as f64
            }
        };
        assert_right(&fitted(cloud_mag), 100);
    }

    #[test]
    fn a_clear_sky_has_no_clouds() {
        assert_right(&fitted(|_| 0.0), 200);
    }
}
