//! What drawings are made of: strokes, areas and letters, in pixels.

use super::color::Rgb;

/// A line or a circle's edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::report) struct Stroke {
    /// In pixels.
    pub(in crate::report) width: f32,
    pub(in crate::report) color: Rgb,
    /// Length of dashes and gaps, in pixels.
    pub(in crate::report) dash: Option<f32>,
}

/// Something that is drawn.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::report) enum DrawnShape {
    #[cfg_attr(
        not(feature = "overlay"),
        expect(dead_code, reason = "overlays have rings")
    )]
    Circle {
        center: [f32; 2],
        radius: f32,
        stroke: Stroke,
    },
    Line {
        points: Vec<[f32; 2]>,
        stroke: Stroke,
    },
    /// A filled circle, and what a pointer shows.
    Disk {
        center: [f32; 2],
        radius: f32,
        color: Rgb,
        note: String,
    },
    /// A filled polygon, and what a pointer shows.
    Polygon {
        points: Vec<[f32; 2]>,
        color: Rgb,
        note: String,
    },
    Text(Letters),
}

impl DrawnShape {
    /// Width of the edge of a polygon, in pixels.
    pub(super) const SEAM_PX: f32 = 0.8;
}

/// A line of text.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::report) struct Letters {
    pub(in crate::report) text: String,
    /// Where the baseline has its anchor.
    pub(in crate::report) at: [f32; 2],
    pub(in crate::report) size: f32,
    pub(in crate::report) color: Rgb,
    pub(in crate::report) anchor: Anchor,
    /// Whether it is read from bottom to top.
    pub(in crate::report) is_upright: bool,
    pub(in crate::report) halo: Option<Halo>,
    /// The width that it must have in any font.
    pub(in crate::report) width: Option<f32>,
}

/// The border of letters over a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::report) struct Halo {
    pub(in crate::report) width: f32,
    pub(in crate::report) color: Rgb,
}

/// The part of a text that is at its place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::report) enum Anchor {
    Start,
    Middle,
    End,
}

impl Anchor {
    /// The part of the width that is before the place.
    #[cfg(feature = "overlay")]
    pub(super) const fn part(self) -> f32 {
        match self {
            Self::Start => 0.0,
            Self::Middle => 0.5,
            Self::End => 1.0,
        }
    }
}
