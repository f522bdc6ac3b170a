//! The font of drawings, and the outlines of its letters.

use std::sync::OnceLock;
use tiny_skia::{Path, PathBuilder};
use ttf_parser::{Face, OutlineBuilder};

/// Font with Latin and Greek letters; its source is in assets/README.md.
static FONT: &[u8] = include_bytes!("../../../assets/DejaVuSans-subset.ttf");

fn face() -> &'static Face<'static> {
    static FACE: OnceLock<Face> = OnceLock::new();
    FACE.get_or_init(|| Face::parse(FONT, 0).expect("tests draw with this very font"))
}

/// Width of `text` in letters of this size, in the unit of `size`.
pub(in crate::report) fn text_width(text: &str, size: f32) -> f32 {
    let face = face();
    let scale = size / f32::from(face.units_per_em());
    let advance = |c: char| f32::from(face.glyph_hor_advance(glyph(c)).unwrap_or(0));
    text.chars().map(advance).sum::<f32>() * scale
}

/// The glyph of `c`; the empty box if the font does not have it.
fn glyph(c: char) -> ttf_parser::GlyphId {
    face().glyph_index(c).unwrap_or(ttf_parser::GlyphId(0))
}

/// The outlines of `text`, whose baseline begins at (x, y).
pub(super) fn outline(text: &str, [x, y]: [f32; 2], size_px: f32) -> Option<Path> {
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
        let others = "°′″−×·…⁰¹²³⁴⁵⁶⁷⁸⁹⁻ –éüßÅ";
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
