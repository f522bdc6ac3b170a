//! The path of a star over the detector while the camera turns.

use crate::base::coords::{PixelPoint, UnitVector};
use crate::camera::CameraModel;
use nalgebra::Vector3;

/// The motion of stars during one exposure.
#[derive(Debug, Clone)]
pub(super) struct StarMotion<'a> {
    camera: &'a CameraModel,
    /// Rotation axis in camera axes, and rotation angle during the exposure, in radians.
    axis: Vector3<f64>,
    angle_rad: f64,
    /// Additional motion of all stars along the rows, in pixels.
    along_x_px: f64,
}

impl<'a> StarMotion<'a> {
    pub(super) fn new(camera: &'a CameraModel, turn_rad: Vector3<f64>, along_x_px: f64) -> Self {
        Self {
            camera,
            axis: turn_rad.try_normalize(0.0).unwrap_or_else(Vector3::z),
            angle_rad: turn_rad.norm(),
            along_x_px,
        }
    }

    /// Longest path of any star on the frame, in pixels.
    pub(super) fn longest_px(&self) -> f64 {
        let corners = self.camera.corners().into_iter();
        let places = corners.chain([self.camera.centre()]);
        places
            .map(|place| self.length_px(&place))
            .fold(0.0, f64::max)
    }

    /// Motion of a star at the centre of the frame along x and y, in pixels.
    pub(super) fn of_centre_px(&self) -> [f64; 2] {
        let centre = self.camera.centre();
        let [from, to] = [-0.5, 0.5].map(|time| self.at(&centre, time).unwrap_or(centre));
        [to.x - from.x, to.y - from.y]
    }

    /// Calls `put` with points along the path of the star that is at `middle` in the middle of the
    /// exposure, and the fraction of its light at each.
    pub(super) fn along(
        &self,
        middle: &PixelPoint,
        sigma_px: f64,
        mut put: impl FnMut(&PixelPoint, f64),
    ) {
        /// Largest length of a path segment, in standard deviations of the spot. Six points per
        /// segment give the light to 10⁻⁹.
        const PART_SIGMAS: f64 = 1.5;
        /// Gauss-Legendre quadrature with six points on −1 to 1: position and weight of those on
        /// one side.
        const QUADRATURE: [(f64, f64); 3] = [
            (0.238_619_186_083_196_9, 0.467_913_934_572_691),
            (0.661_209_386_466_264_5, 0.360_761_573_048_138_6),
            (0.932_469_514_203_152, 0.171_324_492_379_170_36),
        ];
        /// Paths shorter than this, in standard deviations, are ignored: they change no pixel by
        /// 10⁻⁷ of the light.
        const MIN_SIGMAS: f64 = 1e-3;
        let length_px = self.length_px(middle);
        if length_px < MIN_SIGMAS * sigma_px {
            return put(middle, 1.0);
        }
        let parts = (length_px / (PART_SIGMAS * sigma_px)).ceil().max(1.0);
        let half = 0.5 / parts;
        for part in 0..parts as usize {
            let centre = (part as f64 + 0.5) / parts - 0.5;
            for (place, weight) in QUADRATURE {
                for time in [centre - place * half, centre + place * half] {
                    if let Some(point) = self.at(middle, time) {
                        put(&point, weight * half);
                    }
                }
            }
        }
    }

    /// Length of the path through `middle`, in pixels, as that of two chords.
    fn length_px(&self, middle: &PixelPoint) -> f64 {
        if self.angle_rad == 0.0 {
            return self.along_x_px.abs();
        }
        let half = |time| {
            self.at(middle, time)
                .map_or(0.0, |end| end.distance_to(middle))
        };
        half(-0.5) + half(0.5)
    }

    /// Position at `time`, from −½ to ½ of the exposure.
    fn at(&self, middle: &PixelPoint, time: f64) -> Option<PixelPoint> {
        let mut place = *middle;
        if self.angle_rad != 0.0 {
            let direction = self.turned(self.camera.direction_of(middle)?.as_vector(), time);
            place = self.camera.pixel_of(&UnitVector::from_unit(direction))?;
        }
        place.x += time * self.along_x_px;
        Some(place)
    }

