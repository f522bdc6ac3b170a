//! From a scenario to its limiting magnitude, with all intermediate quantities.

use super::check::ScenarioError;
use super::conditions::{Conditions, REFERENCE_NM};
use super::light::{
    self, ILLUMINANCE_OF_MAG_0_LX, PAPER_MAG_RATIO, PAPER_PHOTONS_OF_MAG_0, SKY_TEMPERATURE_K,
};
use super::scenario::{Reading, Scenario};
use crate::base::units::ARCSEC_PER_RAD;
use crate::ephemeris::observer::airmass;
use serde::Serialize;

/// A narrow band of the spectrum.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Band {
    /// Central wavelength.
    pub wavelength_nm: f64,
    /// Photons of a star of V = 0 above the atmosphere, per second and m² (eq. 4: φ₀).
    pub star_photons_s_m2: f64,
    /// Photons of the sky within one pixel's solid angle, before the lens, per second and m².
    pub sky_photons_s_m2: f64,
    /// Transmission of the atmosphere (eqs. 2 and 3: τ to the power of the airmass).
    pub atmosphere_transmission: f64,
    /// Transmission of the lens (K).
    pub lens_transmission: f64,
    /// Quantum efficiency, in electrons per photon (Q).
    pub quantum_efficiency: f64,
}

impl Band {
    fn star_electrons_s_m2(&self) -> f64 {
        self.star_photons_s_m2 * self.atmosphere_transmission * self.throughput()
    }

    fn throughput(&self) -> f64 {
        self.lens_transmission * self.quantum_efficiency
    }
}

/// Every quantity between a star's light and the limiting magnitude.
///
/// # Example
/// ```
/// use starpipe::camera::data_sheet::Preset;
/// use starpipe::predict::{Budget, Scenario};
///
/// let scenario = Scenario::of(Preset::NanosatTracker);
/// let budget = Budget::checked(&scenario)?;
/// // A star at the limit has the required signal-to-noise ratio in its brightest pixel.
/// assert!((budget.star_e / budget.noise_e - scenario.conditions.snr).abs() < 1e-9);
/// // What the noise is of: the sensor's part, the sky's, the star's own.
/// let parts = [budget.sensor_noise_e, budget.sky_noise_e, budget.star_noise_e];
/// let noise_e = parts.iter().map(|part| part * part).sum::<f64>().sqrt();
/// assert!((noise_e - budget.noise_e).abs() < 1e-9);
/// # Ok::<(), starpipe::predict::ScenarioError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Budget {
    /// Set of equations.
    pub reading: Reading,
    /// Airmass.
    pub airmass: f64,
    /// Area of the entrance pupil (A).
    pub aperture_area_m2: f64,
    /// Solid angle of a pixel (A_P).
    pub pixel_solid_angle_sr: f64,
    /// Solid angle of a pixel in square arcseconds.
    pub pixel_area_arcsec2: f64,
    /// Transmission of one airmass at 555 nm.
    pub zenith_transmission: f64,
    /// Transmission of the atmosphere for the star's electrons, over the band.
    pub atmosphere_transmission: f64,
    /// Photons of a star of V = 0 above the atmosphere, over the band, per second and m² (Φ₀).
    pub mag_0_photons_s_m2: f64,
    /// Electrons of that star on all its pixels, per second.
    pub mag_0_e_s: f64,
    /// Fraction of a star's light on its brightest pixel (μ), without motion.
    pub peak_share: f64,
    /// Sky brightness in V magnitudes per square arcsecond.
    pub sky_mag_arcsec2: f64,
    /// Sky luminance in cd/m².
    pub sky_luminance_cd_m2: f64,
    /// Illuminance of level ground by the sky (E_B), in lx.
    pub sky_illuminance_lx: f64,
    /// Magnitude with the illuminance of the sky (eq. 7: M_B).
    pub sky_mag: f64,
    /// V magnitude of the faintest star with the required SNR in its brightest pixel (eq. 12).
    pub limit_vmag: f64,
    /// Illuminance of that star above the atmosphere (eq. 1).
    pub star_illuminance_lx: f64,
    /// Illuminance of that star on the ground, with the transmission at 555 nm (eq. 2).
    pub star_illuminance_ground_lx: f64,
    /// Photons of that star on the ground, per second and m² (eq. 5: φ_S).
    pub star_photons_s_m2: f64,
    /// Electrons of that star on its brightest pixel (eq. 8: S).
    pub star_e: f64,
    /// Sky electrons per pixel (eq. 9: B).
    pub background_e: f64,
    /// Dark electrons per pixel.
    pub dark_e: f64,
    /// Read noise.
    pub read_noise_e: f64,
    /// Quantisation noise; [`Reading::Physical`] only.
    pub quantisation_noise_e: f64,
    /// Sensor noise: dark current, read-out, quantisation (eq. 10: N_C).
    pub sensor_noise_e: f64,
    /// Noise of a pixel without a star: sky and sensor.
    pub background_noise_e: f64,
    /// Shot noise of the star on its brightest pixel (eq. 10: n_S).
    pub star_noise_e: f64,
    /// Shot noise of the sky (eq. 10: n_B).
    pub sky_noise_e: f64,
    /// Total noise of the brightest pixel (eq. 10: N).
    pub noise_e: f64,
    /// Signal-to-noise ratio of the brightest pixel (eq. 11: R_SN).
    pub snr: f64,
    /// The spectrum, band by band.
    pub bands: Vec<Band>,
}

