//! Coordinate systems: directions on the sky and in the camera, rotations between them, pixels.
//!
//! Conventions: directions are unit vectors; [`Icrs`] is right-handed with x to RA 0, Dec 0 and z
//! to the north pole; [`Camera`] has x along image x (right), y along image y (down), z out along
//! the boresight. Angles are in radians. Pixels: x right, y down; (0, 0) is the **centre** of the
//! top-left pixel.
//!
//! Trigonometric functions come from [`libm`], which gives the same bits on every machine:
//! simulated frames and their headers depend on it.
//!
//! A direction carries its system in its type, so mixing two systems does not compile:
//!
//! ```compile_fail
//! use starpipe::base::coords::{Camera, Icrs, UnitVector};
//! let star: UnitVector<Icrs> = UnitVector::from_ra_dec(1.0, 0.5);
//! let boresight: UnitVector<Camera> = UnitVector::BORESIGHT;
//! star.angle_to(&boresight);
//! ```

use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};
use std::fmt;
use std::marker::PhantomData;

/// The International Celestial Reference System.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Icrs;

/// The camera's axes: x right and y down in the image, z out along the boresight.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Camera;

/// The sky of a site: x to the east, y to the north, z to the zenith.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Horizon;

/// A position in the image, in pixels; (0, 0) is the centre of the top-left pixel, y runs down.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PixelPoint {
    /// To the right, in pixels.
    pub x: f64,
    /// Downward, in pixels.
    pub y: f64,
}

impl PixelPoint {
    /// The point at column `x`, row `y`, in pixels.
    pub const fn new(x: f64, y: f64) -> Self {
        Self { x, y }
    }

    /// The distance to `other`, in pixels.
    pub fn distance_to(&self, other: &Self) -> f64 {
        ((self.x - other.x).powi(2) + (self.y - other.y).powi(2)).sqrt()
    }
}

/// A direction in the coordinate system `S`.
pub struct UnitVector<S> {
    vector: Vector3<f64>,
    system: PhantomData<S>,
}

// Derived impls would require `S: Clone` and so on, although `S` is only a marker.
impl<S> Clone for UnitVector<S> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<S> Copy for UnitVector<S> {}
impl<S> PartialEq for UnitVector<S> {
    fn eq(&self, other: &Self) -> bool {
        self.vector == other.vector
    }
}
impl<S> fmt::Debug for UnitVector<S> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let v = &self.vector;
        write!(f, "[{}, {}, {}]", v.x, v.y, v.z)
    }
}

impl<S> UnitVector<S> {
    /// The direction of `vector`, which need not be of unit length but must not be zero.
    pub fn from_vector(vector: Vector3<f64>) -> Self {
        Self::from_unit(vector.normalize())
    }

    /// The direction of `vector`, whose length must be one.
    pub const fn from_unit(vector: Vector3<f64>) -> Self {
        Self {
            vector,
            system: PhantomData,
        }
    }

    /// The components.
    pub fn as_vector(&self) -> &Vector3<f64> {
        &self.vector
    }

    /// The cosine of the angle to `other`.
    pub fn dot(&self, other: &Self) -> f64 {
        self.vector.dot(&other.vector)
    }

    /// The angle to `other` in radians, accurate for small and for large angles.
    pub fn angle_to(&self, other: &Self) -> f64 {
        let sine = self.vector.cross(&other.vector).norm();
        libm::atan2(sine, self.dot(other))
    }
}

impl UnitVector<Icrs> {
    /// The direction at right ascension `ra_rad` and declination `dec_rad`.
    pub fn from_ra_dec(ra_rad: f64, dec_rad: f64) -> Self {
        let (sin_ra, cos_ra) = libm::sincos(ra_rad);
        let (sin_dec, cos_dec) = libm::sincos(dec_rad);
        Self::from_unit(Vector3::new(cos_dec * cos_ra, cos_dec * sin_ra, sin_dec))
    }

    /// Right ascension in [0, 2π) and declination, in radians.
    pub fn to_ra_dec(&self) -> (f64, f64) {
        let v = &self.vector;
        let ra_rad = libm::atan2(v.y, v.x).rem_euclid(std::f64::consts::TAU);
        (ra_rad, libm::atan2(v.z, libm::hypot(v.x, v.y)))
    }

    /// The unit tangents towards east and north at this direction (towards RA 90° at the poles).
    pub fn east_north(&self) -> (Vector3<f64>, Vector3<f64>) {
        let (ra_rad, dec_rad) = self.to_ra_dec();
        let (sin_ra, cos_ra) = libm::sincos(ra_rad);
        let (sin_dec, cos_dec) = libm::sincos(dec_rad);
        (
            Vector3::new(-sin_ra, cos_ra, 0.0),
            Vector3::new(-sin_dec * cos_ra, -sin_dec * sin_ra, cos_dec),
        )
    }
}

impl UnitVector<Camera> {
    /// The camera's optical axis.
    pub const BORESIGHT: Self = Self {
        vector: Vector3::new(0.0, 0.0, 1.0),
        system: PhantomData,
    };
}

/// A proper rotation that converts directions from the system `From` to the system `To`.
pub struct Rotation<From, To> {
    rotation: Rotation3<f64>,
    systems: PhantomData<(From, To)>,
}

impl<A, B> Clone for Rotation<A, B> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<A, B> Copy for Rotation<A, B> {}
impl<A, B> PartialEq for Rotation<A, B> {
    fn eq(&self, other: &Self) -> bool {
        self.rotation == other.rotation
    }
}
impl<A, B> fmt::Debug for Rotation<A, B> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "quaternion {:?}", self.to_quaternion())
    }
}

