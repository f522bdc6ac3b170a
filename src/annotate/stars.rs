//! The stars of a frame that have a name for people.

use super::annotation::{Annotation, AnnotationKind, Unmeasured};
use super::named_light::Lights;
use super::view::View;
use crate::base::coords::{Icrs, UnitVector};
use crate::catalog::StarIndex;
use crate::identify::SourceIndex;
use std::collections::HashMap;

/// Proper names go to this magnitude.
const NAMED_MAG: f64 = 6.6;

/// Stars brighter than the limit of the field, and those with a proper name, brightest first.
pub(super) fn annotations(view: &View<'_>) -> Vec<Annotation> {
    // Most stars have no detection where only the brightest were measured.
    if view.solution.attitude_only {
        return Vec::new();
    }
    let limit_mag = view.limit_mag(0.0);
    let catalog = view.catalog;
    let measured: HashMap<StarIndex, SourceIndex> = view
        .found
        .matches
        .iter()
        .map(|named| (named.star, named.source))
        .collect();
    let lights = Lights::new(view);
    let cone = Cone::of(view);
    let bright = (0..catalog.brighter_than(limit_mag.max(NAMED_MAG))).map(StarIndex::new);
    let wanted = bright.filter(|index| {
        let star = catalog.star(*index);
        cone.contains(&star.direction)
            && (star.is_brighter_than(limit_mag) || catalog.proper_name(*index).is_some())
    });
    wanted
        .filter_map(|index| annotation(view, index, measured.get(&index).copied(), &lights))
        .collect()
}

/// What the frame shows of a star: its measurement, or light at its place that is not.
fn annotation(
    view: &View<'_>,
    star: StarIndex,
    measured: Option<SourceIndex>,
    lights: &Lights<'_>,
) -> Option<Annotation> {
    let known = view.catalog.star(star);
    let (position, uncertainty_px, light) = match measured {
        Some(source) => {
            let source_position = view.solution.source(source).position;
            (
                source_position,
                view.places.at(&source_position),
                (source, None),
            )
        }
        None => {
            let position = view.found.pixel_of(&view.found.places.of(known))?;
            if !view.found.camera.contains(&position) {
                return None;
            }
            let uncertainty_px = view.places.at(&position);
            let (source, why) = lights.at(&position, uncertainty_px, known.v_mag)?;
            let is_hidden = why != Unmeasured::Saturated && !view.shows(&position);
            if is_hidden || view.places.is_large(uncertainty_px) {
                return None;
            }
            (position, uncertainty_px, (source, Some(why)))
        }
    };
    let name = view.catalog.full_name(star);
    Some(Annotation {
        kind: AnnotationKind::Star {
            star,
            source: Some(light.0),
            unmeasured: light.1,
        },
        name: name.unwrap_or_else(|| view.catalog.designation(star)),
        label: view.catalog.label(star),
        position,
        uncertainty_px,
        v_mag: Some(f64::from(known.v_mag)),
        radius_px: 0.0,
    })
}

/// The directions that a frame may see.
struct Cone {
    axis: UnitVector<Icrs>,
    cos: f64,
}

impl Cone {
    fn of(view: &View<'_>) -> Self {
        /// Proper motion, aberration and refraction.
        const MARGIN_RAD: f64 = 0.02;
        let radius_rad = view.found.camera.radius_rad() + MARGIN_RAD;
        Self {
            axis: view.found.icrs_to_camera.boresight(),
            cos: libm::cos(radius_rad.min(std::f64::consts::PI)),
        }
    }

    fn contains(&self, direction: &UnitVector<Icrs>) -> bool {
        self.axis.dot(direction) >= self.cos
    }
}