impl Budget {
    /// The budget of a scenario that passes [`Scenario::check`].
    pub fn new(scenario: &Scenario) -> Self {
        let (sheet, conditions) = (&scenario.camera, &scenario.conditions);
        let light = SpectralSums::compute(scenario);
        let exposure_s = conditions.exposure_s;
        let aperture_area_m2 = sheet.aperture_area_m2();
        let collected = aperture_area_m2 * exposure_s;
        let background_e = light.sky_electrons_s_m2 * collected;
        let dark_e = sheet.dark_current_e_s * exposure_s;
        let quantisation_noise_e = match scenario.reading {
            Reading::Paper => 0.0,
            Reading::Physical => sheet.quantisation_noise_e(),
        };
        let sensor_variance_e2 = sheet.read_noise_e.powi(2) + dark_e + quantisation_noise_e.powi(2);
        let background_variance_e2 = background_e + sensor_variance_e2;
        let star_e = signal_for_snr(conditions.snr, background_variance_e2);
        let mag_0_e_s = light.star_electrons_s_m2 * aperture_area_m2;
        let peak_share = sheet.peak_share();
        let ratio = mag_0_e_s * exposure_s * peak_share / star_e;
        let limit_vmag = light.magnitude(ratio);
        let noise_e = (star_e + background_variance_e2).sqrt();
        let star_illuminance_lx = ILLUMINANCE_OF_MAG_0_LX / ratio;
        let at_555 = conditions.extinction.zenith_transmission(REFERENCE_NM);
        let pixel_solid_angle_sr = sheet.pixel_solid_angle_sr();
        Self {
            reading: scenario.reading,
            airmass: light.airmass,
            aperture_area_m2,
            pixel_solid_angle_sr,
            pixel_area_arcsec2: pixel_solid_angle_sr * ARCSEC_PER_RAD * ARCSEC_PER_RAD,
            zenith_transmission: at_555,
            atmosphere_transmission: light.atmosphere_transmission,
            mag_0_photons_s_m2: light.star_photons_s_m2,
            mag_0_e_s,
            peak_share,
            sky_mag_arcsec2: conditions.sky.mag_arcsec2(),
            sky_luminance_cd_m2: conditions.sky.luminance_cd_m2(),
            sky_illuminance_lx: conditions.sky.illuminance_lx(),
            sky_mag: sky_mag(conditions),
            limit_vmag,
            star_illuminance_lx,
            star_illuminance_ground_lx: star_illuminance_lx * libm::pow(at_555, light.airmass),
            star_photons_s_m2: light.star_photons_ground_s_m2 / ratio,
            star_e,
            background_e,
            dark_e,
            read_noise_e: sheet.read_noise_e,
            quantisation_noise_e,
            sensor_noise_e: sensor_variance_e2.sqrt(),
            background_noise_e: background_variance_e2.sqrt(),
            star_noise_e: star_e.sqrt(),
            sky_noise_e: background_e.sqrt(),
            noise_e,
            snr: star_e / noise_e,
            bands: light.bands,
        }
    }

