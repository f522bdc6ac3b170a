//! Transforms ICRS directions to axes fixed to the Earth: precession, nutation, aberration,
//! rotation.
//!
//! Caveats: UT1 is assumed equal to UTC; they differ by less than 0.9 s, 13″ in right ascension.
//! Frame bias (0.02″), polar motion (0.3″), diurnal aberration (0.3″) and the smaller terms of
//! nutation (0.5″) are neglected.

use crate::base::coords::{Icrs, UnitVector};
use crate::base::units::{RAD_PER_ARCSEC, RAD_PER_DEG};
use nalgebra::{Matrix3, Rotation3, Vector3};
use std::f64::consts::TAU;

const DAYS_PER_JULIAN_YEAR: f64 = 365.25;

/// The apparent direction of a star at `icrs`, `years` Julian years after J2000.0, in axes fixed to
/// the Earth: x to longitude 0 on the equator, y to 90° east, z to the north pole.
pub(super) fn terrestrial(icrs: &UnitVector<Icrs>, years: f64) -> Vector3<f64> {
    let date = Date::new(years);
    let apparent = date.to_true_equator() * icrs.as_vector() + date.aberration();
    about_z(date.sidereal_time_rad()) * apparent.normalize()
}

/// The ICRS axes' components of a vector that is given in axes fixed to the Earth, `years` Julian
/// years after J2000.0.
pub(super) fn icrs(terrestrial: &Vector3<f64>, years: f64) -> Vector3<f64> {
    let date = Date::new(years);
    let to_terrestrial = about_z(date.sidereal_time_rad()) * date.to_true_equator();
    to_terrestrial.tr_mul(terrestrial)
}

/// A date in Julian centuries since J2000.0, and the orientation of the Earth's axis then.
struct Date {
    centuries: f64,
    /// Nutation in longitude and in obliquity, in radians.
    nutation_rad: [f64; 2],
    mean_obliquity_rad: f64,
}

/// c0 + c1 t + c2 t² + ...
fn polynomial(t: f64, coefficients: &[f64]) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, c| sum * t + c)
}

/// Rotates the axes by `angle_rad` about x, that is, vectors by −`angle_rad`.
fn about_x(angle_rad: f64) -> Matrix3<f64> {
    *Rotation3::from_axis_angle(&Vector3::x_axis(), -angle_rad).matrix()
}

/// Rotates the axes by `angle_rad` about z.
fn about_z(angle_rad: f64) -> Matrix3<f64> {
    *Rotation3::from_axis_angle(&Vector3::z_axis(), -angle_rad).matrix()
}

impl Date {
    fn new(years: f64) -> Self {
        let t = years / 100.0;
        let deg = |c: [f64; 2]| polynomial(t, &c) * RAD_PER_DEG;
        let node = deg([125.044_52, -1_934.136_261]);
        let sun = deg([280.4665, 36_000.769_8]);
        let moon = deg([218.3165, 481_267.881_3]);
        // Meeus 1998, Astronomical Algorithms, chapter 22: within 0.5″ and 0.1″.
        let longitude_arcsec =
            -17.20 * node.sin() - 1.32 * (2.0 * sun).sin() - 0.23 * (2.0 * moon).sin()
                + 0.21 * (2.0 * node).sin();
        let obliquity_arcsec =
            9.20 * node.cos() + 0.57 * (2.0 * sun).cos() + 0.10 * (2.0 * moon).cos()
                - 0.09 * (2.0 * node).cos();
        Self {
            centuries: t,
            nutation_rad: [longitude_arcsec, obliquity_arcsec].map(|a| a * RAD_PER_ARCSEC),
            mean_obliquity_rad: polynomial(t, &[84_381.406, -46.836_769, -0.000_183_1])
                * RAD_PER_ARCSEC,
        }
    }

