//! Drawings as pixels.

use super::color::Rgb;
use super::letters;
use super::shape::{DrawnShape, Halo, Letters, Stroke};
use std::io;
use tiny_skia::{
    Color, FillRule, LineCap, LineJoin, Paint, Path, PathBuilder, Pixmap, StrokeDash, Transform,
};

/// Pixels of a figure for each of its SVG, on either axis: so it is sharp.
const FACTOR: usize = 2;
const HALO_OPACITY: u8 = 200;

/// The content of a PNG file with a figure of this width and height, on white.
pub(super) fn png(size: [usize; 2], shapes: &[DrawnShape]) -> io::Result<Vec<u8>> {
    let [width, height] = size.map(|side| (FACTOR * side) as u32);
    let mut pixmap = Pixmap::new(width, height)
        .ok_or_else(|| io::Error::other("a figure without width or height"))?;
    pixmap.fill(Color::WHITE);
    for shape in shapes {
        draw(
            &mut pixmap,
            shape,
            Transform::from_scale(FACTOR as f32, FACTOR as f32),
        );
    }
    let pixels: Vec<u8> = pixmap
        .data()
        .chunks(4)
        .flat_map(|p| [p[0], p[1], p[2]])
        .collect();
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.write_header()?.write_image_data(&pixels)?;
    Ok(bytes)
}

/// Draws `shape`, whose places `transform` gives.
pub(in crate::report) fn draw(pixmap: &mut Pixmap, shape: &DrawnShape, transform: Transform) {
    let mut stroke = |path: Option<Path>, stroke: Stroke| {
        if let Some(path) = path {
            draw_stroke(pixmap, &path, stroke, transform);
        }
    };
    match shape {
        DrawnShape::Circle {
            center: [x, y],
            radius,
            stroke: of,
        } => stroke(PathBuilder::from_circle(*x, *y, *radius), *of),
        DrawnShape::Line { points, stroke: of } => stroke(path_through(points).finish(), *of),
        DrawnShape::Disk {
            center: [x, y],
            radius,
            color,
            ..
        } => {
            if let Some(path) = PathBuilder::from_circle(*x, *y, *radius) {
                fill(pixmap, &path, *color, transform);
            }
        }
        DrawnShape::Polygon { points, color, .. } => {
            let mut path = path_through(points);
            path.close();
            if let Some(path) = path.finish() {
                fill(pixmap, &path, *color, transform);
                let seam = Stroke {
                    width: DrawnShape::SEAM_PX,
                    color: *color,
                    dash: None,
                };
                draw_stroke(pixmap, &path, seam, transform);
            }
        }
        DrawnShape::Text(letters) => draw_text(pixmap, letters, transform),
    }
}

fn path_through(points: &[[f32; 2]]) -> PathBuilder {
    let mut builder = PathBuilder::new();
    for (i, [x, y]) in points.iter().enumerate() {
        if i == 0 {
            builder.move_to(*x, *y);
        } else {
            builder.line_to(*x, *y);
        }
    }
    builder
}

fn draw_text(pixmap: &mut Pixmap, of: &Letters, transform: Transform) {
    let [x, y] = of.at;
    let before = of.anchor.part() * letters::text_width(&of.text, of.size);
    let Some(path) = letters::outline(&of.text, [x - before, y], of.size) else {
        return;
    };
    let transform = if of.is_upright {
        transform.pre_concat(Transform::from_rotate_at(-90.0, x, y))
    } else {
        transform
    };
    if let Some(Halo { width, color }) = of.halo {
        let border = Stroke {
            width,
            color,
            dash: None,
        };
        let paint = paint(color, HALO_OPACITY);
        pixmap.stroke_path(&path, &paint, &skia_stroke(border), transform, None);
    }
    fill(pixmap, &path, of.color, transform);
}

fn fill(pixmap: &mut Pixmap, path: &Path, color: Rgb, transform: Transform) {
    pixmap.fill_path(path, &paint(color, 255), FillRule::Winding, transform, None);
}

fn draw_stroke(pixmap: &mut Pixmap, path: &Path, stroke: Stroke, transform: Transform) {
    let paint = paint(stroke.color, 255);
    pixmap.stroke_path(path, &paint, &skia_stroke(stroke), transform, None);
}

fn skia_stroke(stroke: Stroke) -> tiny_skia::Stroke {
    let dashes = |length: f32| StrokeDash::new(vec![length, length], 0.0);
    tiny_skia::Stroke {
        width: stroke.width,
        line_cap: LineCap::Round,
        line_join: LineJoin::Round,
        dash: stroke.dash.and_then(dashes),
        ..tiny_skia::Stroke::default()
    }
}

fn paint(Rgb([r, g, b]): Rgb, opacity: u8) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color_rgba8(r, g, b, opacity);
    paint.anti_alias = true;
    paint
}
