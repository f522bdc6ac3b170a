//! Where the planets roughly are, in microseconds: enough to tell which ones are in a frame, and how
//! fast they move.

use super::body::{BodyKind, LIGHT_DAYS_PER_AU};
use nalgebra::Vector3;
use sofars::eph::plan94;

const J2000_JD: f64 = 2_451_545.0;
/// Above the largest error of a direction: 97″ from 1900 to 2100 (Simon et al. 1994), and 25″ as the
/// Earth goes round its barycentre with the Moon.
pub(super) const ERROR_RAD: f64 = 0.001;

/// Position and velocity about the Sun in ICRS axes, in au and au a day, `days` of terrestrial time
/// after J2000.0; of the Moon and the Earth, those of their barycentre.
pub(super) fn about_sun(kind: BodyKind, days: f64) -> [Vector3<f64>; 2] {
    let number = match kind {
        BodyKind::Mercury => 1,
        BodyKind::Venus => 2,
        BodyKind::Moon => 3,
        BodyKind::Mars => 4,
        BodyKind::Jupiter => 5,
        BodyKind::Saturn => 6,
        BodyKind::Uranus => 7,
        BodyKind::Neptune => 8,
    };
    // It fails for other numbers only.
    let (found, _) = plan94(J2000_JD, days, number).unwrap_or_default();
    found.map(Vector3::from)
}

/// From the Earth at `earth_au` to where the planet was when the light left it.
pub(super) fn astrometric_au(kind: BodyKind, days: f64, earth_au: &Vector3<f64>) -> Vector3<f64> {
    let [position, velocity] = about_sun(kind, days);
    let geometric = position - earth_au;
    geometric - velocity * geometric.norm() * LIGHT_DAYS_PER_AU
}
