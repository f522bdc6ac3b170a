//! A picture of the frame for people: its stars ringed and named, with a scale and an arrow to the north.
//!
//! ([`Frame`], [`Solution`], [`Catalog`]) → [`RgbImage`]. Nothing is read or written, and the same input
//! gives the same picture.
//!
//! 1. The frame's levels become greys: background and its gradients taken away, then asinh, so that
//!    faint stars show and bright ones keep their size. Small frames are enlarged and large ones
//!    reduced, by whole factors.
//! 2. A ring round every detection: identified, not identified, or no star.
//! 3. Names and V magnitudes, the brightest first, where there is room for them.
//! 4. A strip below the frame: file, centre and field, what the rings mean, a scale bar, and where
//!    north and east are at the frame's centre.
//!
//! Caveats: the scale is that of the frame's centre. Pixel areas, not centres, are drawn: what lies at pixel
//! (0, 0) is drawn half a pixel from the picture's corner.

mod canvas;
mod grey;
mod labels;
mod legend;
mod names;

use crate::base::coords::PixelPoint;
use crate::camera::CameraModel;
use crate::frame::{Frame, OVERLAY_TEXT};
use crate::identify::Identification;
use crate::pipeline::{Solution, Source};
use crate::sky::catalog::Catalog;
pub use canvas::FONT;
use canvas::{Canvas, Colour};
use grey::Grey;
use image::RgbImage;

/// What a detection turned out to be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Identified,
    Unidentified,
    NotAStar,
}

impl Kind {
    /// Told apart by brightness, too, for who cannot tell the colours apart.
    fn colour(self) -> Colour {
        match self {
            Self::Identified => Colour([110, 240, 150]),
            Self::Unidentified => Colour([255, 170, 60]),
            Self::NotAStar => Colour([205, 85, 95]),
        }
    }

    fn stroke(self) -> f32 {
        match self {
            Self::Identified => 1.3,
            Self::Unidentified => 1.1,
            Self::NotAStar => 0.8,
        }
    }
}

/// A detection as it is drawn, in the picture's own pixels.
#[derive(Debug, Clone, PartialEq)]
struct Mark {
    x: f32,
    y: f32,
    radius: f32,
    kind: Kind,
    /// What to write beside it, and its V magnitude, where it is identified.
    label: Option<(String, f32)>,
}

/// Radius of the smallest ring and of the largest, and what a magnitude adds, in units of the strokes.
const RING_RADIUS: (f32, f32) = (5.0, 15.0);
const RING_PER_MAG: f32 = 1.1;
/// The smallest ring is no smaller than this, in pixels of the frame: enlarged stars need larger rings.
const RING_RADIUS_PX: f32 = 3.0;
/// Rings are smaller in a crowd: the smallest is this part of the mean distance between stars, ...
const RING_SHARE: f32 = 0.2;
/// ... but no less than this part of its usual size.
const LEAST_RING: f32 = 0.6;
/// This part of all detections is brighter than the one that gets the smallest ring.
const LARGER_RINGS: f64 = 0.8;

/// Draws `frame` with what was found in it; `title` is what to call it.
pub fn draw(title: &str, frame: &Frame, solution: &Solution, catalog: &Catalog) -> RgbImage {
    let grey = Grey::of(frame, solution.background.as_ref());
    let marks = marks(solution, catalog, &grey);
    let unit = grey.stroke_unit();
    let mut canvas = Canvas::new(&grey, legend::size(&grey, unit), unit);
    for mark in marks.iter().rev() {
        let colour = mark.kind.colour();
        canvas.ring([mark.x, mark.y], mark.radius, mark.kind.stroke(), colour);
    }
    let image = [grey.width as f32, grey.height as f32];
    let letters = Kind::Identified.colour().lighter();
    for label in labels::place(&marks, image, unit) {
        if let Some(line) = label.line {
            canvas.line(&line, 0.8, letters);
        }
        canvas.text(&label.text, label.at, labels::SIZE, letters);
    }
    legend::draw(&mut canvas, &grey, title, solution, &marks);
    canvas.into_image()
}

