//! What is drawn over a picture: strokes and letters, in pixels of the picture.

use crate::base::size::Size;
use crate::report::figure::{Anchor, DrawnShape, Halo, Letters, Rgb, Stroke, text_width};

impl Rgb {
    pub(super) const WHITE: Self = Self([240, 240, 240]);
    pub(super) const DIM: Self = Self([175, 180, 190]);
    /// Background of the strip below the frame.
    pub(super) const BACKDROP: Self = Self([16, 18, 24]);

    /// Halfway to white.
    pub(super) fn lighter(self) -> Self {
        Self(self.0.map(|c| c / 2 + 127))
    }
}

/// Height of the strip below a picture, in units.
pub(super) const STRIP_HEIGHT: f32 = 76.0;

/// A drawing over a picture. Sizes of strokes and letters are in units that suit the picture's size.
pub(super) struct Canvas {
    pub(super) size: Size,
    pub(super) shapes: Vec<DrawnShape>,
    /// Pixels per unit.
    pub(super) unit: f32,
}

impl Canvas {
    /// A drawing of `size` pixels.
    pub(super) fn new(size: Size, unit: f32) -> Self {
        Self {
            size,
            shapes: Vec::new(),
            unit,
        }
    }

    pub(super) fn width(&self) -> f32 {
        self.size.width as f32
    }

    fn stroke(&self, width: f32, color: Rgb, dash: Option<f32>) -> Stroke {
        Stroke {
            width: width * self.unit,
            color,
            dash: dash.map(|length| length * self.unit),
        }
    }

    /// Draws a circle; `radius` in pixels.
    pub(super) fn ring(&mut self, center: [f32; 2], radius: f32, width: f32, color: Rgb) {
        let stroke = self.stroke(width, color, None);
        self.shapes.push(DrawnShape::Circle {
            center,
            radius,
            stroke,
        });
    }

    /// Draws a dashed circle; `radius` in pixels.
    pub(super) fn dashed_ring(&mut self, center: [f32; 2], radius: f32, width: f32, color: Rgb) {
        /// Length of dashes.
        const DASH: f32 = 4.0;
        let stroke = self.stroke(width, color, Some(DASH));
        self.shapes.push(DrawnShape::Circle {
            center,
            radius,
            stroke,
        });
    }

    /// Draws a line through `points`.
    pub(super) fn line(&mut self, points: &[[f32; 2]], width: f32, color: Rgb) {
        let stroke = self.stroke(width, color, None);
        let points = points.to_vec();
        self.shapes.push(DrawnShape::Line { points, stroke });
    }

    /// Draws `text` with a dark border, its baseline beginning at `at`; `size` in units.
    pub(super) fn text(&mut self, text: &str, at: [f32; 2], size: f32, color: Rgb) {
        /// Width of the border, in units.
        const HALO: f32 = 3.0;
        let halo = Halo {
            width: HALO * self.unit,
            color: Rgb::BLACK,
        };
        self.shapes.push(DrawnShape::Text(Letters {
            text: text.to_owned(),
            at,
            size: size * self.unit,
            color,
            anchor: Anchor::Start,
            is_upright: false,
            halo: Some(halo),
            // Keeps names apart in other fonts, too.
            width: Some(self.text_width(text, size)),
        }));
    }

    /// Width of `text` in letters of `size` units, in pixels.
    pub(super) fn text_width(&self, text: &str, size: f32) -> f32 {
        text_width(text, size * self.unit)
    }
}
