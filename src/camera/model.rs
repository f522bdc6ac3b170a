//! The camera model: which direction each pixel looks in.

use super::distortion::{Distortion, DistortionModel};
use super::projection::Projection;
use crate::base::coords::{Camera, PixelPoint, UnitVector};
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::TAU;

/// A camera: its frame, and a lens with its distortion.
///
/// Camera axes: z out along the boresight, x and y along the image's. The boresight of a pinhole is
/// what the frame's centre sees, wherever the lens has its axis; x and y are as nearly along the
/// image's rows and columns there as a right angle can be. The boresight of any other lens is its axis.
///
/// # Example
/// ```
/// use starpipe::{CameraModel, PixelPoint, Rotation, UnitVector};
///
/// let camera = CameraModel::pinhole(640.0, 480.0, 1800.0, false);
/// let fov_x_rad = camera.fov_x_rad().expect("both edges see the sky");
/// assert!((fov_x_rad.to_degrees() - 20.16).abs() < 0.01);
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
    /// Whether the image is reversed left to right, as by an odd number of mirrors.
    pub mirrored: bool,
    focal_length_px: f64,
    projection: Projection,
    distortion: Option<Distortion>,
    /// Angle from the axis up to which the lens is known.
    max_angle_rad: f64,
    /// Its cosine.
    min_cos: f64,
    /// Camera axes to the axes of the lens, where these are not the same.
    to_lens: Option<Matrix3<f64>>,
}

impl CameraModel {
    /// A pinhole camera without distortion. The scale is 1 / `focal_length_px` radians per pixel.
    pub fn pinhole(width_px: f64, height_px: f64, focal_length_px: f64, mirrored: bool) -> Self {
        Self {
            width_px,
            height_px,
            mirrored,
            focal_length_px,
            projection: Projection::Pinhole,
            distortion: None,
            max_angle_rad: Projection::Pinhole.max_angle_rad(),
            min_cos: 0.0,
            to_lens: None,
        }
    }

    /// The same frame with another lens: no distortion, known as far as it images anything.
    #[must_use]
    pub fn with_projection(self, projection: Projection) -> Self {
        Self {
            projection,
            distortion: None,
            to_lens: None,
            ..self
        }
        .limited_to(projection.max_angle_rad())
    }

    /// The same camera with another distortion.
    #[must_use]
    pub fn with_distortion(mut self, distortion: Option<Distortion>) -> Self {
        self.distortion = distortion;
        self.to_lens = self.axes_of_lens();
        self
    }

    /// The same camera with another focal length.
    #[must_use]
    pub fn with_focal_length(mut self, focal_length_px: f64) -> Self {
        self.focal_length_px = focal_length_px;
        self.to_lens = self.axes_of_lens();
        self
    }

    /// The same camera, of which nothing is known beyond an angle from the axis of its lens.
    #[must_use]
    pub fn limited_to(mut self, max_angle_rad: f64) -> Self {
        self.max_angle_rad = max_angle_rad.min(self.projection.max_angle_rad());
        self.min_cos = libm::cos(self.max_angle_rad);
        self
    }

    /// A camera that is like this one near the axis of the lens, with another projection. Its distortion
    /// makes up for the difference to the third order, if it has a distortion.
    #[must_use]
    pub(crate) fn reprojected(&self, projection: Projection) -> Self {
        let mut distortion = self.distortion;
        if let Some(distortion) = &mut distortion {
            let third = projection.third_order_to(self.projection);
            let radius = distortion.radius_px() / self.focal_length_px;
            let more = third * radius.powi(2);
            *distortion = distortion.changed([more * distortion.radius_px()]);
        }
        let other = self.with_projection(projection).with_distortion(distortion);
        let is_limited = self.max_angle_rad < self.projection.max_angle_rad();
        if is_limited && projection != Projection::Pinhole {
            other.limited_to(self.max_angle_rad)
        } else {
            other
        }
    }

