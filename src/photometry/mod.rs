//! How bright what a frame shows is, and how faint it goes: zero point, completeness, sky.
//!
//! ([`MeasuredFrame`], [`IndexedCatalog`]) → [`FramePhotometry`]
//!
//! 1. The catalogue's stars in the frame, at its date, down to well below the faintest detection; each claims its detection.
//! 2. Bright, single, constant stars that are not saturated give the zero point ([`zero_point`]).
//! 3. All single stars, detected or not, give the completeness ([`completeness`]), and that the limiting magnitude: the one at which
//!    half of the stars are detected. The faintest star detected is none: it is the luckiest one.
//!
//! Caveats: a catalogue that is not complete is no harm, as its stars are what is counted, unless it lacks red stars or close pairs more
//! than others. The limit is that of the frame's mean transparency, noise and colours of stars. A JPEG's grey
//! levels are not proportional to light: then the zero point holds for stars of middling brightness only.

mod association;
pub mod comparison;
pub mod completeness;
pub mod zero_point;

use crate::base::statistics::median;
use crate::detect::{Detection, Detections};
use crate::identify::{Identification, IndexedCatalog, View};
use crate::sky::catalog::{Star, StarFlags, StarIndex};
use association::{Association, FrameStar, associate};
use completeness::{Completeness, Trial};
use zero_point::{MeasuredStar, ZeroPoint};

/// The zero point is from stars brighter than the limit by so many widths of the fall, of which 98 % or more are
/// detected. To choose them by their flux would be to choose those that noise and colour make bright.
const COMPLETE_WIDTHS: f64 = 2.0;
/// Where there is no limit, a star of such a signal-to-noise ratio is no matter of luck.
const SURE_SNR: f64 = 10.0;
/// How much further than the faintest star detected the catalogue's stars are looked at, in magnitudes.
const BEYOND_FAINTEST_MAG: f64 = 1.0;
/// Magnitudes to a relative error: 2.5 / ln 10.
const MAG_PER_RELATIVE: f64 = 1.085_736_204_758_13;

/// An identified frame.
#[derive(Debug, Clone, Copy)]
pub struct MeasuredFrame<'a> {
    /// What was detected.
    pub detections: &'a Detections,
    /// Camera and attitude; the matches are indices into the detections.
    pub identification: &'a Identification,
    /// When it was taken, in Julian years since J2000.0.
    pub years_since_j2000: f64,
    /// How long it was exposed, in seconds, where known.
    pub exposure_s: Option<f64>,
}

/// How bright, and how faint.
#[derive(Debug, Clone, PartialEq)]
pub struct FramePhotometry {
    /// V magnitude of a star that gives 1 ADU, or 1 ADU a second where the exposure is known; `None` where too few stars
    /// tell.
    pub zero_point: Option<ZeroPoint>,
    /// B−V of the stars that it is from, where known.
    pub zero_point_colors_mag: Vec<f64>,
    /// The exposure that fluxes were divided by, in seconds.
    pub exposure_s: Option<f64>,
    /// Which part of the stars is detected.
    pub completeness: Completeness,
}

/// The photometry of `frame` with the stars of `sky`.
pub fn measure(frame: &MeasuredFrame, sky: &IndexedCatalog) -> FramePhotometry {
    let view = View {
        camera: &frame.identification.camera,
        icrs_to_camera: &frame.identification.icrs_to_camera,
        years_since_j2000: frame.years_since_j2000,
    };
    let predicted = view.stars_to(sky, depth_v_mag(frame, sky));
    let Association { stars, chance } = associate(frame, &predicted);
    let trials: Vec<Trial> = stars
        .iter()
        .filter(|star| star.is_clear)
        .map(|star| Trial {
            v_mag: star.v_mag,
            detected: star.detection.is_some(),
        })
        .collect();
    let completeness = completeness::measure(&trials, chance);
    let is_sure = |star: &FrameStar, snr: f64| match &completeness.limit {
        Ok(limit) => star.v_mag < limit.v_mag - COMPLETE_WIDTHS * limit.width_mag,
        Err(_) => snr >= SURE_SNR,
    };
    let exposure_s = frame.exposure_s.unwrap_or(1.0);
    let measured: Vec<MeasuredStar> = stars
        .iter()
        .filter_map(|star| {
            let detection = &frame.detections.sources[star.detection?];
            let wanted = is_sure(star, detection.snr) && is_unharmed(detection);
            let known = sky.catalog().star(star.star);
            (star.is_clear && wanted && is_constant_and_single(known)).then(|| MeasuredStar {
                v_mag: star.v_mag,
                bv_mag: known.bv_mag.map(f64::from),
                instrumental_mag: instrumental_mag(detection.flux_adu / exposure_s),
                sigma_mag: MAG_PER_RELATIVE / detection.snr,
            })
        })
        .collect();
    FramePhotometry {
        zero_point: zero_point::measure(&measured),
        zero_point_colors_mag: measured.iter().filter_map(|star| star.bv_mag).collect(),
        exposure_s: frame.exposure_s,
        completeness,
    }
}

/// −2.5 log10(`flux`), the magnitude with an unknown zero point.
pub fn instrumental_mag(flux: f64) -> f64 {
    -2.5 * flux.log10()
}

/// The V magnitude down to which the catalogue's stars are looked at: none much fainter can be detected.
fn depth_v_mag(frame: &MeasuredFrame, sky: &IndexedCatalog) -> f64 {
    let sources = &frame.detections.sources;
    let matches = &frame.identification.matches;
    let v_mag = |star: StarIndex| f64::from(sky.catalog().star(star).v_mag);
    let mag = |source: &Detection| instrumental_mag(source.flux_adu);
    let mut offsets: Vec<f64> = matches
        .iter()
        .map(|m| v_mag(m.star) - mag(&sources[m.source.get()]))
        .collect();
    let faintest = matches.iter().map(|m| v_mag(m.star));
    let faintest_star = sources
        .iter()
        .filter(|source| source.flags.is_star_like() && source.flux_adu > 0.0)
        .map(mag)
        .fold(f64::MIN, f64::max);
    let by_flux = median(&mut offsets) + faintest_star;
    faintest.fold(by_flux, f64::max) + BEYOND_FAINTEST_MAG
}

/// Whether its flux is all its own, and all of it.
fn is_unharmed(detection: &Detection) -> bool {
    let flags = &detection.flags;
    !(flags.saturated || flags.blended || flags.border)
}

fn is_constant_and_single(star: &Star) -> bool {
    let unfit = [
        StarFlags::VARIABLE,
        StarFlags::MULTIPLE,
        StarFlags::BLENDED_MAGNITUDE,
        StarFlags::BLENDED_POSITION,
    ];
    !unfit.into_iter().any(|flag| star.flags.contains(flag))
}
