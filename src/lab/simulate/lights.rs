//! Bright lights: the Moon's disc and lamps, with the halo that the lens spreads around them.

use super::image::ElectronImage;
use super::poisson::poisson;
use super::scene::Scene;
use super::skyline::{horizon_of, zenith_of};
use crate::base::coords::{Camera, PixelPoint, UnitVector};
use crate::camera::CameraModel;
use crate::predict::{Scenario, StarLight};
use nalgebra::Vector3;
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::{PI, TAU};

/// Share of the light in the halo.
const HALO: f64 = 0.05;
/// Exponent of the halo, a Moffat profile: its light falls with the distance to the power of −2.5.
const HALO_BETA: f64 = 1.25;
/// Radius of the Moon's disc, in radians.
const MOON_RADIUS_RAD: f64 = 0.0045;
/// Radius of a lamp's disc, in radians.
const LAMP_RADIUS_RAD: f64 = 0.002;

/// A bright light in the frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct BrightLight {
    place: PixelPoint,
    radius_px: f64,
    electrons: f64,
}

impl BrightLight {
    /// Adds it to an image.
    pub(super) fn draw(&self, image: &mut ElectronImage) {
        let radius_px = self.radius_px.max(1.0);
        let disc_e = (1.0 - HALO) * self.electrons / (PI * radius_px * radius_px);
        for (y, row) in image.rows_mut() {
            for (x, pixel) in row.iter_mut().enumerate() {
                let r_px = self.place.distance_to(&PixelPoint::new(x as f64, y as f64));
                // The disc's edge is a pixel wide.
                let disc = (radius_px + 0.5 - r_px).clamp(0.0, 1.0);
                *pixel += disc_e * disc + self.halo_e(r_px);
            }
        }
    }

    /// Electrons of the halo in the pixel at `place`.
    pub(super) fn halo_at(&self, place: &PixelPoint) -> f64 {
        self.halo_e(self.place.distance_to(place))
    }

    fn halo_e(&self, r_px: f64) -> f64 {
        let radius_px = self.radius_px.max(1.0);
        let center_e = HALO * self.electrons * (HALO_BETA - 1.0) / (PI * radius_px * radius_px);
        center_e * libm::pow(1.0 + (r_px / radius_px).powi(2), -HALO_BETA)
    }
}

/// The direction of the scene's Moon in camera axes.
pub(super) fn moon_direction(scene: &Scene, camera: &CameraModel) -> Option<UnitVector<Camera>> {
    let (sin, cos) = libm::sincos(scene.moon_distance_deg?.to_radians());
    let (sin_way, cos_way) = libm::sincos(scene.moon_direction_deg.to_radians());
    // The direction is that in the image, which a mirror reverses.
    let sin_way = if camera.mirrored { -sin_way } else { sin_way };
    let vector = Vector3::new(sin * sin_way, -sin * cos_way, cos);
    Some(UnitVector::from_unit(vector))
}

/// V magnitude of the scene's Moon.
///
/// # Reference
/// Krisciunas & Schaefer 1991, PASP 103, 1033, eq. (9).
pub(super) fn moon_vmag(scene: &Scene) -> f64 {
    let phase = scene.moon_phase_deg;
    -12.73 + 0.026 * phase + 4e-9 * phase.powi(4)
}

/// The lights of a frame: the Moon, and lamps at or below the altitude of the skyline.
pub(super) fn lights(
    (scenario, scene): (&Scenario, &Scene),
    camera: &CameraModel,
    light: &StarLight,
    mut random: ChaCha8Rng,
) -> Vec<BrightLight> {
    let of = |direction: UnitVector<Camera>, radius_rad: f64, v_mag: f64| {
        let place = camera.pixel_of(&direction)?;
        camera.contains(&place).then_some(BrightLight {
            place,
            radius_px: radius_rad * camera.focal_length_px(),
            electrons: light.electrons(v_mag, None),
        })
    };
    let v_mag = moon_vmag(scene);
    let moon = moon_direction(scene, camera).and_then(|at| of(at, MOON_RADIUS_RAD, v_mag));
    let zenith = zenith_of(scenario);
    let [first, second] = horizon_of(&zenith);
    let count = poisson(scene.lamps, &mut random) as usize;
    let lamp = |_| {
        let (sin, cos) = libm::sincos(random.random_range(0.0..TAU));
        let highest_deg = scene.skyline_deg.unwrap_or(0.0).max(0.1);
        let (up, along) = libm::sincos(random.random_range(0.0..highest_deg).to_radians());
        let at = along * (cos * first + sin * second) + up * zenith.as_vector();
        of(UnitVector::from_unit(at), LAMP_RADIUS_RAD, scene.lamp_vmag)
    };
    let lamps: Vec<BrightLight> = (0..count).filter_map(lamp).collect();
    moon.into_iter().chain(lamps).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_light_has_its_electrons_in_disc_and_halo() {
        let mut image = ElectronImage::new(401, 401, 0.0);
        let light = BrightLight {
            place: PixelPoint::new(200.0, 200.0),
            radius_px: 5.0,
            electrons: 1e6,
        };
        light.draw(&mut image);
        let pixels = image.into_pixels();
        let sum: f64 = pixels.iter().sum();
        // The rest of the halo lies outside: (r / a)^-0.5 of it beyond r.
        let inside = 1.0 - HALO * (200.0_f64 / 5.0).powf(-0.5);
        assert!((sum / 1e6 / inside - 1.0).abs() < 0.01, "{sum}");
        assert!(pixels[200 * 401 + 200] > 100.0 * pixels[200 * 401 + 215]);
    }
}