impl<A, B> Rotation<A, B> {
    /// The rotation with this matrix, which must be orthonormal with determinant +1.
    pub fn from_matrix(matrix: Matrix3<f64>) -> Self {
        Self {
            rotation: Rotation3::from_matrix_unchecked(matrix),
            systems: PhantomData,
        }
    }

    /// The matrix: `to = matrix * from`.
    pub fn matrix(&self) -> &Matrix3<f64> {
        self.rotation.matrix()
    }

    /// The rotation with the quaternion [w, x, y, z], which is normalised and must not be zero.
    pub fn from_quaternion([w, x, y, z]: [f64; 4]) -> Self {
        let quaternion = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
        Self {
            rotation: quaternion.to_rotation_matrix(),
            systems: PhantomData,
        }
    }

    /// The quaternion [w, x, y, z], unit, w ≥ 0, such that `to = q · from · q*`.
    pub fn to_quaternion(&self) -> [f64; 4] {
        let q = UnitQuaternion::from_rotation_matrix(&self.rotation);
        let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
        [q.w * sign, q.i * sign, q.j * sign, q.k * sign]
    }

    /// Converts `direction` from the system `A` to the system `B`.
    pub fn apply(&self, direction: &UnitVector<A>) -> UnitVector<B> {
        UnitVector::from_unit(self.rotation * direction.vector)
    }

    /// The inverse rotation.
    pub fn inverse(&self) -> Rotation<B, A> {
        Rotation {
            rotation: self.rotation.inverse(),
            systems: PhantomData,
        }
    }

    /// This rotation followed by a rotation by the vector `vector_rad` about the axes of `B`.
    pub fn then_turn(&self, vector_rad: Vector3<f64>) -> Self {
        Self {
            rotation: Rotation3::new(vector_rad) * self.rotation,
            systems: PhantomData,
        }
    }

    /// The angle in radians by which the two rotations differ.
    pub fn angle_to(&self, other: &Self) -> f64 {
        let difference = (self.matrix() - other.matrix()).norm();
        2.0 * libm::asin((difference / 8f64.sqrt()).min(1.0))
    }
}

/// The rotation vector of a matrix that turns by a small angle, in radians: to second order in the angle.
pub(crate) fn small_turn_rad(matrix: &Matrix3<f64>) -> Vector3<f64> {
    let half = (matrix - matrix.transpose()) * 0.5;
    Vector3::new(half[(2, 1)], half[(0, 2)], half[(1, 0)])
}

impl Rotation<Icrs, Camera> {
    /// The attitude of a camera with this boresight, whose image-up (−y) has the position angle
    /// `up_pa_rad`, from north through east.
    pub fn looking_at(boresight: &UnitVector<Icrs>, up_pa_rad: f64) -> Self {
        let (east, north) = boresight.east_north();
        let (sin_pa, cos_pa) = libm::sincos(up_pa_rad);
        let down = -(north * cos_pa + east * sin_pa);
        let right = down.cross(boresight.as_vector());
        Self::from_matrix(Matrix3::from_rows(&[
            right.transpose(),
            down.transpose(),
            boresight.as_vector().transpose(),
        ]))
    }

    /// The boresight.
    pub fn boresight(&self) -> UnitVector<Icrs> {
        self.inverse().apply(&UnitVector::BORESIGHT)
    }

    /// The attitude after the shortest turn that brings the boresight to this direction.
    pub fn turned_to(&self, boresight: &UnitVector<Icrs>) -> Self {
        let before = self.boresight();
        let normal = boresight.as_vector().cross(before.as_vector());
        let sine = normal.norm();
        if sine == 0.0 {
            return *self;
        }
        let turn = Rotation3::new(normal * (boresight.angle_to(&before) / sine));
        Self::from_matrix(self.matrix() * turn.matrix())
    }

    /// The boresight, and the position angle of image-up (−y) there in radians, in (−π, π].
    pub fn boresight_and_up(&self) -> (UnitVector<Icrs>, f64) {
        let boresight = self.boresight();
        let (east, north) = boresight.east_north();
        let up = -self.matrix().row(1).transpose();
        (boresight, libm::atan2(up.dot(&east), up.dot(&north)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::units::RAD_PER_DEG;

    const ANGLE_TOLERANCE_RAD: f64 = 1e-12;

    #[test]
    fn looking_north_with_image_up_to_the_pole_has_east_on_the_left() {
        let centre = UnitVector::from_ra_dec(0.0, 0.0);
        let attitude = Rotation::looking_at(&centre, 0.0);
        let north = attitude.apply(&UnitVector::from_ra_dec(0.0, 0.01));
        let east = attitude.apply(&UnitVector::from_ra_dec(0.01, 0.0));
        assert!(north.as_vector().y < -0.009, "north is up: {north:?}");
        assert!(east.as_vector().x < -0.009, "east is left: {east:?}");
    }

    #[test]
    fn attitude_round_trips_through_pointing_and_quaternion() {
        for (ra_deg, dec_deg, up_deg) in [
            (10.0, 20.0, 30.0),
            (359.0, -89.9, -170.0),
            (180.0, 90.0, 0.0),
        ] {
            let centre = UnitVector::from_ra_dec(ra_deg * RAD_PER_DEG, dec_deg * RAD_PER_DEG);
            let attitude = Rotation::looking_at(&centre, up_deg * RAD_PER_DEG);
            let (boresight, up_pa_rad) = attitude.boresight_and_up();
            assert!(boresight.angle_to(&centre) < ANGLE_TOLERANCE_RAD);
            assert!((up_pa_rad - up_deg * RAD_PER_DEG).abs() < ANGLE_TOLERANCE_RAD);
            let same = Rotation::from_quaternion(attitude.to_quaternion());
            assert!(attitude.angle_to(&same) < 1e-7);
            assert!((attitude.matrix().determinant() - 1.0).abs() < 1e-12);
        }
    }
}
