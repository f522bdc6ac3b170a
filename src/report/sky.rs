//! The sky at each place of a frame, in reports.

use super::digits::{FRACTION_DECIMALS, HORIZON_DECIMALS, MAG_DECIMALS, PIXEL_DECIMALS};
use crate::base::format::{significant, to_decimals};
use crate::base::statistics::Estimate;
use crate::sky::{Place, SkyCell, SkyMap, ToneFit, ZenithSky};
use serde::Serialize;

/// Significant digits of solid angles, luminances and probabilities.
const DIGITS: i32 = 4;
/// Decimals of levels.
const ADU_DECIMALS: i32 = 3;
/// Decimals of the exponent of a tone curve.
const EXPONENT_DECIMALS: i32 = 3;

/// The sky at each place of a frame. Magnitudes are those of V.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct SkyReport {
    /// V magnitude of a star of B−V 0.6 outside the atmosphere that gives 1 ADU/s, or 1 ADU without an
    /// exposure, at the frame's centre; without a site and a time, of one seen through the air.
    pub zero_point_vmag: f64,
    /// Its standard error.
    pub zero_point_sigma_mag: f64,
    /// Extinction in magnitudes per airmass, where site and time are known.
    pub extinction_mag_per_airmass: Option<f64>,
    /// Its standard error.
    pub extinction_sigma_mag: Option<f64>,
    /// Whether the stars of the frame tell the extinction, and not experience.
    pub extinction_measured: bool,
    /// Magnitudes by which stars at the edge of the field are dimmer than at its centre.
    pub edge_loss_mag: f64,
    /// Its standard error.
    pub edge_loss_sigma_mag: f64,
    /// Stars that are behind no cloud, by which these were measured.
    pub stars: usize,
    /// Level of a pixel without light, in ADU, where it is known.
    pub dark_level_adu: Option<f64>,
    /// Its standard error.
    pub dark_level_sigma_adu: Option<f64>,
    /// What tells it: `dark`, `camera`, `optical_black`, `unlit` (the pixels outside the circle of an all-sky
    /// lens), `exposures` (other frames of the night), or `darkest` (it is between 0 and the darkest part of the
    /// frame).
    pub dark_level_source: Option<&'static str>,
    /// The tone curve by which levels became light; `null` where they are taken to be proportional to it.
    pub tone_curve: Option<ToneCurveReport>,
    /// Why no brightness was measured: `bias_unknown` or `not_linear`.
    pub no_brightness: Option<&'static str>,
    /// The brightness at the zenith, as a meter with a field of 20° sees it.
    pub zenith: Option<ZenithReport>,
    /// Share of the sky in the frame that is behind clouds.
    pub cloud_share: Option<f64>,
    /// Its standard error.
    pub cloud_share_sigma: Option<f64>,
    /// The parts of the sky.
    pub cells: Vec<SkyCellReport>,
    #[serde(skip)]
    pub(super) no_brightness_text: Option<&'static str>,
}

/// A tone curve.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct ToneCurveReport {
    /// The likeliest kind: `linear`, `power`, `srgb`, `midtones` or `asinh`.
    pub kind: &'static str,
    /// Its probability.
    pub probability: f64,
    /// Relative growth of the sky's level over that of its light, both above those without light; 1 where levels
    /// are proportional to light.
    pub exponent: f64,
    /// Its standard error.
    pub exponent_sigma: f64,
}

/// The brightness at the zenith.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct ZenithReport {
    /// V magnitude of a square arcsecond.
    pub mag_arcsec2: f64,
    /// Its standard error.
    pub sigma_mag: f64,
    /// B−V, where the filters of a raw color frame tell it.
    pub bv_mag: Option<f64>,
    /// Its standard error.
    pub bv_sigma_mag: Option<f64>,
    /// Luminance, in mcd/m².
    pub luminance_mcd_m2: f64,
    /// V magnitude of the faintest star that the unaided eye sees.
    pub naked_eye_limit_vmag: f64,
    /// Bortle's class.
    pub bortle: u8,
}

/// A part of the sky.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct SkyCellReport {
    /// From and to, in degrees; `null` where the horizon is not known, or the field is narrow.
    pub altitude_deg: Option<[f64; 2]>,
    /// From and to, in degrees from north through east.
    pub azimuth_deg: Option<[f64; 2]>,
    /// First and last column, where the cell is a part of the frame.
    pub x: Option<[f64; 2]>,
    /// First and last row.
    pub y: Option<[f64; 2]>,
    /// Solid angle of its sky in the frame, in steradians.
    pub solid_angle_sr: Option<f64>,
    /// Brightness: V magnitude of a square arcsecond.
    pub mag_arcsec2: Option<f64>,
    /// Its standard error.
    pub sigma_mag: Option<f64>,
    /// B−V, where the filters of a raw color frame tell it.
    pub bv_mag: Option<f64>,
    /// Its standard error.
    pub bv_sigma_mag: Option<f64>,
    /// Luminance, in mcd/m².
    pub luminance_mcd_m2: Option<f64>,
    /// Stars that a clear sky would show.
    pub expected: usize,
    /// Those of them that were detected.
    pub detected: usize,
    /// Extinction beyond that of clear air, in magnitudes.
    pub extinction_mag: Option<f64>,
    /// Its standard error.
    pub extinction_sigma_mag: Option<f64>,
    /// Probability that this is below 0.2 mag.
    pub clear: Option<f64>,
    /// The same if clouds are smooth and rather thicker.
    pub clear_low: Option<f64>,
    /// The same if they are broken and rather thinner.
    pub clear_high: Option<f64>,
    /// V magnitude at which half of the stars should be detected, without clouds.
    pub expected_limit_vmag: Option<f64>,
    /// V magnitude at which half of the stars around it are detected.
    pub limit_vmag: Option<f64>,
    /// Its standard error.
    pub limit_sigma_mag: Option<f64>,
}

