//! Why a frame was not identified, in terms that a person can act on.
//!
//! frame, detections, hints and the search's own [`Reason`] → the [`Reason`] that explains it best.
//!
//! In this order, the first that holds:
//!
//! 1. The frame is empty (one value everywhere), or a large part of it is at full scale.
//! 2. The hints exclude the solution: the field is identified without them.
//! 3. The hints ask for a field outside what can be identified.
//! 4. Most of the sources are trails in one direction.
//! 5. The same pattern of stars is there twice.
//! 6. What the search said: too few stars, or no match.
//!
//! All of it costs time only where a frame was not identified; a search without the hints is the longest
//! part, and takes as long as any search with nothing known.

mod doubles;
mod levels;
mod trails;

use crate::camera::focal_length_px;
use crate::detect::Detections;
use crate::frame::Frame;
use crate::identify::{
    Excluded, Hints, Identification, IndexedCatalog, Outcome, Reason, StarField, identify,
};

/// What there is to look at.
#[derive(Debug, Clone, Copy)]
pub struct Examined<'a> {
    /// The frame and all that was detected in it; a list of centroids has neither.
    pub image: Option<(&'a Frame, &'a Detections)>,
    /// The stars that were to be identified.
    pub field: &'a StarField,
    /// What was known beforehand.
    pub hints: &'a Hints,
}

/// The reason why `examined` was not identified; `found` is what the search says.
pub fn explain(examined: &Examined, sky: &IndexedCatalog, found: Reason) -> Reason {
    let image = examined.image;
    let has_stars = matches!(found, Reason::NoMatch { .. });
    image
        .and_then(|(frame, _)| levels::explain(frame))
        .or_else(|| has_stars.then(|| excluded(examined, sky)).flatten())
        .or_else(|| out_of_range(examined, sky))
        .or_else(|| image.and_then(|(frame, detections)| trails::explain(frame, detections)))
        .or_else(|| doubles::explain(examined.field))
        .unwrap_or(found)
}

/// Searches again without the hints.
fn excluded(examined: &Examined, sky: &IndexedCatalog) -> Option<Reason> {
    if *examined.hints == Hints::default() {
        return None;
    }
    match identify(examined.field, &Hints::default(), sky) {
        Outcome::Identified(found) => Some(Reason::HintsExclude(Box::new(contradiction(
            examined, &found,
        )))),
        Outcome::NotIdentified(_) => None,
    }
}

fn contradiction(examined: &Examined, found: &Identification) -> Excluded {
    let (boresight, _) = found.icrs_to_camera.boresight_and_up();
    let pixel_rad = 1.0 / found.camera.focal_length_px;
    let allowed = examined.hints.pixel_scale_rad;
    let excluding = allowed.filter(|(low, high)| !(*low..=*high).contains(&pixel_rad));
    let near = examined.hints.near;
    let distance = near.map(|(near, radius_rad)| (boresight.angle_to(&near), radius_rad));
    Excluded {
        fov_x_rad: found.camera.fov_x_rad(),
        boresight,
        stars: found.matches.len(),
        allowed_fov_x_rad: excluding.map(|scale| fields_of_view(scale, examined.field.width_px)),
        distance_rad: distance.filter(|(away, radius)| away > radius),
    }
}

/// Horizontal fields of view, in radians, of frames with these scales at their centre.
fn fields_of_view((low, high): (f64, f64), width_px: f64) -> (f64, f64) {
    let fov_rad = |pixel_rad: f64| 2.0 * (width_px * pixel_rad / 2.0).atan();
    (fov_rad(low), fov_rad(high))
}

fn out_of_range(examined: &Examined, sky: &IndexedCatalog) -> Option<Reason> {
    let scale = examined.hints.pixel_scale_rad?;
    let width_px = examined.field.width_px;
    let searched_rad = sky.fov_range_rad();
    let pixel_rad = |fov_rad: f64| 1.0 / focal_length_px(width_px, fov_rad);
    let (narrowest, widest) = (pixel_rad(searched_rad.0), pixel_rad(searched_rad.1));
    (scale.1 < narrowest || scale.0 > widest).then(|| Reason::ScaleOutOfRange {
        fov_x_rad: fields_of_view(scale, width_px),
        searched_rad,
    })
}
