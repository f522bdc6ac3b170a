//! The air without clouds: the zero point outside the atmosphere, and extinction per airmass.
//!
//! ```text
//! V = Z + m + c (B−V − 0.6) + q (B−V − 0.6)² − k X − a ρ² − b ρ⁴ + s (V − V̄)
//! ```
//!
//! X is the airmass, ρ the distance from the frame's centre, 1 at the edge of the field; s is 0 where gray
//! levels are proportional to light, and V̄ is the mean of the stars. What is known of
//! cameras and of air enters as measurements: where a frame tells more, it decides. Clouds only dim stars:
//! a part of them is in clear air, and the others are dimmer by anything.

use super::stars::SkyStar;
use crate::base::statistics::{Estimate, median, normal_cdf};
use crate::photometry::Measured;
use crate::photometry::zero_point::REFERENCE_BV_MAG;
use nalgebra::{SMatrix, SVector};
use std::f64::consts::TAU;

/// Unknowns: Z, c, k, a, b, s, q.
const UNKNOWNS: usize = 7;
const COLOR: usize = 1;
const EXTINCTION: usize = 2;
const VIGNETTING: [usize; 2] = [3, 4];
const SLOPE: usize = 5;
const COLOR_CURVE: usize = 6;
/// Extinction in V, in magnitudes per airmass, and how it differs from place to place and night to night
/// (Patat et al. 2011, A&A 527, A91, for Paranal: 0.12; 0.2 to 0.3 near sea level).
const USUAL_EXTINCTION: Estimate = Estimate {
    value: 0.2,
    sigma: 0.1,
};
/// Color terms of cameras.
const USUAL_COLOR_SIGMA: f64 = 0.3;
/// Their change with color: 0 in a band as V, 0.12 without a filter (black bodies from 400 to 800 nm).
const USUAL_COLOR_CURVE: Estimate = Estimate {
    value: 0.06,
    sigma: 0.06,
};
/// B−V of the sky between stars: 0.6 by moonlight, 0.9 to 1.0 without (Patat 2003, A&A 400, 1183).
pub(super) const SKY_BV_MAG: Estimate = Estimate {
    value: 0.8,
    sigma: 0.2,
};
/// Loss of light at the edge where no flat removed it, in magnitudes: of the terms with ρ² and ρ⁴.
const USUAL_LOSS: [Estimate; 2] = [
    Estimate {
        value: 0.3,
        sigma: 0.7,
    },
    Estimate {
        value: 0.0,
        sigma: 0.3,
    },
];
/// The same where a flat did, or the loss is stated.
const FLAT_SIGMA_MAG: f64 = 0.01;
/// Slopes of gray levels with a tone curve.
const USUAL_SLOPE_SIGMA: f64 = 0.3;
/// Least number of stars.
const MIN_STARS: usize = 20;
/// Stars for which a larger error is expected are left out: they are brightened by being detected. A choice
/// by the error that they have would prefer those that noise makes brighter.
/// Where they are too few, fainter ones count.
const LARGEST_SIGMAS_MAG: [f64; 3] = [0.1, 0.25, 0.6];

/// Mean extinction of clouds, in magnitudes: thin ones are more frequent.
pub(super) const MEAN_CLOUD_MAG: f64 = 1.0;

/// The air without clouds, and the camera.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct ClearSky {
    /// V magnitude of a star of B−V 0.6 outside the atmosphere that gives 1 ADU in a second at the frame's
    /// centre.
    pub zero_point_vmag: Estimate,
    /// Extinction in magnitudes per airmass.
    pub extinction_mag: Estimate,
    /// Whether the frame's stars, and not experience, tell the extinction.
    pub is_extinction_measured: bool,
    /// Magnitudes per magnitude of B−V.
    pub color_term: Estimate,
    /// Magnitudes by which stars at the edge of the field are dimmer than at its centre.
    pub edge_loss_mag: Estimate,
    /// Part of a magnitude that is missing in the frame: 0 where gray levels are proportional to light.
    pub slope: Estimate,
    /// Standard deviation of a bright star about the relation.
    pub scatter_mag: f64,
    /// Number of stars.
    pub stars: usize,
    /// Whether airmasses are known.
    pub has_horizon: bool,
    /// The errors of all stars.
    errors: StarErrors,
    unknowns: [f64; UNKNOWNS],
    /// V̄.
    mean_vmag: f64,
    /// Error of the zero point for the sky's light.
    sky_sigma_mag: f64,
}