    /// Checks a scenario and computes its budget.
    ///
    /// # Errors
    /// [`ScenarioError`] if the scenario is invalid or its limit is not finite.
    pub fn checked(scenario: &Scenario) -> Result<Self, ScenarioError> {
        scenario.check()?;
        let budget = Self::new(scenario);
        let numbers = [
            budget.limit_vmag,
            budget.background_e,
            budget.noise_e,
            budget.snr,
        ];
        if numbers.iter().all(|number| number.is_finite()) {
            return Ok(budget);
        }
        Err(ScenarioError::NoLimit {
            limit_vmag: budget.limit_vmag,
            star_photons_s_m2: budget.mag_0_photons_s_m2 * budget.atmosphere_transmission,
            background_e: budget.background_e,
            noise_e: budget.noise_e,
        })
    }

    /// V magnitude of a star with this number of electrons on all its pixels in an exposure.
    pub fn vmag_of(&self, electrons: f64, exposure_s: f64) -> f64 {
        magnitude(self.reading, self.mag_0_e_s * exposure_s / electrons)
    }

    /// Electrons on all pixels of a star of this V magnitude in an exposure.
    pub fn electrons_of(&self, v_mag: f64, exposure_s: f64) -> f64 {
        let ratio = match self.reading {
            Reading::Paper => libm::pow(PAPER_MAG_RATIO, v_mag),
            Reading::Physical => libm::pow(10.0, 0.4 * v_mag),
        };
        self.mag_0_e_s * exposure_s / ratio
    }
}

/// Magnitude of a star `ratio` times fainter than one of magnitude 0.
fn magnitude(reading: Reading, ratio: f64) -> f64 {
    match reading {
        Reading::Paper => libm::log10(ratio) / libm::log10(PAPER_MAG_RATIO),
        Reading::Physical => 2.5 * libm::log10(ratio),
    }
}

/// The signal S for which S/√(S + variance) is `snr`.
///
/// # Reference
/// Tong, Li & Wang 2014, eq. (11).
fn signal_for_snr(snr: f64, variance_e2: f64) -> f64 {
    snr * snr / 2.0 + snr * (variance_e2 + snr * snr / 4.0).sqrt()
}

/// Magnitude with the illuminance of the sky.
///
/// # Reference
/// Tong, Li & Wang 2014, eq. (7).
fn sky_mag(conditions: &Conditions) -> f64 {
    magnitude(
        Reading::Paper,
        ILLUMINANCE_OF_MAG_0_LX / conditions.sky.illuminance_lx(),
    )
}

/// Light of a star of magnitude 0, and of the sky in a pixel, summed over the bands.
struct SpectralSums {
    reading: Reading,
    airmass: f64,
    bands: Vec<Band>,
    star_photons_s_m2: f64,
    star_photons_ground_s_m2: f64,
    star_electrons_s_m2: f64,
    /// Per pixel.
    sky_electrons_s_m2: f64,
    atmosphere_transmission: f64,
}