/// The picture as the bytes of a PNG file, compressed fast and not small, which says that it is no frame
/// ([`is_overlay`](crate::frame::is_overlay)).
///
/// # Errors
/// [`png::EncodingError`] if the picture cannot be encoded, which the pictures made here give no occasion for.
pub fn to_png(picture: &RgbImage) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let (width, height) = picture.dimensions();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    // Noise has no gradients that a filter could use; greys repeat themselves without one.
    encoder.set_filter(png::Filter::NoFilter);
    encoder.set_deflate_compression(png::DeflateCompression::Level(1));
    let (keyword, text) = OVERLAY_TEXT;
    encoder.add_text_chunk(keyword.to_owned(), text.to_owned())?;
    encoder.write_header()?.write_image_data(picture)?;
    Ok(bytes)
}

/// Every detection as it is drawn, brightest first.
fn marks(solution: &Solution, catalog: &Catalog, grey: &Grey) -> Vec<Mark> {
    let mut catalog_star = vec![None; solution.sources.len()];
    for star_match in identification(solution).iter().flat_map(|i| &i.matches) {
        if let Some(star) = catalog_star.get_mut(star_match.source.get()) {
            *star = Some(star_match.star);
        }
    }
    let rings = Rings::of(&solution.sources, grey);
    let sources = solution.sources.iter().zip(catalog_star);
    sources
        .map(|(source, star)| {
            let [x, y] = grey.place_of(&source.position);
            let label = star.map(|index| {
                let v_mag = catalog.star(index).v_mag;
                (names::label(catalog, index), v_mag)
            });
            Mark {
                x,
                y,
                radius: rings.radius(source),
                kind: kind(source, label.is_some()),
                label,
            }
        })
        .collect()
}

fn kind(source: &Source, identified: bool) -> Kind {
    let star_like = source.measured.is_none_or(|m| m.flags.is_star_like());
    match (identified, star_like) {
        (true, _) => Kind::Identified,
        (false, true) => Kind::Unidentified,
        (false, false) => Kind::NotAStar,
    }
}

/// How large rings are, in pixels of the picture.
struct Rings {
    /// The flux that gets the smallest ring.
    flux: f64,
    smallest: f32,
    unit: f32,
}

impl Rings {
    /// For `sources`, which come brightest first.
    fn of(sources: &[Source], grey: &Grey) -> Self {
        let place = (sources.len() as f64 * LARGER_RINGS) as usize;
        let area = (grey.width * grey.height) as f32;
        let spacing = (area / sources.len().max(1) as f32).sqrt();
        let usual = (RING_RADIUS.0 * grey.stroke_unit()).max(RING_RADIUS_PX * grey.scale());
        Self {
            flux: sources.get(place).and_then(|s| s.flux).unwrap_or(f64::NAN),
            smallest: usual * (RING_SHARE * spacing / usual).clamp(LEAST_RING, 1.0),
            unit: grey.stroke_unit(),
        }
    }

    fn radius(&self, source: &Source) -> f32 {
        let above = source
            .flux
            .map_or(0.0, |flux| 2.5 * (flux / self.flux).log10());
        // Written so that what is no number gets the smallest ring.
        let above = if above > 0.0 { above as f32 } else { 0.0 };
        let most = (RING_RADIUS.1 * self.unit).max(self.smallest);
        (self.smallest + RING_PER_MAG * self.unit * above).min(most)
    }
}

fn identification(solution: &Solution) -> Option<&Identification> {
    solution.outcome.identification()
}

/// Where in the picture, at the frame's centre, north and east are: unit vectors, y down.
fn north_and_east(identification: &Identification) -> [[f32; 2]; 2] {
    let (boresight, _) = identification.icrs_to_camera.boresight_and_up();
    let (east, north) = boresight.east_north();
    [north, east].map(|axis| {
        let along = identification.icrs_to_camera.matrix() * axis;
        let x = if identification.camera.mirrored {
            -along.x
        } else {
            along.x
        };
        let length = x.hypot(along.y);
        [(x / length) as f32, (along.y / length) as f32]
    })
}

/// Length in pixels of the frame of an angle across its centre.
fn length_px(camera: &CameraModel, angle_rad: f64) -> f64 {
    2.0 * camera.focal_length_px * (angle_rad / 2.0).tan()
}

/// Where the centre of a pixel comes to lie, in pixels from the picture's upper left corner.
fn scaled(pixel: &PixelPoint, scale: f32) -> [f32; 2] {
    [
        (pixel.x as f32 + 0.5) * scale,
        (pixel.y as f32 + 0.5) * scale,
    ]
}

#[cfg(test)]
mod tests;
