//! The stars by which the sky is measured.

use super::lens_circle::LensCircle;
use crate::base::coords::{Icrs, PixelPoint, UnitVector};
use crate::identify::{IndexedCatalog, PredictedStar};
use crate::photometry::association::Association;
use crate::photometry::{IdentifiedFrame, MeasuredMagnitude};

/// A star that the frame should show, alone at its place.
#[derive(Debug, Clone, Copy)]
pub(super) struct SkyStar {
    /// Where it is in the frame.
    pub pixel: PixelPoint,
    /// The direction in which it appears.
    pub direction: UnitVector<Icrs>,
    /// V magnitude.
    pub v_mag: f64,
    /// B−V, where known.
    pub bv_mag: Option<f64>,
    /// Airmass of its light, where the horizon is known.
    pub airmass: Option<f64>,
    /// Distance from the lens's axis over that of the edge of the field, squared.
    pub off_axis_sq: f64,
    /// By how much its undetected neighbors make it brighter, in magnitudes.
    pub brighter_mag: f64,
    /// Whether it was detected.
    pub is_detected: bool,
    /// Where it was detected.
    pub seen_at: Option<PixelPoint>,
    /// Its brightness in the frame, where that is clean.
    pub measured: Option<MeasuredMagnitude>,
}

/// The stars of a frame that are alone at their places.
pub(super) fn select(
    frame: &IdentifiedFrame,
    association: &Association,
    predicted: &[PredictedStar],
    catalog: &IndexedCatalog,
) -> Vec<SkyStar> {
    let found = frame.identification;
    let camera = &found.camera;
    let circle = LensCircle::from_camera(camera);
    let inside = predicted.iter().filter(|star| camera.contains(&star.pixel));
    let both = association.stars.iter().zip(inside);
    let clear = both.filter(|(star, _)| star.is_clear);
    clear
        .map(|(star, predicted)| {
            let known = catalog.catalog().star(star.star);
            let detection = star.detection.map(|index| &frame.detections.sources[index]);
            let clean = detection.filter(|detection| {
                detection.flags.has_clean_flux() && known.flags.is_constant_and_single()
            });
            let measured = clean
                .filter(|detection| detection.flux_adu > 0.0)
                .map(|detection| MeasuredMagnitude::of(frame, star, detection));
            let direction = frame.identification.places.of(known);
            SkyStar {
                direction,
                pixel: predicted.pixel,
                v_mag: star.v_mag,
                bv_mag: known.bv_mag.map(f64::from),
                airmass: frame.identification.places.airmass(&direction),
                off_axis_sq: circle.off_axis_sq(&predicted.pixel),
                brighter_mag: star.brighter_mag(),
                is_detected: detection.is_some(),
                seen_at: detection.map(|detection| detection.position),
                measured,
            }
        })
        .collect()
}
