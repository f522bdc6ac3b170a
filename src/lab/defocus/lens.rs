//! Defocus distance of a lens for a given spot.

use crate::camera::data_sheet::DataSheet;
use serde::Serialize;

/// A lens and its pixels.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DefocusLens {
    /// Focal length over aperture.
    pub f_number: f64,
    /// Pixel pitch, in µm: the geometric mean of both.
    pub pitch_um: f64,
    /// Central wavelength, in nm.
    pub wavelength_nm: f64,
    /// Standard deviation of the spot in focus, in pixels.
    pub focused_px: f64,
}

impl DefocusLens {
    /// The lens of a camera with this standard deviation of the spot in focus, in pixels.
    pub fn of(sheet: &DataSheet, focused_px: f64) -> Self {
        Self {
            f_number: sheet.focal_length_mm / sheet.aperture_mm,
            pitch_um: (sheet.pitch_x_um * sheet.pitch_y_um).sqrt(),
            wavelength_nm: 0.5 * (sheet.band_from_nm + sheet.band_to_nm),
            focused_px,
        }
    }

    /// A radius in µm.
    pub fn spot_um(&self, spot_px: f64) -> f64 {
        spot_px * self.pitch_um
    }

    /// Distance from focus that makes a spot of this radius, in µm; none if it is sharper than the
    /// spot in focus.
    ///
    /// Geometric blur: a uniform disc whose diameter is distance over f-number. Its variance adds
    /// to that of the spot in focus.
    pub fn distance_um(&self, spot_px: f64) -> Option<f64> {
        /// Standard deviation along one axis of a uniform disc of diameter 1: the cross-section of
        /// a cone of light at one f-number from focus.
        const DISC_SIGMA: f64 = 0.25;
        let blur2 = spot_px * spot_px - self.focused_px * self.focused_px;
        (blur2 >= 0.0).then(|| blur2.sqrt() * self.pitch_um * self.f_number / DISC_SIGMA)
    }

    /// Radius of the diffraction-limited spot in focus, in pixels.
    pub fn diffraction_px(&self) -> f64 {
        /// Standard deviation of the Gaussian closest to the core of the Airy pattern, in units of
        /// wavelength times f-number.
        ///
        /// # Reference
        /// Zhang, Zerubia & Olivo-Marin 2007, Applied Optics 46, 1819: 0.21 λ/NA, with 1/NA = 2 N.
        const AIRY_SIGMA: f64 = 0.42;
        AIRY_SIGMA * self.wavelength_nm * 1e-3 * self.f_number / self.pitch_um
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_disc_has_the_standard_deviation_of_the_spot_asked_for() {
        let lens = DefocusLens {
            f_number: 1.5,
            pitch_um: 5.0,
            wavelength_nm: 600.0,
            focused_px: 0.0,
        };
        // 60 µm at f/1.5: a disc of 40 µm across, radius 20 µm, standard deviation 10 µm: 2 px.
        assert_eq!(lens.distance_um(2.0), Some(60.0));
        let blurred = DefocusLens {
            focused_px: 1.2,
            ..lens
        };
        assert!((blurred.distance_um(2.0).unwrap() - 48.0).abs() < 1e-12);
        assert_eq!(blurred.distance_um(1.0), None);
        assert!((lens.diffraction_px() - 0.0756).abs() < 1e-12);
    }
}
