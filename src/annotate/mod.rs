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

mod annotation;
mod constellations;
mod named_light;
mod objects;
mod place;
mod sentence;
mod stars;
mod view;

use crate::catalog::Catalog;
use crate::solve::Solution;
pub(crate) use annotation::{Annotation, AnnotationKind};
pub(crate) use constellations::VisibleConstellation;
use view::View;

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

#[cfg(test)]
mod tests;
