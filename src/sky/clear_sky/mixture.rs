//! Stars in clear air, among others: clouds dim stars by some extinctions, and a few may be anything.

use super::candidate::ClearSkyStar;
use super::relation::Unknowns;
use crate::base::statistics::{SIGMA_PER_MAD, median, median_of, normal_density};

/// Mean extinction of clouds, in magnitudes: thin ones are more frequent.
const MEAN_CLOUD_MAG: f64 = 1.0;

/// Least number of stars in clear air, and their least share of all: fewer may be brighter by a neighbor, in a
/// sky that is clear.
const MIN_STARS: f64 = 12.0;
const MIN_FRACTION: f64 = 0.1;

/// What the magnitudes of stars in clear air scatter, beside what is stated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct StarErrors {
    /// The error by the star's own flux, over the stated one. Less than 1 in pictures whose spots have
    /// another form than the model: their stated errors contain what this makes of a pixel.
    pub scale: f64,
    /// Scatter beyond these errors.
    pub scatter_mag: f64,
}

impl StarErrors {
    /// The error of a magnitude with this stated one.
    pub fn actual_sigma_mag(&self, sigma_mag: f64) -> f64 {
        libm::hypot(self.scale * sigma_mag, self.scatter_mag)
    }
}

/// How many stars clouds dim, and by how much: parts of them about some extinctions. An even cloud is one of them.
#[derive(Debug, Clone, Copy)]
pub(super) struct CloudMix {
    /// Part of the stars that is behind clouds.
    clouded: f64,
    /// Shares of these stars.
    fractions: [f64; PARTS],
}

/// Extinctions of the parts, and their standard deviations, in magnitudes. Air with less counts as clear.
const PARTS: usize = 15;
const PART_MAG: [f64; PARTS] = [
    0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0,
];
const PART_SIGMA_MAG: [f64; PARTS] = [
    0.05, 0.05, 0.05, 0.05, 0.05, 0.05, 0.05, 0.05, 0.1, 0.12, 0.2, 0.25, 0.25, 0.4, 0.6,
];

impl CloudMix {
    /// Before stars tell: thin clouds are more frequent.
    pub fn usual() -> Self {
        Self {
            clouded: 0.5,
            fractions: Self::usual_fractions(),
        }
    }

    fn usual_fractions() -> [f64; PARTS] {
        let weight =
            |part: usize| PART_SIGMA_MAG[part] * libm::exp(-PART_MAG[part] / MEAN_CLOUD_MAG);
        let total: f64 = (0..PARTS).map(weight).sum();
        std::array::from_fn(|part| weight(part) / total)
    }

    /// By what `stars` are, and what is usual.
    pub fn estimate(stars: &[(&ClearSkyStar, StarMembership)]) -> Self {
        /// Stars in clear air, and behind clouds, which a frame has beforehand.
        const BEFOREHAND: f64 = 0.5;
        let cloudy = |part: usize| stars.iter().map(|(_, kind)| kind.clouds[part]).sum::<f64>();
        let usual = Self::usual_fractions();
        let counts: [f64; PARTS] =
            std::array::from_fn(|part| BEFOREHAND * usual[part] + cloudy(part));
        let cloudy: f64 = counts.iter().sum();
        Self {
            clouded: cloudy / (cloudy + BEFOREHAND + clear_stars(stars)),
            fractions: counts.map(|count| count / cloudy),
        }
    }
}

/// What a star is.
#[derive(Debug, Clone, Copy)]
pub(super) struct StarMembership {
    /// Probability that it is in clear air, and that it is behind each part of the clouds.
    pub clear: f64,
    pub clouds: [f64; PARTS],
    /// Logarithm of the likelihood of its magnitude.
    pub ln_likelihood: f64,
}