/// A fit.
struct Fit {
    unknowns: SVector<f64, UNKNOWNS>,
    covariance: SMatrix<f64, UNKNOWNS, UNKNOWNS>,
}

/// What the magnitudes of stars in clear air scatter, beside what is stated.
#[derive(Debug, Clone, Copy, PartialEq)]
struct StarErrors {
    /// The error by the star's own flux, over the stated one. Less than 1 in pictures whose spots have
    /// another form than the model: their stated errors contain what this makes of a pixel.
    scale: f64,
    /// Scatter beyond these errors.
    scatter_mag: f64,
}

impl StarErrors {
    /// The error of a magnitude with this stated one.
    fn of(&self, sigma_mag: f64) -> f64 {
        libm::hypot(self.scale * sigma_mag, self.scatter_mag)
    }
}

/// A fit to stars in clear air, among others.
struct ClearFit {
    fit: Fit,
    errors: StarErrors,
    /// Number of stars in clear air.
    stars: usize,
    /// Part of the stars that is behind clouds.
    clouded: f64,
}

impl ClearFit {
    /// From the height of the relation at which this share of the stars is above it.
    fn from(candidates: &[Candidate], largest_mag: f64, is_flat: bool, above: f64) -> Option<Self> {
        const ROUNDS: usize = 50;
        const SETTLED_MAG: f64 = 1e-4;
        /// Stars in clear air, and behind clouds, which a frame has beforehand.
        const BEFOREHAND: f64 = 0.5;
        let mut fitted = Self {
            fit: Fit::first(candidates, largest_mag, is_flat, above)?,
            errors: StarErrors {
                scale: 1.0,
                scatter_mag: 0.2,
            },
            stars: 0,
            clouded: 0.5,
        };
        for _ in 0..ROUNDS {
            let Self { fit, errors, .. } = &fitted;
            let counting = candidates
                .iter()
                .filter(|star| star.counts(fit, largest_mag));
            let stars: Vec<(&Candidate, Kind)> = counting
                .map(|star| (star, star.kind(fit, errors, fitted.clouded)))
                .collect();
            let clear = clear_stars(&stars);
            if clear < MIN_STARS as f64 {
                return None;
            }
            let mut next = Fit::of(&stars, fit, errors, is_flat)?;
            let next_errors = errors_of(&stars, &next);
            let changed_mag = (next_errors.scatter_mag - errors.scatter_mag).abs();
            let moved_mag = (next.unknowns - fit.unknowns).amax();
            next.covariance *= next.scatter_over_errors(&stars, &next_errors).max(1.0);
            let cloudy: f64 = stars.iter().map(|(_, kind)| kind.cloud).sum();
            fitted = Self {
                fit: next,
                errors: next_errors,
                stars: clear.round() as usize,
                clouded: (BEFOREHAND + cloudy) / (2.0 * BEFOREHAND + clear + cloudy),
            };
            if changed_mag.max(moved_mag) < SETTLED_MAG {
                break;
            }
        }
        Some(fitted)
    }

    /// Logarithm of the likelihood of `stars` and of the unknowns by experience.
    fn ln_posterior(&self, stars: &[&Candidate], is_flat: bool) -> f64 {
        let of_star = |star: &&Candidate| {
            let kind = star.kind(&self.fit, &self.errors, self.clouded);
            kind.ln_likelihood
        };
        let known = Fit::experience(is_flat).into_iter();
        let off = known
            .zip(&self.fit.unknowns)
            .map(|(known, value)| -0.5 * ((value - known.value) / known.sigma).powi(2));
        stars.iter().map(of_star).sum::<f64>() + off.sum::<f64>()
    }
}

/// A star by which it may be measured.
struct Candidate {
    row: SVector<f64, UNKNOWNS>,
    /// V magnitude less the instrumental one.
    offset_mag: f64,
    /// Standard error of that by its own flux.
    sigma_mag: f64,
}

