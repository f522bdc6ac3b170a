//! Directions to the planets, by VSOP87.

use super::body::{BodyKind, LIGHT_DAYS_PER_AU};
use crate::ephemeris::OBLIQUITY_J2000_RAD;
use nalgebra::Vector3;
use vsop87::{RectangularCoordinates, vsop87a};

const J2000_JD: f64 = 2_451_545.0;

/// From the Sun to the Earth, in ICRS axes, `days` of terrestrial time after J2000.0.
fn earth_au(days: f64) -> Vector3<f64> {
    icrs(&vsop87a::earth(J2000_JD + days))
}

/// From the Earth to where the planet was when the light left it, `days` of terrestrial time after
/// J2000.0.
pub(super) fn astrometric_au(kind: BodyKind, days: f64) -> Vector3<f64> {
    let earth_au = earth_au(days);
    let since = |light_days: f64| planet_au(kind, days - light_days) - earth_au;
    // A second round changes the planet's place by less than 0.01″.
    let geometric = since(0.0);
    since(geometric.norm() * LIGHT_DAYS_PER_AU)
}

/// From the Sun to the planet.
fn planet_au(kind: BodyKind, days: f64) -> Vector3<f64> {
    let heliocentric = match kind {
        BodyKind::Mercury => vsop87a::mercury,
        BodyKind::Venus => vsop87a::venus,
        BodyKind::Mars => vsop87a::mars,
        BodyKind::Jupiter => vsop87a::jupiter,
        BodyKind::Saturn => vsop87a::saturn,
        BodyKind::Uranus => vsop87a::uranus,
        BodyKind::Neptune => vsop87a::neptune,
        // The Moon goes round the Sun with the Earth.
        BodyKind::Moon => vsop87a::earth_moon,
    };
    icrs(&heliocentric(J2000_JD + days))
}

/// From the ecliptic of J2000.0 to the ICRS.
fn icrs(ecliptic: &RectangularCoordinates) -> Vector3<f64> {
    let (sin, cos) = libm::sincos(OBLIQUITY_J2000_RAD);
    Vector3::new(
        ecliptic.x,
        cos * ecliptic.y - sin * ecliptic.z,
        sin * ecliptic.y + cos * ecliptic.z,
    )
}