    /// Focal length in pixels: the scale on the axis of the lens is 1 / it radians per pixel.
    pub fn focal_length_px(&self) -> f64 {
        self.focal_length_px
    }

    /// The ideal lens that is nearest to this one.
    pub fn projection(&self) -> Projection {
        self.projection
    }

    /// How the lens differs from it, if it does.
    pub fn distortion(&self) -> Option<&Distortion> {
        self.distortion.as_ref()
    }

    /// The distortion model, if there is a distortion.
    pub fn distortion_model(&self) -> Option<DistortionModel> {
        self.distortion.as_ref().map(Distortion::model)
    }

    /// Angle from the axis, in radians, beyond which nothing is known of the lens.
    pub fn max_angle_rad(&self) -> f64 {
        self.max_angle_rad
    }

    /// Whether the camera is a pinhole, with or without distortion.
    pub fn is_pinhole(&self) -> bool {
        self.projection == Projection::Pinhole
    }

    /// Camera axes to the axes of the lens: z along its axis.
    pub(crate) fn lens_axes(&self) -> Matrix3<f64> {
        self.to_lens.unwrap_or_else(Matrix3::identity)
    }

    /// The axes of the camera in those of the lens; `None` where they are the same.
    fn axes_of_lens(&self) -> Option<Matrix3<f64>> {
        let distortion = self.distortion.as_ref()?;
        if !self.is_pinhole() || distortion.model() < DistortionModel::BrownConrady {
            return None;
        }
        let ideal = distortion.remove([0.0; 2])?;
        let [[uu, uv], [vu, vv]] = distortion.observe(ideal)?.by_ideal;
        let boresight = Vector3::new(ideal[0], ideal[1], self.focal_length_px).normalize();
        // What moves the image along u alone, and along v alone; only the ratio of their lengths counts.
        let [along_u, along_v] = [[vv, -vu], [-uv, uu]].map(|[x, y]| {
            let moved = Vector3::new(x, y, 0.0);
            moved - boresight * boresight.dot(&moved)
        });
        // The pair of axes that is nearest to both.
        let right = along_u.normalize();
        let down = boresight.cross(&right);
        let turn = libm::atan2(-right.dot(&along_v), along_u.norm() + down.dot(&along_v));
        let (sin, cos) = libm::sincos(turn);
        Some(Matrix3::from_columns(&[
            right * cos + down * sin,
            down * cos - right * sin,
            boresight,
        ]))
    }

    /// The focal length of a pinhole that has the scale of this camera at the frame's centre, as the
    /// geometric mean over all directions; of a camera that is no pinhole, that on its axis.
    pub fn central_focal_length_px(&self) -> f64 {
        let of_centre = || {
            let distortion = self.distortion.as_ref().filter(|_| self.is_pinhole())?;
            let ideal = distortion.remove([0.0; 2])?;
            let [[uu, uv], [vu, vv]] = distortion.observe(ideal)?.by_ideal;
            let [x, y] = ideal.map(|along| along / self.focal_length_px);
            let stretch = libm::pow(1.0 + x * x + y * y, 1.5);
            Some(self.focal_length_px * ((uu * vv - uv * vu) * stretch).sqrt())
        };
        of_centre().unwrap_or(self.focal_length_px)
    }

    /// The frame's centre, ((width − 1) / 2, (height − 1) / 2).
    pub fn centre(&self) -> PixelPoint {
        frame_centre(self.width_px, self.height_px)
    }

    /// The pixel on the axis of the lens.
    pub fn axis(&self) -> PixelPoint {
        let offset = self.distortion.map_or([0.0; 2], |d| d.axis_offset_px());
        self.pixel_at(offset)
    }

    /// Half the diagonal of the frame, in pixels.
    pub fn radius_px(&self) -> f64 {
        libm::hypot(self.width_px, self.height_px) / 2.0
    }

    /// Whether a corner of the frame sees the sky.
    pub(crate) fn fills_frame(&self) -> bool {
        self.corners()
            .iter()
            .any(|corner| self.direction_of(corner).is_some())
    }

