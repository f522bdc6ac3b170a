//! Magnitudes of the Moon and the planets, from distances and phase.
//!
//! Caveat: Mars's rotation, seasons and dust change it by some 0.1 mag, which is neglected.

use super::body::BodyKind;
use crate::base::units::{DEG_PER_RAD, RAD_PER_DEG};
use nalgebra::Vector3;

/// The Johnson V magnitude of a body in the Julian year `year`, by where it is from the Sun and the Earth.
///
/// # Reference
/// Planets: Mallama & Hilton 2018, with the equations' numbers below; Moon: Allen 1973,
/// Astrophysical Quantities, § 66.
pub(super) fn v_mag(
    kind: BodyKind,
    from_sun_au: &Vector3<f64>,
    from_earth_au: &Vector3<f64>,
    year: f64,
) -> f64 {
    let phase_deg = from_sun_au.angle(from_earth_au) * DEG_PER_RAD;
    let at_unit_distance = match kind {
        BodyKind::Moon => 0.23 + 0.026 * phase_deg + 4.0e-9 * phase_deg.powi(4),
        BodyKind::Mercury => mercury(phase_deg),
        BodyKind::Venus => venus(phase_deg),
        BodyKind::Mars => mars(phase_deg),
        BodyKind::Jupiter => -9.395 + polynomial(phase_deg, &[0.0, -3.7e-4, 6.16e-4]),
        BodyKind::Saturn => saturn(phase_deg, from_sun_au, from_earth_au),
        // Equation 14, but for the latitude's 0.03 mag.
        BodyKind::Uranus => -7.13 + polynomial(phase_deg, &[0.0, 6.587e-3, 1.045e-4]),
        // Equation 16: it became brighter from 1980 to 2000.
        BodyKind::Neptune => (-6.89 - 0.0054 * (year - 1980.0)).clamp(-7.0, -6.89),
    };
    at_unit_distance + 5.0 * libm::log10(from_sun_au.norm() * from_earth_au.norm())
}

/// c0 + c1 x + c2 x² + ...
fn polynomial(x: f64, coefficients: &[f64]) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

/// Equation 2.
fn mercury(phase_deg: f64) -> f64 {
    let coefficients = [
        -0.613,
        6.3280e-2,
        -1.6336e-3,
        3.3644e-5,
        -3.4265e-7,
        1.6893e-9,
        -3.0334e-12,
    ];
    polynomial(phase_deg, &coefficients)
}

/// Equations 3 and 4: near the Sun, clouds forward the light.
fn venus(phase_deg: f64) -> f64 {
    if phase_deg < 163.7 {
        polynomial(
            phase_deg,
            &[-4.384, -1.044e-3, 3.687e-4, -2.814e-6, 8.938e-9],
        )
    } else {
        polynomial(phase_deg, &[236.058_28, -2.819_14, 8.390_34e-3])
    }
}

/// Equations 6 and 7.
fn mars(phase_deg: f64) -> f64 {
    if phase_deg <= 50.0 {
        polynomial(phase_deg, &[-1.601, 2.267e-2, -1.302e-4])
    } else {
        polynomial(phase_deg, &[-0.367, -0.025_73, 3.445e-4])
    }
}

/// Equation 10: the globe with its rings.
fn saturn(phase_deg: f64, from_sun_au: &Vector3<f64>, from_earth_au: &Vector3<f64>) -> f64 {
    /// The pole in ICRS, in degrees (IAU 2015, Archinal et al. 2018).
    const POLE_DEG: [f64; 2] = [40.589, 83.537];
    let [ra, dec] = POLE_DEG.map(|deg| deg * RAD_PER_DEG);
    let pole = Vector3::new(
        libm::cos(dec) * libm::cos(ra),
        libm::cos(dec) * libm::sin(ra),
        libm::sin(dec),
    );
    let tilt = |direction: &Vector3<f64>| -libm::asin(pole.dot(&direction.normalize()));
    let product = tilt(from_sun_au) * tilt(from_earth_au);
    // The rings' lit side may be turned away from the Earth.
    let sin_tilt = libm::sin(product.max(0.0).sqrt());
    let opposition_surge = 0.378 * sin_tilt * libm::exp(-2.25 * phase_deg);
    -8.914 - 1.825 * sin_tilt + 0.026 * phase_deg - opposition_surge
}
