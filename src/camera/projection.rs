//! Ideal lenses: how far from its axis a lens images a direction.

use crate::base::coords::{Camera, UnitVector};
use nalgebra::Vector3;
use std::f64::consts::{FRAC_PI_2, PI};

/// The ideal lens that a real one comes closest to.
///
/// A direction at the angle θ from the axis is imaged at a distance from the axis that is
/// [`radius`](Self::radius) times the focal length.
///
/// # Reference
/// Kannala & Brandt 2006, IEEE Trans. PAMI 28, 1335, eqs. (1) to (5).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
#[non_exhaustive]
pub enum Projection {
    /// tan θ, the pinhole: ordinary lenses.
    #[default]
    Pinhole,
    /// θ: most all-sky lenses.
    Equidistant,
    /// 2 sin(θ/2): equal areas.
    Equisolid,
    /// 2 tan(θ/2): circles stay circles.
    Stereographic,
    /// sin θ.
    Orthographic,
}

/// The image of a direction in units of the focal length, and its derivatives.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Projected {
    /// Along the camera's x and y axes.
    pub at: [f64; 2],
    /// Derivatives of each coordinate by small turns of the camera about its x, y and z axes.
    pub by_turn: [[f64; 3]; 2],
}

impl Projection {
    /// All projections.
    pub const ALL: [Self; 5] = [
        Self::Pinhole,
        Self::Equidistant,
        Self::Equisolid,
        Self::Stereographic,
        Self::Orthographic,
    ];

