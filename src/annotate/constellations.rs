//! Which constellations does a frame show, and how much of each?

use super::annotation::{Annotation, AnnotationKind};
use super::view::View;
use crate::base::coords::{Icrs, PixelPoint, UnitVector};
use crate::catalog::StarIndex;
use crate::catalog::boundaries::constellation_at;
use crate::catalog::objects::{Constellation, constellations};

/// Columns and rows of the places at which a frame is asked for its constellation.
const PLACES: [usize; 2] = [16, 12];
/// The stars that make a constellation conspicuous.
const CONSPICUOUS_MAG: f64 = 4.5;
/// A constellation has its name in the picture where this much of the frame is in it, …
const MIN_SHARE: f64 = 0.03;
/// … or this much of its figure is in the frame.
const MIN_FIGURE: f64 = 0.4;

/// A constellation in the frame.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct VisibleConstellation {
    /// The IAU's abbreviation.
    pub abbreviation: &'static str,
    /// Its Latin name.
    pub name: &'static str,
    /// The share of the frame's sky that lies in it.
    pub share: f64,
    /// The share of its figure's lines that is in the frame.
    pub figure_share: f64,
    /// Light of its conspicuous stars in the frame, in stars of magnitude 0.
    pub light: f64,
    /// The share of the light of all its conspicuous stars that is in the frame.
    pub light_share: f64,
    /// The centre of what is seen of it.
    pub middle: Option<PixelPoint>,
}

impl VisibleConstellation {
    /// Its name in the picture.
    pub fn annotation(&self) -> Option<Annotation> {
        let is_seen = self.share >= MIN_SHARE || self.figure_share >= MIN_FIGURE;
        let position = self.middle.filter(|_| is_seen)?;
        Some(Annotation {
            kind: AnnotationKind::Constellation,
            name: self.name.to_owned(),
            label: self.name.to_owned(),
            position,
            uncertainty_px: 0.0,
            v_mag: None,
            radius_px: 0.0,
        })
    }
}

/// The constellations in the frame, largest share first.
pub(super) fn visible(view: &View<'_>) -> Vec<VisibleConstellation> {
    let places = Places::of(view);
    let mut seen: Vec<VisibleConstellation> = Vec::new();
    // Serpens has two parts, of which the first has the lines of both.
    for constellation in constellations() {
        if seen
            .last()
            .is_none_or(|last| last.abbreviation != constellation.abbreviation)
        {
            seen.extend(places.constellation(view, constellation));
        }
    }
    seen.sort_by(|a, b| {
        b.share
            .total_cmp(&a.share)
            .then(b.light.total_cmp(&a.light))
    });
    seen
}

/// What the frame shows at places spread evenly over it, and its conspicuous stars.
struct Places<'a> {
    /// Where the sky is seen, and the constellation there.
    sky: Vec<(PixelPoint, &'static str)>,
    /// All conspicuous stars: constellation, light, and whether the frame shows them.
    stars: Vec<(&'a str, f64, bool)>,
}

impl<'a> Places<'a> {
    fn of(view: &View<'a>) -> Self {
        let camera = &view.found.camera;
        let [columns, rows] = PLACES;
        let along = |count: usize, at: usize, px: f64| (at as f64 + 0.5) / count as f64 * px - 0.5;
        let places = (0..rows).flat_map(|row| (0..columns).map(move |column| (column, row)));
        let sky = places.filter_map(|(column, row)| {
            let place = PixelPoint::new(
                along(columns, column, camera.width_px),
                along(rows, row, camera.height_px),
            );
            let direction = view.found.apparent_direction_of(&place)?;
            view.shows(&place)
                .then(|| (place, constellation_at(&direction)))
        });
        let catalog = view.catalog;
        let stars = (0..catalog.brighter_than(CONSPICUOUS_MAG)).map(StarIndex::new);
        let axis = view.found.icrs_to_camera.boresight();
        let cos_radius = libm::cos(camera.radius_rad());
        let stars = stars.filter_map(|index| {
            let star = catalog.star(index);
            // Their designations name the constellation: `19 bet Ori`.
            let constellation = catalog.name_of(index)?.split(' ').next_back()?;
            let is_near = axis.dot(&star.direction) > cos_radius;
            let place = view.found.pixel_of(&star.direction).filter(|_| is_near);
            let light = libm::pow(10.0, -0.4 * f64::from(star.v_mag));
            Some((
                constellation,
                light,
                place.is_some_and(|place| view.shows(&place)),
            ))
        });
        Self {
            sky: sky.collect(),
            stars: stars.collect(),
        }
    }

    /// What is seen of a constellation; `None` where nothing is.
    fn constellation(
        &self,
        view: &View<'_>,
        known: &Constellation,
    ) -> Option<VisibleConstellation> {
        let is_it = |abbreviation: &str| abbreviation == known.abbreviation;
        let places: Vec<PixelPoint> = self
            .sky
            .iter()
            .filter(|(_, name)| is_it(name))
            .map(|(place, _)| *place)
            .collect();
        let own = self.stars.iter().filter(|(name, ..)| is_it(name));
        let all: f64 = own.clone().map(|(_, light, _)| light).sum();
        let light: f64 = own.filter(|star| star.2).map(|(_, light, _)| light).sum();
        if places.is_empty() && light == 0.0 {
            return None;
        }
        let points: Vec<UnitVector<Icrs>> = known
            .lines
            .iter()
            .flat_map(|line| points_of(line))
            .collect();
        let on_figure: Vec<PixelPoint> = points
            .iter()
            .filter_map(|point| view.found.pixel_of(point).filter(|place| view.shows(place)))
            .collect();
        // The middle of a few points of a figure may lie at its edge.
        let is_enough = on_figure.len() >= 4 && 4 * on_figure.len() >= points.len();
        let middle = if is_enough {
            mean(&on_figure)
        } else {
            mean(&places)
        };
        Some(VisibleConstellation {
            abbreviation: known.abbreviation,
            name: if known.abbreviation == "Ser" {
                "Serpens"
            } else {
                known.name
            },
            share: places.len() as f64 / self.sky.len().max(1) as f64,
            figure_share: on_figure.len() as f64 / points.len().max(1) as f64,
            light,
            light_share: if all > 0.0 { light / all } else { 0.0 },
            middle,
        })
    }
}

/// The stars of a line, and the middles between them.
fn points_of(line: &[UnitVector<Icrs>]) -> impl Iterator<Item = UnitVector<Icrs>> + '_ {
    let middles = line
        .windows(2)
        .map(|pair| UnitVector::from_vector(pair[0].as_vector() + pair[1].as_vector()));
    line.iter().copied().chain(middles)
}

fn mean(places: &[PixelPoint]) -> Option<PixelPoint> {
    let count = places.len() as f64;
    let sum = |along: fn(&PixelPoint) -> f64| places.iter().map(along).sum::<f64>();
    (!places.is_empty()).then(|| PixelPoint::new(sum(|p| p.x) / count, sum(|p| p.y) / count))
}