impl Candidate {
    fn of(star: &SkyStar, mean_vmag: f64) -> Option<Self> {
        let Measured {
            instrumental_mag,
            sigma_mag,
        } = star.measured?;
        Some(Self {
            row: SVector::from(row_of(
                star.airmass,
                star.off_centre_sq,
                star.bv_mag,
                star.v_mag - mean_vmag,
            )),
            offset_mag: star.v_mag - instrumental_mag,
            sigma_mag,
        })
    }

    /// By how much it is brighter than a fit says.
    fn residual_mag(&self, fit: &Fit) -> f64 {
        self.offset_mag - fit.unknowns.dot(&self.row)
    }

    /// Its standard error if it were as bright as the fit says.
    fn expected_sigma_mag(&self, fit: &Fit) -> f64 {
        self.sigma_mag * libm::pow(10.0, 0.4 * self.residual_mag(fit))
    }

    /// Whether it counts, by the error that it would have.
    fn counts(&self, fit: &Fit, largest_mag: f64) -> bool {
        self.expected_sigma_mag(fit) < largest_mag
    }

    /// What it is by a fit where a part `clouded` of the stars is behind clouds.
    fn kind(&self, fit: &Fit, errors: &StarErrors, clouded: f64) -> Kind {
        /// Share of stars of which nothing is known: variable ones, wrong names.
        const UNTRUE: f64 = 0.02;
        /// Their magnitudes are anything within this range.
        const UNTRUE_RANGE_MAG: f64 = 6.0;
        let dimmer_mag = -self.residual_mag(fit);
        let sigma_mag = errors.of(self.expected_sigma_mag(fit));
        let off = dimmer_mag / sigma_mag;
        let clear = libm::exp(-0.5 * off * off) / (sigma_mag * TAU.sqrt());
        // An exponential distribution with the star's error.
        let per_mean = sigma_mag / MEAN_CLOUD_MAG;
        let cloud = libm::exp(0.5 * per_mean * per_mean - dimmer_mag / MEAN_CLOUD_MAG)
            * normal_cdf(off - per_mean)
            / MEAN_CLOUD_MAG;
        let clear = (1.0 - UNTRUE) * (1.0 - clouded) * clear;
        let cloud = (1.0 - UNTRUE) * clouded * cloud;
        let all = clear + cloud + UNTRUE / UNTRUE_RANGE_MAG;
        Kind {
            clear: clear / all,
            cloud: cloud / all,
            ln_likelihood: libm::log(all),
        }
    }
}

/// What a star is.
#[derive(Debug, Clone, Copy)]
struct Kind {
    /// Probability that it is in clear air, and that it is behind clouds.
    clear: f64,
    cloud: f64,
    /// Logarithm of the likelihood of its magnitude.
    ln_likelihood: f64,
}

impl ClearSky {
    /// Measures it; `None` with too few stars.
    pub(super) fn of(stars: &[SkyStar], is_flat: bool) -> Option<Self> {
        let measured = || stars.iter().filter(|star| star.measured.is_some());
        let sum: f64 = measured().map(|star| star.v_mag).sum();
        let mean_vmag = sum / measured().count().max(1) as f64;
        let candidate = |star| Candidate::of(star, mean_vmag);
        let candidates: Vec<Candidate> = stars.iter().filter_map(candidate).collect();
        let has_horizon = stars.iter().any(|star| star.airmass.is_some());
        let fitted = |largest_mag| Fit::of_clear_sky(&candidates, largest_mag, is_flat);
        let (fit, errors, used) = LARGEST_SIGMAS_MAG.into_iter().find_map(fitted)?;
        Some(fit.clear_sky(errors, used, has_horizon, mean_vmag))
    }

    /// By how many magnitudes a star is dimmer than in clear air, and the standard error of that.
    pub(super) fn dimmed_by(&self, star: &SkyStar) -> Option<Estimate> {
        let Measured {
            instrumental_mag,
            sigma_mag,
        } = star.measured?;
        Some(Estimate {
            value: self.dimmer_mag(star, instrumental_mag),
            sigma: self.errors.of(sigma_mag),
        })
    }

