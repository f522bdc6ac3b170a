//! Draws strokes and letters on a picture.

use super::picture::Picture;
use crate::base::size::Size;
use image::RgbImage;
use std::sync::OnceLock;
use tiny_skia::{FillRule, LineCap, LineJoin, Paint, Path, PathBuilder, Pixmap, Stroke, Transform};
use ttf_parser::{Face, OutlineBuilder};

/// Font with Latin and Greek letters; its source is in assets/README.md.
pub static FONT: &[u8] = include_bytes!("../../../assets/DejaVuSans-subset.ttf");

/// Width of the dark border around letters, in units of strokes.
const HALO: f32 = 3.0;
const HALO_OPACITY: u8 = 200;
/// Background of the strip below the frame.
const BACKDROP: Rgb = Rgb([16, 18, 24]);

fn face() -> &'static Face<'static> {
    static FACE: OnceLock<Face> = OnceLock::new();
    FACE.get_or_init(|| Face::parse(FONT, 0).expect("tests draw with this very font"))
}

/// Red, green and blue.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Rgb(pub(super) [u8; 3]);

impl Rgb {
    pub(super) const WHITE: Self = Self([240, 240, 240]);
    pub(super) const DIM: Self = Self([175, 180, 190]);

    /// Halfway to white.
    pub(super) fn lighter(self) -> Self {
        Self(self.0.map(|c| c / 2 + 127))
    }

    fn paint(self, opacity: u8) -> Paint<'static> {
        let mut paint = Paint::default();
        let [r, g, b] = self.0;
        paint.set_color_rgba8(r, g, b, opacity);
        paint.anti_alias = true;
        paint
    }
}

/// A picture to draw on. Sizes of strokes and letters are in units that suit its size.
pub(super) struct Canvas {
    pixmap: Pixmap,
    /// Pixels per unit.
    pub(super) unit: f32,
}

impl Canvas {
    /// A canvas of `size` pixels with the frame in its upper left corner.
    pub(super) fn new(picture: &Picture, size: Size, unit: f32) -> Self {
        let Size { width, height } = size;
        // A picture has at least one pixel, and far fewer than 2^31.
        let mut pixmap = Pixmap::new(width.max(1) as u32, height.max(1) as u32)
            .expect("the size of a picture is above zero and bounded");
        let [r, g, b] = BACKDROP.0;
        pixmap.fill(tiny_skia::Color::from_rgba8(r, g, b, 255));
        let rows = pixmap.data_mut().chunks_mut(width * 4);
        for (row, colors) in rows.zip(picture.pixels.chunks(picture.width)) {
            for (pixel, &[r, g, b]) in row.chunks_mut(4).zip(colors) {
                pixel.copy_from_slice(&[r, g, b, 255]);
            }
        }
        Self { pixmap, unit }
    }

    pub(super) fn width(&self) -> f32 {
        self.pixmap.width() as f32
    }

    /// Draws a circle; `radius` in pixels.
    pub(super) fn ring(&mut self, [x, y]: [f32; 2], radius: f32, stroke: f32, color: Rgb) {
        if let Some(path) = PathBuilder::from_circle(x, y, radius) {
            self.stroke(&path, stroke * self.unit, color, 255);
        }
    }

    /// Draws a line through `points`.
    pub(super) fn line(&mut self, points: &[[f32; 2]], stroke: f32, color: Rgb) {
        let mut builder = PathBuilder::new();
        for (i, [x, y]) in points.iter().enumerate() {
            if i == 0 {
                builder.move_to(*x, *y);
            } else {
                builder.line_to(*x, *y);
            }
        }
        if let Some(path) = builder.finish() {
            self.stroke(&path, stroke * self.unit, color, 255);
        }
    }

