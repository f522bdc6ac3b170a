//! Where the catalogue's stars fall in a frame.

use super::Sky;
use crate::camera::CameraModel;
use crate::catalog::sky_grid::GridStar;
use crate::coords::{Camera, Icrs, PixelPoint, Rotation, UnitVector};

/// Stars predicted so far outside the frame, in units of its diagonal, may still be seen on it.
const MARGIN: f64 = 0.01;
/// Lenses shift stars by no more than so much of the frame's half diagonal.
const UNDISTORTED_MARGIN: f64 = 0.1;

/// A catalogue star where camera and attitude put it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PredictedStar {
    /// Its place in the frame.
    pub pixel: PixelPoint,
    /// Its direction at the time of the frame.
    pub direction: UnitVector<Icrs>,
    /// V magnitude.
    pub v_mag: f32,
    /// Index into the catalogue's stars.
    pub catalog: usize,
}

/// A camera in its attitude, at a time.
#[derive(Debug, Clone, Copy)]
pub struct View<'a> {
    /// The camera.
    pub camera: &'a CameraModel,
    /// The attitude.
    pub icrs_to_camera: &'a Rotation<Icrs, Camera>,
    /// When, in Julian years since J2000.0: the stars move.
    pub years_since_j2000: f64,
}

impl View<'_> {
    /// The catalogue stars in the frame, or within 1 % of its diagonal of it, down to a V magnitude, brightest first.
    pub fn stars_to(&self, sky: &Sky, faintest_v_mag: f64) -> Vec<PredictedStar> {
        let margin_px = MARGIN * self.camera.width_px.hypot(self.camera.height_px);
        let radius_rad = self.camera.radius_rad() * (1.0 + 2.0 * MARGIN);
        let centre = self.icrs_to_camera.inverse().apply(&UnitVector::BORESIGHT);
        // The cone is rounder than the frame: most of what it holds beside it needs no closer look.
        let nearly_px = margin_px + UNDISTORTED_MARGIN * self.camera.radius_px();
        let pinhole = CameraModel {
            distortion: None,
            ..self.camera.clone()
        };
        let mut predicted = Vec::new();
        let mut look = |star: &GridStar| {
            let direction = sky.stars()[star.catalog as usize].direction_at(self.years_since_j2000);
            let in_camera = self.icrs_to_camera.apply(&direction);
            let near = |p: &PixelPoint| self.camera.nearly_contains(p, nearly_px);
            let inside = |p: &PixelPoint| self.camera.nearly_contains(p, margin_px);
            let undistorted = pinhole.pixel_of(&in_camera).filter(near);
            let pixel = undistorted.and_then(|_| self.camera.pixel_of(&in_camera));
            if let Some(pixel) = pixel.filter(inside) {
                predicted.push(PredictedStar {
                    pixel,
                    direction,
                    v_mag: star.v_mag,
                    catalog: star.catalog as usize,
                });
            }
        };
        sky.grid
            .for_each_within(&centre, radius_rad, faintest_v_mag as f32, &mut look);
        predicted.sort_unstable_by_key(|star| star.catalog);
        predicted
    }
}
