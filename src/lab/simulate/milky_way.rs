//! The Milky Way: light of stars that are too faint to be drawn one by one.

use super::camera::Pointing;
use super::scene::Scene;
use crate::base::coords::{Camera, Icrs, PixelPoint, Rotation, UnitVector};
use crate::base::units::RAD_PER_DEG;
use crate::camera::CameraModel;

/// V magnitude of a square arcsecond where a square degree has the light of a star of magnitude 10.
const MAG_ARCSEC2: f64 = 27.78;

/// The Milky Way over a frame.
pub(super) struct MilkyWay {
    camera_to_icrs: Rotation<Camera, Icrs>,
    /// Light of one star of magnitude 10 in a square degree, over that of the scenario's sky.
    unit: f64,
}

impl MilkyWay {
    /// That of a scene, under a sky of so many magnitudes per square arcsecond; `None` without it.
    pub(super) fn new(scene: &Scene, pointing: &Pointing, mag_arcsec2: f64) -> Option<Self> {
        let strength = scene.milky_way.filter(|strength| *strength > 0.0)?;
        Some(Self {
            camera_to_icrs: pointing.icrs_to_camera.inverse(),
            unit: strength * libm::pow(10.0, 0.4 * (mag_arcsec2 - MAG_ARCSEC2)),
        })
    }

    /// Its light at `place`, over that of the scenario's sky.
    pub(super) fn at(&self, camera: &CameraModel, place: &PixelPoint) -> f64 {
        let direction = camera.direction_of(place);
        direction.map_or(0.0, |direction| {
            self.unit * stars_of_magnitude_10(&self.camera_to_icrs.apply(&direction))
        })
    }
}

/// Its light in a direction, in stars of magnitude 10 per square degree: a thin disk that is brighter towards
/// its center, dark clouds that wave about its plane, and patches. About half of the integrated starlight,
/// of which the catalogue's stars are the other half.
///
/// # Reference
/// Leinert et al. 1998, A&AS 127, 1, section 10, for the brightness of plane and poles.
fn stars_of_magnitude_10(direction: &UnitVector<Icrs>) -> f64 {
    const POLES: f64 = 15.0;
    const PLANE: f64 = 130.0;
    const THICKNESS_RAD: f64 = 9.0 * RAD_PER_DEG;
    const DARK_THICKNESS_RAD: f64 = 2.5 * RAD_PER_DEG;
    const DARK_WAVE_RAD: f64 = 2.0 * RAD_PER_DEG;
    let pole = of_ra_dec_deg(192.859, 27.128);
    let center = of_ra_dec_deg(266.405, -28.936);
    let latitude_rad = libm::asin(pole.dot(direction).clamp(-1.0, 1.0));
    let to_center = center.dot(direction);
    let along = pole.as_vector().cross(center.as_vector());
    let longitude_rad = libm::atan2(along.dot(direction.as_vector()), to_center);
    let disk = libm::exp(-latitude_rad.abs() / THICKNESS_RAD) * (1.0 + 0.6 * to_center);
    let off_rad = latitude_rad - DARK_WAVE_RAD * libm::sin(3.0 * longitude_rad);
    let dark = 0.6 * libm::exp(-0.5 * (off_rad / DARK_THICKNESS_RAD).powi(2));
    let patches = 0.25 * libm::sin(11.0 * longitude_rad) * libm::cos(17.0 * latitude_rad);
    POLES + PLANE * disk * (1.0 - dark) * (1.0 + patches)
}

fn of_ra_dec_deg(ra_deg: f64, dec_deg: f64) -> UnitVector<Icrs> {
    UnitVector::from_ra_dec(ra_deg * RAD_PER_DEG, dec_deg * RAD_PER_DEG)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_where_it_is() {
        let of = |ra_deg, dec_deg| stars_of_magnitude_10(&of_ra_dec_deg(ra_deg, dec_deg));
        let [cygnus, scutum, coma] = [of(305.0, 40.0), of(281.0, -7.0), of(193.0, 27.0)];
        assert!((14.0..17.0).contains(&coma), "{coma}");
        assert!(cygnus > 2.0 * coma, "{cygnus}");
        assert!((70.0..220.0).contains(&scutum), "{scutum}");
    }
}
