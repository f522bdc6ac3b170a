//! The air without clouds: the zero point outside the atmosphere, and extinction per airmass.
//!
//! ```text
//! V = Z + m + c (B−V − 0.6) + q (B−V − 0.6)² − k X − a ρ² − b ρ⁴ + s (V − V̄)
//! ```
//!
//! X is the airmass, ρ the distance from the lens's axis, 1 at the edge of the field; s is 0 where gray
//! levels are proportional to light, and V̄ is the mean of the stars. What is known of
//! cameras and of air enters as measurements: where a frame tells more, it decides. Clouds only dim stars:
//! a part of them is in clear air, and the others are dimmer by some extinctions.

mod candidate;
mod fit;
mod mixture;
mod relation;

use super::stars::SkyStar;
use crate::base::statistics::Estimate;
use crate::photometry::MeasuredMagnitude;
use crate::photometry::zero_point::REFERENCE_BV_MAG;
use candidate::ClearSkyStar;
use fit::{ClearFit, RelationFit};
use mixture::StarErrors;
use relation::{
    COLOR, COLOR_CURVE, EXTINCTION, SLOPE, UNKNOWNS, USUAL_EXTINCTION, Unknowns, VIGNETTING, row_of,
};

/// B−V of the sky between stars: 0.6 by moonlight, 0.9 to 1.0 without (Patat 2003, A&A 400, 1183).
pub(super) const USUAL_SKY_BV_MAG: Estimate = Estimate {
    value: 0.8,
    sigma: 0.2,
};

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
    fit: RelationFit,
    /// V̄.
    mean_vmag: f64,
    /// What the zero point for the sky's light may be off beyond it.
    doubt_mag: f64,
}

impl ClearSky {
    /// Measures it; `None` with too few stars.
    pub(super) fn measure(stars: &[SkyStar], is_flat: bool) -> Option<Self> {
        let measured = || stars.iter().filter(|star| star.measured.is_some());
        let sum: f64 = measured().map(|star| star.v_mag).sum();
        let mean_vmag = sum / measured().count().max(1) as f64;
        let candidates = ClearSkyStar::all_of(stars, mean_vmag);
        let has_horizon = stars.iter().any(|star| star.airmass.is_some());
        let fitted = ClearFit::fit(&candidates, is_flat)?;
        Some(Self::by(&fitted, has_horizon, mean_vmag))
    }

    /// The same by `stars` whose magnitudes are those of light, all of which count, and the logarithm of its
    /// likelihood.
    pub(super) fn of_light(stars: &[SkyStar], is_flat: bool) -> Option<(Self, f64)> {
        let mut candidates = ClearSkyStar::all_of(stars, 0.0);
        for candidate in &mut candidates {
            candidate.row[SLOPE] = 0.0;
        }
        let has_horizon = stars.iter().any(|star| star.airmass.is_some());
        let fitted = ClearFit::to_all(&candidates, is_flat)?;
        let all: Vec<&ClearSkyStar> = candidates.iter().collect();
        let clear_sky = Self::by(&fitted, has_horizon, 0.0);
        Some((clear_sky, fitted.ln_posterior(&all, is_flat)))
    }

    fn by(fitted: &ClearFit, has_horizon: bool, mean_vmag: f64) -> Self {
        /// Part of what experience leaves open that a measured extinction leaves.
        const MEASURED: f64 = 0.5;
        /// Largest scatter of stars in clear air, where gray levels are proportional to light.
        const CLEAR_SCATTER_MAG: f64 = 0.12;
        let ClearFit {
            fit, errors, stars, ..
        } = fitted;
        let estimate = |unknown: usize| Estimate {
            value: fit.unknowns[unknown],
            sigma: fit.covariance[(unknown, unknown)].max(0.0).sqrt(),
        };
        let edge = Unknowns::from(row_of(None, 1.0, None, 0.0))
            - Unknowns::from(row_of(None, 0.0, None, 0.0));
        let extinction_mag = estimate(EXTINCTION);
        // Stars that scatter more may be behind thin clouds, all of them.
        let doubt_mag = Some(errors.scatter_mag).filter(|scatter| *scatter > CLEAR_SCATTER_MAG);
        let slope = estimate(SLOPE);
        // A tone curve dims stars on the bright sky above the horizon, as air does.
        let is_extinction_measured =
            !is_tone_curve(&slope) && extinction_mag.sigma < MEASURED * USUAL_EXTINCTION.sigma;
        Self {
            zero_point_vmag: estimate(0),
            extinction_mag,
            is_extinction_measured,
            color_term: estimate(COLOR),
            edge_loss_mag: Estimate {
                value: -fit.unknowns.dot(&edge),
                sigma: fit.variance(&edge).sqrt(),
            },
            slope,
            scatter_mag: errors.scatter_mag,
            stars: *stars,
            has_horizon,
            errors: *errors,
            mean_vmag,
            fit: *fit,
            doubt_mag: doubt_mag.unwrap_or(0.0),
        }
    }

