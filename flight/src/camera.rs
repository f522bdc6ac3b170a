//! Which pixel looks in which direction?

use crate::Error;
use nalgebra::Vector3;

/// Steps that undo the distortion: Newton's method doubles the digits with each.
const UNDO_STEPS: usize = 8;
/// Points at which the distortion is checked, from the axis to the corners.
const CHECKED: u32 = 64;
/// Wider fields are no pinholes.
const MAX_RADIUS_TAN: f64 = 5.0;

/// A pinhole with radial distortion.
///
/// With r the tangent of the angle from the axis, a star is seen at
/// `focal_length_px` · r · (1 + `radial[0]` r² + `radial[1]` r⁴ + `radial[2]` r⁶) from `center_px`.
///
/// # Reference
/// Brown 1966, Photogrammetric Engineering 32, 444.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C)]
pub struct Camera {
    /// Columns.
    pub width_px: u32,
    /// Rows.
    pub height_px: u32,
    /// Focal length, in pixels.
    pub focal_length_px: f64,
    /// Where the axis meets the frame.
    pub center_px: [f64; 2],
    /// Distortion.
    pub radial: [f64; 3],
    /// 1 where the sky is seen as in a mirror, else 0. Camera axes are then those of the picture with x reversed.
    pub mirrored: u32,
}

/// A camera that was checked.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lens {
    pub camera: Camera,
    /// Angle from the boresight, the axis of the frame's centre, to the farthest corner.
    pub radius_rad: f64,
    /// Tangent of the angle from the axis of the lens to the farthest corner, and a little more.
    reach_tan: f64,
}

impl Lens {
    pub(crate) fn new(camera: Camera) -> Result<Self, Error> {
        let [width, height] = [camera.width_px, camera.height_px].map(f64::from);
        let lengths = [
            camera.focal_length_px,
            camera.center_px[0],
            camera.center_px[1],
        ];
        let finite = lengths
            .iter()
            .chain(&camera.radial)
            .all(|value| value.is_finite());
        let sides = [camera.width_px, camera.height_px];
        if camera.mirrored > 1
            || !finite
            || camera.focal_length_px < 1.0
            || sides.iter().any(|side| !(32..=16384).contains(side))
        {
            return Err(Error::Config);
        }
        let farthest = |at: f64, side: f64| (at + 0.5).abs().max((side - 0.5 - at).abs());
        let [x, y] = camera.center_px;
        let seen = libm::hypot(farthest(x, width), farthest(y, height)) / camera.focal_length_px;
        let reach_tan = reach(&camera.radial, seen).ok_or(Error::Lens)?;
        let mut lens = Self {
            camera,
            radius_rad: 0.0,
            reach_tan,
        };
        let middle = lens.direction_of([0.5 * (width - 1.0), 0.5 * (height - 1.0)]);
        for corner in [
            [0.0, 0.0],
            [width - 1.0, 0.0],
            [0.0, height - 1.0],
            [width - 1.0, height - 1.0],
        ] {
            let angle = middle.angle(&lens.direction_of(corner));
            lens.radius_rad = lens.radius_rad.max(angle);
        }
        Ok(lens)
    }

    /// The direction of the frame's centre.
    pub(crate) fn middle(&self) -> Vector3<f64> {
        let sides = [self.camera.width_px, self.camera.height_px];
        self.direction_of(sides.map(|side| 0.5 * (f64::from(side) - 1.0)))
    }

    /// The direction that a pixel sees, a unit vector in camera axes.
    pub(crate) fn direction_of(&self, [x, y]: [f64; 2]) -> Vector3<f64> {
        let Camera {
            focal_length_px,
            center_px,
            radial,
            mirrored,
            ..
        } = &self.camera;
        let hand = 1.0 - 2.0 * f64::from(*mirrored);
        let [u, v] = [
            hand * (x - center_px[0]) / focal_length_px,
            (y - center_px[1]) / focal_length_px,
        ];
        let seen = libm::hypot(u, v);
        let mut ideal = seen;
        for _ in 0..UNDO_STEPS {
            let (stretch, slope) = stretch(radial, ideal);
            ideal -= (ideal * stretch - seen) / slope;
        }
        let factor = if seen > 0.0 { ideal / seen } else { 1.0 };
        Vector3::new(u * factor, v * factor, 1.0).normalize()
    }

