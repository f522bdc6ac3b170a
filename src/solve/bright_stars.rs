//! Bright stars without a name, and bright detections that are no star: what a person sees first.

use crate::catalog::StarIndex;
use crate::detect::{Detection, Detections};
use crate::identify::{Identification, IndexedCatalog, PredictedStar};
use crate::photometry::resolved_px;
use std::collections::HashSet;
use std::fmt;

/// Stars to this V magnitude are bright.
const BRIGHT_V_MAG: f64 = 4.0;
/// This many of the brightest detections are bright.
const BRIGHT_DETECTIONS: usize = 10;
/// Distance from the frame's border within which a star may be cut off, in standard deviations of
/// the spot, and at least in pixels.
const BORDER_SIGMAS: f64 = 6.0;
const BORDER_PX: f64 = 5.0;
/// A detection within this fraction of the frame's diagonal may be the star.
const NEAR_FRACTION: f64 = 0.01;

/// A bright catalogue star in the frame that no detection has the name of.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct MissingStar {
    /// Its name, or its identifier.
    pub name: String,
    /// Its V magnitude.
    pub v_mag: f64,
    /// Where it should be, in pixels.
    pub expected_px: [f64; 2],
    /// Distance in pixels from there to the brightest detection nearby, and whether that has the
    /// shape of a star.
    pub nearest: Option<(f64, bool)>,
}

impl fmt::Display for MissingStar {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, v_mag, .. } = self;
        write!(f, "{name} (V {v_mag:.1}, ")?;
        match self.nearest {
            None => f.write_str("not detected)"),
            Some((distance_px, true)) => write!(f, "a detection {distance_px:.1} px off)"),
            Some((distance_px, false)) => write!(
                f,
                "a detection {distance_px:.1} px off that does not look like a star)"
            ),
        }
    }
}

/// A frame's detections, and what was identified.
pub(super) struct NamedFrame<'a> {
    pub detections: &'a Detections,
    pub identification: &'a Identification,
    pub indexed: &'a IndexedCatalog<'a>,
}

impl NamedFrame<'_> {
    /// Bright catalogue stars well inside the frame without a name, brightest first.
    pub(super) fn missing_stars(&self) -> Vec<MissingStar> {
        let found = self.identification;
        let view = found.view();
        let spot_px = self.detections.spot_sigma_px;
        let border_px = (BORDER_SIGMAS * spot_px).max(BORDER_PX);
        let named: HashSet<StarIndex> = found.matches.iter().map(|m| m.star).collect();
        let bright = view.stars_to(self.indexed, BRIGHT_V_MAG);
        let is_missing = |(index, star): &(usize, &PredictedStar)| {
            found.camera.nearly_contains(&star.pixel, -border_px)
                && self.detections.shows_sky(&star.pixel)
                && !named.contains(&star.star)
                && !self.is_in_light_of(&bright[..*index], star)
        };
        let missing = bright.iter().enumerate().filter(is_missing);
        missing.map(|(_, star)| self.missing(star)).collect()
    }

    /// Whether a star is part of the light of a `brighter` one.
    fn is_in_light_of(&self, brighter: &[PredictedStar], star: &PredictedStar) -> bool {
        let resolved_px = resolved_px(self.detections.spot_sigma_px);
        let is_near = |other: &PredictedStar| other.pixel.distance_to(&star.pixel) < resolved_px;
        brighter.iter().any(is_near)
    }

    fn missing(&self, star: &PredictedStar) -> MissingStar {
        let catalog = self.indexed.catalog();
        let camera = &self.identification.camera;
        let reach_px = NEAR_FRACTION * libm::hypot(camera.width_px, camera.height_px);
        let distance_px = |detection: &Detection| detection.position.distance_to(&star.pixel);
        // The brightest comes first.
        let nearby = self.detections.sources.iter();
        let nearest = nearby
            .map(|detection| (distance_px(detection), detection.flags.is_star_like()))
            .find(|(distance_px, _)| *distance_px <= reach_px);
        MissingStar {
            name: catalog
                .full_name(star.star)
                .unwrap_or_else(|| catalog.designation(star.star)),
            v_mag: f64::from(star.v_mag),
            expected_px: [star.pixel.x, star.pixel.y],
            nearest,
        }
    }

    /// Positions of the brightest detections that look like stars, have no name and are not
    /// `known`, brightest first.
    pub(super) fn unnamed_detections(&self, known: &HashSet<usize>) -> Vec<[f64; 2]> {
        let named = self.identification.matches.iter().map(|m| m.source.get());
        let named: HashSet<usize> = named.collect();
        let sources = self.detections.sources.iter().enumerate();
        sources
            .filter(|(_, source)| source.flags.is_star_like() && !source.flags.border)
            .take(BRIGHT_DETECTIONS)
            .filter(|(index, _)| !named.contains(index) && !known.contains(index))
            .map(|(_, source)| [source.position.x, source.position.y])
            .collect()
    }
}
