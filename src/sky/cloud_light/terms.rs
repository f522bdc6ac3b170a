//! What the light of a clear sky is composed of.

use crate::base::coords::{Icrs, PixelPoint, UnitVector};
use crate::camera::CameraModel;
use crate::ephemeris::observer::airmass::airmass_krisciunas_schaefer;
use nalgebra::{Matrix3, Vector3};

/// Terms of which the light of a clear sky over a frame is a sum, with coefficients that are not known: at a
/// place that is imaged in an apparent direction, where the zenith is known, and the Moon if it is up.
///
/// - Over the frame: polynomials of the second degree, and ρ⁴, for lamps of towns and what the lens loses.
/// - Air: airglow and stray light go with the depth of the air, and its square.
/// - Galaxy: starlight from its disk, also with a gradient towards its center.
/// - Moon: light scattered by air, which has a broad part, and by dust, which has a halo; and the glare of
///   the lens.
///
/// # Reference
/// Krisciunas & Schaefer 1991, PASP 103, 1033: eq. (3) for the depth, (16) to (21) for moonlight.
pub(in crate::sky) fn terms(
    camera: &CameraModel,
    place: &PixelPoint,
    direction: &UnitVector<Icrs>,
    zenith: Option<&UnitVector<Icrs>>,
    moon: Option<&UnitVector<Icrs>>,
) -> Vec<f64> {
    let centre = camera.centre();
    let radius_px = camera.field_radius_px();
    let [u, v] = [place.x - centre.x, place.y - centre.y].map(|off_px| off_px / radius_px);
    let radius_sq = u * u + v * v;
    let mut terms = vec![1.0, u, v, u * u, u * v, v * v, radius_sq * radius_sq];
    let Some(zenith) = zenith else {
        return terms;
    };
    let depth = airmass_krisciunas_schaefer(zenith.angle_to(direction));
    terms.extend([depth, depth * depth]);
    let galactic = galactic(direction);
    let disk = 1.0 / (DISK_THICKNESS + galactic.z.abs());
    terms.extend([disk, disk * galactic.x]);
    if let Some(moon) = moon.filter(|moon| zenith.dot(moon) > 0.0) {
        let angle_rad = moon.angle_to(direction);
        let broad = libm::cos(angle_rad).powi(2);
        let halo = libm::pow(10.0, -angle_rad.to_degrees() / 40.0);
        let glare = 1.0 / (GLARE_RAD * GLARE_RAD + angle_rad * angle_rad);
        terms.extend([broad * depth, halo * depth, halo, glare * depth]);
    }
    terms
}

/// Half thickness of the Galaxy's disk, as the sine of a latitude.
const DISK_THICKNESS: f64 = 0.15;
/// Within this angle from the Moon glare does not grow any more.
const GLARE_RAD: f64 = 0.17;

/// Galactic direction: towards the center, along the rotation, to the north pole.
///
/// # Reference
/// ESA 1997, The Hipparcos Catalogue, volume 1, eq. (1.5.11).
fn galactic(direction: &UnitVector<Icrs>) -> Vector3<f64> {
    #[rustfmt::skip]
    let axes = Matrix3::new(
        -0.054_875_560_4, -0.873_437_090_2, -0.483_835_015_5,
        0.494_109_427_9, -0.444_829_630_0, 0.746_982_244_5,
        -0.867_666_149_0, -0.198_076_373_4, 0.455_983_776_2,
    );
    axes * direction.as_vector()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_galaxy_is_where_it_is() {
        let center = UnitVector::from_ra_dec(266.405_f64.to_radians(), (-28.936_f64).to_radians());
        assert!((galactic(&center) - Vector3::x()).norm() < 1e-4);
        let pole = UnitVector::from_ra_dec(192.859_f64.to_radians(), 27.128_f64.to_radians());
        assert!((galactic(&pole) - Vector3::z()).norm() < 1e-4);
    }
}
