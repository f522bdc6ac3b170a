//! The brightness of the sky: the background above the level without light, over the solid angle of a
//! pixel, on the zero point of the stars of the same frame.

use super::clear_sky::{ClearSky, USUAL_SKY_BV_MAG};
use super::color::{SkyColorIndex, SkyColors};
use super::dark_level::DarkLevel;
use super::grid::SkyCellGrid;
use super::lens_circle::LensCircle;
use super::picture::SkyPicture;
use crate::base::coords::{Icrs, PixelPoint, UnitVector};
use crate::base::statistics::{Estimate, median_of};
use crate::base::units::{DEG_PER_RAD, RAD_PER_ARCSEC, RAD_PER_DEG};
use crate::detect::{BackgroundMap, least_cell_px};
use crate::photometry::{IdentifiedFrame, MAG_PER_RELATIVE, instrumental_mag};
use crate::predict::SkyBrightness;
use std::f64::consts::PI;

/// Full width at half maximum of what a meter of the sky's brightness sees, in degrees.
const METER_DEG: f64 = 20.0;
/// How far from the zenith it sees, in degrees.
const METER_REACH_DEG: f64 = 30.0;
/// The light of the zenith is that of the sky farther than this from the Moon, in degrees: a meter would
/// measure the Moon, and a camera is saturated around it.
pub(crate) const MOON_REACH_DEG: f64 = 10.0;
/// Largest side of the cells in which the background is measured, in pixels: larger ones smooth clouds away.
const MAX_MESH_PX: f64 = 64.0;

/// Why no brightness was measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum NoBrightness {
    /// The level of a pixel without light is not known.
    BiasUnknown,
    /// Gray levels are not proportional to light.
    NotLinear,
}

impl NoBrightness {
    /// Why there is none in a frame with this clear sky, where its dark level is known or not.
    pub(super) fn diagnose(dark: Option<&DarkLevel>, clear_sky: &ClearSky) -> Self {
        match dark {
            None if !clear_sky.has_tone_curve() => Self::BiasUnknown,
            _ => Self::NotLinear,
        }
    }

    /// Its code in reports.
    pub const fn code(self) -> &'static str {
        match self {
            Self::BiasUnknown => "bias_unknown",
            Self::NotLinear => "not_linear",
        }
    }

    /// What it means, and what would help.
    pub const fn text(self) -> &'static str {
        match self {
            Self::BiasUnknown => {
                "the dark level is unknown; give a dark frame or a camera description"
            }
            Self::NotLinear => "the detector response is not linear, as in most JPEG files",
        }
    }
}

/// The brightness of a part of the sky, seen from the ground.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct SkyLight {
    /// V magnitude of a square arcsecond.
    pub mag_arcsec2: Estimate,
    /// B−V, where the filters of a raw color frame tell it.
    pub bv_mag: Option<Estimate>,
    /// Luminance, in cd/m².
    pub luminance_cd_m2: f64,
}

/// The brightness about the zenith, as a meter with a field of 20° sees it, and what follows from it.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct ZenithSky {
    /// The brightness.
    pub light: SkyLight,
    /// V magnitude of the faintest star that the unaided eye sees.
    pub naked_eye_limit_vmag: f64,
    /// Bortle's class, from 1 (excellent) to 9 (inner city).
    pub bortle: u8,
}

/// Light and threshold of a cell.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct CellLevel {
    /// Solid angle of the sky in it, in steradians.
    pub solid_angle_sr: f64,
    /// Flux at which half of the stars are detected, in ADU in front of the lens.
    pub limit_adu: f64,
    /// Airmass, where the horizon is known.
    pub airmass: Option<f64>,
    light: LightSum,
}

/// Light over solid angle; of a sample, too.
#[derive(Debug, Clone, Copy, Default)]
struct LightSum {
    /// Number of samples.
    samples: f64,
    /// Their distances from the lens's axis over that of the edge of the field, squared.
    off_axis_sq: f64,
    /// Their light, in ADU.
    light_adu: f64,
    /// The same behind the two filters that tell the color.
    filters_adu: [f64; 2],
    /// Their solid angle in the lens's center, in steradians.
    solid_angle_sr: f64,
}

/// Light and threshold of all cells.
pub(super) struct SkyLevels {
    /// Each of them.
    pub cells: Vec<CellLevel>,
    /// Fluxes are over this time.
    pub exposure_s: f64,
    /// Error of the level that was subtracted, in ADU.
    dark_sigma_adu: f64,
    /// How light behind filters tells its color.
    color_index: Option<SkyColorIndex>,
    /// The light about the zenith, weighted as a meter sees it.
    zenith: LightSum,
    /// Solid angle about the zenith in the frame, weighted in the same way.
    zenith_sr: f64,
    /// Where it was measured.
    places: Vec<LightSample>,
}