    /// The instrumental magnitude of a star in clear air.
    pub(super) fn instrumental_mag(&self, star: &SkyStar) -> f64 {
        let above_mean_mag = star.v_mag - self.mean_vmag;
        let row = row_of(
            star.airmass,
            star.off_centre_sq,
            star.bv_mag,
            above_mean_mag,
        );
        star.v_mag - self.dot(row)
    }

    /// The V magnitude of a star of B−V 0.6 in clear air, by its instrumental one.
    pub(super) fn v_mag(
        &self,
        airmass: Option<f64>,
        off_centre_sq: f64,
        instrumental_mag: f64,
    ) -> f64 {
        let slope = self.unknowns[SLOPE];
        let row = row_of(airmass, off_centre_sq, None, -self.mean_vmag);
        (instrumental_mag + self.dot(row)) / (1.0 - slope)
    }

    /// By how many magnitudes a star of this instrumental magnitude would be dimmer than in clear air.
    pub(super) fn dimmer_mag(&self, star: &SkyStar, instrumental_mag: f64) -> f64 {
        (instrumental_mag - self.instrumental_mag(star)) / (1.0 - self.unknowns[SLOPE])
    }

    /// Whether gray levels have a tone curve.
    pub(super) fn has_tone_curve(&self) -> bool {
        const LEAST_SLOPE: f64 = 0.1;
        const SIGMAS: f64 = 3.0;
        let Estimate { value, sigma } = self.slope;
        value.abs() > LEAST_SLOPE.max(SIGMAS * sigma)
    }

    fn dot(&self, row: [f64; UNKNOWNS]) -> f64 {
        row.iter().zip(self.unknowns).map(|(a, b)| a * b).sum()
    }

    /// The zero point for the sky's light at the ground, at the frame's centre; the error contains that of the
    /// sky's color.
    pub(super) fn for_sky(&self) -> Estimate {
        let row = row_of(None, 0.0, Some(SKY_BV_MAG.value), 0.0);
        let off_mag = SKY_BV_MAG.value - REFERENCE_BV_MAG;
        let per_mag = self.unknowns[COLOR] + 2.0 * self.unknowns[COLOR_CURVE] * off_mag;
        Estimate {
            value: self.dot(row),
            sigma: libm::hypot(self.sky_sigma_mag, per_mag * SKY_BV_MAG.sigma),
        }
    }

    /// V magnitude of a star of B−V 0.6 at the zenith that gives 1 ADU in a second at the frame's centre; without
    /// a horizon, of one seen through the air.
    pub(crate) fn ground_vmag(&self) -> f64 {
        let extinction_mag = if self.has_horizon {
            self.extinction_mag.value
        } else {
            0.0
        };
        self.zero_point_vmag.value - extinction_mag
    }

    /// What arrives at a place, over what arrives at the centre.
    pub(super) fn transmission(&self, off_centre_sq: f64) -> f64 {
        let [a, b] = VIGNETTING.map(|unknown| self.unknowns[unknown]);
        let loss_mag = a * off_centre_sq + b * off_centre_sq * off_centre_sq;
        libm::pow(10.0, -0.4 * loss_mag)
    }
}

/// Number of stars in clear air.
fn clear_stars(stars: &[(&Candidate, Kind)]) -> f64 {
    stars.iter().map(|(_, kind)| kind.clear).sum()
}