    /// The angle from the axis up to which the lens is known, unless it is known up to all corners.
    pub(crate) fn valid_to_rad(&self) -> Option<f64> {
        let corners = self.corners();
        let sees_all = corners
            .iter()
            .all(|corner| self.direction_of(corner).is_some());
        (!sees_all).then_some(self.max_angle_rad)
    }

    /// Distance from the centre of the frame to where its field ends, in pixels: its corners, or the edge of
    /// an all-sky lens.
    pub(crate) fn field_radius_px(&self) -> f64 {
        if self.fills_frame() {
            return self.radius_px();
        }
        // Just inside.
        let (sin, cos) = libm::sincos((1.0 - 1e-9) * self.max_angle_rad);
        let edge = self.pixel_of(&UnitVector::from_unit(Vector3::new(sin, 0.0, cos)));
        edge.map_or(self.radius_px(), |edge| edge.distance_to(&self.axis()))
    }

    /// The largest displacement by the distortion where the field ends, without that of the axis, in pixels.
    pub(crate) fn largest_distortion_px(&self) -> f64 {
        let ideal_px = if self.fills_frame() {
            self.radius_px()
        } else {
            self.focal_length_px * self.projection.radius(self.max_angle_rad)
        };
        let distortion = self.distortion.as_ref();
        distortion.map_or(0.0, |distortion| distortion.largest_at_px(ideal_px))
    }

    /// Distance of `pixel` from the centre over that of the corner, squared.
    pub fn off_centre_sq(&self, pixel: &PixelPoint) -> f64 {
        let [u, v] = self.offset_of(pixel);
        (u * u + v * v) / self.radius_px().powi(2)
    }

    /// Offset of `pixel` from the centre along the camera's x and y axes, in pixels.
    pub fn offset_of(&self, pixel: &PixelPoint) -> [f64; 2] {
        let centre = self.centre();
        let u = pixel.x - centre.x;
        [if self.mirrored { -u } else { u }, pixel.y - centre.y]
    }

    /// The pixel at an offset from the centre along the camera's x and y axes.
    pub(crate) fn pixel_at(&self, [u, v]: [f64; 2]) -> PixelPoint {
        let centre = self.centre();
        let u = if self.mirrored { -u } else { u };
        PixelPoint::new(centre.x + u, centre.y + v)
    }

    /// The direction in which `pixel` looks. `None` where the lens images nothing, or is not known.
    pub fn direction_of(&self, pixel: &PixelPoint) -> Option<UnitVector<Camera>> {
        let offset = self.offset_of(pixel);
        let ideal = match &self.distortion {
            Some(distortion) => distortion.remove(offset)?,
            None => offset,
        };
        let at = ideal.map(|along| along / self.focal_length_px);
        let direction = self.projection.direction_at(at)?;
        if direction.as_vector().z < self.min_cos {
            return None;
        }
        Some(match &self.to_lens {
            Some(to_lens) => UnitVector::from_unit(to_lens.tr_mul(direction.as_vector())),
            None => direction,
        })
    }

