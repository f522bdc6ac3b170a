//! Why was a frame not identified, in terms that a person can act on?
//!
//! Frame, detections, priors and the [`SearchFailure`] → a [`Diagnosis`], where there is one.
//!
//! The first of these that holds:
//!
//! 1. The frame is empty (one value everywhere), or a large fraction of it is at full scale.
//! 2. The priors exclude the solution: the stars are identified without them.
//! 3. The stated field of view is too narrow for the catalogue.
//! 4. Most of the sources are trails in one direction.
//! 5. The same pattern of stars occurs twice.
//!
//! Where none of them holds, and where the picture clearly shows another, `picture` says what it shows instead.
//!
//! It costs time only where a frame was not identified. The search without the priors takes
//! longest: as long as any search with nothing known.

mod above;
mod cause;
mod doubles;
mod levels;
mod picture;
mod repeats;
mod trails;

pub use cause::DoubleImage;
pub use cause::{Diagnosis, Excluded};
pub(crate) use doubles::find_unnamed as find_double_image;
pub(crate) use picture::{Unexplained, bytes as picture_bytes};
pub use repeats::{RepeatedSky, find as find_repeated_sky};

use crate::base::units::DEG_PER_RAD;
use crate::camera::focal_length_px;
use crate::detect::Detections;
use crate::frame::Frame;
use crate::identify::identification::{Identification, SearchFailure};
use crate::identify::priors::Priors;
use crate::identify::{IndexedCatalog, StarField, identify};

/// A star field that was not identified.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Unidentified<'a> {
    /// The frame and its detections. A list of centroids has neither.
    pub image: Option<(&'a Frame<'a>, &'a Detections)>,
    /// The observed stars.
    pub field: &'a StarField,
    /// What was known beforehand.
    pub priors: &'a Priors,
    /// Why the search failed.
    pub failure: SearchFailure,
}

/// The cause why the stars were not identified; `None` where the search's own failure says it best.
pub(crate) fn diagnose(case: &Unidentified, sky: &IndexedCatalog) -> Option<Diagnosis> {
    if case.failure == SearchFailure::Interrupted {
        return None;
    }
    let image = case.image;
    let has_stars = !matches!(case.failure, SearchFailure::TooFewStars { .. });
    image
        .and_then(|(frame, _)| levels::diagnose(frame))
        .or_else(|| has_stars.then(|| excluded(case, sky)).flatten())
        .or_else(|| too_narrow(case, sky))
        .or_else(|| image.and_then(|(frame, detections)| trails::diagnose(frame, detections)))
        .or_else(|| doubles::find(case.field).map(Diagnosis::DoubleExposure))
}

/// Searches again without the scale. Whoever searches only near a direction first does so without it then.
fn excluded(case: &Unidentified, sky: &IndexedCatalog) -> Option<Diagnosis> {
    let priors = case.priors.binding();
    priors.scale?;
    let found = identify(case.field, &Priors::default(), sky).ok()?;
    Some(Diagnosis::HintsExclude(Box::new(contradiction(
        case, &priors, &found,
    ))))
}

fn contradiction(case: &Unidentified, priors: &Priors, found: &Identification) -> Excluded {
    let (boresight, _) = found.icrs_to_camera.boresight_and_up();
    let pixel_rad = 1.0 / found.camera.focal_length_px();
    let width_px = case.field.width_px;
    let allowed = priors.pixel_scale_range_rad(width_px);
    let excluding = allowed.filter(|[low, high]| !(*low..=*high).contains(&pixel_rad));
    Excluded {
        fov_x_rad: found
            .camera
            .fov_x_rad()
            .unwrap_or(2.0 * found.camera.radius_rad()),
        boresight,
        stars: found.matches.len(),
        allowed_fov_x_rad: excluding.map(|scale| fields_of_view(scale, width_px)),
    }
}

/// Horizontal fields of view, in radians, of frames with these pixel scales at their centre.
fn fields_of_view(pixel_scales_rad: [f64; 2], width_px: f64) -> [f64; 2] {
    pixel_scales_rad.map(|pixel_rad| 2.0 * libm::atan(width_px * pixel_rad / 2.0))
}

fn too_narrow(case: &Unidentified, sky: &IndexedCatalog) -> Option<Diagnosis> {
    let width_px = case.field.width_px;
    let stated = case.priors.scale?;
    let scale = stated.pixel_scale_range_rad(width_px);
    let [narrowest_rad, _] = sky.fov_range_rad();
    let narrowest_pixel_rad = 1.0 / focal_length_px(width_px, narrowest_rad);
    let pixel_deg = (scale[0] + scale[1]) / 2.0 * DEG_PER_RAD;
    let area_sq_deg = pixel_deg * pixel_deg * width_px * case.field.height_px;
    (scale[1] < narrowest_pixel_rad).then(|| Diagnosis::TooNarrow {
        fov_x_rad: fields_of_view(scale, width_px),
        source: stated.source,
        narrowest_rad,
        stars: area_sq_deg * sky.per_sq_deg(),
    })
}