/// A place at which light is measured.
struct LightSample {
    cell: usize,
    /// How a meter at the zenith weighs it.
    zenith_weight: f64,
    /// Level of the sky, in ADU.
    level_adu: f64,
    /// Distance from the lens's axis over that of the edge of the field, squared.
    off_axis_sq: f64,
    /// Solid angle of a pixel, in steradians, times the part of its light that the lens is known to let through.
    pixel_sr: f64,
}

/// Light of cells and about the zenith, in other units than levels.
pub(super) struct OtherLight {
    cells: Vec<LightSum>,
    zenith: LightSum,
}

/// What the sums of a cell need.
#[derive(Debug, Clone, Copy, Default)]
struct CellSums {
    airmass: f64,
    limit_adu: f64,
}

impl SkyLevels {
    /// Measures them on samples of the frame.
    pub(super) fn of(
        frame: &IdentifiedFrame,
        picture: &SkyPicture,
        dark: Option<&DarkLevel>,
        grid: &SkyCellGrid,
        clear_sky: &ClearSky,
        mut colors: Option<SkyColors>,
    ) -> Self {
        /// Places at which the light is measured.
        const SAMPLES: f64 = 60_000.0;
        let (width, height) = (picture.frame.width, picture.frame.height);
        let step = (((width * height) as f64 / SAMPLES).sqrt().ceil() as usize).max(1);
        let circle = LensCircle::from_camera(grid.camera());
        let mesh_px = least_cell_px(frame.detections.spot_sigma_px).min(MAX_MESH_PX);
        let background = BackgroundMap::measure(picture.frame, mesh_px as usize);
        let dark_adu = dark.map_or(0.0, |dark| dark.adu.value);
        let mut levels = Self {
            cells: vec![CellLevel::default(); grid.places.len()],
            exposure_s: frame.exposure_s.unwrap_or(1.0),
            dark_sigma_adu: picture.flux_scale * dark.map_or(0.0, |dark| dark.adu.sigma),
            color_index: colors.as_ref().map(|colors| colors.index),
            zenith: LightSum::default(),
            zenith_sr: 0.0,
            places: Vec::new(),
        };
        let mut sums = vec![CellSums::default(); grid.places.len()];
        let is_by_moon = |direction: &UnitVector<Icrs>| {
            let by =
                |moon: UnitVector<Icrs>| moon.angle_to(direction) * DEG_PER_RAD < MOON_REACH_DEG;
            picture.moon.is_some_and(by)
        };
        let mut background_row = vec![0.0; width];
        for y in (step / 2..height).step_by(step) {
            background.row(y, &mut background_row);
            if let Some(colors) = &mut colors {
                colors.set_row(y);
            }
            for x in (step / 2..width).step_by(step) {
                let pixel = PixelPoint::new(x as f64, y as f64);
                let Some(direction) = grid.direction_of(&pixel) else {
                    continue;
                };
                let cell = grid.cell_of(&pixel, &direction);
                let Some(cell) = cell.filter(|_| frame.detections.shows_sky(&pixel)) else {
                    continue;
                };
                let Some(pixel_sr) = solid_angle_sr(grid, &pixel) else {
                    continue;
                };
                let airmass = frame.identification.places.airmass(&direction);
                let weight = frame.identification.places.zenith().map_or(0.0, |zenith| {
                    meter_weight(zenith.angle_to(&direction) * DEG_PER_RAD)
                });
                let place = LightSample {
                    cell,
                    zenith_weight: if is_by_moon(&direction) { 0.0 } else { weight },
                    level_adu: f64::from(background_row[x]),
                    off_axis_sq: circle.off_axis_sq(&pixel),
                    pixel_sr: pixel_sr * frame.lens_transmission(&pixel),
                };
                let sample = LightSum {
                    filters_adu: colors.as_ref().map_or([0.0; 2], |colors| colors.at(x)),
                    ..place.sample(picture.flux_scale * (place.level_adu - dark_adu), clear_sky)
                };
                let level = &mut levels.cells[cell];
                level.solid_angle_sr += pixel_sr * (step * step) as f64;
                level.light.add(1.0, &sample);
                let sum = &mut sums[cell];
                sum.airmass += airmass.unwrap_or(f64::NAN);
                sum.limit_adu += frame.flux_limit_adu(&pixel).unwrap_or(f64::NAN);
                if place.zenith_weight > 0.0 {
                    levels.zenith.add(place.zenith_weight, &sample);
                    levels.zenith_sr += place.zenith_weight * pixel_sr * (step * step) as f64;
                }
                levels.places.push(place);
            }
        }
        for (level, sum) in levels.cells.iter_mut().zip(sums) {
            let LightSum { samples, .. } = level.light;
            level.limit_adu = sum.limit_adu / samples;
            let airmass = sum.airmass / samples;
            level.airmass = Some(airmass).filter(|airmass| !airmass.is_nan());
        }
        levels
    }

