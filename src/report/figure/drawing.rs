//! What a figure is drawn on, and how wide its letters are.

use super::color::Rgb;
use super::shape::{Anchor, DrawnShape, Letters, Stroke};
use super::typeset::typeset;

/// Shapes of a figure, each put at its place on it.
#[derive(Debug, Default)]
pub(super) struct Drawing {
    pub(super) shapes: Vec<DrawnShape>,
    /// Where the places of what is drawn next begin.
    pub(super) origin: [f32; 2],
}

impl Drawing {
    fn place(&self, [x, y]: [f32; 2]) -> [f32; 2] {
        [self.origin[0] + x, self.origin[1] + y]
    }

    pub(super) fn line(&mut self, points: &[[f32; 2]], stroke: Stroke) {
        let points = points.iter().map(|at| self.place(*at)).collect();
        self.shapes.push(DrawnShape::Line { points, stroke });
    }

    pub(super) fn polygon(&mut self, points: &[[f32; 2]], color: Rgb, note: &str) {
        let points = points.iter().map(|at| self.place(*at)).collect();
        self.shapes.push(DrawnShape::Polygon {
            points,
            color,
            note: typeset(note),
        });
    }

    pub(super) fn disk(&mut self, center: [f32; 2], radius: f32, color: Rgb, note: &str) {
        self.shapes.push(DrawnShape::Disk {
            center: self.place(center),
            radius,
            color,
            note: typeset(note),
        });
    }

    pub(super) fn text(&mut self, letters: Letters) {
        let at = self.place(letters.at);
        self.shapes
            .push(DrawnShape::Text(Letters { at, ..letters }));
    }
}

impl Stroke {
    /// A line without gaps.
    pub(super) const fn solid(width: f32, color: Rgb) -> Self {
        Self {
            width,
            color,
            dash: None,
        }
    }
}

impl Letters {
    /// Black letters to the right of `at`, vertically centred on it.
    pub(super) fn new(text: &str, [x, y]: [f32; 2], size: f32) -> Self {
        /// From the baseline to the middle of a capital letter.
        const MIDDLE: f32 = 0.36;
        Self {
            text: typeset(text),
            at: [x, y + MIDDLE * size],
            size,
            color: Rgb::BLACK,
            anchor: Anchor::Start,
            is_upright: false,
            halo: None,
            width: None,
        }
    }

    /// The same, centred on its place or to the left of it.
    pub(super) fn anchored(self, anchor: Anchor) -> Self {
        Self { anchor, ..self }
    }

    /// The same, read from bottom to top and centred on `at`.
    pub(super) fn upright(text: &str, at: [f32; 2], size: f32) -> Self {
        Self {
            at: [Self::new("", [0.0, at[0]], size).at[1], at[1]],
            is_upright: true,
            ..Self::new(text, at, size).anchored(Anchor::Middle)
        }
    }
}

/// About how wide `text` is when it is drawn: fonts of other machines are hardly wider than that of ours.
pub(super) fn width_px(text: &str, size: f32) -> f32 {
    let em = |character: char| match character {
        'i' | 'j' | 'l' | 'I' | 'J' | '\'' => 0.29,
        ' ' | '.' | ',' | ':' | ';' | '|' | '/' | '(' | ')' | 'f' | 't' | '-' | '⁻' | '·' => {
            0.37
        }
        '⁰'..='⁹' | '²' | '³' | '¹' | 'r' => 0.41,
        'w' | '+' | '=' | '<' | '>' | '−' | '×' | '±' => 0.84,
        'm' | 'M' | 'W' | '%' | '@' | '…' => 0.97,
        'A'..='Z' => 0.71,
        _ => 0.62,
    };
    size * typeset(text).chars().map(em).sum::<f32>()
}

/// The words of `text` in lines of at most this width.
pub(super) fn wrapped(text: &str, size: f32, most_px: f32) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if width_px(&format!("{line} {word}"), size) <= most_px => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}
