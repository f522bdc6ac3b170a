//! The input of the photometry.

use crate::base::coords::PixelPoint;
use crate::camera::data_sheet::lens_transmission;
use crate::detect::Detections;
use crate::identify::Identification;
use crate::photometry::comparison::FieldPosition;

/// An identified frame.
#[derive(Debug, Clone, Copy)]
pub struct IdentifiedFrame<'a> {
    /// The detections.
    pub detections: &'a Detections,
    /// Camera, attitude and matches; the matches are indices into the detections.
    pub identification: &'a Identification,
    /// Exposure in seconds, where known.
    pub exposure_s: Option<f64>,
    /// Share of the light lost in the corners, as far as it is known.
    pub vignetting: f64,
}

impl IdentifiedFrame<'_> {
    /// Part of the centre's light that the lens lets through to a place, as far as it is known.
    pub(crate) fn lens_transmission(&self, pixel: &PixelPoint) -> f64 {
        let off_centre_sq = self.identification.camera.off_centre_sq(pixel);
        lens_transmission(self.vignetting, off_centre_sq)
    }

    /// Flux at which half of the stars at a place are detected, in ADU in front of the lens; `None` where nothing
    /// was searched.
    pub(crate) fn flux_limit_adu(&self, pixel: &PixelPoint) -> Option<f64> {
        let camera = &self.identification.camera;
        let size_px = [camera.width_px, camera.height_px];
        let limit_adu = self.detections.flux_limits.at(pixel, size_px)?;
        Some(limit_adu / self.lens_transmission(pixel))
    }

    /// Places all over a wide field whose horizon is known, as far as they show the sky.
    pub fn places_of_horizon(&self) -> Option<Vec<FieldPosition>> {
        /// Along each side.
        const PLACES: usize = 25;
        /// From one place to the next: any few in a row lie all over the frame.
        const STEP: usize = 233;
        let camera = &self.identification.camera;
        let airmass = |pixel: &PixelPoint| {
            let direction = self.identification.apparent_direction_of(pixel)?;
            self.identification.places.airmass(&direction)
        };
        let central_airmass = airmass(&camera.centre())?;
        let typical_adu = self.detections.flux_limits.typical()?;
        let offset = |place: usize| (place as f64 + 0.5) / PLACES as f64;
        let place = |number: usize| {
            let place = number * STEP % (PLACES * PLACES);
            let (x, y) = (offset(place % PLACES), offset(place / PLACES));
            let pixel = PixelPoint::new(x * camera.width_px - 0.5, y * camera.height_px - 0.5);
            let is_seen = self.detections.shows_sky(&pixel);
            let limit_adu = self.flux_limit_adu(&pixel).filter(|_| is_seen)?;
            Some(FieldPosition {
                brighter_mag: 2.5 * libm::log10(limit_adu / typical_adu),
                airmass_ratio: airmass(&pixel)? / central_airmass,
            })
        };
        let places: Vec<FieldPosition> = (0..PLACES * PLACES).filter_map(place).collect();
        (!places.is_empty()).then_some(places)
    }
}