    /// Name, as in reports and files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Pinhole => "pinhole",
            Self::Equidistant => "equidistant",
            Self::Equisolid => "equisolid",
            Self::Stereographic => "stereographic",
            Self::Orthographic => "orthographic",
        }
    }

    /// The projection called `name`.
    pub fn named(name: &str) -> Option<Self> {
        let mut all = Self::ALL.into_iter();
        all.find(|projection| projection.name() == name)
    }

    /// The coefficient of θ³ in the radius by powers of θ.
    const fn third_order(self) -> f64 {
        match self {
            Self::Pinhole => 1.0 / 3.0,
            Self::Equidistant => 0.0,
            Self::Equisolid => -1.0 / 24.0,
            Self::Stereographic => 1.0 / 12.0,
            Self::Orthographic => -1.0 / 6.0,
        }
    }

    /// The coefficient of r³ by which a lens of this projection must be distorted to be like one of
    /// `other` to the third order, with radii in units of the focal length.
    pub(crate) const fn third_order_to(self, other: Self) -> f64 {
        other.third_order() - self.third_order()
    }

    /// The angle from the axis, in radians, below which directions are imaged.
    pub const fn max_angle_rad(self) -> f64 {
        match self {
            Self::Pinhole | Self::Orthographic => FRAC_PI_2,
            Self::Equidistant | Self::Equisolid | Self::Stereographic => PI,
        }
    }

    /// Distance from the axis in units of the focal length, of what is at `angle_rad` from it.
    pub fn radius(self, angle_rad: f64) -> f64 {
        match self {
            Self::Pinhole => libm::tan(angle_rad),
            Self::Equidistant => angle_rad,
            Self::Equisolid => 2.0 * libm::sin(0.5 * angle_rad),
            Self::Stereographic => 2.0 * libm::tan(0.5 * angle_rad),
            Self::Orthographic => libm::sin(angle_rad),
        }
    }

    /// The angle from the axis, in radians, of what is imaged at a distance from it in units of the
    /// focal length. `None` where nothing is.
    pub fn angle_rad(self, radius: f64) -> Option<f64> {
        let angle_rad = match self {
            Self::Pinhole => libm::atan(radius),
            Self::Equidistant => radius,
            Self::Equisolid => 2.0 * libm::asin(0.5 * radius),
            Self::Stereographic => 2.0 * libm::atan(0.5 * radius),
            Self::Orthographic => libm::asin(radius),
        };
        // NaN where the sine would be above 1.
        (angle_rad < self.max_angle_rad()).then_some(angle_rad)
    }

    /// The image of `direction` in units of the focal length. `None` where it has none.
    #[inline]
    pub fn image_of(self, direction: &UnitVector<Camera>) -> Option<[f64; 2]> {
        let d = direction.as_vector();
        let [stretch, _] = self.stretch(d.z)?;
        Some([stretch * d.x, stretch * d.y])
    }

    /// [`Self::image_of`], with its derivatives.
    #[inline]
    pub(crate) fn project(self, direction: &UnitVector<Camera>) -> Option<Projected> {
        let d = direction.as_vector();
        let [stretch, by_z] = self.stretch(d.z)?;
        // A turn ω moves the direction by ω × d.
        let moved = [[0.0, d.z, -d.y], [-d.z, 0.0, d.x], [d.y, -d.x, 0.0]];
        let by_turn = |axis: usize| {
            let along = [d.x, d.y][axis] * by_z;
            std::array::from_fn(|turn| stretch * moved[axis][turn] + along * moved[2][turn])
        };
        Some(Projected {
            at: [stretch * d.x, stretch * d.y],
            by_turn: [by_turn(0), by_turn(1)],
        })
    }

    /// The direction that is imaged at `at`, in units of the focal length.
    #[inline]
    pub fn direction_at(self, [x, y]: [f64; 2]) -> Option<UnitVector<Camera>> {
        if self == Self::Pinhole {
            return Some(UnitVector::from_vector(Vector3::new(x, y, 1.0)));
        }
        let radius = libm::hypot(x, y);
        let angle_rad = self.angle_rad(radius)?;
        let (sin, cos) = libm::sincos(angle_rad);
        let shrink = if radius > 0.0 { sin / radius } else { 1.0 };
        Some(UnitVector::from_unit(Vector3::new(
            x * shrink,
            y * shrink,
            cos,
        )))
    }

    /// Radius over sin θ for a cosine of θ, and its derivative by the cosine.
    #[inline]
    fn stretch(self, cos: f64) -> Option<[f64; 2]> {
        /// Above this cosine the equidistant lens is expanded: errors are below 1e-16 there.
        const NEAR_AXIS: f64 = 1.0 - 1e-4;
        match self {
            Self::Pinhole => (cos > 0.0).then(|| [1.0 / cos, -1.0 / (cos * cos)]),
            Self::Orthographic => (cos > 0.0).then_some([1.0, 0.0]),
            Self::Equisolid => (cos > -1.0).then(|| {
                let stretch = (2.0 / (1.0 + cos)).sqrt();
                [stretch, -0.5 * stretch / (1.0 + cos)]
            }),
            Self::Stereographic => (cos > -1.0).then(|| {
                let half = 1.0 / (1.0 + cos);
                [2.0 * half, -2.0 * half * half]
            }),
            Self::Equidistant if cos > NEAR_AXIS => {
                // θ / sin θ by powers of 1 − cos θ.
                let e = 1.0 - cos;
                let stretch = 1.0 + e * (1.0 / 3.0 + e * (2.0 / 15.0 + e * (2.0 / 35.0)));
                let slope = 1.0 / 3.0 + e * (4.0 / 15.0 + e * (6.0 / 35.0));
                Some([stretch, -slope])
            }
            Self::Equidistant => (cos > -1.0).then(|| {
                let sin = ((1.0 - cos) * (1.0 + cos)).sqrt();
                let stretch = libm::acos(cos) / sin;
                [stretch, (cos * stretch - 1.0) / (sin * sin)]
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::coords::{Icrs, Rotation};

    fn at(angle_rad: f64, way_rad: f64) -> UnitVector<Camera> {
        let ((sin, cos), (sin_way, cos_way)) = (angle_rad.sin_cos(), way_rad.sin_cos());
        UnitVector::from_unit(Vector3::new(sin * cos_way, sin * sin_way, cos))
    }

    #[test]
    fn directions_are_found_again() {
        for projection in Projection::ALL {
            for step in 0..100 {
                let angle_rad = f64::from(step) / 100.0 * projection.max_angle_rad();
                let direction = at(angle_rad, 0.7 + f64::from(step));
                let [x, y] = projection.image_of(&direction).unwrap();
                let radius = projection.radius(angle_rad);
                assert!((x.hypot(y) - radius).abs() < 1e-11 * (1.0 + radius));
                let back = projection.direction_at([x, y]).unwrap();
                let off_rad = back.angle_to(&direction);
                assert!(off_rad < 1e-8, "{projection:?} {angle_rad} {off_rad}");
            }
            assert_eq!(Projection::named(projection.name()), Some(projection));
        }
    }

    #[test]
    fn nothing_is_imaged_beyond_the_largest_angle() {
        for projection in [Projection::Pinhole, Projection::Orthographic] {
            assert_eq!(projection.image_of(&at(1.6, 0.3)), None);
        }
        assert!(Projection::Stereographic.image_of(&at(3.0, 0.3)).is_some());
        assert_eq!(Projection::Orthographic.direction_at([0.9, 0.9]), None);
        assert_eq!(Projection::Equisolid.direction_at([2.0, 0.9]), None);
        assert_eq!(Projection::Equidistant.direction_at([3.0, 1.0]), None);
    }

    #[test]
    fn the_derivatives_are_those_of_small_turns() {
        const STEP_RAD: f64 = 1e-5;
        for projection in Projection::ALL {
            for angle_rad in [0.0, 1e-3, 0.0141, 0.0142, 0.3, 1.1, 1.5] {
                let direction = at(angle_rad, 2.3);
                let projected = projection.project(&direction).unwrap();
                for turn in 0..3 {
                    let turned = |by: f64| {
                        let mut vector = Vector3::zeros();
                        vector[turn] = by;
                        let identity = Rotation::<Icrs, Camera>::from_quaternion([1., 0., 0., 0.]);
                        let same = UnitVector::from_unit(*direction.as_vector());
                        let there = identity.then_turn(vector).apply(&same);
                        projection.image_of(&there).unwrap()
                    };
                    let (low, high) = (turned(-STEP_RAD), turned(STEP_RAD));
                    for axis in 0..2 {
                        let slope = (high[axis] - low[axis]) / (2.0 * STEP_RAD);
                        let found = projected.by_turn[axis][turn];
                        let off = (found - slope).abs() / (1.0 + slope.abs());
                        assert!(off < 1e-6, "{projection:?} {angle_rad} {found} {slope}");
                    }
                }
            }
        }
    }
}