/// The errors of stars. Only what is above the relation is noise alone.
fn errors_of(stars: &[(&Candidate, Kind)], fit: &Fit) -> StarErrors {
    /// Least scatter of a star: its catalogue magnitude and its pixels.
    const LEAST_MAG: f64 = 0.01;
    const MOST_MAG: f64 = 0.5;
    /// Standard deviation of normal noise over its median size.
    const PER_MEDIAN: f64 = 1.4826;
    /// Stated errors too large by less than this are right.
    const LARGEST_SCALE: f64 = 0.8;
    let clear = stars.iter().filter(|(_, kind)| kind.clear > 0.5);
    let above = clear.filter(|(star, _)| star.residual_mag(fit) > 0.0);
    let pairs = above.map(|(star, _)| {
        let seen_mag = PER_MEDIAN * star.residual_mag(fit);
        (seen_mag, star.expected_sigma_mag(fit))
    });
    let median_of = |values: &mut Vec<f64>| (!values.is_empty()).then(|| median(values));
    let mut ratios: Vec<f64> = pairs.clone().map(|(seen, stated)| seen / stated).collect();
    let scale = median_of(&mut ratios).unwrap_or(1.0);
    let scale = if scale < LARGEST_SCALE { scale } else { 1.0 };
    let mut excess: Vec<f64> = pairs
        .map(|(seen, stated)| seen.powi(2) - (scale * stated).powi(2))
        .collect();
    let scatter_mag2 = median_of(&mut excess).unwrap_or(0.0);
    StarErrors {
        scale,
        scatter_mag: scatter_mag2.max(LEAST_MAG.powi(2)).sqrt().min(MOST_MAG),
    }
}

/// The derivatives of the relation by the unknowns.
fn row_of(
    airmass: Option<f64>,
    off_centre_sq: f64,
    bv_mag: Option<f64>,
    above_mean_mag: f64,
) -> [f64; UNKNOWNS] {
    let off_mag = bv_mag.map_or(0.0, |bv_mag| bv_mag - REFERENCE_BV_MAG);
    [
        1.0,
        off_mag,
        // Without a horizon the zero point is that of the ground.
        -airmass.unwrap_or(0.0),
        -off_centre_sq,
        -off_centre_sq * off_centre_sq,
        above_mean_mag,
        off_mag * off_mag,
    ]
}

impl Fit {
    /// Expected values of the unknowns and their standard deviations; nothing is known of Z.
    fn experience(is_flat: bool) -> [Estimate; UNKNOWNS] {
        let flat = Estimate {
            value: 0.0,
            sigma: FLAT_SIGMA_MAG,
        };
        let [first, second] = if is_flat { [flat; 2] } else { USUAL_LOSS };
        let of = |value: f64, sigma: f64| Estimate { value, sigma };
        [
            of(0.0, f64::INFINITY),
            of(0.0, USUAL_COLOR_SIGMA),
            USUAL_EXTINCTION,
            first,
            second,
            of(0.0, USUAL_SLOPE_SIGMA),
            USUAL_COLOR_CURVE,
        ]
    }

    /// The fit to the stars that are not dimmed and have at most this expected error, their errors, and their
    /// number. `None` if they are too few.
    ///
    /// Clear stars and those behind clouds are told apart by expectation and maximization, from several
    /// heights of the relation: the likeliest one counts.
    fn of_clear_sky(
        candidates: &[Candidate],
        largest_mag: f64,
        is_flat: bool,
    ) -> Option<(Self, StarErrors, usize)> {
        /// Shares of the stars that are above the relation at first.
        const ABOVE: [f64; 4] = [0.1, 0.3, 0.5, 0.7];
        let highest = Self::first(candidates, largest_mag, is_flat, ABOVE[0])?;
        let counting = |star: &&Candidate| star.counts(&highest, largest_mag);
        let common: Vec<&Candidate> = candidates.iter().filter(counting).collect();
        let from = |above| ClearFit::from(candidates, largest_mag, is_flat, above);
        let fits = ABOVE.into_iter().filter_map(from);
        let rated = fits.map(|fit| (fit.ln_posterior(&common, is_flat), fit));
        let (_, best) = rated.max_by(|a, b| a.0.total_cmp(&b.0))?;
        Some((best.fit, best.errors, best.stars))
    }

    /// The relation of experience, so high that this share of the stars is above it.
    fn first(stars: &[Candidate], largest_mag: f64, is_flat: bool, share: f64) -> Option<Self> {
        let mut fit = Self {
            unknowns: SVector::from(Self::experience(is_flat).map(|known| known.value)),
            covariance: SMatrix::zeros(),
        };
        let bright = stars.iter().filter(|star| star.sigma_mag < largest_mag);
        let mut above: Vec<f64> = bright.map(|star| star.residual_mag(&fit)).collect();
        above.sort_unstable_by(|a, b| b.total_cmp(a));
        fit.unknowns[0] += above.get((share * above.len() as f64) as usize)?;
        Some(fit)
    }

