//! What is in an identified frame? Everything that people have a name for, placed by the pose.
//!
//! ([`Solution`], catalog) → [`Scene`]: annotations, constellations by their share of the frame, and one
//! sentence
//!
//! With the attitude known to a second of arc, a bright star needs no measurement to be found: it is at its
//! place. An annotation says whether its star was measured and named, and why not where it was not.
//!
//! 1. The error of a place is that of the named stars around it ([`place`]).
//! 2. Stars brighter than a limit that suits the field, and all with a proper name, are looked up ([`stars`]).
//! 3. Constellations are those of the IAU ([`constellations`]); clusters, nebulae and galaxies, the Moon and
//!    planets, and the radiants of meteor showers follow.
//! 4. The [`sentence`] says the most important of it.
//!
//! Caveats: nothing is annotated where the residuals of the stars are large, where something is in front of
//! the sky, or where a star should be seen and is not.

mod constellations;
mod named_light;
mod place;
mod sentence;
mod stars;

use crate::base::coords::PixelPoint;
use crate::base::units::DEG_PER_RAD;
use crate::catalog::objects::{DeepSkyObject, deep_sky};
use crate::catalog::{Catalog, StarIndex};
use crate::ephemeris::meteor_showers::active_radiants;
use crate::ephemeris::solar_system::BodyKind;
use crate::identify::{Identification, SourceIndex};
use crate::solve::{BodyInFrame, Solution};
pub(crate) use constellations::VisibleConstellation;
pub(crate) use named_light::Unmeasured;
use place::PlaceErrors;

/// What people have a name for in an identified frame.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Scene {
    /// The most important of it.
    pub sentence: String,
    /// The constellations in the frame, largest share first.
    pub constellations: Vec<VisibleConstellation>,
    /// What is named: constellations, bodies, deep-sky objects, radiants, then stars, brightest first.
    pub annotations: Vec<Annotation>,
}

/// Something in the frame that has a name.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Annotation {
    pub kind: AnnotationKind,
    /// Its name, in full.
    pub name: String,
    /// Its name beside it in a picture.
    pub label: String,
    /// Where it is in the frame.
    pub position: PixelPoint,
    /// Its light is within so many pixels of there.
    pub uncertainty_px: f64,
    /// Its V magnitude, where it has one.
    pub v_mag: Option<f64>,
    /// Half of its longer side, in pixels; 0 for what has no size.
    pub radius_px: f64,
}

/// What an annotation names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum AnnotationKind {
    Star {
        star: StarIndex,
        /// The detection of its light, where there is one.
        source: Option<SourceIndex>,
        /// Why that is not its measurement; `None` where it is.
        unmeasured: Option<Unmeasured>,
    },
    Constellation,
    DeepSky {
        /// As in `M 42`; also its name, where it has no other.
        designation: &'static str,
    },
    Body {
        /// The detection that it is.
        source: Option<SourceIndex>,
    },
    Radiant,
}

impl AnnotationKind {
    /// Its name in JSON.
    pub const fn code(self) -> &'static str {
        match self {
            Self::Star { .. } => "star",
            Self::Constellation => "constellation",
            Self::DeepSky { .. } => "deep_sky",
            Self::Body { .. } => "body",
            Self::Radiant => "radiant",
        }
    }
}

impl Scene {
    /// What is in the frame of `solution`; `None` where it is not identified.
    pub fn of(solution: &Solution, catalog: &Catalog) -> Option<Self> {
        let found = solution.outcome.identification()?;
        let view = View::new(solution, found, catalog);
        let constellations = constellations::visible(&view);
        let mut annotations: Vec<Annotation> = constellations
            .iter()
            .filter_map(VisibleConstellation::annotation)
            .collect();
        annotations.extend(solution.bodies.iter().filter_map(|body| view.body(body)));
        annotations.extend(view.deep_sky());
        annotations.extend(view.radiants());
        annotations.extend(stars::annotations(&view));
        let sentence = sentence::of(&view, &constellations, &annotations);
        Some(Self {
            sentence,
            constellations,
            annotations,
        })
    }
}

/// An identified frame with what is known of places in it.
pub(crate) struct View<'a> {
    solution: &'a Solution,
    found: &'a Identification,
    catalog: &'a Catalog,
    places: PlaceErrors,
    /// Angle across the frame, or the circle of its lens.
    field_deg: f64,
}

impl<'a> View<'a> {
    fn new(solution: &'a Solution, found: &'a Identification, catalog: &'a Catalog) -> Self {
        let across = [found.camera.fov_x_rad(), found.camera.fov_y_rad()];
        let widest = across.into_iter().flatten().fold(0.0, f64::max);
        let field_rad = if widest > 0.0 {
            widest
        } else {
            2.0 * found.camera.radius_rad()
        };
        Self {
            solution,
            found,
            catalog,
            places: PlaceErrors::new(solution, found),
            field_deg: field_rad * DEG_PER_RAD,
        }
    }

    /// Whether the sky is seen at a place: nothing is in front of it, and the lens sees it.
    fn shows(&self, place: &PixelPoint) -> bool {
        let area = self.solution.sky_area.as_ref();
        self.found.camera.contains(place) && area.is_none_or(|area| area.shows(place))
    }

    /// The magnitude that a clear night shows at a glance in a field of this width: 7 at 5°, 4 at 60°, 3 in the
    /// whole sky. What is brighter is annotated, `fainter_mag` beyond it.
    fn limit_mag(&self, fainter_mag: f64) -> f64 {
        const AT_5_DEG: f64 = 7.0;
        /// 3 magnitudes from 5° to 60°.
        const PER_DECADE: f64 = 2.78;
        const LIMITS: [f64; 2] = [3.0, 9.0];
        let limit = AT_5_DEG - PER_DECADE * libm::log10(self.field_deg / 5.0);
        limit.clamp(LIMITS[0], LIMITS[1]) + fainter_mag
    }

    /// The Moon, or a planet that is seen or bright enough to be looked for.
    fn body(&self, seen: &BodyInFrame) -> Option<Annotation> {
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
    fn deep_sky(&self) -> impl Iterator<Item = Annotation> + '_ {
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
    fn radiants(&self) -> Vec<Annotation> {
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

/// How far a radiant may be from where it is stated.
const RADIANT_RAD: f64 = 3.0 / DEG_PER_RAD;

#[cfg(test)]
mod tests;