fn mag(value: f64) -> f64 {
    to_decimals(value, MAG_DECIMALS)
}

impl SkyReport {
    pub(super) fn new(sky: &SkyMap) -> Self {
        let clear = &sky.clear_sky;
        let has_horizon = clear.has_horizon;
        let share = |value: fn(&Estimate) -> f64| {
            let share = sky.cloud_share.as_ref();
            share.map(|share| to_decimals(value(share), FRACTION_DECIMALS))
        };
        Self {
            zero_point_vmag: mag(clear.zero_point_vmag.value),
            zero_point_sigma_mag: mag(clear.zero_point_vmag.sigma),
            extinction_mag_per_airmass: has_horizon.then(|| mag(clear.extinction_mag.value)),
            extinction_sigma_mag: has_horizon.then(|| mag(clear.extinction_mag.sigma)),
            extinction_measured: has_horizon && clear.is_extinction_measured,
            edge_loss_mag: mag(clear.edge_loss_mag.value),
            edge_loss_sigma_mag: mag(clear.edge_loss_mag.sigma),
            stars: clear.stars,
            dark_level_adu: sky
                .dark
                .map(|dark| to_decimals(dark.adu.value, ADU_DECIMALS)),
            dark_level_sigma_adu: sky
                .dark
                .map(|dark| to_decimals(dark.adu.sigma, ADU_DECIMALS)),
            dark_level_source: sky.dark.map(|dark| dark.source.code()),
            tone_curve: sky.tone_curve.as_ref().map(ToneCurveReport::new),
            no_brightness: sky.no_brightness.map(|why| why.code()),
            no_brightness_text: sky.no_brightness.map(|why| why.text()),
            zenith: sky.zenith.as_ref().map(ZenithReport::new),
            cloud_share: share(|share| share.value),
            cloud_share_sigma: share(|share| share.sigma),
            cells: sky.cells.iter().map(SkyCellReport::new).collect(),
        }
    }
}

impl ToneCurveReport {
    fn new(tone: &ToneFit) -> Self {
        Self {
            kind: tone.kind.code(),
            probability: to_decimals(tone.probability, FRACTION_DECIMALS),
            exponent: to_decimals(tone.exponent.value, EXPONENT_DECIMALS),
            exponent_sigma: to_decimals(tone.exponent.sigma, EXPONENT_DECIMALS),
        }
    }
}

impl ZenithReport {
    fn new(zenith: &ZenithSky) -> Self {
        Self {
            mag_arcsec2: mag(zenith.light.mag_arcsec2.value),
            sigma_mag: mag(zenith.light.mag_arcsec2.sigma),
            bv_mag: zenith.light.bv_mag.map(|bv| mag(bv.value)),
            bv_sigma_mag: zenith.light.bv_mag.map(|bv| mag(bv.sigma)),
            luminance_mcd_m2: mcd_m2(zenith.light.luminance_cd_m2),
            naked_eye_limit_vmag: to_decimals(zenith.naked_eye_limit_vmag, 2),
            bortle: zenith.bortle,
        }
    }
}

impl SkyCellReport {
    fn new(cell: &SkyCell) -> Self {
        let degrees = |range: [f64; 2]| Some(range.map(|at| to_decimals(at, HORIZON_DECIMALS)));
        let pixels = |range: [f64; 2]| Some(range.map(|at| to_decimals(at, PIXEL_DECIMALS)));
        let (altitude_deg, azimuth_deg, x, y) = match cell.place {
            Place::Horizon {
                altitude_deg,
                azimuth_deg,
            } => (degrees(altitude_deg), degrees(azimuth_deg), None, None),
            Place::Frame { x, y } => (None, None, pixels(x), pixels(y)),
        };
        let light = cell.light.as_ref();
        let color = light.and_then(|light| light.bv_mag);
        let limit = cell.limit_vmag.as_ref();
        let extinction = cell.extinction_mag.as_ref();
        Self {
            altitude_deg,
            azimuth_deg,
            x,
            y,
            solid_angle_sr: significant(cell.solid_angle_sr, DIGITS),
            mag_arcsec2: light.map(|light| mag(light.mag_arcsec2.value)),
            sigma_mag: light.map(|light| mag(light.mag_arcsec2.sigma)),
            bv_mag: color.map(|bv| mag(bv.value)),
            bv_sigma_mag: color.map(|bv| mag(bv.sigma)),
            luminance_mcd_m2: light.map(|light| mcd_m2(light.luminance_cd_m2)),
            expected: cell.expected,
            detected: cell.detected,
            extinction_mag: extinction.map(|extinction| mag(extinction.value)),
            extinction_sigma_mag: extinction.map(|extinction| mag(extinction.sigma)),
            clear: cell
                .clear
                .map(|clear| to_decimals(clear, FRACTION_DECIMALS)),
            clear_low: cell
                .clear_band
                .map(|[low, _]| to_decimals(low, FRACTION_DECIMALS)),
            clear_high: cell
                .clear_band
                .map(|[_, high]| to_decimals(high, FRACTION_DECIMALS)),
            expected_limit_vmag: cell.expected_limit_vmag.map(mag),
            limit_vmag: limit.map(|limit| mag(limit.value)),
            limit_sigma_mag: limit.map(|limit| mag(limit.sigma)),
        }
    }
}

/// A luminance in mcd/m².
fn mcd_m2(luminance_cd_m2: f64) -> f64 {
    significant(1e3 * luminance_cd_m2, DIGITS).unwrap_or(0.0)
}
