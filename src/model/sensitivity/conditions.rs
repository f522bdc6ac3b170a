//! What the camera looks through and how long: sky, air, exposure, and what counts as detected.

use super::light;
use crate::camera::data_sheet::{DataSheet, Preset};
use serde::Serialize;
use std::f64::consts::PI;

/// Which equations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Reading {
    /// The paper's, as its authors used them.
    Paper,
    /// With the physics put right.
    Physical,
}

/// How bright the sky is, in one of the ways in which people say it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SkyBrightness {
    /// Johnson V magnitudes in a square arcsecond, as seen from the ground.
    MagArcsec2(f64),
    /// Luminance, in cd/m².
    LuminanceCdM2(f64),
    /// Illuminance by the whole sky on level ground, in lx: π times the luminance where that is the same everywhere.
    IlluminanceLx(f64),
}

impl SkyBrightness {
    /// In V magnitudes in a square arcsecond.
    pub fn mag_arcsec2(self) -> f64 {
        match self {
            Self::MagArcsec2(mag) => mag,
            Self::LuminanceCdM2(luminance) => light::mag_arcsec2(luminance),
            Self::IlluminanceLx(illuminance) => light::mag_arcsec2(illuminance / PI),
        }
    }

    /// In cd/m².
    pub fn luminance_cd_m2(self) -> f64 {
        match self {
            Self::MagArcsec2(mag) => light::luminance_cd_m2(mag),
            Self::LuminanceCdM2(luminance) => luminance,
            Self::IlluminanceLx(illuminance) => illuminance / PI,
        }
    }

    /// In lx, from a sky that is the same everywhere.
    pub fn illuminance_lx(self) -> f64 {
        match self {
            Self::IlluminanceLx(illuminance) => illuminance,
            other => other.luminance_cd_m2() * PI,
        }
    }
}

/// What the air takes away.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Extinction {
    /// The paper's eq. (3), its optical depth multiplied by this factor.
    Law(f64),
    /// So many magnitudes for each airmass, the same at every wavelength; 0 in space.
    MagPerAirmass(f64),
}

impl Extinction {
    /// Part of the light that comes through one airmass, at a wavelength in nm.
    #[doc(alias = "tau_lambda")]
    pub fn zenith_transmission(self, wavelength_nm: f64) -> f64 {
        match self {
            Self::Law(factor) => libm::exp(-factor * law_optical_depth(wavelength_nm)),
            Self::MagPerAirmass(mag) => libm::pow(10.0, -0.4 * mag),
        }
    }

    /// The paper's law with its optical depth multiplied so that this part of the light of 555 nm comes
    /// through one airmass.
    pub fn law_through(zenith_transmission: f64) -> Self {
        Self::Law(-libm::log(zenith_transmission) / law_optical_depth(REFERENCE_NM))
    }
}

/// The wavelength at which the paper states the air's transmission (section 3.2), in nm.
pub const REFERENCE_NM: f64 = 555.0;

/// The optical depth of one airmass at a wavelength in nm.
///
/// # Reference
/// Tong, Li & Wang 2014, eq. (3), with the wavelength in µm.
fn law_optical_depth(wavelength_nm: f64) -> f64 {
    const RAYLEIGH: f64 = 0.009;
    const GREY: f64 = 0.223;
    RAYLEIGH * (wavelength_nm * 1e-3).powi(-4) + GREY
}

/// What the camera looks through and how long.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conditions {
    /// Exposure, in seconds.
    #[doc(alias = "T")]
    pub exposure_s: f64,
    /// Zenith distance, in degrees, from 0 to below 90.
    #[doc(alias = "Z")]
    pub zenith_distance_deg: f64,
    /// How bright the sky is.
    #[doc(alias = "E_B")]
    pub sky: SkyBrightness,
    /// What the air takes away.
    pub extinction: Extinction,
    /// Colour temperature of the star, in kelvin; [`Reading::Physical`] only.
    pub star_temperature_k: f64,
    /// How far a star moves during the exposure, along the rows, in pixels.
    pub motion_px: f64,
    /// Signal over noise in the brightest pixel that counts as a detection.
    #[doc(alias = "R_SN")]
    pub snr: f64,
    /// False detections in a million pixels that the detector as built accepts.
    pub false_alarms_per_mpx: f64,
}

impl Default for Conditions {
    /// A dark sky at the zenith, a tenth of a second.
    fn default() -> Self {
        Self {
            exposure_s: 0.1,
            zenith_distance_deg: 0.0,
            sky: SkyBrightness::MagArcsec2(21.0),
            extinction: Extinction::Law(1.0),
            star_temperature_k: 5800.0,
            motion_px: 0.0,
            snr: 6.0,
            false_alarms_per_mpx: crate::detect::DetectConfig::DEFAULT_FALSE_ALARMS_PER_MPX,
        }
    }
}

/// A camera under conditions, and how to reckon.
#[derive(Debug, Clone, PartialEq)]
pub struct Scenario {
    /// The camera.
    pub camera: DataSheet,
    /// The conditions.
    pub conditions: Conditions,
    /// Which equations.
    pub reading: Reading,
}