impl SpectralSums {
    fn compute(scenario: &Scenario) -> Self {
        let conditions = &scenario.conditions;
        let zenith_distance_deg = conditions.zenith_distance_deg;
        let airmass = match scenario.reading {
            Reading::Paper => airmass::airmass_plane_parallel(zenith_distance_deg.to_radians()),
            Reading::Physical => airmass::airmass_kasten_young(zenith_distance_deg.to_radians()),
        };
        let bands = match scenario.reading {
            Reading::Paper => paper_bands(scenario, airmass),
            Reading::Physical => physical_bands(scenario, airmass),
        };
        let sum = |part: fn(&Band) -> f64| bands.iter().map(part).sum::<f64>();
        let star_electrons_s_m2 = sum(Band::star_electrons_s_m2);
        let outside = sum(|band| band.star_photons_s_m2 * band.throughput());
        Self {
            reading: scenario.reading,
            airmass,
            star_photons_s_m2: sum(|band| band.star_photons_s_m2),
            star_photons_ground_s_m2: sum(|band| {
                band.star_photons_s_m2 * band.atmosphere_transmission
            }),
            star_electrons_s_m2,
            sky_electrons_s_m2: sum(|band| band.sky_photons_s_m2 * band.throughput()),
            atmosphere_transmission: star_electrons_s_m2 / outside,
            bands,
        }
    }

    fn magnitude(&self, ratio: f64) -> f64 {
        magnitude(self.reading, ratio)
    }
}

/// The bands of table 1. The atmosphere attenuates the sky's light like a star's, and a pixel
/// receives its solid angle's share of one steradian.
///
/// # Reference
/// Tong, Li & Wang 2014, eqs. (4) to (9).
fn paper_bands(scenario: &Scenario, airmass: f64) -> Vec<Band> {
    let (sheet, conditions) = (&scenario.camera, &scenario.conditions);
    let table = light::luminous_efficiency();
    let sum: f64 = table.iter().map(|(_, efficiency)| efficiency).sum();
    let sky_over_star =
        sheet.pixel_solid_angle_sr() * libm::pow(PAPER_MAG_RATIO, -sky_mag(conditions));
    let band = |(wavelength_nm, efficiency): (f64, f64)| {
        let star_photons_s_m2 = PAPER_PHOTONS_OF_MAG_0 * efficiency / sum;
        let zenith = conditions.extinction.zenith_transmission(wavelength_nm);
        let atmosphere_transmission = libm::pow(zenith, airmass);
        Band {
            wavelength_nm,
            star_photons_s_m2,
            sky_photons_s_m2: star_photons_s_m2 * atmosphere_transmission * sky_over_star,
            atmosphere_transmission,
            lens_transmission: sheet.lens_transmission.at(wavelength_nm),
            quantum_efficiency: sheet.quantum_efficiency.at(wavelength_nm),
        }
    };
    table.into_iter().map(band).collect()
}

/// Black bodies in bands over the camera's own range. The sky's brightness is that seen from the
/// ground, so it is not attenuated.
fn physical_bands(scenario: &Scenario, airmass: f64) -> Vec<Band> {
    /// Largest width of a band, in nm.
    const BAND_NM: f64 = 5.0;
    let (sheet, conditions) = (&scenario.camera, &scenario.conditions);
    let width_nm = sheet.band_to_nm - sheet.band_from_nm;
    let count = (width_nm / BAND_NM).ceil().max(1.0);
    let step_nm = width_nm / count;
    let pixel_arcsec2 = sheet.pixel_solid_angle_sr() * ARCSEC_PER_RAD * ARCSEC_PER_RAD;
    let sky_over_star = pixel_arcsec2 * libm::pow(10.0, -0.4 * conditions.sky.mag_arcsec2());
    let band = |i: usize| {
        let wavelength_nm = sheet.band_from_nm + (i as f64 + 0.5) * step_nm;
        let photons =
            |temperature_k| light::photons_of_mag_0(wavelength_nm, temperature_k) * step_nm;
        let zenith = conditions.extinction.zenith_transmission(wavelength_nm);
        Band {
            wavelength_nm,
            star_photons_s_m2: photons(conditions.star_temperature_k),
            sky_photons_s_m2: photons(SKY_TEMPERATURE_K) * sky_over_star,
            atmosphere_transmission: libm::pow(zenith, airmass),
            lens_transmission: sheet.lens_transmission.at(wavelength_nm),
            quantum_efficiency: sheet.quantum_efficiency.at(wavelength_nm),
        }
    };
    (0..count as usize).map(band).collect()
}

#[cfg(test)]
mod tests;
