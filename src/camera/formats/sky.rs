//! RMS's sky: precession, sidereal time and refraction as RMS has them.
//!
//! RMS knows the directions of stars in the axes of J2000 and lifts them by refraction; aberration and
//! nutation it leaves out (newer versions have nutation: up to 17″). The reference direction of a plate is
//! in the axes of the date, and its refraction is looked up after these have been precessed once more: at an
//! altitude that is off by up to 0.4°, which moves the direction itself by nothing, as the same is done
//! when the file is used.
//!
//! # References
//! - Precession: Meeus 1998, Astronomical Algorithms, p. 134 (IAU 1976)
//! - Sidereal time: the same, eq. 12.4
//! - Refraction: Sæmundsson 1986, Sky & Telescope 72, 70

use crate::base::coords::{Icrs, UnitVector};
use crate::base::units::{DEG_PER_RAD, RAD_PER_ARCSEC, RAD_PER_DEG};
use nalgebra::{Matrix3, Vector3};

/// The sky of a site at a date.
#[derive(Debug, Clone)]
pub(super) struct RmsSky {
    /// From the axes of J2000 to those of the date.
    pub(super) to_date: Matrix3<f64>,
    /// In the axes of the date.
    zenith: Vector3<f64>,
    is_refracted: bool,
}

impl RmsSky {
    pub(super) fn new(julian_date: f64, lat_deg: f64, lon_deg: f64, is_refracted: bool) -> Self {
        let turn_rad = (sidereal_time_deg(julian_date) + lon_deg) * RAD_PER_DEG;
        let zenith = UnitVector::from_ra_dec(turn_rad, lat_deg * RAD_PER_DEG);
        Self {
            to_date: precession(julian_date),
            zenith: *zenith.as_vector(),
            is_refracted,
        }
    }

    /// From the axes of J2000 to those of the horizon: east, north, up.
    pub(super) fn to_horizon(&self) -> Matrix3<f64> {
        let east = Vector3::z().cross(&self.zenith).normalize();
        let north = self.zenith.cross(&east);
        let rows = [east, north, self.zenith].map(|axis| axis.transpose());
        Matrix3::from_rows(&rows) * self.to_date
    }

    /// Altitude and azimuth, from north through east, of a direction in the axes of the date.
    pub(super) fn altitude_azimuth_rad(&self, direction: &Vector3<f64>) -> [f64; 2] {
        let up = self.zenith.dot(direction);
        let east = Vector3::z().cross(&self.zenith);
        let north = self.zenith.cross(&east);
        let (along_east, along_north) = (east.dot(direction), north.dot(direction));
        let level = (direction - self.zenith * up).norm();
        [
            libm::atan2(up, level),
            libm::atan2(along_east, along_north).rem_euclid(std::f64::consts::TAU),
        ]
    }

    /// Where a direction in the axes of the date appears.
    pub(super) fn refracted(&self, direction: &Vector3<f64>) -> Vector3<f64> {
        let up = self.zenith.dot(direction);
        let level = self.zenith - direction * up;
        if !self.is_refracted || level.norm() == 0.0 {
            return *direction;
        }
        let altitude_rad = libm::atan2(up, level.norm());
        let (sin, cos) = libm::sincos(refraction_rad(altitude_rad));
        direction * cos + level.normalize() * sin
    }

    /// The inverse of [`Self::refracted`].
    pub(super) fn unrefracted(&self, apparent: &Vector3<f64>) -> Vector3<f64> {
        let mut direction = *apparent;
        for _ in 0..30 {
            direction = (direction + apparent - self.refracted(&direction)).normalize();
        }
        direction
    }

    /// Where a catalogue direction appears, in the axes of J2000.
    pub(super) fn apparent(&self, direction: &UnitVector<Icrs>) -> UnitVector<Icrs> {
        let of_date = self.to_date * direction.as_vector();
        UnitVector::from_vector(self.to_date.tr_mul(&self.refracted(&of_date)))
    }

    /// The inverse of [`Self::apparent`].
    pub(super) fn true_direction(&self, apparent: &UnitVector<Icrs>) -> UnitVector<Icrs> {
        let of_date = self.to_date * apparent.as_vector();
        UnitVector::from_vector(self.to_date.tr_mul(&self.unrefracted(&of_date)))
    }
}

/// Mean sidereal time at Greenwich, in degrees from 0 to 360.
pub(super) fn sidereal_time_deg(julian_date: f64) -> f64 {
    let days = julian_date - 2_451_545.0;
    let t = days / 36_525.0;
    let degrees = 280.460_618_37 + 360.985_647_366_29 * days + 0.000_387_933 * t * t
        - t * t * t / 38_710_000.0;
    degrees.rem_euclid(360.0)
}

/// From the axes of J2000 to those of a date.
fn precession(julian_date: f64) -> Matrix3<f64> {
    let t = (julian_date - 2_451_545.0) / 36_525.0;
    let arcsec = |a: f64, b: f64, c: f64| t * (a + t * (b + t * c)) * RAD_PER_ARCSEC;
    let (sin_zeta, cos_zeta) = libm::sincos(arcsec(2306.2181, 0.301_88, 0.017_998));
    let (sin_z, cos_z) = libm::sincos(arcsec(2306.2181, 1.094_68, 0.018_203));
    let (sin_theta, cos_theta) = libm::sincos(arcsec(2004.3109, -0.426_65, -0.041_833));
    let about_z = |sin: f64, cos: f64| Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0);
    let about_y = Matrix3::new(
        cos_theta, 0.0, -sin_theta, 0.0, 1.0, 0.0, sin_theta, 0.0, cos_theta,
    );
    about_z(sin_z, cos_z) * about_y * about_z(sin_zeta, cos_zeta)
}

/// Refraction at a true altitude; below −0.5° it stays as it is there.
fn refraction_rad(altitude_rad: f64) -> f64 {
    let altitude_deg = (altitude_rad * DEG_PER_RAD).max(-0.5);
    let bent_rad = (altitude_deg + 10.3 / (altitude_deg + 5.11)) * RAD_PER_DEG;
    1.02 / (60.0 * libm::tan(bent_rad)) * RAD_PER_DEG
}