/// What in a scenario makes no sense.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ScenarioError {
    /// A value out of its limits.
    #[error("{name} is {found}, expected {expected}")]
    Value {
        /// The parameter.
        name: &'static str,
        /// Its value.
        found: f64,
        /// What it may be.
        expected: String,
    },
    /// Values that contradict each other.
    #[error("{0}")]
    Contradiction(String),
    /// Values of which no number follows.
    #[error(
        "there is no limiting magnitude: with {star_photons_s_m2:e} photons of a star of V = 0 below the air per second and \
         m², {background_e:e} electrons of the sky and a noise of {noise_e:e} electrons it would be {limit_vmag}"
    )]
    NoLimit {
        /// The limit that would be.
        limit_vmag: f64,
        /// Photons of a star of V = 0 below the air.
        star_photons_s_m2: f64,
        /// Electrons of the sky in a pixel.
        background_e: f64,
        /// Noise of the brightest pixel, in electrons.
        noise_e: f64,
    },
}

impl Scenario {
    /// A camera under the default conditions, in the physical reading.
    pub fn new(camera: DataSheet) -> Self {
        Self {
            camera,
            conditions: Conditions::default(),
            reading: Reading::Physical,
        }
    }

    /// The scenario of a preset: the paper's experiments as the paper has them, other cameras under the default conditions but
    /// for the exposure.
    pub fn of(preset: Preset) -> Self {
        let paper = |exposure_s, zenith_distance_deg| Self {
            camera: preset.data_sheet(),
            conditions: Conditions {
                exposure_s,
                zenith_distance_deg,
                sky: SkyBrightness::IlluminanceLx(0.01),
                ..Conditions::default()
            },
            reading: Reading::Paper,
        };
        let other = |exposure_s| {
            let mut scenario = Self::new(preset.data_sheet());
            scenario.conditions.exposure_s = exposure_s;
            scenario
        };
        match preset {
            Preset::Experiment1 => paper(0.04, 0.0),
            Preset::Experiment2 => paper(0.1, 45.0),
            Preset::NanosatTracker => other(0.1),
            Preset::Imx174 => other(0.2),
            Preset::Asi183 => other(0.5),
        }
    }

    /// Checks every parameter against its limits, and the camera's against each other.
    ///
    /// # Errors
    /// [`ScenarioError`] with the parameter, its value, and what it may be.
    pub fn check(&self) -> Result<(), ScenarioError> {
        for parameter in super::Parameter::all() {
            let Some(found) = parameter.get(self) else {
                continue;
            };
            if !parameter.limits().accept(found) {
                return Err(ScenarioError::Value {
                    name: parameter.name(),
                    found,
                    expected: parameter.limits().to_string(),
                });
            }
        }
        match self
            .camera
            .contradiction()
            .or_else(|| self.beyond_the_papers_table())
        {
            Some(what) => Err(ScenarioError::Contradiction(what)),
            None => Ok(()),
        }
    }

    /// The paper's reading reckons with the wavelengths of its table 1, whatever the camera's band.
    fn beyond_the_papers_table(&self) -> Option<String> {
        let uncovered = match self.reading {
            Reading::Paper => self
                .camera
                .uncovered(light::PAPER_BAND_NM.0, light::PAPER_BAND_NM.1),
            Reading::Physical => None,
        };
        uncovered.map(|uncovered| format!("{uncovered} of the paper's reading"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::data_sheet::Response;

    #[test]
    fn a_hundredth_of_a_lux_is_a_sky_of_18_8() {
        // 0.01 lx / π = 3.183e-3 cd/m²; −2.5 log10(3.183e-3 / 10.8e4) = 18.826.
        let sky = SkyBrightness::IlluminanceLx(0.01);
        assert!((sky.mag_arcsec2() - 18.826).abs() < 0.001);
        let back = SkyBrightness::MagArcsec2(sky.mag_arcsec2());
        assert!((back.illuminance_lx() - 0.01).abs() < 1e-12);
        let same = SkyBrightness::LuminanceCdM2(back.luminance_cd_m2());
        assert!((same.mag_arcsec2() - sky.mag_arcsec2()).abs() < 1e-12);
    }

    #[test]
    fn the_papers_reading_wants_curves_over_its_own_band() {
        let mut scenario = Scenario::of(Preset::Experiment1);
        scenario.camera.quantum_efficiency = Response::Table(vec![(400.0, 0.5), (800.0, 0.5)]);
        scenario.camera.band_from_nm = 450.0;
        let error = scenario.check().unwrap_err().to_string();
        assert_eq!(
            error,
            "quantum_efficiency is known from 400 to 800 nm, which does not cover the band from 360 to 780 nm of the \
             paper's reading"
        );
        scenario.reading = Reading::Physical;
        assert_eq!(scenario.check(), Ok(()));
    }

    #[test]
    fn the_law_lets_through_what_equation_3_says() {
        // exp(−(0.009 · 0.555⁻⁴ + 0.223)) = exp(−(0.09486 + 0.223)) = 0.72771.
        let law = Extinction::Law(1.0);
        assert!((law.zenith_transmission(555.0) - 0.72771).abs() < 1e-5);
        let thin = Extinction::law_through(0.2);
        assert!((thin.zenith_transmission(555.0) - 0.2).abs() < 1e-12);
        // 0.25 mag are 10^−0.1 = 0.79433.
        let grey = Extinction::MagPerAirmass(0.25);
        assert!((grey.zenith_transmission(700.0) - 0.794_328).abs() < 1e-6);
    }
}
