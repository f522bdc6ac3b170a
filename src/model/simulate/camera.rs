//! The camera model of a data sheet, and where the camera points.

use crate::base::coords::{Camera, Icrs, Rotation};
use crate::camera::data_sheet::DataSheet;
use crate::camera::{CameraModel, Distortion, DistortionModel};

/// Attitude and date of a frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Pointing {
    /// Attitude in the middle of the exposure.
    pub icrs_to_camera: Rotation<Icrs, Camera>,
    /// Date in Julian years since J2000.0, for proper motion.
    pub years_since_j2000: f64,
}

/// The camera model of a data sheet, with square pixels of the same area, and the distortion of its
/// lens.
///
/// A camera model has one scale for both axes. If the pitches differ by percents, a frame with the
/// true pixels could not be identified with it; the simulated frame can.
pub fn camera_of(sheet: &DataSheet) -> CameraModel {
    let made = &sheet.imperfections;
    let pitch_um = (sheet.pitch_x_um * sheet.pitch_y_um).sqrt();
    let focal_length_px = sheet.focal_length_mm * 1e3 / pitch_um;
    let (width_px, height_px) = (sheet.width_px as f64, sheet.height_px as f64);
    let mut camera = CameraModel::pinhole(width_px, height_px, focal_length_px, made.mirrored);
    // The model maps observed to pinhole positions, which is the opposite direction.
    let [radial, x, y] = [
        -made.distortion_px,
        -made.decentring_x_px,
        -made.decentring_y_px,
    ];
    if x != 0.0 || y != 0.0 {
        // Conrady 1919: u and v of x (3u² + v², 2uv) + y (2uv, u² + 3v²), in thirds; then r² (u,
        // v).
        let third = 1.0 / 3.0;
        let second = [x, y * third, 2.0 * third * y, 2.0 * third * x, x * third, y];
        let cubic = [radial, 0.0, 0.0, radial, radial, 0.0, 0.0, radial];
        let terms: Vec<f64> = [0.0; 2].into_iter().chain(second).chain(cubic).collect();
        let distortion = Distortion::new(DistortionModel::Cubic, camera.radius_px(), &terms);
        camera.distortion = Some(distortion);
    } else if radial != 0.0 {
        let radius_px = camera.radius_px();
        let distortion = Distortion::new(DistortionModel::Radial, radius_px, &[radial]);
        camera.distortion = Some(distortion);
    }
    camera
}
