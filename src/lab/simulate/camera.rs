//! The camera model of a data sheet, and where the camera points.

use crate::base::coords::{Camera, Icrs, Rotation};
use crate::base::units::RAD_PER_DEG;
use crate::camera::data_sheet::DataSheet;
use crate::camera::{CameraModel, Distortion, DistortionModel, Projection};
use crate::ephemeris::places::StarPlaces;

/// Attitude of a frame, and where stars appear.
#[derive(Debug, Clone, PartialEq)]
pub struct Pointing {
    /// Attitude in the middle of the exposure, relative to apparent directions.
    pub icrs_to_camera: Rotation<Icrs, Camera>,
    /// Where the catalogue's stars appear.
    pub places: StarPlaces,
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
    if made.projection != Projection::Pinhole {
        let field_rad = made.field_radius_deg * RAD_PER_DEG;
        camera = camera
            .with_projection(made.projection)
            .limited_to(field_rad);
    }
    let terms_px = made.lens_terms_px();
    let terms = terms_px.iter().rposition(|term| *term != 0.0);
    let model = terms.and_then(|last| DistortionModel::with_terms(last + 1));
    let distortion = |model: DistortionModel| {
        Distortion::new(model, camera.radius_px(), &terms_px[..model.terms()])
    };
    camera.with_distortion(model.map(distortion))
}