    /// Precession and nutation: from ICRS to the true equator and equinox of the date.
    fn to_true_equator(&self) -> Matrix3<f64> {
        let [longitude, obliquity] = self.nutation_rad;
        let nutation = about_x(-(self.mean_obliquity_rad + obliquity))
            * about_z(-longitude)
            * about_x(self.mean_obliquity_rad);
        nutation * self.precession()
    }

    /// Precession (IAU 2006): from ICRS to the mean equator and equinox of the date.
    ///
    /// # Reference
    /// Capitaine, Wallace & Chapront 2003, A&A 412, 567, eq. 37 (ψ_A), 39 (ω_A and χ_A), with their
    /// ε₀; the rotations are eq. 38.
    fn precession(&self) -> Matrix3<f64> {
        const OBLIQUITY_J2000_ARCSEC: f64 = 84_381.406;
        let arcsec = |c: &[f64]| polynomial(self.centuries, c) * RAD_PER_ARCSEC;
        let psi = arcsec(&[0.0, 5_038.481_507, -1.079_006_9, -0.001_140_45]);
        let omega = arcsec(&[
            OBLIQUITY_J2000_ARCSEC,
            -0.025_754,
            0.051_262_3,
            -0.007_725_03,
        ]);
        let chi = arcsec(&[0.0, 10.556_403, -2.381_429_2, -0.001_211_97]);
        let obliquity_j2000 = OBLIQUITY_J2000_ARCSEC * RAD_PER_ARCSEC;
        about_z(chi) * about_x(-omega) * about_z(-psi) * about_x(obliquity_j2000)
    }

    /// The Earth's velocity in units of the speed of light, in the axes of the true equator and
    /// equinox of the date.
    ///
    /// # Reference
    /// Meeus 1998, chapters 23 (the constant) and 25 (the Sun's longitude, the Earth's eccentricity
    /// and perihelion).
    fn aberration(&self) -> Vector3<f64> {
        const CONSTANT_RAD: f64 = 20.495_52 * RAD_PER_ARCSEC;
        let t = self.centuries;
        let anomaly = polynomial(t, &[357.529_11, 35_999.050_29]) * RAD_PER_DEG;
        let centre_deg = 1.9146 * anomaly.sin() + 0.02 * (2.0 * anomaly).sin();
        let sun = (polynomial(t, &[280.466_46, 36_000.769_83]) + centre_deg) * RAD_PER_DEG;
        let eccentricity = 0.016_708_634 - 0.000_042_037 * t;
        let perihelion = polynomial(t, &[102.937_35, 1.719_46]) * RAD_PER_DEG;
        let ecliptic = Vector3::new(
            sun.sin() - eccentricity * perihelion.sin(),
            -sun.cos() + eccentricity * perihelion.cos(),
            0.0,
        );
        about_x(-self.mean_obliquity_rad) * ecliptic * CONSTANT_RAD
    }

    /// Greenwich apparent sidereal time in radians.
    ///
    /// # Reference
    /// IERS Conventions 2010, eq. 5.15 (Earth rotation angle) and 5.32 (IAU 2006 sidereal time).
    fn sidereal_time_rad(&self) -> f64 {
        let days = self.centuries * 100.0 * DAYS_PER_JULIAN_YEAR;
        // Whole turns are removed first, to keep digits.
        let turns = 0.779_057_273_264 + 0.002_737_811_911_354_48 * days + days.rem_euclid(1.0);
        let precession_arcsec =
            polynomial(self.centuries, &[0.014_506, 4_612.156_534, 1.391_581_7]);
        let equinoxes_rad = self.nutation_rad[0] * self.mean_obliquity_rad.cos();
        turns.rem_euclid(1.0) * TAU + precession_arcsec * RAD_PER_ARCSEC + equinoxes_rad
    }
}

