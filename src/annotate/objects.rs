//! Moon, planets, deep-sky objects and radiants in a frame.

use super::annotation::{Annotation, AnnotationKind};
use super::view::View;
use crate::base::units::DEG_PER_RAD;
use crate::catalog::objects::{DeepSkyObject, deep_sky};
use crate::ephemeris::meteor_showers::active_radiants;
use crate::ephemeris::solar_system::BodyKind;
use crate::solve::BodyInFrame;

/// How far a radiant may be from where it is stated.
const RADIANT_RAD: f64 = 3.0 / DEG_PER_RAD;

impl View<'_> {
    /// The Moon, or a planet that is seen or bright enough to be looked for.
    pub fn body(&self, seen: &BodyInFrame) -> Option<Annotation> {
        let is_moon = seen.body.kind == BodyKind::Moon;
        let is_shown = seen.source.is_some() || is_moon;
        let source = seen
            .source
            .and_then(|source| self.solution.sources.get(source.get()));
        let position = source.map_or(seen.position, |source| source.position);
        is_shown.then(|| Annotation {
            kind: AnnotationKind::Body {
                source: seen.source,
            },
            name: seen.body.kind.name().to_owned(),
            label: seen.body.kind.name().to_owned(),
            position,
            uncertainty_px: seen.uncertainty_px,
            v_mag: Some(seen.body.v_mag),
            radius_px: seen.body.radius_rad * self.found.camera.focal_length_px(),
        })
    }

    /// Clusters, nebulae and galaxies, brightest first.
    pub fn deep_sky(&self) -> impl Iterator<Item = Annotation> + '_ {
        /// They are annotated to this much beyond the stars: they are looked for.
        const FAINTER_MAG: f64 = 2.0;
        const NARROW_DEG: f64 = 5.0;
        let limit_mag = self.limit_mag(FAINTER_MAG);
        let bright = deep_sky()
            .iter()
            .take_while(move |object| object.v_mag < limit_mag);
        // Others are clutter in wide fields.
        let is_known = |object: &&DeepSkyObject| {
            !object.name.is_empty() || object.designation.starts_with("M ")
        };
        let is_narrow = self.field_deg < NARROW_DEG;
        let known = bright.filter(move |object| is_narrow || is_known(object));
        known.filter_map(|object| {
            let position = self
                .found
                .pixel_of(&self.found.places.apparent(&object.direction))?;
            let designation = object.designation;
            let name = if object.name.is_empty() {
                designation
            } else {
                object.name
            };
            self.shows(&position).then(|| Annotation {
                kind: AnnotationKind::DeepSky { designation },
                name: name.to_owned(),
                label: designation.to_owned(),
                position,
                uncertainty_px: self.places.at(&position),
                v_mag: Some(object.v_mag),
                radius_px: object.radius_rad * self.found.camera.focal_length_px(),
            })
        })
    }

    /// The radiants of the meteor showers of the frame's date.
    pub fn radiants(&self) -> Vec<Annotation> {
        let known = self.solution.date.as_ref();
        let active = known.map_or(Vec::new(), |known| active_radiants(&known.date));
        let seen = active.into_iter().filter_map(|radiant| {
            let position = self
                .found
                .pixel_of(&self.found.places.apparent(&radiant.direction))?;
            self.shows(&position).then(|| Annotation {
                kind: AnnotationKind::Radiant,
                name: format!("radiant of the {}", radiant.name),
                label: format!("{} (radiant)", radiant.name),
                position,
                uncertainty_px: RADIANT_RAD * self.found.camera.focal_length_px(),
                v_mag: None,
                radius_px: 0.0,
            })
        });
        seen.collect()
    }
}
