//! The camera model: which direction each pixel looks in.

use super::distortion::{Distortion, DistortionModel, LANES};
use crate::base::coords::{Camera, PixelPoint, UnitVector};
use nalgebra::Vector3;

/// A pinhole camera whose axis goes through the frame's centre, with lens distortion.
///
/// # Example
/// ```
/// use starpipe::{CameraModel, PixelPoint, Rotation, UnitVector};
///
/// let camera = CameraModel::pinhole(640.0, 480.0, 1800.0, false);
/// assert!((camera.fov_x_rad().to_degrees() - 20.16).abs() < 0.01);
/// // The star in the boresight is at the frame's centre; what is north of it is above.
/// let boresight = UnitVector::from_ra_dec(1.0, 0.3);
/// let attitude = Rotation::looking_at(&boresight, 0.0);
/// let pixel = camera.pixel_of(&attitude.apply(&boresight)).expect("it is in front");
/// assert!(pixel.distance_to(&PixelPoint::new(319.5, 239.5)) < 1e-9);
/// let north = attitude.apply(&UnitVector::from_ra_dec(1.0, 0.31));
/// assert!(camera.pixel_of(&north).expect("it is in front").y < pixel.y);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraModel {
    /// Columns of the frame.
    pub width_px: f64,
    /// Rows of the frame.
    pub height_px: f64,
    /// Focal length in pixels: the scale at the centre is 1 / `focal_length_px` radians per pixel.
    pub focal_length_px: f64,
    /// Whether the image is reversed left to right, as by an odd number of mirrors.
    pub mirrored: bool,
    /// Lens distortion, if known.
    pub distortion: Option<Distortion>,
}

impl CameraModel {
    /// A pinhole camera without distortion.
    pub fn pinhole(width_px: f64, height_px: f64, focal_length_px: f64, mirrored: bool) -> Self {
        Self {
            width_px,
            height_px,
            focal_length_px,
            mirrored,
            distortion: None,
        }
    }

    /// The distortion model, if there is a distortion.
    pub fn distortion_model(&self) -> Option<DistortionModel> {
        self.distortion.as_ref().map(Distortion::model)
    }

    /// The frame's centre, ((width − 1) / 2, (height − 1) / 2).
    pub fn centre(&self) -> PixelPoint {
        frame_centre(self.width_px, self.height_px)
    }

    /// Half the diagonal of the frame, in pixels.
    pub fn radius_px(&self) -> f64 {
        libm::hypot(self.width_px, self.height_px) / 2.0
    }

    /// Distance of `pixel` from the centre over that of the corner, squared.
    pub fn off_centre_sq(&self, pixel: &PixelPoint) -> f64 {
        let [u, v] = self.offset_of(pixel);
        (u * u + v * v) / self.radius_px().powi(2)
    }

    /// Observed offset of `pixel` from the centre along the camera's x and y axes, in pixels.
    pub fn offset_of(&self, pixel: &PixelPoint) -> [f64; 2] {
        let centre = self.centre();
        let u = pixel.x - centre.x;
        [if self.mirrored { -u } else { u }, pixel.y - centre.y]
    }

    /// Offset of `pixel` from the centre without distortion, along the camera's axes, in pixels.
    pub fn ideal_offset_of(&self, pixel: &PixelPoint) -> [f64; 2] {
        let offset = self.offset_of(pixel);
        match &self.distortion {
            Some(distortion) => distortion.remove(offset),
            None => offset,
        }
    }

    /// [`Self::ideal_offset_of`] for the observed offsets of several pixels.
    #[inline(always)]
    pub(crate) fn ideal_offsets(&self, observed: &[[f64; LANES]; 2]) -> [[f64; LANES]; 2] {
        match &self.distortion {
            Some(distortion) => distortion.remove_from_lanes(observed),
            None => *observed,
        }
    }

    /// The direction in which `pixel` looks.
    pub fn direction_of(&self, pixel: &PixelPoint) -> UnitVector<Camera> {
        let [u, v] = self.ideal_offset_of(pixel);
        UnitVector::from_vector(Vector3::new(u, v, self.focal_length_px))
    }

    /// The pixel at `direction`, inside or outside the frame; `None` behind the camera.
    pub fn pixel_of(&self, direction: &UnitVector<Camera>) -> Option<PixelPoint> {
        let d = direction.as_vector();
        if d.z <= 0.0 {
            return None;
        }
        let ideal = [
            self.focal_length_px * d.x / d.z,
            self.focal_length_px * d.y / d.z,
        ];
        let [u, v] = match &self.distortion {
            Some(distortion) => distortion.apply(ideal)?,
            None => ideal,
        };
        let centre = self.centre();
        let u = if self.mirrored { -u } else { u };
        Some(PixelPoint::new(centre.x + u, centre.y + v))
    }

    /// [`Self::pixel_of`] for the first [`LANES`] of `directions`, which is faster than one by one.
    pub(crate) fn pixels_of(
        &self,
        directions: &[UnitVector<Camera>],
    ) -> [Option<PixelPoint>; LANES] {
        let mut ideal = [[0.0; LANES]; 2];
        let mut in_front = [false; LANES];
        for (lane, direction) in directions.iter().take(LANES).enumerate() {
            let d = direction.as_vector();
            in_front[lane] = d.z > 0.0;
            if in_front[lane] {
                ideal[0][lane] = self.focal_length_px * d.x / d.z;
                ideal[1][lane] = self.focal_length_px * d.y / d.z;
            }
        }
        let (offsets, inverted) = match &self.distortion {
            Some(distortion) => distortion.apply_to_lanes(&ideal),
            None => (ideal, [true; LANES]),
        };
        let centre = self.centre();
        std::array::from_fn(|lane| {
            let [u, v] = [offsets[0][lane], offsets[1][lane]];
            let u = if self.mirrored { -u } else { u };
            let is_valid = in_front[lane] && inverted[lane];
            is_valid.then(|| PixelPoint::new(centre.x + u, centre.y + v))
        })
    }

