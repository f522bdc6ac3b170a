//! What is drawn in a panel: layers of marks of one kind and color.

use super::style::{BLACK, GREY};
use plotters::style::RGBColor;

/// Marks of one kind and color.
#[derive(Clone)]
pub(crate) struct PlotLayer {
    /// Name in the legend, if it is there.
    pub(crate) label: Option<String>,
    pub(crate) color: RGBColor,
    pub(crate) marks: Marks,
    /// What the colors of its cells mean, where they are numbers.
    pub(crate) scale: Option<ColorScale>,
}

/// Colors of numbers, shown as a bar beside the panel.
#[derive(Clone)]
pub(crate) struct ColorScale {
    /// The quantity and its unit.
    pub(crate) title: String,
    /// The numbers of the first and the last color.
    pub(crate) ends: [f64; 2],
    /// Whether equal ratios have equal distances.
    pub(crate) is_log: bool,
    /// The color of a place between the ends, from 0 to 1.
    pub(crate) color_of: fn(f64) -> RGBColor,
}

impl ColorScale {
    /// The number at a place between the ends, from 0 to 1.
    pub(super) fn number_at(&self, place: f64) -> f64 {
        let [first, last] = self.ends;
        if self.is_log {
            first * (last / first).powf(place)
        } else {
            first + (last - first) * place
        }
    }
}

/// x, y, and an interval of y.
pub(crate) type Dot = (f64, f64, [f64; 2]);

/// Marks at (x, y).
#[derive(Clone)]
pub(crate) enum Marks {
    Line(Vec<(f64, f64)>),
    /// Several lines.
    Lines(Vec<Vec<(f64, f64)>>),
    /// Dots without an interval.
    Points(Vec<(f64, f64)>),
    Dots(Vec<Dot>),
    /// An interval of x, and a height.
    Bars(Vec<([f64; 2], f64)>),
    /// A line from side to side at each y.
    Levels(Vec<f64>),
    /// Rectangles with colors of their own, from left to right and then upwards.
    Cells(Vec<FilledRectangle>),
    /// Text centred on a place.
    Texts(Vec<(f64, f64, String)>),
}

/// A filled rectangle.
#[derive(Clone)]
pub(crate) struct FilledRectangle {
    pub(crate) x: [f64; 2],
    pub(crate) y: [f64; 2],
    pub(crate) color: RGBColor,
}

impl PlotLayer {
    pub(crate) fn new(label: impl Into<String>, color: RGBColor, marks: Marks) -> Self {
        Self {
            label: Some(label.into()),
            color,
            marks,
            scale: None,
        }
    }

    /// Marks that are not in the legend.
    pub(crate) fn unnamed(color: RGBColor, marks: Marks) -> Self {
        Self {
            label: None,
            color,
            marks,
            scale: None,
        }
    }

    /// Cells whose colors are numbers.
    pub(crate) fn colored(cells: Vec<FilledRectangle>, scale: ColorScale) -> Self {
        Self {
            scale: Some(scale),
            ..Self::unnamed(BLACK, Marks::Cells(cells))
        }
    }

    /// Grey marks that show what is expected.
    pub(crate) fn guide(marks: Marks) -> Self {
        Self::unnamed(GREY, marks)
    }

    /// The points that the axes must reach.
    pub(super) fn points(&self) -> Vec<(f64, f64)> {
        match &self.marks {
            Marks::Line(points) | Marks::Points(points) => points.clone(),
            Marks::Lines(lines) => lines.concat(),
            Marks::Dots(dots) => dots
                .iter()
                .flat_map(|&(x, y, [low, high])| [(x, y), (x, low), (x, high)])
                .collect(),
            Marks::Bars(bars) => bars
                .iter()
                .flat_map(|&([from, to], y)| [(from, 0.0), (to, y)])
                .collect(),
            Marks::Cells(cells) => cells
                .iter()
                .flat_map(|cell| [(cell.x[0], cell.y[0]), (cell.x[1], cell.y[1])])
                .collect(),
            Marks::Texts(texts) => texts.iter().map(|(x, y, _)| (*x, *y)).collect(),
            Marks::Levels(_) => Vec::new(),
        }
    }
}