    /// Where a direction is seen, within a border of `margin_px` around the frame; `None` outside of it.
    pub(crate) fn pixel_of(&self, direction: &Vector3<f64>, margin_px: f64) -> Option<[f64; 2]> {
        let Camera {
            width_px,
            height_px,
            focal_length_px,
            center_px,
            radial,
            mirrored,
        } = &self.camera;
        if direction.z <= 0.0 {
            return None;
        }
        let [u, v] = [direction.x / direction.z, direction.y / direction.z];
        let ideal = libm::hypot(u, v);
        if ideal > self.reach_tan {
            return None;
        }
        let (stretch, _) = stretch(radial, ideal);
        let hand = 1.0 - 2.0 * f64::from(*mirrored);
        let pixel = [
            center_px[0] + hand * u * stretch * focal_length_px,
            center_px[1] + v * stretch * focal_length_px,
        ];
        let sides = [*width_px, *height_px].map(f64::from);
        let inside =
            |axis: usize| (-0.5 - margin_px..sides[axis] - 0.5 + margin_px).contains(&pixel[axis]);
        (inside(0) && inside(1)).then_some(pixel)
    }
}

/// The tangent at which the distorted radius is `seen`, and 1 % more; `None` where the distorted radius does not grow
/// all the way.
fn reach(radial: &[f64; 3], seen: f64) -> Option<f64> {
    let grows = |ideal: f64| stretch(radial, ideal).1 > 0.05;
    let distorted = |ideal: f64| ideal * stretch(radial, ideal).0;
    let mut outer = 0.01 * seen;
    while distorted(outer) < seen {
        outer *= 1.05;
        if outer > MAX_RADIUS_TAN || !grows(outer) {
            return None;
        }
    }
    let reach = 1.01 * outer;
    let all = (0..=CHECKED).all(|step| grows(reach * f64::from(step) / f64::from(CHECKED)));
    all.then_some(reach)
}

/// Distorted over ideal radius, and the derivative of the distorted radius.
fn stretch(radial: &[f64; 3], ideal: f64) -> (f64, f64) {
    let square = ideal * ideal;
    let [a, b, c] = radial;
    let value = 1.0 + square * (a + square * (b + square * c));
    let slope = 1.0 + square * (3.0 * a + square * (5.0 * b + square * 7.0 * c));
    (value, slope)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn camera() -> Camera {
        Camera {
            width_px: 1024,
            height_px: 768,
            focal_length_px: 3000.0,
            center_px: [520.0, 371.0],
            radial: [-0.2, 0.1, 0.0],
            mirrored: 0,
        }
    }

    proptest! {
        #[test]
        fn pixels_are_seen_where_they_look(x in -0.4..1023.4, y in -0.4..767.4, a in -0.4..0.6, mirrored in 0_u32..2) {
            let lens = Lens::new(Camera { radial: [a, 0.1, 0.0], mirrored, ..camera() }).unwrap();
            let [back_x, back_y] = lens.pixel_of(&lens.direction_of([x, y]), 0.0).unwrap();
            prop_assert!((back_x - x).abs() < 1e-9 && (back_y - y).abs() < 1e-9);
        }
    }

    #[test]
    fn a_lens_that_folds_the_sky_is_refused() {
        let folded = Camera {
            focal_length_px: 600.0,
            radial: [-0.5, 0.0, 0.0],
            ..camera()
        };
        assert_eq!(Lens::new(folded).unwrap_err(), Error::Lens);
        assert_eq!(
            Lens::new(Camera {
                focal_length_px: f64::NAN,
                ..camera()
            })
            .unwrap_err(),
            Error::Config
        );
        assert_eq!(
            Lens::new(Camera {
                width_px: 0,
                ..camera()
            })
            .unwrap_err(),
            Error::Config
        );
    }

    #[test]
    fn what_is_behind_or_far_outside_is_not_seen() {
        let lens = Lens::new(camera()).unwrap();
        assert_eq!(lens.pixel_of(&Vector3::new(0.0, 0.0, -1.0), 0.0), None);
        assert_eq!(
            lens.pixel_of(&Vector3::new(1.0, 0.0, 0.2).normalize(), 0.0),
            None
        );
        let corner = lens.direction_of([0.0, 0.0]);
        assert!((lens.radius_rad - lens.middle().angle(&corner)).abs() < 2e-3);
    }
}