/// Compared with `sofars`, a translation of the IAU's SOFA library.
#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::units::ARCSEC_PER_RAD;
    use sofars::eph::epv00;
    use sofars::erst::gst06a;
    use sofars::pnp;

    const J2000_JD: f64 = 2_451_545.0;
    /// Terms of fourth order and above are neglected: up to 0.00017″ t⁴, which is 0.014″ after
    /// three centuries, in angles that partly cancel.
    const PRECESSION_ARCSEC: f64 = 0.01;
    /// Smaller terms of nutation (0.5″ in longitude, 0.1″ in obliquity) and the frame bias (0.02″).
    const NUTATION_ARCSEC: f64 = 0.6;
    /// The Earth's orbit is assumed to be an ellipse about the Sun. The Sun moves about the
    /// barycentre with up to 16 m/s (0.011″), the Earth about that with the Moon with 12 m/s
    /// (0.009″).
    const ABERRATION_ARCSEC: f64 = 0.03;

    /// Every 97 days from `years` before J2000.0 to `years` after it.
    fn dates(years: f64) -> impl Iterator<Item = (f64, Date)> {
        let last = (years * DAYS_PER_JULIAN_YEAR / 97.0) as i32;
        (-last..=last).map(|i| {
            let days = f64::from(i) * 97.0 + 0.3;
            (days, Date::new(days / DAYS_PER_JULIAN_YEAR))
        })
    }

    fn matrix(rows: [[f64; 3]; 3]) -> Matrix3<f64> {
        Matrix3::from_fn(|row, column| rows[row][column])
    }

    /// The angle by which two rotations differ.
    fn difference_arcsec(a: &Matrix3<f64>, b: &Matrix3<f64>) -> f64 {
        // The norm of the difference is 2√2 sin(angle/2).
        (a - b).norm() / std::f64::consts::SQRT_2 * ARCSEC_PER_RAD
    }

    fn worst(differences: impl Iterator<Item = f64>) -> f64 {
        differences.fold(0.0, f64::max)
    }

    #[test]
    fn precession_over_six_centuries_is_that_of_sofa() {
        let worst = worst(dates(300.0).map(|(days, date)| {
            let (_, precession, _) = pnp::bp06(J2000_JD, days);
            difference_arcsec(&date.precession(), &matrix(precession))
        }));
        println!("largest difference: {worst:.4} arcsec");
        assert!(worst < PRECESSION_ARCSEC, "{worst}");
    }

    #[test]
    fn nutation_over_six_centuries_is_that_of_sofa() {
        let worst = worst(dates(300.0).map(|(days, date)| {
            let expected = matrix(pnp::pnm06a(J2000_JD, days));
            difference_arcsec(&date.to_true_equator(), &expected)
        }));
        println!("largest difference: {worst:.4} arcsec");
        assert!(worst < NUTATION_ARCSEC, "{worst}");
    }

    #[test]
    fn sidereal_time_over_six_centuries_is_that_of_sofa() {
        let worst = worst(dates(300.0).map(|(days, date)| {
            let expected = gst06a(J2000_JD, days, J2000_JD, days);
            let off = (date.sidereal_time_rad() - expected).rem_euclid(TAU);
            off.min(TAU - off) * ARCSEC_PER_RAD
        }));
        println!("largest difference: {worst:.4} arcsec");
        assert!(worst < NUTATION_ARCSEC, "{worst}");
    }

    #[test]
    fn aberration_over_two_centuries_is_that_of_sofa() {
        const LIGHT_AU_A_DAY: f64 = 173.144_632_67;
        let worst = worst(dates(100.0).map(|(days, date)| {
            let (_, [_, velocity]) = epv00(J2000_JD, days).unwrap();
            let expected = date.to_true_equator() * Vector3::from(velocity) / LIGHT_AU_A_DAY;
            (date.aberration() - expected).norm() * ARCSEC_PER_RAD
        }));
        println!("largest difference: {worst:.4} arcsec");
        assert!(worst < ABERRATION_ARCSEC, "{worst}");
    }
}