    /// By how many magnitudes a star is dimmer than in clear air, and the standard error of that.
    pub(super) fn dimmed_by(&self, star: &SkyStar) -> Option<Estimate> {
        let MeasuredMagnitude {
            instrumental_mag,
            sigma_mag,
        } = star.measured?;
        Some(Estimate {
            value: self.dimmer_mag(star, instrumental_mag),
            sigma: self.errors.actual_sigma_mag(sigma_mag),
        })
    }

    /// The instrumental magnitude of a star in clear air.
    pub(super) fn instrumental_mag(&self, star: &SkyStar) -> f64 {
        let above_mean_mag = star.v_mag - self.mean_vmag;
        let row = row_of(star.airmass, star.off_axis_sq, star.bv_mag, above_mean_mag);
        star.v_mag - self.dot(row)
    }

    /// The V magnitude of a star of B−V 0.6 in clear air, by its instrumental one.
    pub(super) fn v_mag(
        &self,
        airmass: Option<f64>,
        off_axis_sq: f64,
        instrumental_mag: f64,
    ) -> f64 {
        let slope = self.fit.unknowns[SLOPE];
        let row = row_of(airmass, off_axis_sq, None, -self.mean_vmag);
        (instrumental_mag + self.dot(row)) / (1.0 - slope)
    }

    /// By how many magnitudes a star of this instrumental magnitude would be dimmer than in clear air.
    pub(super) fn dimmer_mag(&self, star: &SkyStar, instrumental_mag: f64) -> f64 {
        (instrumental_mag - self.instrumental_mag(star)) / (1.0 - self.fit.unknowns[SLOPE])
    }

    /// The standard error of the magnitude that a star in clear air should have at a place.
    pub(super) fn sigma_mag(&self, airmass: Option<f64>, off_axis_sq: f64) -> f64 {
        let row = Unknowns::from(row_of(airmass, off_axis_sq, None, 0.0));
        libm::hypot(self.fit.variance(&row).sqrt(), self.doubt_mag)
    }

    /// Whether gray levels have a tone curve.
    pub(super) fn has_tone_curve(&self) -> bool {
        is_tone_curve(&self.slope)
    }

    fn dot(&self, row: [f64; UNKNOWNS]) -> f64 {
        row.iter().zip(&self.fit.unknowns).map(|(a, b)| a * b).sum()
    }

    /// The zero point for the light of a sky of this color at the ground, with what the lens takes at a place
    /// given back; the error contains that of the color and of the lens.
    pub(super) fn for_sky(&self, bv_mag: Estimate, off_axis_sq: f64) -> Estimate {
        let row = |off_axis_sq| row_of(None, off_axis_sq, Some(bv_mag.value), 0.0);
        let at_place = Unknowns::from(row(off_axis_sq));
        let variance = self.fit.variance(&at_place);
        let off_mag = bv_mag.value - REFERENCE_BV_MAG;
        let per_mag = self.fit.unknowns[COLOR] + 2.0 * self.fit.unknowns[COLOR_CURVE] * off_mag;
        Estimate {
            value: self.dot(row(0.0)),
            sigma: (variance + self.doubt_mag.powi(2) + (per_mag * bv_mag.sigma).powi(2)).sqrt(),
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
    pub(super) fn transmission(&self, off_axis_sq: f64) -> f64 {
        let [a, b] = VIGNETTING.map(|unknown| self.fit.unknowns[unknown]);
        let loss_mag = a * off_axis_sq + b * off_axis_sq * off_axis_sq;
        libm::pow(10.0, -0.4 * loss_mag)
    }
}

/// Whether a slope is that of a tone curve.
fn is_tone_curve(slope: &Estimate) -> bool {
    const MIN_SLOPE: f64 = 0.1;
    const SIGMAS: f64 = 3.0;
    slope.value.abs() > MIN_SLOPE.max(SIGMAS * slope.sigma)
}