    /// The fit to `stars`, by what they are and the errors that they have by the fit `before`.
    fn of(
        stars: &[(&Candidate, Kind)],
        before: &Self,
        errors: &StarErrors,
        is_flat: bool,
    ) -> Option<Self> {
        /// Least information of a star, over what it has if it is known to be clear.
        const LEAST: f64 = 0.1;
        let known = Self::experience(is_flat);
        let mut normal = SMatrix::<f64, UNKNOWNS, UNKNOWNS>::zeros();
        let mut right = SVector::<f64, UNKNOWNS>::zeros();
        for (unknown, Estimate { value, sigma }) in known.into_iter().enumerate() {
            normal[(unknown, unknown)] += sigma.powi(-2);
            right[unknown] += value * sigma.powi(-2);
        }
        let mut information = normal;
        for (star, kind) in stars {
            let variance = errors.of(star.expected_sigma_mag(before)).powi(2);
            let square = star.row * star.row.transpose() * (kind.clear / variance);
            normal += square;
            right += star.row * (kind.clear * star.offset_mag / variance);
            // What is lost as it may be behind clouds (Louis 1982, J. R. Stat. Soc. B 44, 226).
            let lost = (1.0 - kind.clear) * star.residual_mag(before).powi(2) / variance;
            information += square * (1.0 - lost).max(LEAST);
        }
        Some(Self {
            unknowns: normal.cholesky()?.solve(&right),
            covariance: information.cholesky()?.inverse(),
        })
    }

    /// Mean of the squared residuals of its stars over their variances, for the number of unknowns.
    fn scatter_over_errors(&self, stars: &[(&Candidate, Kind)], errors: &StarErrors) -> f64 {
        let square = |(star, kind): &(&Candidate, Kind)| {
            let sigma_mag = errors.of(star.expected_sigma_mag(self));
            kind.clear * (star.residual_mag(self) / sigma_mag).powi(2)
        };
        let sum: f64 = stars.iter().map(square).sum();
        sum / (clear_stars(stars) - UNKNOWNS as f64).max(1.0)
    }

    fn variance(&self, row: &SVector<f64, UNKNOWNS>) -> f64 {
        row.dot(&(self.covariance * row)).max(0.0)
    }

    fn clear_sky(
        &self,
        errors: StarErrors,
        stars: usize,
        has_horizon: bool,
        mean_vmag: f64,
    ) -> ClearSky {
        /// Part of what experience leaves open that a measured extinction leaves.
        const MEASURED: f64 = 0.5;
        /// Largest scatter of stars in clear air, where gray levels are proportional to light.
        const CLEAR_SCATTER_MAG: f64 = 0.12;
        let estimate = |unknown: usize| Estimate {
            value: self.unknowns[unknown],
            sigma: self.covariance[(unknown, unknown)].max(0.0).sqrt(),
        };
        let edge = SVector::from(row_of(None, 1.0, None, 0.0))
            - SVector::from(row_of(None, 0.0, None, 0.0));
        let extinction_mag = estimate(EXTINCTION);
        let of_sky = SVector::from(row_of(None, 0.0, Some(SKY_BV_MAG.value), 0.0));
        // Stars that scatter more may be behind thin clouds, all of them.
        let doubt_mag = Some(errors.scatter_mag).filter(|scatter| *scatter > CLEAR_SCATTER_MAG);
        let doubt_mag = doubt_mag.unwrap_or(0.0);
        ClearSky {
            zero_point_vmag: estimate(0),
            extinction_mag,
            is_extinction_measured: extinction_mag.sigma < MEASURED * USUAL_EXTINCTION.sigma,
            color_term: estimate(COLOR),
            edge_loss_mag: Estimate {
                value: -self.unknowns.dot(&edge),
                sigma: self.variance(&edge).sqrt(),
            },
            slope: estimate(SLOPE),
            scatter_mag: errors.scatter_mag,
            stars,
            has_horizon,
            errors,
            mean_vmag,
            unknowns: self.unknowns.into(),
            sky_sigma_mag: libm::hypot(self.variance(&of_sky).sqrt(), doubt_mag),
        }
    }
}