    /// The pixel at `direction`, inside or outside the frame. `None` where it is not imaged, or the
    /// lens is not known.
    #[inline]
    pub fn pixel_of(&self, direction: &UnitVector<Camera>) -> Option<PixelPoint> {
        let direction = match &self.to_lens {
            Some(to_lens) => UnitVector::from_unit(to_lens * direction.as_vector()),
            None => *direction,
        };
        if direction.as_vector().z < self.min_cos {
            return None;
        }
        let at = self.projection.image_of(&direction)?;
        let ideal = at.map(|along| along * self.focal_length_px);
        let offset = match &self.distortion {
            Some(distortion) => distortion.apply(ideal)?,
            None => ideal,
        };
        Some(self.pixel_at(offset))
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

    /// Angle between the midpoints of the left and right edges, in radians. `None` where one of them
    /// sees nothing.
    pub fn fov_x_rad(&self) -> Option<f64> {
        let y = self.centre().y;
        self.angle_between(
            &PixelPoint::new(-0.5, y),
            &PixelPoint::new(self.width_px - 0.5, y),
        )
    }

    /// Angle between the midpoints of the upper and lower edges, in radians. `None` where one of them
    /// sees nothing.
    pub fn fov_y_rad(&self) -> Option<f64> {
        let x = self.centre().x;
        self.angle_between(
            &PixelPoint::new(x, -0.5),
            &PixelPoint::new(x, self.height_px - 0.5),
        )
    }

    /// The solid angle of the frame in steradians, without its distortion. Of an all-sky lens it is
    /// that of the circle that it is known in, or of the frame, whichever is smaller.
    pub fn solid_angle_sr(&self) -> f64 {
        let (f, w, h) = (self.focal_length_px, self.width_px, self.height_px);
        if self.is_pinhole() {
            // A pyramid's.
            let diagonal = libm::sqrt(4.0 * f * f + w * w + h * h);
            return 4.0 * libm::atan(w * h / (2.0 * f * diagonal));
        }
        (w * h / (f * f)).min(TAU * (1.0 - libm::cos(self.radius_rad())))
    }

    /// The corners of the frame.
    pub fn corners(&self) -> [PixelPoint; 4] {
        let (right, bottom) = (self.width_px - 0.5, self.height_px - 0.5);
        [(-0.5, -0.5), (right, -0.5), (-0.5, bottom), (right, bottom)]
            .map(|(x, y)| PixelPoint::new(x, y))
    }

    /// Largest angle between the boresight and what the frame sees, in radians.
    pub fn radius_rad(&self) -> f64 {
        let corners = self.corners().map(|corner| {
            let direction = self.direction_of(&corner);
            direction.map_or(self.max_angle_rad, |d| d.angle_to(&UnitVector::BORESIGHT))
        });
        corners.into_iter().fold(0.0, f64::max)
    }

    fn angle_between(&self, a: &PixelPoint, b: &PixelPoint) -> Option<f64> {
        Some(self.direction_of(a)?.angle_to(&self.direction_of(b)?))
    }
}

/// The centre of a frame: ((width − 1) / 2, (height − 1) / 2).
pub fn frame_centre(width_px: f64, height_px: f64) -> PixelPoint {
    PixelPoint::new((width_px - 1.0) / 2.0, (height_px - 1.0) / 2.0)
}

/// Focal length, in pixels, of a pinhole camera whose field is `fov_rad` across `extent_px` pixels.
pub fn focal_length_px(extent_px: f64, fov_rad: f64) -> f64 {
    extent_px / 2.0 / libm::tan(fov_rad / 2.0)
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
        assert!((camera.fov_x_rad().unwrap() - 20.0 * RAD_PER_DEG).abs() < 1e-12);
        let right = camera
            .direction_of(&PixelPoint::new(1023.5, 383.5))
            .unwrap();
        assert!((right.as_vector().x - (10.0 * RAD_PER_DEG).sin()).abs() < 1e-12);
        let below = camera.direction_of(&PixelPoint::new(511.5, 600.0)).unwrap();
        assert!(below.as_vector().y > 0.0);
    }

    fn distorted(camera: CameraModel) -> CameraModel {
        let coefficients_px = [-9.0, 4.0, 1.0, 21.0, -13.0, 2.0, -1.0, 3.0, 5.0];
        let radius_px = camera.radius_px();
        let model = DistortionModel::Stretched;
        camera.with_distortion(Some(Distortion::new(model, radius_px, &coefficients_px)))
    }

