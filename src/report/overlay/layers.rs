//! What of the sky is drawn over a frame, layer by layer, for pages that draw it themselves.

use super::canvas::Canvas;
use super::labels::Room;
use super::picture::Picture;
use super::sky::OverlayLayer;
use crate::annotate::Scene;
use crate::base::format::to_decimals;
use crate::base::size::Size;
use crate::catalog::Catalog;
use crate::report::figure::{DrawnShape, Letters};
use crate::solve::Solution;
use serde::Serialize;

/// A layer, in pixels of the frame.
#[derive(Debug, Serialize)]
pub(in crate::report) struct SkyLayer {
    /// Its name in scripts.
    pub key: &'static str,
    /// Its name for people.
    pub title: &'static str,
    /// x and y of the points of each line.
    lines: Vec<Vec<[f64; 2]>>,
    /// x and y of the centre, and radius.
    circles: Vec<[f64; 3]>,
    /// Where the baseline of each text begins.
    texts: Vec<(String, [f64; 2])>,
}

/// The layers of a frame that have something within it; none where it is not identified. A name stands where there is room
/// among the names of its layer.
pub(in crate::report) fn sky_layers(solution: &Solution, catalog: &Catalog) -> Vec<SkyLayer> {
    let known = solution
        .outcome
        .identification()
        .zip(Scene::of(solution, catalog));
    let Some((found, scene)) = known else {
        return Vec::new();
    };
    let size = Size::new(solution.width, solution.height);
    let picture = Picture::empty(size);
    let unit = picture.stroke_unit();
    let image = [size.width as f32, size.height as f32];
    let drawn = |layer: OverlayLayer| {
        let mut canvas = Canvas::new(size, unit);
        layer.draw(
            &mut canvas,
            (&picture, found),
            &scene,
            &mut Room::all(image, unit),
        );
        SkyLayer::from_canvas(layer, canvas)
    };
    let layers = OverlayLayer::ALL.into_iter().map(drawn);
    layers.filter(|layer| !layer.is_empty()).collect()
}

impl SkyLayer {
    fn from_canvas(layer: OverlayLayer, canvas: Canvas) -> Self {
        let (key, title) = names(layer);
        let mut this = Self {
            key,
            title,
            lines: Vec::new(),
            circles: Vec::new(),
            texts: Vec::new(),
        };
        for shape in canvas.shapes {
            match shape {
                DrawnShape::Line { points, .. } => {
                    this.lines.push(points.into_iter().map(pixel).collect());
                }
                DrawnShape::Circle { center, radius, .. } => {
                    let [x, y] = pixel(center);
                    this.circles.push([x, y, rounded(radius)]);
                }
                DrawnShape::Text(Letters { text, at, .. }) => this.texts.push((text, pixel(at))),
                // Of charts.
                DrawnShape::Disk { .. } | DrawnShape::Polygon { .. } => (),
            }
        }
        this
    }

    fn is_empty(&self) -> bool {
        self.lines.is_empty() && self.circles.is_empty() && self.texts.is_empty()
    }
}

fn names(layer: OverlayLayer) -> (&'static str, &'static str) {
    match layer {
        OverlayLayer::Horizon => ("horizon", "horizon"),
        OverlayLayer::EquatorialGrid => ("equatorial", "right ascension and declination"),
        OverlayLayer::HorizontalGrid => ("horizontal", "azimuth and altitude"),
        OverlayLayer::DeepSky => ("deepsky", "clusters and nebulae"),
        OverlayLayer::Constellations => ("constellations", "constellations"),
    }
}

/// A position in the picture as a pixel of the frame: (0, 0) is the centre of the first one.
fn pixel(position: [f32; 2]) -> [f64; 2] {
    position.map(|along| rounded(along - 0.5))
}

fn rounded(px: f32) -> f64 {
    to_decimals(f64::from(px), 1)
}
