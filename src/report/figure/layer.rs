//! What is drawn in a panel: layers of marks of one kind and color.

use super::color::{ColorScale, Rgb};

/// Marks of one kind and color.
#[derive(Debug, Clone)]
pub struct PlotLayer {
    /// Name in the legend, if it is there.
    pub label: Option<String>,
    /// Of lines, dots, bars and letters.
    pub color: Rgb,
    /// What is drawn.
    pub marks: Marks,
    /// What the colors of its areas mean, where they are numbers.
    pub scale: Option<ColorScale>,
}

/// Marks at (x, y).
#[derive(Debug, Clone)]
pub enum Marks {
    /// Through all points.
    Line(Vec<(f64, f64)>),
    /// Several lines.
    Lines(Vec<Vec<(f64, f64)>>),
    /// Points with their errors.
    Dots(Vec<Dot>),
    /// An interval of x, and a height.
    Bars(Vec<([f64; 2], f64)>),
    /// A line from side to side at each y.
    Levels(Vec<f64>),
    /// A dashed line from bottom to top at each x, with its name.
    Moments(Vec<(f64, String)>),
    /// With colors of their own.
    Areas(Vec<Area>),
    /// Text centred on a place.
    Texts(Vec<(f64, f64, String)>),
}

/// A point with its errors.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Dot {
    /// Its place along the x axis.
    pub x: f64,
    /// Its place along the y axis.
    pub y: f64,
    /// An interval of x.
    pub x_range: Option<[f64; 2]>,
    /// An interval of y.
    pub y_range: Option<[f64; 2]>,
    /// What a pointer shows.
    pub note: String,
}

impl From<(f64, f64)> for Dot {
    fn from((x, y): (f64, f64)) -> Self {
        Self {
            x,
            y,
            ..Self::default()
        }
    }
}

impl From<(f64, f64, [f64; 2])> for Dot {
    fn from((x, y, range): (f64, f64, [f64; 2])) -> Self {
        Self {
            y_range: Some(range),
            ..Self::from((x, y))
        }
    }
}

/// A filled polygon. What lies beyond the panel ends at its border.
#[derive(Debug, Clone)]
pub struct Area {
    /// Its corners.
    pub points: Vec<(f64, f64)>,
    /// What it is filled with.
    pub color: Rgb,
    /// What a pointer shows.
    pub note: String,
}

impl Area {
    /// The rectangle of an interval of x and of y.
    pub fn rectangle([left, right]: [f64; 2], [low, high]: [f64; 2], color: Rgb) -> Self {
        Self {
            points: vec![(left, low), (right, low), (right, high), (left, high)],
            color,
            note: String::new(),
        }
    }
}

impl PlotLayer {
    /// Marks with a name.
    pub fn new(label: impl Into<String>, color: Rgb, marks: Marks) -> Self {
        Self {
            label: Some(label.into()),
            ..Self::unnamed(color, marks)
        }
    }

    /// Marks that are not in the legend.
    pub const fn unnamed(color: Rgb, marks: Marks) -> Self {
        Self {
            label: None,
            color,
            marks,
            scale: None,
        }
    }

    /// Areas whose colors are numbers.
    pub fn colored(areas: Vec<Area>, scale: ColorScale) -> Self {
        Self {
            scale: Some(scale),
            ..Self::unnamed(Rgb::BLACK, Marks::Areas(areas))
        }
    }

    /// Grey marks that show what is expected.
    pub const fn guide(marks: Marks) -> Self {
        Self::unnamed(Rgb::GREY, marks)
    }

    /// The points that the axes must reach.
    pub(super) fn points(&self) -> Vec<(f64, f64)> {
        match &self.marks {
            Marks::Line(points) => points.clone(),
            Marks::Lines(lines) => lines.concat(),
            Marks::Dots(dots) => dots.iter().flat_map(Dot::points).collect(),
            Marks::Bars(bars) => bars
                .iter()
                .flat_map(|&([from, to], y)| [(from, 0.0), (to, y)])
                .collect(),
            Marks::Areas(areas) => areas.iter().flat_map(|area| area.points.clone()).collect(),
            Marks::Texts(texts) => texts.iter().map(|(x, y, _)| (*x, *y)).collect(),
            Marks::Levels(levels) => levels.iter().map(|y| (f64::NAN, *y)).collect(),
            Marks::Moments(moments) => moments.iter().map(|(x, _)| (*x, f64::NAN)).collect(),
        }
    }
}

impl Dot {
    fn points(&self) -> [(f64, f64); 5] {
        let ([left, right], [low, high]) = (
            self.x_range.unwrap_or([self.x; 2]),
            self.y_range.unwrap_or([self.y; 2]),
        );
        [
            (self.x, self.y),
            (left, self.y),
            (right, self.y),
            (self.x, low),
            (self.x, high),
        ]
    }
}
