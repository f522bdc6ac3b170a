//! Observing conditions: sky, atmosphere, exposure, and the detection criterion.

use super::light;
use std::f64::consts::PI;

/// Sky brightness, in one of the usual units.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum SkyBrightness {
    /// V magnitudes per square arcsecond, as seen from the ground.
    MagArcsec2(f64),
    /// Luminance, in cd/m².
    LuminanceCdM2(f64),
    /// Illuminance of level ground by the whole sky, in lx: π times the luminance of a uniform sky.
    IlluminanceLx(f64),
}

impl SkyBrightness {
    /// Brightness in V magnitudes per square arcsecond.
    pub fn mag_arcsec2(self) -> f64 {
        match self {
            Self::MagArcsec2(mag) => mag,
            Self::LuminanceCdM2(luminance) => light::mag_arcsec2(luminance),
            Self::IlluminanceLx(illuminance) => light::mag_arcsec2(illuminance / PI),
        }
    }

    /// Luminance in cd/m².
    pub fn luminance_cd_m2(self) -> f64 {
        match self {
            Self::MagArcsec2(mag) => light::luminance_cd_m2(mag),
            Self::LuminanceCdM2(luminance) => luminance,
            Self::IlluminanceLx(illuminance) => illuminance / PI,
        }
    }

    /// Illuminance of level ground in lx, for a uniform sky.
    pub fn illuminance_lx(self) -> f64 {
        match self {
            Self::IlluminanceLx(illuminance) => illuminance,
            other => other.luminance_cd_m2() * PI,
        }
    }
}

/// Atmospheric extinction.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Extinction {
    /// Eq. (3) of the paper, its optical depth multiplied by this factor.
    Law(f64),
    /// Magnitudes per airmass, the same at every wavelength; 0 in space.
    MagPerAirmass(f64),
}

impl Extinction {
    /// Fraction of the light transmitted through one airmass, at a wavelength in nm.
    #[doc(alias = "tau_lambda")]
    pub fn zenith_transmission(self, wavelength_nm: f64) -> f64 {
        match self {
            Self::Law(factor) => libm::exp(-factor * law_optical_depth(wavelength_nm)),
            Self::MagPerAirmass(mag) => libm::pow(10.0, -0.4 * mag),
        }
    }

    /// The law of the paper, scaled so that one airmass transmits this fraction of the light at 555
    /// nm.
    pub fn law_through(zenith_transmission: f64) -> Self {
        Self::Law(-libm::log(zenith_transmission) / law_optical_depth(REFERENCE_NM))
    }
}

/// Wavelength at which the paper states the atmospheric transmission (section 3.2), in nm.
pub const REFERENCE_NM: f64 = 555.0;

/// Optical depth of one airmass at a wavelength in nm.
///
/// # Reference
/// Tong, Li & Wang 2014, eq. (3), with the wavelength in µm.
fn law_optical_depth(wavelength_nm: f64) -> f64 {
    const RAYLEIGH: f64 = 0.009;
    const GREY: f64 = 0.223;
    RAYLEIGH * (wavelength_nm * 1e-3).powi(-4) + GREY
}

/// Observing conditions.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Conditions {
    /// Exposure, in seconds.
    #[doc(alias = "T")]
    pub exposure_s: f64,
    /// Zenith distance, in degrees, from 0 to below 90.
    #[doc(alias = "Z")]
    pub zenith_distance_deg: f64,
    /// Sky brightness.
    #[doc(alias = "E_B")]
    pub sky: SkyBrightness,
    /// Atmospheric extinction.
    pub extinction: Extinction,
    /// Color temperature of the star, in kelvin; used by
    /// [`Reading::Physical`](super::Reading::Physical) only.
    pub star_temperature_k: f64,
    /// Motion of a star during the exposure, along the rows, in pixels.
    pub motion_px: f64,
    /// Required signal-to-noise ratio of the brightest pixel.
    #[doc(alias = "R_SN")]
    pub snr: f64,
    /// False detections per million pixels that the matched filter accepts.
    pub false_alarms_per_mpx: f64,
}

impl Default for Conditions {
    /// A dark sky at the zenith, and an exposure of 0.1 s.
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

#[cfg(test)]
mod tests {
    use super::*;

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
