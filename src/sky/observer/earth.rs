//! Transforms ICRS directions to axes fixed to the Earth: precession, nutation, aberration,
//! rotation.
//!
//! Precession and nutation (IAU 2006/2000A) are those of `sofars`, a translation of the IAU's SOFA
//! library.
//!
//! Caveats: UT1 and terrestrial time are assumed equal to UTC; the first differs by less than 0.9 s,
//! 13″ in right ascension, the second moves nothing by more than 0.001″. Polar motion (0.3″) and
//! diurnal aberration (0.3″) are neglected.

use crate::base::coords::{Icrs, UnitVector};
use crate::base::units::{RAD_PER_ARCSEC, RAD_PER_DEG};
use nalgebra::{Matrix3, Rotation3, Vector3};
use sofars::consts::DJ00;
use sofars::erst::gst06;
use sofars::pnp;

const DAYS_PER_JULIAN_YEAR: f64 = 365.25;

/// The apparent direction of a star at `icrs`, `years` Julian years after J2000.0, in axes fixed to
/// the Earth: x to longitude 0 on the equator, y to 90° east, z to the north pole.
pub(super) fn terrestrial(icrs: &UnitVector<Icrs>, years: f64) -> Vector3<f64> {
    let date = Date::new(years);
    let apparent = date.to_true_equator * icrs.as_vector() + date.aberration();
    about_z(date.sidereal_time_rad) * apparent.normalize()
}

/// The ICRS axes' components of a vector that is given in axes fixed to the Earth, `years` Julian
/// years after J2000.0.
pub(super) fn icrs(terrestrial: &Vector3<f64>, years: f64) -> Vector3<f64> {
    let date = Date::new(years);
    let to_terrestrial = about_z(date.sidereal_time_rad) * date.to_true_equator;
    to_terrestrial.tr_mul(terrestrial)
}

/// A date, and the orientation of the Earth then.
struct Date {
    /// Julian days since J2000.0.
    days: f64,
    /// Precession and nutation: from ICRS to the true equator and equinox of the date.
    to_true_equator: Matrix3<f64>,
    /// Greenwich apparent sidereal time.
    sidereal_time_rad: f64,
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
        let days = years * DAYS_PER_JULIAN_YEAR;
        let matrix = pnp::pnm06a(DJ00, days);
        Self {
            days,
            to_true_equator: Matrix3::from_fn(|row, column| matrix[row][column]),
            sidereal_time_rad: gst06(DJ00, days, DJ00, days, &matrix),
        }
    }

    /// The Earth's velocity in units of the speed of light, in the axes of the true equator and
    /// equinox of the date.
    ///
    /// # Reference
    /// Meeus 1998, Astronomical Algorithms, chapters 23 (the constant) and 25 (the Sun's longitude,
    /// the Earth's eccentricity and perihelion).
    fn aberration(&self) -> Vector3<f64> {
        const CONSTANT_RAD: f64 = 20.495_52 * RAD_PER_ARCSEC;
        let t = self.days / (100.0 * DAYS_PER_JULIAN_YEAR);
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
        about_x(-pnp::obl06(DJ00, self.days)) * ecliptic * CONSTANT_RAD
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::units::ARCSEC_PER_RAD;
    use sofars::eph::epv00;

    /// The Earth's orbit is assumed to be an ellipse about the Sun. The Sun moves about the
    /// barycentre with up to 16 m/s (0.011″), the Earth about that with the Moon with 12 m/s
    /// (0.009″).
    const ABERRATION_ARCSEC: f64 = 0.03;

    #[test]
    fn aberration_over_two_centuries_is_that_of_sofa() {
        const LIGHT_AU_A_DAY: f64 = 173.144_632_67;
        // Every 97 days.
        let worst = (-376..=376).map(|i| {
            let date = Date::new((f64::from(i) * 97.0 + 0.3) / DAYS_PER_JULIAN_YEAR);
            let (_, [_, velocity]) = epv00(DJ00, date.days).unwrap();
            let expected = date.to_true_equator * Vector3::from(velocity) / LIGHT_AU_A_DAY;
            (date.aberration() - expected).norm() * ARCSEC_PER_RAD
        });
        let worst = worst.fold(0.0, f64::max);
        println!("largest difference: {worst:.4} arcsec");
        assert!(worst < ABERRATION_ARCSEC, "{worst}");
    }
}
