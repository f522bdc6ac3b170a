//! The data sheet and the quantities that follow from it.

use super::imperfections::Imperfections;
use super::response::Response;
use super::spot_image::SpotImage;
use crate::base::size::Size;
use std::f64::consts::SQRT_2;
use std::sync::Arc;

/// Data sheet of a camera, lens and detector.
#[derive(Debug, Clone, PartialEq)]
pub struct DataSheet {
    /// Name of the camera.
    pub name: String,
    /// Columns.
    pub width_px: usize,
    /// Rows.
    pub height_px: usize,
    /// Pixel pitch along a row, in µm.
    pub pitch_x_um: f64,
    /// Pixel pitch along a column, in µm.
    pub pitch_y_um: f64,
    /// Focal length, in mm.
    pub focal_length_mm: f64,
    /// Diameter of the entrance pupil, in mm.
    pub aperture_mm: f64,
    /// Transmission of the lens, by wavelength.
    pub lens_transmission: Response,
    /// Electrons per photon that reaches a pixel, by wavelength.
    pub quantum_efficiency: Response,
    /// Shortest wavelength that reaches the detector, in nm.
    pub band_from_nm: f64,
    /// Longest wavelength that reaches the detector, in nm.
    pub band_to_nm: f64,
    /// Read noise of a pixel, in electrons.
    pub read_noise_e: f64,
    /// Dark current of a pixel, in electrons per second.
    pub dark_current_e_s: f64,
    /// Full well of a pixel, in electrons.
    pub full_well_e: f64,
    /// Gain, in electrons per grey level.
    pub gain_e_per_adu: f64,
    /// Bits of a grey level.
    pub bits: u32,
    /// Bias: the grey level without light.
    pub bias_adu: f64,
    /// Standard deviation of a star's Gaussian spot before integration over the pixels, in pixels.
    pub spot_sigma_px: f64,
    /// Share of a star's light on its brightest pixel; if `None`, it follows from
    /// [`Self::spot_sigma_px`].
    pub peak_share: Option<f64>,
    /// The picture of a star's spot, for spots of the form [`SpotForm::File`](super::SpotForm::File).
    pub spot_image: Option<Arc<SpotImage>>,
    /// Properties that affect simulated frames, but not the limiting magnitude of the centre.
    pub imperfections: Imperfections,
}

impl DataSheet {
    /// Size of the detector.
    pub(crate) fn size(&self) -> Size {
        Size::new(self.width_px, self.height_px)
    }

    /// Area of the entrance pupil, in m².
    #[doc(alias = "A")]
    pub fn aperture_area_m2(&self) -> f64 {
        let diameter_m = self.aperture_mm * 1e-3;
        std::f64::consts::FRAC_PI_4 * diameter_m * diameter_m
    }

    /// Solid angle of a pixel at the centre of the field, in steradians.
    #[doc(alias = "A_P")]
    pub fn pixel_solid_angle_sr(&self) -> f64 {
        let focal_um = self.focal_length_mm * 1e3;
        self.pitch_x_um * self.pitch_y_um / (focal_um * focal_um)
    }

    /// Pixel scale at the centre of the field, in radians: the geometric mean along both axes.
    pub fn pixel_scale_rad(&self) -> f64 {
        self.pixel_solid_angle_sr().sqrt()
    }

    /// Share of a star's light on its brightest pixel: as stated, or of a spot centred on a pixel.
    #[doc(alias = "mu")]
    pub fn peak_share(&self) -> f64 {
        self.peak_share
            .unwrap_or_else(|| libm::erf(0.5 / (SQRT_2 * self.spot_sigma_px)).powi(2))
    }

    /// Standard deviation of the rounding to whole grey levels, in electrons.
    pub fn quantisation_noise_e(&self) -> f64 {
        self.gain_e_per_adu / 12f64.sqrt()
    }

    /// Grey level at and above which a pixel counts as saturated: full well or full scale.
    pub fn saturation_adu(&self) -> f64 {
        // The level of a full pixel varies by the read noise.
        const FULL_WELL_SIGMAS: f64 = 4.0;
        let full_e = self.full_well_e - FULL_WELL_SIGMAS * self.read_noise_e;
        let full_adu = self.bias_adu + full_e / self.gain_e_per_adu;
        full_adu.floor().min(self.full_scale_adu())
    }

    /// Largest grey level.
    pub fn full_scale_adu(&self) -> f64 {
        2f64.powi(self.bits as i32) - 1.0
    }
}

#[cfg(test)]
mod tests {
    use crate::camera::data_sheet::Preset;

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
