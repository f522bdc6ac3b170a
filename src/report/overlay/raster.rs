//! A drawing as pixels.

use super::canvas::Canvas;
use super::picture::Picture;
use crate::report::figure::{Rgb, draw_shape};
use image::RgbImage;
use tiny_skia::{Pixmap, Transform};

/// The drawing over `picture`.
pub(super) fn image(canvas: &Canvas, picture: &Picture) -> RgbImage {
    let mut pixmap = background(canvas, picture);
    for shape in &canvas.shapes {
        draw_shape(&mut pixmap, shape, Transform::identity());
    }
    let opaque = pixmap.data().chunks(4).flat_map(|p| [p[0], p[1], p[2]]);
    RgbImage::from_raw(pixmap.width(), pixmap.height(), opaque.collect())
        .expect("three bytes a pixel")
}

/// The picture in the upper left corner.
fn background(canvas: &Canvas, picture: &Picture) -> Pixmap {
    let [width, height] = [canvas.size.width, canvas.size.height].map(|side| side.max(1));
    // A picture has at least one pixel, and far fewer than 2^31.
    let mut pixmap = Pixmap::new(width as u32, height as u32)
        .expect("the size of a picture is above zero and bounded");
    let [r, g, b] = Rgb::BACKDROP.0;
    pixmap.fill(tiny_skia::Color::from_rgba8(r, g, b, 255));
    let rows = pixmap.data_mut().chunks_mut(width * 4);
    for (row, colors) in rows.zip(picture.pixels.chunks(picture.width)) {
        for (pixel, &[r, g, b]) in row.chunks_mut(4).zip(colors) {
            pixel.copy_from_slice(&[r, g, b, 255]);
        }
    }
    pixmap
}
