//! The stars of a frame, as identification takes them.

use crate::detect::{Detection, Detections};
use crate::ephemeris::places::StarPlaces;
use crate::frame::Frame;
use crate::identify::{ObservedStar, Photometry, SourceIndex, StarField};
use crate::photometry::instrumental_mag;

/// The detections that may be stars, as identification takes them.
pub fn star_field(frame: &Frame, detections: &Detections, places: StarPlaces) -> StarField {
    let is_star = |source: &Detection| source.flags.is_star_like();
    field_of(is_star, frame, detections, places)
}

/// [`star_field`] in a buffer.
pub(super) fn fill_field<'b>(
    buffer: &'b mut Option<StarField>,
    frame: &Frame,
    detections: &Detections,
    places: StarPlaces,
) -> &'b StarField {
    let mut stars = buffer.take().map_or_else(Vec::new, |field| field.stars);
    stars.clear();
    let is_star = |source: &Detection| source.flags.is_star_like();
    stars.extend(observed(is_star, detections));
    buffer.insert(field_with(stars, frame, detections, places))
}

/// The detections for which `is_star` holds, without those in front of the sky, as identification takes them.
pub(super) fn field_of(
    is_star: impl Fn(&Detection) -> bool,
    frame: &Frame,
    detections: &Detections,
    places: StarPlaces,
) -> StarField {
    let stars = observed(is_star, detections).collect();
    field_with(stars, frame, detections, places)
}

/// The stars among the detections.
fn observed(
    is_star: impl Fn(&Detection) -> bool,
    detections: &Detections,
) -> impl Iterator<Item = ObservedStar> {
    let sources = detections.sources.iter().enumerate();
    sources
        .filter(move |(_, source)| is_star(source) && source.flux_adu > 0.0)
        .filter(|(_, source)| !detections.is_dark(&source.position))
        .map(|(index, source)| {
            let variance_px2 = (source.sigma_x_px.powi(2) + source.sigma_y_px.powi(2)) / 2.0;
            ObservedStar {
                source: SourceIndex::new(index),
                position: source.position,
                sigma_px: variance_px2.sqrt(),
                mag: instrumental_mag(source.flux_adu),
                is_saturated: source.flags.saturated,
            }
        })
}

/// The field of these stars.
fn field_with(
    stars: Vec<ObservedStar>,
    frame: &Frame,
    detections: &Detections,
    places: StarPlaces,
) -> StarField {
    StarField {
        width_px: frame.width as f64,
        height_px: frame.height as f64,
        photometry: Photometry::Instrumental,
        places,
        spot_sigma_px: Some(detections.spot_sigma_px),
        sky_area: detections.sky_area.clone(),
        stars,
    }
}