    /// Direction in the camera at `time` of what is in `direction` at time 0, by Rodrigues'
    /// formula.
    fn turned(&self, direction: &Vector3<f64>, time: f64) -> Vector3<f64> {
        // Stars turn opposite to the camera.
        let (sin, cos) = libm::sincos(-time * self.angle_rad);
        let along_axis = self.axis * (self.axis.dot(direction) * (1.0 - cos));
        direction * cos + self.axis.cross(direction) * sin + along_axis
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> CameraModel {
        CameraModel::pinhole(200.0, 100.0, 1000.0, false)
    }

    /// Sum of the fractions, mean position, and points.
    fn summed(motion: &StarMotion, middle: PixelPoint) -> (f64, PixelPoint, Vec<PixelPoint>) {
        let (mut sum, mut mean, mut points) = (0.0, PixelPoint::default(), Vec::new());
        motion.along(&middle, 1.0, |point, part| {
            sum += part;
            mean = PixelPoint::new(mean.x + part * point.x, mean.y + part * point.y);
            points.push(*point);
        });
        (sum, mean, points)
    }

    #[test]
    fn a_camera_that_turns_about_y_moves_the_stars_along_the_rows() {
        let camera = camera();
        // 0.01 rad at a focal length of 1000 px; x to the right, the camera turns to it, stars go
        // left.
        let motion = StarMotion::new(&camera, Vector3::new(0.0, 0.01, 0.0), 0.0);
        let end = motion.at(&camera.centre(), 0.5).unwrap();
        assert!((end.x - (camera.centre().x - 5.0)).abs() < 1e-3 && (end.y - 49.5).abs() < 1e-9);
        assert!((motion.length_px(&camera.centre()) - 10.0).abs() < 1e-3);
        let (sum, mean, points) = summed(&motion, camera.centre());
        assert!(
            (sum - 1.0).abs() < 1e-12 && points.len() == 7 * 6,
            "{}",
            points.len()
        );
        assert!((mean.x - camera.centre().x).abs() < 1e-9);
    }

    #[test]
    fn a_camera_that_rolls_leaves_its_centre_and_turns_the_rest() {
        let camera = camera();
        let motion = StarMotion::new(&camera, Vector3::new(0.0, 0.0, 0.1), 0.0);
        let (_, _, points) = summed(&motion, camera.centre());
        assert_eq!(points, [camera.centre()]);
        let edge = PixelPoint::new(camera.centre().x + 90.0, camera.centre().y);
        assert!((motion.length_px(&edge) - 9.0).abs() < 0.01);
        // The distance from the centre is constant.
        let (_, _, points) = summed(&motion, edge);
        let off = |point: &PixelPoint| (point.distance_to(&camera.centre()) - 90.0).abs();
        assert!(points.iter().all(|point| off(point) < 1e-9));
        assert!((motion.longest_px() - 0.1 * camera.radius_px()).abs() < 0.02);
    }

    #[test]
    fn what_is_put_down_is_the_mean_along_the_way() {
        let camera = camera();
        let motion = StarMotion::new(&camera, Vector3::zeros(), 3.0);
        let gaussian = |x: f64| (-0.5 * x * x).exp();
        let middle = PixelPoint::new(20.0, 20.0);
        for offset in [0.0, 0.4, 1.7, -2.6] {
            let mut found = 0.0;
            motion.along(&middle, 1.0, |point, part| {
                found += part * gaussian(point.x - middle.x - offset);
            });
            let steps = 20_000;
            let at = |step: i32| 3.0 * ((f64::from(step) + 0.5) / f64::from(steps) - 0.5);
            let sum: f64 = (0..steps).map(|step| gaussian(at(step) - offset)).sum();
            assert!((found - sum / f64::from(steps)).abs() < 1e-8);
        }
    }
}
