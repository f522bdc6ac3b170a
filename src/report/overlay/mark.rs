//! Detections as they are drawn.

use super::canvas::Canvas;
use super::names::StarLabel;
use super::options::LabelKind;
use super::picture::Picture;
use crate::annotate::{AnnotationKind, Scene};
use crate::base::coords::PixelPoint;
use crate::catalog::{Catalog, StarIndex};
use crate::ephemeris::solar_system::BodyKind;
use crate::identify::SourceIndex;
use crate::report::figure::Rgb;
use crate::solve::{BodyInFrame, Solution, Source};

/// Smallest and largest radius of a ring, in units of strokes.
const RADIUS: (f32, f32) = (5.0, 15.0);

/// Kind of a detection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum MarkKind {
    Identified,
    /// A star at the place that the pose gives it: its light was not measured.
    Placed,
    /// The Moon or a planet.
    Body,
    Unidentified,
    NotAStar,
}

impl MarkKind {
    /// Forms differ, too, and these colors to color-blind readers.
    pub(super) fn color(self) -> Rgb {
        match self {
            Self::Identified => Rgb([110, 205, 255]),
            Self::Placed => Rgb([150, 225, 205]),
            Self::Body => Rgb([255, 225, 90]),
            Self::Unidentified => Rgb([255, 170, 60]),
            Self::NotAStar => Rgb([200, 120, 190]),
        }
    }

    /// Draws the form of this kind: a circle, a dashed circle, a rhombus, a square or a cross.
    pub(super) fn draw(self, canvas: &mut Canvas, at: [f32; 2], radius: f32) {
        let [x, y] = at;
        match self {
            Self::Identified => canvas.ring(at, radius, 1.3, self.color()),
            Self::Placed => canvas.dashed_ring(at, radius, 1.3, self.color()),
            Self::Body => {
                let side = 1.25 * radius;
                let corners = [[x - side, y], [x, y - side], [x + side, y], [x, y + side]];
                let rhombus = [&corners[..], &corners[..1]].concat();
                canvas.line(&rhombus, 1.3, self.color());
            }
            Self::Unidentified => {
                let side = 0.8 * radius;
                let (left, right, top, bottom) = (x - side, x + side, y - side, y + side);
                let corners = [[left, top], [right, top], [right, bottom], [left, bottom]];
                let square = [&corners[..], &corners[..1]].concat();
                canvas.line(&square, 1.1, self.color());
            }
            Self::NotAStar => {
                let side = 0.6 * radius;
                let cross = [[1.0, 1.0], [1.0, -1.0]];
                for [right, down] in cross.map(|ends| ends.map(|end| end * side)) {
                    let ends = [[x - right, y - down], [x + right, y + down]];
                    canvas.line(&ends, 0.9, self.color());
                }
            }
        }
    }
}

/// A detection as it is drawn, in pixels of the picture.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Mark {
    pub(super) x: f32,
    pub(super) y: f32,
    pub(super) radius: f32,
    pub(super) kind: MarkKind,
    /// That of an identified star.
    pub(super) label: Option<StarLabel>,
}

impl Mark {
    pub(super) fn draw(&self, canvas: &mut Canvas) {
        self.kind.draw(canvas, [self.x, self.y], self.radius);
    }
}

/// The marks of the Moon and the planets, of stars that are not measured, and of all detections, brightest
/// first.
pub(super) fn marks(
    solution: &Solution,
    scene: Option<&Scene>,
    catalog: &Catalog,
    picture: &Picture,
    label: LabelKind,
) -> Vec<Mark> {
    let rings = RingRadii::of(&solution.sources, picture);
    let matches = solution.matches_by_source();
    let placed: Vec<PlacedStar> = scene.map_or(Vec::new(), PlacedStar::all);
    // Light without a name of its own that has another mark.
    let is_marked = |index: usize| {
        let bodies = solution.bodies.iter().filter_map(|body| body.source);
        let of_placed = placed.iter().filter_map(|star| star.source);
        bodies.chain(of_placed).any(|source| source.get() == index)
    };
    let sources = solution.sources.iter().zip(&matches).enumerate();
    let stars = sources
        .filter(|(index, (_, named))| named.is_some() || !is_marked(*index))
        .map(|(_, (source, star_match))| {
            let [x, y] = picture.position_of(&source.position);
            let label = star_match
                .as_ref()
                .map(|found| StarLabel::of_star(catalog, found.star, label));
            Mark {
                x,
                y,
                radius: rings.radius(source),
                kind: kind(source, label.is_some()),
                label,
            }
        });
    let of_placed = placed.iter().map(|star| {
        let [x, y] = picture.position_of(&star.position);
        let source = star
            .source
            .and_then(|index| solution.sources.get(index.get()));
        Mark {
            x,
            y,
            radius: source.map_or(rings.smallest, |source| rings.radius(source)),
            kind: MarkKind::Placed,
            label: Some(StarLabel::of_star(catalog, star.star, label)),
        }
    });
    bodies(solution, picture)
        .chain(of_placed)
        .chain(stars)
        .filter(|mark| picture.shows([mark.x, mark.y]))
        .collect()
}