    #[test]
    fn pixels_round_trip_through_directions() {
        for (projection, focal_px) in [
            (Projection::Pinhole, 1500.0),
            (Projection::Equidistant, 380.0),
            (Projection::Equisolid, 420.0),
            (Projection::Stereographic, 300.0),
            (Projection::Orthographic, 700.0),
        ] {
            for mirrored in [false, true] {
                let camera = CameraModel::pinhole(1000.0, 800.0, focal_px, mirrored);
                let camera = distorted(camera.with_projection(projection));
                for pixel in [
                    PixelPoint::new(0.0, 0.0),
                    PixelPoint::new(999.0, 799.0),
                    PixelPoint::new(321.5, 700.25),
                    camera.centre(),
                ] {
                    let direction = camera.direction_of(&pixel).unwrap();
                    let back = camera.pixel_of(&direction).unwrap();
                    let off_px = back.distance_to(&pixel);
                    assert!(
                        off_px < PIXEL_TOLERANCE,
                        "{projection:?} {pixel:?} {back:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn the_boresight_is_at_the_centre_of_a_pinhole_and_on_the_axis_of_another_lens() {
        let camera = CameraModel::pinhole(1000.0, 800.0, 1500.0, false);
        for pinhole in [camera, distorted(camera)] {
            let centre = pinhole.pixel_of(&UnitVector::BORESIGHT).unwrap();
            assert!(centre.distance_to(&pinhole.centre()) < PIXEL_TOLERANCE);
            let at = |x: f64, y: f64| {
                let pixel = PixelPoint::new(centre.x + x, centre.y + y);
                *pinhole.direction_of(&pixel).unwrap().as_vector()
            };
            let (right, below) = (at(1e-3, 0.0), at(0.0, 1e-3));
            assert!((right.y - below.x).abs() < 1e-12, "{right} {below}");
        }
        let fisheye = distorted(camera.with_projection(Projection::Equidistant));
        let axis = fisheye.pixel_of(&UnitVector::BORESIGHT).unwrap();
        assert!(axis.distance_to(&PixelPoint::new(520.5, 386.5)) < PIXEL_TOLERANCE);
        assert!(axis.distance_to(&fisheye.axis()) < PIXEL_TOLERANCE);
    }

    #[test]
    fn the_central_focal_length_is_the_scale_at_the_centre() {
        let plain = CameraModel::pinhole(1000.0, 800.0, 1500.0, false);
        assert_eq!(plain.central_focal_length_px(), 1500.0);
        let camera = distorted(plain);
        let centre = camera.centre();
        let at = |x: f64, y: f64| {
            let pixel = PixelPoint::new(centre.x + x, centre.y + y);
            *camera.direction_of(&pixel).unwrap().as_vector()
        };
        let (along_x, along_y) = (at(0.5, 0.0) - at(-0.5, 0.0), at(0.0, 0.5) - at(0.0, -0.5));
        let area_sr = along_x.cross(&along_y).norm();
        let found_px = camera.central_focal_length_px();
        assert!((found_px * area_sr.sqrt() - 1.0).abs() < 1e-6, "{found_px}");
    }

    #[test]
    fn a_lens_is_not_known_beyond_its_limit() {
        let camera = CameraModel::pinhole(1000.0, 1000.0, 300.0, false)
            .with_projection(Projection::Equidistant)
            .limited_to(80.0 * RAD_PER_DEG);
        let at = |angle_deg: f64| {
            let (sin, cos) = (angle_deg * RAD_PER_DEG).sin_cos();
            UnitVector::from_unit(Vector3::new(sin, 0.0, cos))
        };
        assert!(camera.pixel_of(&at(79.9)).is_some());
        assert_eq!(camera.pixel_of(&at(80.1)), None);
        assert_eq!(camera.direction_of(&PixelPoint::new(5.0, 499.5)), None);
        assert_eq!(camera.fov_x_rad(), None);
        assert!((camera.radius_rad() - 80.0 * RAD_PER_DEG).abs() < 1e-12);
        let sky_sr = TAU * (1.0 - (80.0 * RAD_PER_DEG).cos());
        assert!((camera.solid_angle_sr() - sky_sr).abs() < 1e-12);
    }
}
