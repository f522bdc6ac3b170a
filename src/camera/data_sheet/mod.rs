//! A camera as its data sheets describe it: pixels, lens, and what a photon becomes.
//!
//! `camera.toml` → [`DataSheet`]. Lengths are in mm and µm, charges in electrons, times in seconds.
//!
//! [`DataSheet::read`] takes a file whose keys are those of [`KEYS`]; [`Preset`] has some that are ready; [`template`] writes
//! one with comments. A transmission or an efficiency is a number, or a CSV file of two columns, wavelength in
//! nanometres and value, which [`Response`] interpolates.
//!
//! What the limit does not depend on, and a simulated frame shows (vignetting, distortion, pixels that differ) is in
//! [`Imperfections`].
//!
//! Caveats: one spot for the whole field; no stray light.

mod file;
mod imperfections;
mod keys;
mod preset;
mod response;

pub use file::DataSheetError;
pub use imperfections::{IMPERFECTION_KEYS, Imperfections, SpotForm};
pub(crate) use keys::key;
pub use keys::{KEYS, Key, Limits, is_curve, nearest_name, template};
pub use preset::Preset;
pub use response::{Response, ResponseError};

use std::f64::consts::SQRT_2;

/// A camera: lens and detector.
#[derive(Debug, Clone, PartialEq)]
pub struct DataSheet {
    /// What it is called.
    pub name: String,
    /// Columns.
    pub width_px: usize,
    /// Rows.
    pub height_px: usize,
    /// Distance between the centres of neighbouring columns, in µm.
    pub pitch_x_um: f64,
    /// Distance between the centres of neighbouring rows, in µm.
    pub pitch_y_um: f64,
    /// Focal length, in mm.
    pub focal_length_mm: f64,
    /// Diameter of the entrance pupil, in mm.
    pub aperture_mm: f64,
    /// Part of the light that the lens lets through, by wavelength.
    pub lens_transmission: Response,
    /// Electrons for each photon that reaches a pixel, by wavelength.
    pub quantum_efficiency: Response,
    /// The shortest wavelength that reaches the detector, in nm.
    pub band_from_nm: f64,
    /// The longest wavelength that reaches the detector, in nm.
    pub band_to_nm: f64,
    /// Noise of reading a pixel, in electrons.
    pub read_noise_e: f64,
    /// Dark current of a pixel, in electrons a second.
    pub dark_current_e_s: f64,
    /// Charge at which a pixel is full, in electrons.
    pub full_well_e: f64,
    /// Electrons for a step of the grey level.
    pub gain_e_per_adu: f64,
    /// Bits of the grey level.
    pub bits: u32,
    /// The grey level without light.
    pub bias_adu: f64,
    /// Standard deviation of a star's spot, Gaussian before the pixels integrate it, in pixels.
    pub spot_sigma_px: f64,
    /// The part of a star's light on its brightest pixel, where that is stated and not to follow from
    /// [`Self::spot_sigma_px`].
    pub peak_share: Option<f64>,
    /// What its limit does not depend on, and a simulated frame shows.
    pub imperfections: Imperfections,
}

impl DataSheet {
    /// The area of the entrance pupil, in m².
    #[doc(alias = "A")]
    pub fn aperture_area_m2(&self) -> f64 {
        let diameter_m = self.aperture_mm * 1e-3;
        std::f64::consts::FRAC_PI_4 * diameter_m * diameter_m
    }

    /// The solid angle of a pixel at the centre of the field, in steradians.
    #[doc(alias = "A_P")]
    pub fn pixel_solid_angle_sr(&self) -> f64 {
        let focal_um = self.focal_length_mm * 1e3;
        self.pitch_x_um * self.pitch_y_um / (focal_um * focal_um)
    }

    /// The angle that a pixel spans at the centre of the field, in radians: the geometric mean of both sides.
    pub fn pixel_scale_rad(&self) -> f64 {
        self.pixel_solid_angle_sr().sqrt()
    }

    /// The part of a star's light on its brightest pixel: as stated, else that of a spot centred on a pixel.
    #[doc(alias = "mu")]
    pub fn peak_share(&self) -> f64 {
        self.peak_share
            .unwrap_or_else(|| libm::erf(0.5 / (SQRT_2 * self.spot_sigma_px)).powi(2))
    }

    /// The standard deviation of rounding to whole grey levels, in electrons.
    pub fn quantisation_noise_e(&self) -> f64 {
        self.gain_e_per_adu / 12f64.sqrt()
    }

    /// The grey level from which on a pixel is taken to be saturated: full, or at the end of the scale.
    pub fn saturation_adu(&self) -> f64 {
        // The level of a full pixel varies with the noise of reading.
        const FULL_WELL_SIGMAS: f64 = 4.0;
        let surely_full_e = self.full_well_e - FULL_WELL_SIGMAS * self.read_noise_e;
        let full_adu = self.bias_adu + surely_full_e / self.gain_e_per_adu;
        full_adu.floor().min(self.full_scale_adu())
    }

    /// The largest grey level.
    pub fn full_scale_adu(&self) -> f64 {
        2f64.powi(self.bits as i32) - 1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ninth_of_the_light_is_on_the_brightest_pixel_at_sigma_1_16() {
        let mut sheet = Preset::Experiment1.data_sheet();
        assert_eq!(sheet.peak_share(), 1.0 / 9.0);
        sheet.peak_share = None;
        sheet.spot_sigma_px = 1.16;
        assert!((sheet.peak_share() * 9.0 - 1.0).abs() < 0.01);
    }

    #[test]
    fn the_papers_pixel_is_2_79e_9_sr_and_its_pupil_78_5_cm2() {
        let sheet = Preset::Experiment1.data_sheet();
        assert!((sheet.pixel_solid_angle_sr() / 2.788_28e-9 - 1.0).abs() < 1e-5);
        assert!((sheet.aperture_area_m2() / 7.853_98e-3 - 1.0).abs() < 1e-6);
    }
}
