//! How the Earth turns and moves.
//!
//! Precession, nutation, sidereal time and the Earth's velocity are those of `sofars`, a translation of
//! the IAU's SOFA library (IAU 2006/2000A; Simon et al. 1994 and VSOP2000 for the velocity).
//!
//! Caveats: UT1 and terrestrial time are assumed equal to UTC; the first differs by less than 0.9 s,
//! 13″ in right ascension, the second moves nothing by more than 0.001″. Polar motion (0.3″) is
//! neglected.

use nalgebra::{Matrix3, Rotation3, Vector3};
use sofars::consts::DJ00;
use sofars::eph::epv00;
use sofars::erst::gst06;
use sofars::pnp;

const DAYS_PER_JULIAN_YEAR: f64 = 365.25;

/// From ICRS axes to axes fixed to the Earth, `years` Julian years after J2000.0: x to longitude 0 on
/// the equator, y to 90° east, z to the north pole.
pub(super) fn icrs_to_terrestrial(years: f64) -> Matrix3<f64> {
    let days = years * DAYS_PER_JULIAN_YEAR;
    let matrix = pnp::pnm06a(DJ00, days);
    let to_true_equator = Matrix3::from_fn(|row, column| matrix[row][column]);
    let sidereal_time_rad = gst06(DJ00, days, DJ00, days, &matrix);
    Rotation3::from_axis_angle(&Vector3::z_axis(), -sidereal_time_rad).matrix() * to_true_equator
}

/// The velocity of the Earth's centre relative to the solar system's barycentre, in ICRS axes, in units
/// of the speed of light, `years` Julian years after J2000.0.
pub(super) fn velocity_c(years: f64) -> Vector3<f64> {
    const LIGHT_AU_PER_DAY: f64 = 173.144_632_67;
    /// A hundred turns about the Sun, in days.
    const CENTURY_DAYS: f64 = 100.0 * 365.256_363;
    let days = years * DAYS_PER_JULIAN_YEAR;
    // SOFA's theory covers 1900 to 2100; before that the Earth moved much as a century later.
    let orbit = epv00(DJ00, days).or_else(|| epv00(DJ00, days + CENTURY_DAYS));
    orbit.map_or_else(Vector3::zeros, |(_, [_, velocity])| {
        Vector3::from(velocity) / LIGHT_AU_PER_DAY
    })
}
