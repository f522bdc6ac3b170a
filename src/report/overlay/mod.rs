//! What does the frame show? A picture of it with its stars ringed and named.
//!
//! ([`Shown`], [`Solution`], [`Catalog`]) → [`RgbImage`]. Nothing is read or written, and equal
//! input gives equal pictures.
//!
//! 1. The frame becomes a picture, in its own colors where these are known ([`Stretch`]). Small frames are enlarged and large ones reduced, by
//!    whole factors.
//! 2. Names and V magnitudes of the brightest stars are placed where there is room, brightest first. They
//!    cover neither each other nor what is marked.
//! 3. Detections are marked ([`Rings`]): a circle is identified, a square is not, a cross is not a star.
//! 4. Where site and time are known: zenith, horizon and cardinal points.
//! 5. A strip below the frame shows file, centre and field, the meaning of the rings, a scale bar,
//!    and north and east at the frame's centre.
//!
//! Caveats: the scale is that of the frame's centre. A pixel is drawn as an area: the centre of
//! pixel (0, 0) lies half a pixel from the picture's corner.

mod canvas;
mod horizon;
mod labels;
mod legend;
mod mark;
mod names;
mod options;
mod picture;
mod shown;

#[doc(hidden)]
pub use canvas::FONT;

use crate::frame::OVERLAY_TEXT;
use crate::pipeline::{Background, Solution};
use crate::sky::catalog::Catalog;
use canvas::Canvas;
use image::RgbImage;
use mark::MarkKind;
use picture::Picture;
use std::io;

pub use options::{OverlayOptions, Rings, Stretch};
pub use shown::Shown;

/// Draws a frame with its detections, as PNG. The file is marked as an overlay
/// ([`is_overlay`](crate::frame::is_overlay)).
///
/// # Errors
/// If the picture cannot be encoded, which does not occur for frames within the limits of their size.
pub fn png(
    shown: &Shown<'_>,
    solution: &Solution,
    catalog: &Catalog,
    options: &OverlayOptions,
) -> io::Result<Vec<u8>> {
    to_png(&draw(shown, solution, catalog, options)).map_err(io::Error::other)
}

/// Draws a frame with its detections.
#[doc(hidden)]
pub fn draw(
    shown: &Shown<'_>,
    solution: &Solution,
    catalog: &Catalog,
    options: &OverlayOptions,
) -> RgbImage {
    let picture = Picture::of(shown, solution.background.as_ref(), options.stretch);
    let marks = mark::marks(solution, catalog, &picture);
    let unit = picture.stroke_unit();
    let mut canvas = Canvas::new(&picture, legend::size(&picture, unit), unit);
    let image = [picture.width as f32, picture.height as f32];
    let (marked, labels) = labels::place(&marks, options.rings, image, unit);
    for mark in marked.iter().rev() {
        mark.draw(&mut canvas);
    }
    if let Some(found) = solution.outcome.identification() {
        horizon::draw(&mut canvas, &picture, found);
    }
    let letters = MarkKind::Identified.color().lighter();
    for label in labels {
        if let Some(line) = label.line {
            canvas.line(&line, 0.8, letters);
        }
        canvas.text(&label.text, label.at, labels::SIZE, letters);
    }
    legend::draw(&mut canvas, &picture, shown.title, solution, &marks);
    canvas.into_image()
}

/// A frame without marks, at the size of its overlay. [`Stretch::Hard`] needs the noise of its background.
#[doc(hidden)]
pub fn photograph(
    shown: &Shown<'_>,
    background: Option<&Background>,
    options: &OverlayOptions,
) -> RgbImage {
    Picture::of(shown, background, options.stretch).into_image()
}

/// Encodes the picture, fast rather than small.
fn to_png(picture: &RgbImage) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let (width, height) = picture.dimensions();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    // Filters do not help with noise; equal grey levels compress without them.
    encoder.set_filter(png::Filter::NoFilter);
    encoder.set_deflate_compression(png::DeflateCompression::Level(1));
    let (keyword, text) = OVERLAY_TEXT;
    encoder.add_text_chunk(keyword.to_owned(), text.to_owned())?;
    encoder.write_header()?.write_image_data(picture)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests;