    /// Draws `text` with a dark border, its baseline beginning at `at`; `size` in units.
    pub(super) fn text(&mut self, text: &str, at: [f32; 2], size: f32, color: Rgb) {
        let Some(path) = outline(text, at, size * self.unit) else {
            return;
        };
        self.stroke(&path, HALO * self.unit, Rgb([0, 0, 0]), HALO_OPACITY);
        self.pixmap.fill_path(
            &path,
            &color.paint(255),
            FillRule::Winding,
            Transform::identity(),
            None,
        );
    }

    pub(super) fn into_image(self) -> RgbImage {
        let (width, height) = (self.pixmap.width(), self.pixmap.height());
        let opaque = self
            .pixmap
            .data()
            .chunks(4)
            .flat_map(|p| [p[0], p[1], p[2]]);
        RgbImage::from_raw(width, height, opaque.collect()).expect("three bytes a pixel")
    }

    fn stroke(&mut self, path: &Path, width: f32, color: Rgb, opacity: u8) {
        let stroke = Stroke {
            width,
            line_cap: LineCap::Round,
            line_join: LineJoin::Round,
            ..Stroke::default()
        };
        let paint = color.paint(opacity);
        self.pixmap
            .stroke_path(path, &paint, &stroke, Transform::identity(), None);
    }
}

/// Width of `text` in letters of this size, in the unit of `size`.
pub(super) fn text_width(text: &str, size: f32) -> f32 {
    let face = face();
    let scale = size / f32::from(face.units_per_em());
    let advance = |c: char| f32::from(face.glyph_hor_advance(glyph(c)).unwrap_or(0));
    text.chars().map(advance).sum::<f32>() * scale
}

/// The glyph of `c`; the empty box if the font does not have it.
fn glyph(c: char) -> ttf_parser::GlyphId {
    face().glyph_index(c).unwrap_or(ttf_parser::GlyphId(0))
}

fn outline(text: &str, [x, y]: [f32; 2], size_px: f32) -> Option<Path> {
    let face = face();
    let scale = size_px / f32::from(face.units_per_em());
    let mut pen = Pen {
        builder: PathBuilder::new(),
        scale,
        x,
        y,
    };
    for c in text.chars() {
        face.outline_glyph(glyph(c), &mut pen);
        pen.x += scale * f32::from(face.glyph_hor_advance(glyph(c)).unwrap_or(0));
    }
    pen.builder.finish()
}

/// Converts the font's outlines, which have y up, to paths.
struct Pen {
    builder: PathBuilder,
    scale: f32,
    x: f32,
    y: f32,
}

impl Pen {
    fn at(&self, x: f32, y: f32) -> (f32, f32) {
        (self.x + x * self.scale, self.y - y * self.scale)
    }
}

impl OutlineBuilder for Pen {
    fn move_to(&mut self, x: f32, y: f32) {
        let (x, y) = self.at(x, y);
        self.builder.move_to(x, y);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        let (x, y) = self.at(x, y);
        self.builder.line_to(x, y);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        let ((x1, y1), (x, y)) = (self.at(x1, y1), self.at(x, y));
        self.builder.quad_to(x1, y1, x, y);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        let ((x1, y1), (x2, y2)) = (self.at(x1, y1), self.at(x2, y2));
        let (x, y) = self.at(x, y);
        self.builder.cubic_to(x1, y1, x2, y2, x, y);
    }

    fn close(&mut self) {
        self.builder.close();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_font_has_every_letter_that_names_and_captions_need() {
        let greek = "αβγδεζηθικλμνξοπρστυφχψω";
        let others = "°′″−×·…²³¹⁴⁵⁶⁷⁸⁹ –éüßÅ";
        let ascii: String = (' '..='~').collect();
        for c in greek.chars().chain(others.chars()).chain(ascii.chars()) {
            assert!(face().glyph_index(c).is_some(), "{c}");
        }
    }

    #[test]
    fn wider_texts_are_wider() {
        assert_eq!(text_width("", 12.0), 0.0);
        assert!(text_width("α CMa", 12.0) > text_width("α", 12.0));
        assert!((text_width("m", 24.0) - 2.0 * text_width("m", 12.0)).abs() < 1e-4);
    }
}
