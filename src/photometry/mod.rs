//! How bright are the stars in a frame, and how faint does it go? Zero point and completeness.
//!
//! (`IdentifiedFrame`, [`IndexedCatalog`]) → [`FramePhotometry`]
//!
//! 1. The catalogue's stars in the frame are predicted, at its date and to well below the faintest
//!    detection. Those that a detection has the name of are detected.
//! 2. Bright, single, constant, unsaturated stars (`standards`) give the zero point ([`zero_point`]).
//! 3. All single stars, detected or not, give the completeness ([`completeness`]) and the limiting
//!    magnitude, at which half of the stars are detected, on a background with its mean of faint
//!    stars. The faintest detected star is a poor measure of the limit, because it owes its detection
//!    to noise.
//! 4. [`comparison`] compares the results with the stated camera.
//!
//! Caveats: an incomplete catalogue biases the completeness only if it lacks red stars or close
//! pairs more than others. The limit is that of the frame's mean transparency, noise and star
//! color. The grey levels of a JPEG are not proportional to light, so its zero point holds only
//! for stars of medium brightness.

pub(crate) mod association;
mod color_frame;
pub mod comparison;
pub mod completeness;
mod identified_frame;
mod measured;
mod standards;
pub mod zero_point;

pub(crate) use association::{filter_response, resolved_px};
pub(crate) use color_frame::{ColorFrame, PictureColors};
pub(crate) use identified_frame::IdentifiedFrame;
pub use measured::instrumental_mag;

use crate::base::statistics::median_of;
use crate::catalog::StarIndex;
use crate::detect::Detection;
use crate::identify::IndexedCatalog;
use association::{Association, FrameStar, associate};
use completeness::{Completeness, CountedStar, NoLimit};
pub(crate) use measured::{MAG_PER_RELATIVE, MeasuredMagnitude};
use standards::Standards;
use zero_point::{NoZeroPoint, ZeroPoint};

/// B−V of a star like the Sun, for which limits hold.
pub(crate) const SUN_BV_MAG: f64 = 0.64;

/// Photometry of a frame.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct FramePhotometry {
    /// V magnitude of a star that gives 1 ADU, or 1 ADU/s where the exposure is known; `None` with
    /// too few stars.
    pub zero_point: Option<ZeroPoint>,
    /// Why there is none; `None` where there is one.
    pub no_zero_point: Option<NoZeroPoint>,
    /// The exposure by which fluxes were divided, in seconds.
    pub exposure_s: Option<f64>,
    /// The share of stars that is detected, by magnitude.
    pub completeness: Completeness,
}

/// Measures zero point and completeness of `frame` with the stars of `sky`.
pub(crate) fn measure(frame: &IdentifiedFrame, sky: &IndexedCatalog) -> FramePhotometry {
    let view = frame.identification.view();
    let predicted = view.stars_to(sky, depth_v_mag(frame, sky));
    let Association { stars, chance } = associate(frame, &predicted);
    let clear: Vec<&FrameStar> = stars.iter().filter(|star| star.is_clear).collect();
    let counted = |v_mag: &dyn Fn(&FrameStar) -> f64| {
        let counted = clear.iter().map(|star| CountedStar {
            v_mag: v_mag(star) - star.brighter_mag(),
            detected: star.detection.is_some(),
        });
        completeness::measure(&counted.collect::<Vec<_>>(), chance)
    };
    let by_v = counted(&|star| star.v_mag);
    let standards = Standards::select(&clear, frame, sky);
    let chosen = standards.chosen(by_v.fall.as_ref());
    let mut zero_point = zero_point::measure(&chosen);
    let v_sigma_mag = sky.catalog().v_sigma_mag();
    if let Some(zero_point) = &mut zero_point {
        let common_sigma_mag = MAG_PER_RELATIVE * frame.detections.flux_scale_sigma;
        let common_sigma_mag = libm::hypot(common_sigma_mag, v_sigma_mag);
        zero_point.sigma_mag = libm::hypot(zero_point.sigma_mag, common_sigma_mag);
    }
    let color_term = zero_point.as_ref().and_then(|zero| zero.color_term);
    let mut completeness = match color_term {
        None => by_v,
        Some(term) => counted(&|star| {
            let bv_mag = sky.catalog().star(star.star).bv_mag.map(f64::from);
            let redder_mag = bv_mag.map_or(0.0, |bv| bv - SUN_BV_MAG);
            star.v_mag - term.value * redder_mag
        }),
    };
    if let Ok(limit) = &mut completeness.limit {
        limit.sigma_mag = libm::hypot(limit.sigma_mag, v_sigma_mag);
    }
    if frame.detections.is_truncated {
        let measured = frame.detections.sources.len();
        completeness.limit = Err(NoLimit::StarsLeftOut { measured });
    }
    FramePhotometry {
        no_zero_point: zero_point.is_none().then(|| standards.lack()),
        zero_point,
        exposure_s: frame.exposure_s,
        completeness,
    }
}

/// The V magnitude to which catalogue stars are predicted: clearly fainter ones cannot be detected.
pub(crate) fn depth_v_mag(frame: &IdentifiedFrame, sky: &IndexedCatalog) -> f64 {
    /// How far beyond the faintest detection.
    const MARGIN_MAG: f64 = 1.0;
    let sources = &frame.detections.sources;
    let matches = &frame.identification.matches;
    let v_mag = |star: StarIndex| f64::from(sky.catalog().star(star).v_mag);
    let mag = |source: &Detection| instrumental_mag(source.flux_adu);
    let offsets = matches
        .iter()
        .map(|m| v_mag(m.star) - mag(&sources[m.source.get()]));
    let faintest = matches.iter().map(|m| v_mag(m.star));
    let faintest_star = sources
        .iter()
        .filter(|source| source.flags.is_star_like() && source.flux_adu > 0.0)
        .map(mag)
        .fold(f64::MIN, f64::max);
    let by_flux = median_of(offsets).unwrap_or(0.0) + faintest_star;
    faintest.fold(by_flux, f64::max) + MARGIN_MAG
}