impl ClearSkyStar {
    /// What it is by a fit, and by what clouds there are.
    pub fn kind(
        &self,
        unknowns: &Unknowns,
        errors: &StarErrors,
        clouds: &CloudMix,
    ) -> StarMembership {
        /// Share of stars of which nothing is known: variable ones, wrong names.
        const UNTRUE: f64 = 0.02;
        /// Their magnitudes are anything within this range.
        const UNTRUE_RANGE_MAG: f64 = 6.0;
        let dimmer_mag = -self.residual_mag(unknowns);
        let sigma_mag = errors.actual_sigma_mag(self.expected_sigma_mag(unknowns));
        let normal = |off_mag: f64, sigma_mag: f64| normal_density(off_mag / sigma_mag) / sigma_mag;
        let of_part = |part: usize| {
            let sigma_mag = libm::hypot(sigma_mag, PART_SIGMA_MAG[part]);
            clouds.fractions[part] * normal(dimmer_mag - PART_MAG[part], sigma_mag)
        };
        let clear = (1.0 - UNTRUE) * (1.0 - clouds.clouded) * normal(dimmer_mag, sigma_mag);
        let parts: [f64; PARTS] =
            std::array::from_fn(|part| (1.0 - UNTRUE) * clouds.clouded * of_part(part));
        let all = clear + parts.iter().sum::<f64>() + UNTRUE / UNTRUE_RANGE_MAG;
        StarMembership {
            clear: clear / all,
            clouds: parts.map(|part| part / all),
            ln_likelihood: libm::log(all),
        }
    }
}

/// How many of so many stars are in clear air at least.
pub(super) fn least_clear(stars: usize) -> f64 {
    MIN_STARS.max(MIN_FRACTION * stars as f64)
}

/// Number of stars in clear air.
pub(super) fn clear_stars(stars: &[(&ClearSkyStar, StarMembership)]) -> f64 {
    stars.iter().map(|(_, kind)| kind.clear).sum()
}

/// The errors of stars. Only what is above the relation is noise alone. What neighbors have in common is none, but
/// clouds.
pub(super) fn errors_of(
    stars: &[(&ClearSkyStar, StarMembership)],
    candidates: &[ClearSkyStar],
    unknowns: &Unknowns,
) -> StarErrors {
    /// Least scatter of a star: its catalogue magnitude and its pixels.
    const MIN_MAG: f64 = 0.02;
    const MAX_MAG: f64 = 0.5;
    const MIN_PAIRS: usize = 20;
    /// Stated errors too large by less than this are right.
    const LARGEST_SCALE: f64 = 0.8;
    let clear = stars.iter().filter(|(_, kind)| kind.clear > 0.5);
    let above = clear.filter(|(star, _)| star.residual_mag(unknowns) > 0.0);
    let pairs = above.map(|(star, _)| {
        let seen_mag = SIGMA_PER_MAD * star.residual_mag(unknowns);
        (seen_mag, star.expected_sigma_mag(unknowns))
    });
    let ratios = pairs.clone().map(|(seen, stated)| seen / stated);
    let scale = median_of(ratios).unwrap_or(1.0);
    let scale = if scale < LARGEST_SCALE { scale } else { 1.0 };
    let excess = pairs.map(|(seen, stated)| seen.powi(2) - (scale * stated).powi(2));
    let mut scatter_mag2 = median_of(excess).unwrap_or(0.0);
    let apart = stars.iter().filter_map(|(star, _)| {
        let other = &candidates[star.neighbor?];
        let apart_mag =
            SIGMA_PER_MAD * (star.residual_mag(unknowns) - other.residual_mag(unknowns));
        let stated = [*star, other].map(|star| scale * star.expected_sigma_mag(unknowns));
        Some(0.5 * (apart_mag.powi(2) - stated[0].powi(2) - stated[1].powi(2)))
    });
    let mut apart: Vec<f64> = apart.collect();
    if apart.len() >= MIN_PAIRS {
        scatter_mag2 = scatter_mag2.min(median(&mut apart));
    }
    StarErrors {
        scale,
        scatter_mag: scatter_mag2.max(MIN_MAG.powi(2)).sqrt().min(MAX_MAG),
    }
}