/// A star at the place that the pose gives it.
struct PlacedStar {
    star: StarIndex,
    position: PixelPoint,
    /// The detection of its light.
    source: Option<SourceIndex>,
}

impl PlacedStar {
    fn all(scene: &Scene) -> Vec<Self> {
        let placed = scene
            .annotations
            .iter()
            .filter_map(|shown| match shown.kind {
                AnnotationKind::Star {
                    star,
                    source,
                    unmeasured: Some(_),
                } => Some(Self {
                    star,
                    position: shown.position,
                    source,
                }),
                _ => None,
            });
        placed.collect()
    }
}

/// The marks of the planets that are seen, and of the Moon, which may be too bright to be a detection.
fn bodies(solution: &Solution, picture: &Picture) -> impl Iterator<Item = Mark> {
    let identified = solution.outcome.identification();
    let focal_px = identified.map_or(0.0, |found| found.camera.focal_length_px());
    let shown = |seen: &&BodyInFrame| seen.source.is_some() || seen.body.kind == BodyKind::Moon;
    solution.bodies.iter().filter(shown).map(move |seen| {
        let source = seen
            .source
            .and_then(|index| solution.sources.get(index.get()));
        let [x, y] = picture.position_of(source.map_or(&seen.position, |source| &source.position));
        let disc = (seen.body.radius_rad * focal_px) as f32 * picture.scale();
        Mark {
            x,
            y,
            radius: disc.max(RADIUS.0 * 1.6 * picture.stroke_unit()),
            kind: MarkKind::Body,
            label: Some(StarLabel::of_body(&seen.body)),
        }
    })
}

fn kind(source: &Source, identified: bool) -> MarkKind {
    let star_like = source.measured.is_none_or(|m| m.flags.is_star_like());
    match (identified, star_like) {
        (true, _) => MarkKind::Identified,
        (false, true) => MarkKind::Unidentified,
        (false, false) => MarkKind::NotAStar,
    }
}

/// Radii of rings, in pixels of the picture.
struct RingRadii {
    /// The flux of the smallest ring.
    flux: f64,
    smallest: f32,
    unit: f32,
}

impl RingRadii {
    /// The radii for `sources`, brightest first.
    fn of(sources: &[Source], picture: &Picture) -> Self {
        /// Smallest radius in pixels of the frame: enlarged stars need larger rings.
        const MIN_RADIUS_PX: f32 = 3.0;
        /// In a crowd, the smallest ring is this share of the mean distance between stars, ...
        const FRACTION_OF_SPACING: f32 = 0.2;
        /// ... but at least this share of its usual size.
        const MIN_FRACTION: f32 = 0.6;
        /// Share of the detections that get larger rings than the smallest.
        const LARGER_RINGS: f64 = 0.8;
        let faintest_larger = (sources.len() as f64 * LARGER_RINGS) as usize;
        let area = (picture.width * picture.height) as f32;
        let spacing = (area / sources.len().max(1) as f32).sqrt();
        let usual = (RADIUS.0 * picture.stroke_unit()).max(MIN_RADIUS_PX * picture.scale());
        Self {
            flux: sources
                .get(faintest_larger)
                .and_then(|s| s.flux)
                .unwrap_or(f64::NAN),
            smallest: usual * (FRACTION_OF_SPACING * spacing / usual).clamp(MIN_FRACTION, 1.0),
            unit: picture.stroke_unit(),
        }
    }

    fn radius(&self, source: &Source) -> f32 {
        /// What a magnitude adds, in units of strokes.
        const PER_MAG: f32 = 1.1;
        let above = source
            .flux
            .map_or(0.0, |flux| 2.5 * libm::log10(flux / self.flux));
        // NaN gets the smallest ring.
        let above = if above > 0.0 { above as f32 } else { 0.0 };
        let most = (RADIUS.1 * self.unit).max(self.smallest);
        (self.smallest + PER_MAG * self.unit * above).min(most)
    }
}