    /// Light of a cell over its solid angle, in ADU per steradian.
    pub(super) fn radiance_adu_sr(&self, cell: usize) -> Option<f64> {
        let LightSum {
            light_adu,
            solid_angle_sr,
            ..
        } = self.cells[cell].light;
        let radiance = light_adu / solid_angle_sr;
        (radiance.is_finite() && radiance > 0.0).then_some(radiance)
    }

    /// The brightness of a cell; `None` where it has no light.
    pub(super) fn light(&self, cell: usize, clear_sky: &ClearSky) -> Option<SkyLight> {
        self.brightness(&self.cells[cell].light, clear_sky, self.dark_sigma_adu)
    }

    /// The brightness about the zenith; `None` where too little of it is in the frame.
    pub(super) fn zenith(&self, clear_sky: &ClearSky) -> Option<ZenithSky> {
        let light = self.brightness(&self.zenith, clear_sky, self.dark_sigma_adu);
        light
            .filter(|_| self.shows_zenith())
            .map(ZenithSky::from_light)
    }

    /// Whether what a meter would see about the zenith is in the frame.
    pub(super) fn shows_zenith(&self) -> bool {
        /// The share of it that is at least.
        const MIN_FRACTION: f64 = 0.9;
        self.zenith_sr >= MIN_FRACTION * meter_solid_angle_sr()
    }

    /// The median level of the sky, in ADU.
    pub(super) fn median_adu(&self) -> Option<f64> {
        median_of(self.places.iter().map(|place| place.level_adu))
    }

    /// The light in other units, of which `light` tells that of a level.
    pub(super) fn in_units(&self, light: impl Fn(f64) -> f64, clear_sky: &ClearSky) -> OtherLight {
        let mut found = OtherLight {
            cells: vec![LightSum::default(); self.cells.len()],
            zenith: LightSum::default(),
        };
        for place in &self.places {
            let sample = place.sample(light(place.level_adu), clear_sky);
            found.cells[place.cell].add(1.0, &sample);
            found.zenith.add(place.zenith_weight, &sample);
        }
        found
    }

    /// The brightness of each cell, and that about the zenith, in light of other units.
    pub(super) fn brightness_of(
        &self,
        light: &OtherLight,
        clear_sky: &ClearSky,
    ) -> (Vec<Option<SkyLight>>, Option<SkyLight>) {
        let of = |sum: &LightSum| self.brightness(sum, clear_sky, 0.0);
        let zenith = Some(&light.zenith).filter(|_| self.shows_zenith());
        (light.cells.iter().map(of).collect(), zenith.and_then(of))
    }

    fn brightness(
        &self,
        light: &LightSum,
        clear_sky: &ClearSky,
        dark_sigma_adu: f64,
    ) -> Option<SkyLight> {
        let square_arcsec = light.solid_angle_sr / RAD_PER_ARCSEC.powi(2);
        let flux_adu_s = light.light_adu / square_arcsec / self.exposure_s;
        if flux_adu_s.is_nan() || flux_adu_s <= 0.0 {
            return None;
        }
        let color_index = self.color_index.as_ref();
        let bv_mag = color_index.and_then(|index| index.of_sky(light.filters_adu));
        let zero_point =
            clear_sky.for_sky(bv_mag.unwrap_or(USUAL_SKY_BV_MAG), light.mean_off_axis_sq());
        let mag = zero_point.value + instrumental_mag(flux_adu_s);
        let by_dark = light.samples * dark_sigma_adu / light.light_adu;
        Some(SkyLight {
            mag_arcsec2: Estimate {
                value: mag,
                sigma: libm::hypot(zero_point.sigma, MAG_PER_RELATIVE * by_dark),
            },
            bv_mag,
            luminance_cd_m2: SkyBrightness::MagArcsec2(mag).luminance_cd_m2(),
        })
    }
}

