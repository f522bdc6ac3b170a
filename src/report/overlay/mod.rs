//! What does the frame show? A picture of it with its stars ringed and named.
//!
//! ([`Shown`], [`Solution`], [`Catalog`]) → a picture ([`OverlayFormat`]). Nothing is read or written, and equal
//! input gives equal pictures.
//!
//! 1. The frame becomes a picture, in its own colors where these are known ([`Stretch`]). Small frames are enlarged and large ones reduced, by
//!    whole factors.
//! 2. Names and V magnitudes of the brightest stars are placed where there is room, brightest first. They
//!    cover neither each other nor what is marked.
//! 3. Detections are marked ([`Rings`]): a circle is identified, a square is not, a cross is not a star; a
//!    rhombus is the Moon or a planet.
//! 4. Where site and time are known: zenith, horizon and cardinal points. Where they are wanted
//!    ([`SkyLayers`]): grids, constellations, clusters, nebulae and galaxies.
//! 5. A strip below the frame shows file, centre and field, the meaning of the rings, a scale bar,
//!    and north and east at the frame's centre.
//!
//! Caveats: the scale is that of the frame's centre. A pixel is drawn as an area: the centre of
//! pixel (0, 0) lies half a pixel from the picture's corner.

mod canvas;
mod encode;
mod labels;
#[cfg(feature = "page")]
mod layers;
mod legend;
mod mark;
mod names;
mod options;
mod picture;
mod raster;
mod shown;
mod sky;
mod svg;
mod trails;

pub use svg::is_overlay as is_svg;

use crate::annotate::Scene;
use crate::catalog::Catalog;
#[cfg(feature = "page")]
use crate::frame::Frame;
use crate::solve::{Background, Solution};
use canvas::Canvas;
use image::RgbImage;
use labels::Room;
use mark::MarkKind;
use picture::Picture;
use std::io;

#[cfg(feature = "page")]
pub(super) use encode::jpeg;
#[cfg(feature = "page")]
pub(super) use layers::{SkyLayer, sky_layers};
pub use options::{
    LabelKind, OverlayFormat, OverlayOptions, PictureCut, Rings, SkyLayers, Stretch,
};
pub use shown::Shown;

/// Draws a frame with its detections, as a file of the kind that `options` say. It is marked as an overlay
/// ([`is_overlay`](crate::frame::is_overlay)).
///
/// # Errors
/// If the picture cannot be encoded, which does not occur for frames within the limits of their size.
pub fn encoded(
    shown: &Shown<'_>,
    solution: &Solution,
    catalog: &Catalog,
    options: &OverlayOptions,
) -> io::Result<Vec<u8>> {
    let (canvas, picture) = drawing(shown, solution, catalog, options);
    match options.format {
        OverlayFormat::Png => encode::png(&raster::image(&canvas, &picture)),
        OverlayFormat::Jpeg => encode::marked_jpeg(&raster::image(&canvas, &picture)),
        OverlayFormat::Svg => svg::document(&canvas, picture).map(String::into_bytes),
    }
}

/// Draws a frame with its detections.
pub fn draw(
    shown: &Shown<'_>,
    solution: &Solution,
    catalog: &Catalog,
    options: &OverlayOptions,
) -> RgbImage {
    let (canvas, picture) = drawing(shown, solution, catalog, options);
    raster::image(&canvas, &picture)
}

/// The frame as a picture, and what is drawn over it.
fn drawing(
    shown: &Shown<'_>,
    solution: &Solution,
    catalog: &Catalog,
    options: &OverlayOptions,
) -> (Canvas, Picture) {
    let picture = Picture::draw(shown, solution.background.as_ref(), options);
    let catalog = solution.catalog(catalog);
    let scene = Scene::of(solution, catalog);
    let marks = mark::marks(solution, scene.as_ref(), catalog, &picture, options.label);
    let unit = picture.stroke_unit();
    let sentence = scene.as_ref().map(|scene| scene.sentence.as_str());
    let mut canvas = Canvas::new(legend::size(&picture, unit, sentence), unit);
    let image = [picture.width as f32, picture.height as f32];
    let mut room = Room::of(&marks, options.rings, image, unit);
    if let Some((found, scene)) = solution.outcome.identification().zip(scene.as_ref()) {
        sky::draw(
            &mut canvas,
            (&picture, found),
            scene,
            options.sky,
            &mut room,
        );
    }
    let labels = room.place_names();
    trails::draw(&mut canvas, &picture, solution);
    for mark in room.marked().iter().rev() {
        mark.draw(&mut canvas);
    }
    let letters = MarkKind::Identified.color().lighter();
    for label in labels {
        if let Some(line) = label.line {
            canvas.line(&line, 0.8, letters);
        }
        canvas.text(&label.text, label.at, labels::SIZE, letters);
    }
    legend::draw(
        &mut canvas,
        &picture,
        (shown.title, sentence),
        solution,
        &marks,
    );
    (canvas, picture)
}

/// A frame without marks, at the size of its overlay. [`Stretch::Hard`] needs the noise of its background.
pub fn photograph(
    shown: &Shown<'_>,
    background: Option<&Background>,
    options: &OverlayOptions,
) -> RgbImage {
    Picture::draw(shown, background, options).into_image()
}

/// A frame without marks, reduced to at most `most_px` columns.
#[cfg(feature = "page")]
pub(super) fn thumbnail(frame: &Frame<'_>, most_px: usize) -> RgbImage {
    Picture::reduced(frame, frame.width.div_ceil(most_px)).into_image()
}

#[cfg(test)]
mod tests;
