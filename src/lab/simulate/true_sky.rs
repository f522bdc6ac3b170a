//! The true sky of a simulated frame at each place, without noise.

use super::lights::BrightLight;
use super::sky::{SimulatedSky, solid_angle_sr};
use crate::base::coords::PixelPoint;
use crate::camera::CameraModel;

/// The true sky of a simulated frame.
pub struct TrueSky<'a> {
    pub(super) sky: SimulatedSky<'a>,
    pub(super) lights: Vec<BrightLight>,
    pub(super) camera: &'a CameraModel,
    /// V magnitudes per square arcsecond of the scenario's sky.
    pub(super) mag_arcsec2: f64,
    /// Its electrons in a pixel in the centre of the frame.
    pub(super) sky_e: f64,
}

impl TrueSky<'_> {
    /// V magnitudes by which clouds dim a star at `place`.
    pub fn clouds_mag(&self, place: &PixelPoint) -> f64 {
        self.sky.clouds_mag(place)
    }

    /// Electrons of a steradian at `place`, in front of a lens without vignetting, with the halos of bright
    /// lights and without stars; `None` where the lens images nothing.
    pub fn electrons_per_sr(&self, place: &PixelPoint) -> Option<f64> {
        let halos_e: f64 = self.lights.iter().map(|light| light.halo_at(place)).sum();
        let light_e = self.sky_e * self.sky.light(place)? + halos_e / self.sky.lens(place);
        Some(light_e / solid_angle_sr(self.camera, place)?)
    }

    /// Part of a star's light that air, clouds and lens let through to `place`, over that of the centre's airmass.
    pub fn transmission(&self, place: &PixelPoint) -> f64 {
        self.sky.transmission(place)
    }

    /// What of that is the lens's part.
    pub fn lens(&self, place: &PixelPoint) -> f64 {
        self.sky.lens(place)
    }

    /// V magnitudes per square arcsecond of so many electrons of a steradian.
    pub fn mag_arcsec2(&self, electrons_per_sr: f64) -> f64 {
        let center_sr = solid_angle_sr(self.camera, &self.camera.centre()).unwrap_or(f64::NAN);
        self.mag_arcsec2 - 2.5 * libm::log10(electrons_per_sr * center_sr / self.sky_e)
    }
}