impl LightSample {
    /// With this light, and what a clear sky's lens lets through.
    fn sample(&self, light_adu: f64, clear_sky: &ClearSky) -> LightSum {
        LightSum {
            samples: 1.0,
            off_axis_sq: self.off_axis_sq,
            light_adu,
            filters_adu: [0.0; 2],
            solid_angle_sr: self.pixel_sr * clear_sky.transmission(self.off_axis_sq),
        }
    }
}

impl ZenithSky {
    /// What follows from its brightness.
    pub(super) fn from_light(light: SkyLight) -> Self {
        let mag = light.mag_arcsec2.value;
        Self {
            light,
            naked_eye_limit_vmag: naked_eye_limit_vmag(mag),
            bortle: bortle(mag),
        }
    }
}

impl CellLevel {
    /// Mean distance from the lens's axis over that of the edge of the field, squared.
    pub(super) fn off_axis_sq(&self) -> f64 {
        self.light.mean_off_axis_sq()
    }
}

impl LightSum {
    fn mean_off_axis_sq(&self) -> f64 {
        self.off_axis_sq / self.samples
    }

    fn add(&mut self, weight: f64, sample: &Self) {
        self.samples += weight * sample.samples;
        self.off_axis_sq += weight * sample.off_axis_sq;
        self.light_adu += weight * sample.light_adu;
        self.solid_angle_sr += weight * sample.solid_angle_sr;
        for (sum, light_adu) in self.filters_adu.iter_mut().zip(sample.filters_adu) {
            *sum += weight * light_adu;
        }
    }
}

/// The solid angle of a pixel, in steradians.
fn solid_angle_sr(grid: &SkyCellGrid, pixel: &PixelPoint) -> Option<f64> {
    let at = |dx: f64, dy: f64| {
        let place = PixelPoint::new(pixel.x + dx, pixel.y + dy);
        Some(*grid.camera().direction_of(&place)?.as_vector())
    };
    let across = at(0.5, 0.0)? - at(-0.5, 0.0)?;
    let down = at(0.0, 0.5)? - at(0.0, -0.5)?;
    Some(across.cross(&down).norm())
}

/// How a meter weighs what is this far from the zenith.
///
/// # Reference
/// Cinzano 2005, ISTIL Internal Report 9, for the SQM-L.
fn meter_weight(angle_deg: f64) -> f64 {
    if angle_deg > METER_REACH_DEG {
        return 0.0;
    }
    libm::exp(-4.0 * libm::log(2.0) * (angle_deg / METER_DEG).powi(2))
}

/// The solid angle that it sees, weighted.
fn meter_solid_angle_sr() -> f64 {
    const STEPS: u32 = 300;
    let step_rad = METER_REACH_DEG * RAD_PER_DEG / f64::from(STEPS);
    let ring = |step: u32| {
        let angle_rad = (f64::from(step) + 0.5) * step_rad;
        meter_weight(angle_rad * DEG_PER_RAD) * libm::sin(angle_rad)
    };
    2.0 * PI * step_rad * (0..STEPS).map(ring).sum::<f64>()
}

/// The faintest star for the unaided eye.
///
/// # Reference
/// Schaefer 1990, PASP 102, 212, in the form that makers of meters print.
fn naked_eye_limit_vmag(mag_arcsec2: f64) -> f64 {
    7.93 - 5.0 * libm::log10(libm::pow(10.0, 4.316 - mag_arcsec2 / 5.0) + 1.0)
}

/// Bortle's class by the brightness of the zenith: within one class. Bortle (2001, Sky & Telescope 101 (2),
/// 126) defines them by what the eye sees; these limits in brightness are those of DeepskyLog.
fn bortle(mag_arcsec2: f64) -> u8 {
    /// The darkest brightness of each class but the first.
    const DARKEST: [f64; 8] = [21.7, 21.5, 21.3, 20.4, 19.1, 18.5, 18.0, 17.5];
    1 + DARKEST
        .iter()
        .filter(|darkest| mag_arcsec2 < **darkest)
        .count() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn brightness_in_other_units() {
        let luminance_cd_m2 = SkyBrightness::MagArcsec2(21.6).luminance_cd_m2();
        assert!((luminance_cd_m2 * 1e3 - 0.247).abs() < 0.001);
        assert!((naked_eye_limit_vmag(21.6) - 6.5).abs() < 0.1);
        assert!((naked_eye_limit_vmag(18.0) - 4.0).abs() < 0.3);
        assert_eq!([22.0, 21.6, 21.0, 19.0, 17.0].map(bortle), [1, 2, 4, 6, 9]);
    }
}