    /// Whether `pixel` lies on the frame.
    pub fn contains(&self, pixel: &PixelPoint) -> bool {
        self.nearly_contains(pixel, 0.0)
    }

    /// Whether `pixel` lies on the frame or within `margin_px` of it.
    pub fn nearly_contains(&self, pixel: &PixelPoint, margin_px: f64) -> bool {
        let low = -0.5 - margin_px;
        (low..self.width_px - 0.5 + margin_px).contains(&pixel.x)
            && (low..self.height_px - 0.5 + margin_px).contains(&pixel.y)
    }

    /// Angle between the midpoints of the left and right edges, in radians.
    pub fn fov_x_rad(&self) -> f64 {
        let y = self.centre().y;
        self.angle_between(
            &PixelPoint::new(-0.5, y),
            &PixelPoint::new(self.width_px - 0.5, y),
        )
    }

    /// Angle between the midpoints of the upper and lower edges, in radians.
    pub fn fov_y_rad(&self) -> f64 {
        let x = self.centre().x;
        self.angle_between(
            &PixelPoint::new(x, -0.5),
            &PixelPoint::new(x, self.height_px - 0.5),
        )
    }

    /// The corners of the frame.
    pub fn corners(&self) -> [PixelPoint; 4] {
        let (right, bottom) = (self.width_px - 0.5, self.height_px - 0.5);
        [(-0.5, -0.5), (right, -0.5), (-0.5, bottom), (right, bottom)]
            .map(|(x, y)| PixelPoint::new(x, y))
    }

    /// Largest angle between the boresight and a corner of the frame, in radians.
    pub fn radius_rad(&self) -> f64 {
        let corners = self.corners().map(|corner| self.direction_of(&corner));
        let angles_rad = corners.iter().map(|c| c.angle_to(&UnitVector::BORESIGHT));
        angles_rad.fold(0.0, f64::max)
    }

    fn angle_between(&self, a: &PixelPoint, b: &PixelPoint) -> f64 {
        self.direction_of(a).angle_to(&self.direction_of(b))
    }
}

/// The centre of a frame: ((width − 1) / 2, (height − 1) / 2).
pub fn frame_centre(width_px: f64, height_px: f64) -> PixelPoint {
    PixelPoint::new((width_px - 1.0) / 2.0, (height_px - 1.0) / 2.0)
}

/// Focal length, in pixels, of a pinhole camera whose field is `fov_rad` across `extent_px` pixels.
pub fn focal_length_px(extent_px: f64, fov_rad: f64) -> f64 {
    extent_px / 2.0 / (fov_rad / 2.0).tan()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::units::RAD_PER_DEG;

    const PIXEL_TOLERANCE: f64 = 1e-9;

    #[test]
    fn the_right_edge_looks_half_the_field_to_the_right() {
        let camera = CameraModel::pinhole(
            1024.0,
            768.0,
            focal_length_px(1024.0, 20.0 * RAD_PER_DEG),
            false,
        );
        assert!((camera.fov_x_rad() - 20.0 * RAD_PER_DEG).abs() < 1e-12);
        let right = camera.direction_of(&PixelPoint::new(1023.5, 383.5));
        assert!((right.as_vector().x - (10.0 * RAD_PER_DEG).sin()).abs() < 1e-12);
        let below = camera.direction_of(&PixelPoint::new(511.5, 600.0));
        assert!(below.as_vector().y > 0.0);
    }

    #[test]
    fn pixels_round_trip_through_directions() {
        for mirrored in [false, true] {
            let mut camera = CameraModel::pinhole(1000.0, 800.0, 1500.0, mirrored);
            let mut coefficients = vec![0.0; DistortionModel::Cubic.terms()];
            coefficients.iter_mut().enumerate().for_each(|(i, c)| {
                *c = 3.0 * (i as f64 - 7.0) / 7.0;
            });
            camera.distortion = Some(Distortion::new(
                DistortionModel::Cubic,
                640.0,
                &coefficients,
            ));
            for pixel in [
                PixelPoint::new(0.0, 0.0),
                PixelPoint::new(999.0, 799.0),
                PixelPoint::new(321.5, 700.25),
            ] {
                let direction = camera.direction_of(&pixel);
                let back = camera.pixel_of(&direction).unwrap();
                let behind = UnitVector::from_unit(-direction.as_vector());
                let many = camera.pixels_of(&[behind, direction, direction]);
                assert_eq!(many[..4], [None, Some(back), Some(back), None]);
                assert!(back.distance_to(&pixel) < 1e-5, "{pixel:?} {back:?}");
            }
        }
        let camera = CameraModel::pinhole(1000.0, 800.0, 1500.0, false);
        let centre = camera.pixel_of(&UnitVector::BORESIGHT).unwrap();
        assert!(centre.distance_to(&camera.centre()) < PIXEL_TOLERANCE);
    }
}
