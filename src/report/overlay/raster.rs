//! A drawing as pixels.

use super::canvas::{Canvas, DrawnShape, Rgb, Stroke};
use super::letters;
use super::picture::Picture;
use image::RgbImage;
use tiny_skia::{
    FillRule, LineCap, LineJoin, Paint, Path, PathBuilder, Pixmap, StrokeDash, Transform,
};

const HALO_OPACITY: u8 = 200;

/// The drawing over `picture`.
pub(super) fn image(canvas: &Canvas, picture: &Picture) -> RgbImage {
    let mut pixmap = background(canvas, picture);
    for shape in &canvas.shapes {
        draw(&mut pixmap, shape);
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

fn draw(pixmap: &mut Pixmap, shape: &DrawnShape) {
    match shape {
        DrawnShape::Circle {
            center: [x, y],
            radius,
            stroke,
        } => {
            if let Some(path) = PathBuilder::from_circle(*x, *y, *radius) {
                draw_stroke(pixmap, &path, *stroke, 255);
            }
        }
        DrawnShape::Line { points, stroke } => {
            let mut builder = PathBuilder::new();
            for (i, [x, y]) in points.iter().enumerate() {
                if i == 0 {
                    builder.move_to(*x, *y);
                } else {
                    builder.line_to(*x, *y);
                }
            }
            if let Some(path) = builder.finish() {
                draw_stroke(pixmap, &path, *stroke, 255);
            }
        }
        DrawnShape::Text {
            text,
            at,
            size,
            halo,
            color,
        } => {
            let Some(path) = letters::outline(text, *at, *size) else {
                return;
            };
            let border = Stroke {
                width: *halo,
                color: Rgb([0, 0, 0]),
                dash: None,
            };
            draw_stroke(pixmap, &path, border, HALO_OPACITY);
            let paint = paint(*color, 255);
            pixmap.fill_path(
                &path,
                &paint,
                FillRule::Winding,
                Transform::identity(),
                None,
            );
        }
    }
}

fn draw_stroke(pixmap: &mut Pixmap, path: &Path, stroke: Stroke, opacity: u8) {
    let paint = paint(stroke.color, opacity);
    let dashes = |length: f32| StrokeDash::new(vec![length, length], 0.0);
    let stroke = tiny_skia::Stroke {
        width: stroke.width,
        line_cap: LineCap::Round,
        line_join: LineJoin::Round,
        dash: stroke.dash.and_then(dashes),
        ..tiny_skia::Stroke::default()
    };
    pixmap.stroke_path(path, &paint, &stroke, Transform::identity(), None);
}

fn paint(color: Rgb, opacity: u8) -> Paint<'static> {
    let mut paint = Paint::default();
    let [r, g, b] = color.0;
    paint.set_color_rgba8(r, g, b, opacity);
    paint.anti_alias = true;
    paint
}
