//! Where a place is in the circle of the lens: what a lens loses goes with the distance from its axis.

use crate::base::coords::PixelPoint;
use crate::camera::CameraModel;

/// The circle of a lens in its frame.
pub(super) struct LensCircle {
    axis: PixelPoint,
    radius_px: f64,
}

impl LensCircle {
    /// That of a camera.
    pub(super) fn from_camera(camera: &CameraModel) -> Self {
        Self {
            axis: camera.axis(),
            radius_px: camera.field_radius_px(),
        }
    }

    /// Distance from the axis over that of the edge of the field, squared.
    pub(super) fn off_axis_sq(&self, pixel: &PixelPoint) -> f64 {
        (pixel.distance_to(&self.axis) / self.radius_px).powi(2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Distortion, DistortionModel};

    #[test]
    fn a_lens_loses_light_about_its_axis_and_not_about_the_middle_of_the_frame() {
        let camera = CameraModel::pinhole(400.0, 300.0, 500.0, false);
        let axis_px = [0.0, 0.0, 0.0, 12.0, -5.0, 0.0, 0.0];
        let model = DistortionModel::BrownConrady;
        let off_axis =
            camera.with_distortion(Some(Distortion::new(model, camera.radius_px(), &axis_px)));
        let of = |camera: &CameraModel, place| LensCircle::from_camera(camera).off_axis_sq(&place);
        let centre = camera.centre();
        assert!(of(&camera, centre) < 1e-12);
        let axis = PixelPoint::new(centre.x + 12.0, centre.y - 5.0);
        assert!(of(&off_axis, axis) < 1e-12);
        assert!((of(&off_axis, centre) - (13.0 / 250.0_f64).powi(2)).abs() < 1e-4);
    }
}
