//! A panel with dots, lines and bars over two axes, and sheets of such panels.

use super::{Area, FONT, Figure, LETTERS_PX, MARGIN_PX, chart_on, draw_words, said};
use plotters::coord::combinators::{BindKeyPoints, LogCoord, WithKeyPoints};
use plotters::coord::ranged1d::Ranged;
use plotters::coord::ranged1d::{AsRangedCoord, ValueFormatter};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use starpipe::base::format::five_digits as number;
use std::ops::Range;

const PANEL_PX: (u32, u32) = (440, 330);
/// A panel that stands alone.
const ALONE_PX: (u32, u32) = (640, 440);
const TITLE_PX: u32 = 17;
/// Above a panel: its title and what its marks are.
const HEAD_PX: u32 = 50;
/// Below the axis of x, and left of that of y.
const AXIS_PX: (u32, u32) = (44, 66);
/// Room beyond the marks on either side, as a part of the axis.
const ROOM: f64 = 0.04;

/// What is drawn in a panel.
pub(crate) struct Layer {
    /// What it is; layers without a label are not told of.
    pub label: Option<String>,
    pub colour: RGBColor,
    pub marks: Marks,
}

/// x and y, and the ends of an interval of y.
pub(crate) type Dot = (f64, f64, [f64; 2]);

/// Marks at (x, y).
pub(crate) enum Marks {
    Line(Vec<(f64, f64)>),
    Dots(Vec<Dot>),
    /// From x to x, and how high.
    Bars(Vec<([f64; 2], f64)>),
    /// A line from side to side at each y.
    Levels(Vec<f64>),
    /// Several lines of one kind.
    Lines(Vec<Vec<(f64, f64)>>),
    /// Filled with colours of their own, from left to right and then upwards.
    Cells(Vec<Cell>),
    /// Words around a place.
    Words(Vec<(f64, f64, String)>),
}

/// A rectangle from x to x and from y to y.
pub(crate) struct Cell {
    pub x: [f64; 2],
    pub y: [f64; 2],
    pub colour: RGBColor,
}

impl Layer {
    pub(crate) fn new(label: impl Into<String>, colour: RGBColor, marks: Marks) -> Self {
        Self {
            label: Some(label.into()),
            colour,
            marks,
        }
    }

    /// Marks that need no words.
    pub(crate) fn unnamed(colour: RGBColor, marks: Marks) -> Self {
        Self {
            label: None,
            colour,
            marks,
        }
    }

    /// A grey line that tells how it should be.
    pub(crate) fn guide(marks: Marks) -> Self {
        Self::unnamed(RGBColor(130, 130, 130), marks)
    }

    fn points(&self) -> Vec<(f64, f64)> {
        match &self.marks {
            Marks::Line(points) => points.clone(),
            Marks::Dots(dots) => {
                let ends =
                    |&(x, y, [low, high]): &(f64, f64, [f64; 2])| [(x, y), (x, low), (x, high)];
                dots.iter().flat_map(ends).collect()
            }
            Marks::Bars(bars) => {
                let corners = |&([from, to], y): &([f64; 2], f64)| [(from, 0.0), (to, y)];
                bars.iter().flat_map(corners).collect()
            }
            Marks::Lines(lines) => lines.concat(),
            Marks::Cells(cells) => {
                let corners = |cell: &Cell| [(cell.x[0], cell.y[0]), (cell.x[1], cell.y[1])];
                cells.iter().flat_map(corners).collect()
            }
            Marks::Words(words) => words.iter().map(|(x, y, _)| (*x, *y)).collect(),
            Marks::Levels(_) => Vec::new(),
        }
    }
}

/// An axis; it reaches over all marks unless it is bounded.
#[derive(Default)]
pub(crate) struct Axis {
    pub words: String,
    pub is_log: bool,
    pub from: Option<f64>,
    pub to: Option<f64>,
}

impl Axis {
    pub(crate) fn of(words: impl Into<String>) -> Self {
        Self {
            words: words.into(),
            ..Self::default()
        }
    }

    pub(crate) fn log(words: impl Into<String>, is_log: bool) -> Self {
        Self {
            is_log,
            ..Self::of(words)
        }
    }

    pub(crate) fn within(self, from: f64, to: f64) -> Self {
        Self {
            from: Some(from),
            to: Some(to),
            ..self
        }
    }

    /// From where to where it reaches for marks at `values`.
    fn range(&self, values: impl Iterator<Item = f64>) -> [f64; 2] {
        let fits = |value: &f64| value.is_finite() && (!self.is_log || *value > 0.0);
        let ends = values.filter(fits).fold(None, |ends, value| {
            let [low, high] = ends.unwrap_or([value; 2]);
            Some([f64::min(low, value), f64::max(high, value)])
        });
        let [low, high] = ends.unwrap_or([1.0, 2.0]);
        let [from, to] = if self.is_log {
            let room = (high / low).powf(ROOM).max(1.05);
            [low / room, high * room]
        } else {
            // What does not vary has an extent as well.
            let room = ((high - low) * ROOM).max(1e-3 * high.abs()).max(1e-6);
            [low - room, high + room]
        };
        [self.from.unwrap_or(from), self.to.unwrap_or(to)]
    }
}

/// Layers over two axes.
pub(crate) struct Panel {
    pub title: String,
    pub x: Axis,
    pub y: Axis,
    pub layers: Vec<Layer>,
}

impl Panel {
    fn draw<B: DrawingBackend>(&self, area: &Area<B>) -> anyhow::Result<()> {
        let (head, body) = area.split_vertically(HEAD_PX);
        self.draw_head(&head)?;
        let points: Vec<_> = self.layers.iter().flat_map(Layer::points).collect();
        let x = self.x.range(points.iter().map(|point| point.0));
        let y = self.y.range(points.iter().map(|point| point.1));
        let ends = (x, y);
        let (x, y) = (x[0]..x[1], y[0]..y[1]);
        match (self.x.is_log, self.y.is_log) {
            (false, false) => self.draw_over(&body, (x, y), ends),
            (true, false) => self.draw_over(&body, (by_ratios(x), y), ends),
            (false, true) => self.draw_over(&body, (x, by_ratios(y)), ends),
            (true, true) => self.draw_over(&body, (by_ratios(x), by_ratios(y)), ends),
        }
    }

    /// The title, and below it what the marks are: above the panel they hide nothing.
    fn draw_head<B: DrawingBackend>(&self, area: &Area<B>) -> anyhow::Result<()> {
        let left = (MARGIN_PX + AXIS_PX.1) as i32;
        draw_words(area, &self.title, (TITLE_PX, HPos::Left), (left, 14))?;
        let y = 38;
        let mut x = left;
        for layer in &self.layers {
            let Some(label) = &layer.label else {
                continue;
            };
            let filled = layer.colour.filled();
            match layer.marks {
                Marks::Dots(_) => area.draw(&Circle::new((x + 8, y), 4, filled)),
                Marks::Bars(_) => {
                    let pale = layer.colour.mix(0.45).filled();
                    area.draw(&Rectangle::new([(x, y - 6), (x + 16, y + 6)], pale))
                }
                _ => area.draw(&PathElement::new(
                    [(x, y), (x + 18, y)],
                    layer.colour.stroke_width(2),
                )),
            }
            .map_err(said)?;
            draw_words(area, label, (LETTERS_PX, HPos::Left), (x + 24, y))?;
            let style = (FONT, LETTERS_PX).into_text_style(area);
            let (width, _) = area.estimate_text_size(label, &style).map_err(said)?;
            x += 24 + width as i32 + 12;
        }
        Ok(())
    }

    fn draw_over<B: DrawingBackend, X, Y>(
        &self,
        area: &Area<B>,
        (x, y): (X, Y),
        ends: ([f64; 2], [f64; 2]),
    ) -> anyhow::Result<()>
    where
        X: AsRangedCoord<Value = f64>,
        X::CoordDescType: ValueFormatter<f64>,
        Y: AsRangedCoord<Value = f64>,
        Y::CoordDescType: ValueFormatter<f64>,
    {
        let mut builder = chart_on(area, AXIS_PX);
        let mut chart = builder.build_cartesian_2d(x, y).map_err(said)?;
        chart
            .configure_mesh()
            .x_desc(&self.x.words)
            .y_desc(&self.y.words)
            .x_label_formatter(&|value| number(*value))
            .y_label_formatter(&|value| number(*value))
            .x_labels(8)
            .y_labels(8)
            .label_style((FONT, LETTERS_PX))
            .max_light_lines(1)
            .draw()
            .map_err(said)?;
        let (across, up) = ends;
        for Layer { colour, marks, .. } in &self.layers {
            let stroke = colour.stroke_width(2);
            match marks {
                Marks::Line(points) => {
                    let line = LineSeries::new(points.iter().copied(), stroke);
                    chart.draw_series(line).map(drop)
                }
                Marks::Dots(dots) => {
                    let bars = dots.iter().map(|&(x, _, [low, high])| {
                        let low = low.max(up[0]);
                        PathElement::new([(x, low), (x, high.min(up[1]))], colour.stroke_width(1))
                    });
                    chart.draw_series(bars).map_err(said)?;
                    let dots = dots.iter();
                    let dots = dots.map(|&(x, y, _)| Circle::new((x, y), 3, colour.filled()));
                    chart.draw_series(dots).map(drop)
                }
                Marks::Bars(bars) => {
                    let pale = colour.mix(0.45).filled();
                    let bars = bars.iter().map(|&([from, to], height)| {
                        Rectangle::new([(from, 0.0), (to, height)], pale)
                    });
                    chart.draw_series(bars).map(drop)
                }
                Marks::Lines(lines) => {
                    for line in lines {
                        let line = LineSeries::new(line.iter().copied(), stroke);
                        chart.draw_series(line).map_err(said)?;
                    }
                    Ok(())
                }
                Marks::Cells(cells) => draw_cells(&mut chart, cells, ends),
                Marks::Words(words) => draw_around(&mut chart, area, words, *colour)?,
                Marks::Levels(places) => {
                    let lines = places
                        .iter()
                        .map(|&y| PathElement::new([(across[0], y), (across[1], y)], stroke));
                    chart.draw_series(lines).map(drop)
                }
            }
            .map_err(said)?;
        }
        Ok(())
    }
}

/// Fills rectangles.
fn draw_cells<B: DrawingBackend, X: Ranged<ValueType = f64>, Y: Ranged<ValueType = f64>>(
    chart: &mut ChartContext<'_, B, Cartesian2d<X, Y>>,
    cells: &[Cell],
    (across, up): ([f64; 2], [f64; 2]),
) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
    // Over the seams to those that follow: the ground would show through.
    let seam = |[from, to]: [f64; 2]| 0.003 * (to - from);
    let seams = (seam(across), seam(up));
    let cells = cells.iter().map(|cell| {
        let right = (cell.x[1] + seams.0).min(across[1]);
        let end = (right, (cell.y[1] + seams.1).min(up[1]));
        Rectangle::new([(cell.x[0], cell.y[0]), end], cell.colour.filled())
    });
    chart.draw_series(cells).map(drop)
}

/// Draws words around places, on a bright ground: what is below may have any colour.
fn draw_around<B: DrawingBackend, X: Ranged<ValueType = f64>, Y: Ranged<ValueType = f64>>(
    chart: &mut ChartContext<'_, B, Cartesian2d<X, Y>>,
    area: &Area<B>,
    words: &[(f64, f64, String)],
    colour: RGBColor,
) -> anyhow::Result<Result<(), DrawingAreaErrorKind<B::ErrorType>>> {
    let style = (FONT, LETTERS_PX)
        .into_text_style(area)
        .color(&colour)
        .pos(Pos::new(HPos::Center, VPos::Center));
    let mut placed = Vec::new();
    for (x, y, words) in words {
        let (width, height) = area.estimate_text_size(words, &style).map_err(said)?;
        let half = (width as i32 / 2 + 2, height as i32 / 2);
        let corners = [(-half.0, -half.1), (half.0, half.1)];
        let ground = Rectangle::new(corners, WHITE.mix(0.8).filled());
        let words = Text::new(words.clone(), (0, 0), style.clone());
        placed.push(EmptyElement::at((*x, *y)) + ground + words);
    }
    Ok(chart.draw_series(placed).map(drop))
}

/// A logarithmic axis with round numbers beside it, whatever its range.
fn by_ratios(range: Range<f64>) -> WithKeyPoints<LogCoord<f64>> {
    let points = round_numbers(range.start, range.end);
    let minor = decades(range.start, range.end);
    let minor = minor.flat_map(|decade| (2..10).map(move |i| decade * f64::from(i)));
    let minor: Vec<f64> = minor.filter(|value| range.contains(value)).collect();
    range
        .log_scale()
        .with_key_points(points)
        .with_light_points(minor)
}

/// Powers of ten, the first below `from`.
fn decades(from: f64, to: f64) -> impl Iterator<Item = f64> {
    let (first, last) = (from.log10().floor() as i32, to.log10().ceil() as i32);
    (first..=last).map(|power| 10f64.powi(power))
}

/// Numbers to be written beside a logarithmic axis: of each decade as few as leave three on the axis.
fn round_numbers(from: f64, to: f64) -> Vec<f64> {
    const ENOUGH: usize = 3;
    let mantissas: [&[f64]; 4] = [
        &[1.0],
        &[1.0, 3.0],
        &[1.0, 2.0, 5.0],
        &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0],
    ];
    let of = |mantissas: &[f64]| -> Vec<f64> {
        let all = decades(from, to).flat_map(|decade| mantissas.iter().map(move |m| m * decade));
        all.filter(|value| (from..=to).contains(value)).collect()
    };
    let enough = mantissas.iter().map(|mantissas| of(mantissas));
    enough
        .reduce(|points, more| if points.len() < ENOUGH { more } else { points })
        .unwrap_or_default()
}

/// Panels side by side, so many abreast.
pub(crate) struct Sheet {
    pub panels: Vec<Panel>,
    pub abreast: usize,
}

impl Sheet {
    /// A panel that stands alone.
    pub(crate) fn of_one(panel: Panel) -> Self {
        Self {
            panels: vec![panel],
            abreast: 1,
        }
    }

    fn lines(&self) -> usize {
        self.panels.len().div_ceil(self.abreast)
    }
}

impl Figure for Sheet {
    fn size_px(&self) -> (u32, u32) {
        match self.panels.len() {
            1 => ALONE_PX,
            _ => {
                let (width, height) = PANEL_PX;
                (width * self.abreast as u32, height * self.lines() as u32)
            }
        }
    }

    fn draw<B: DrawingBackend>(&self, area: &Area<B>) -> anyhow::Result<()> {
        let places = area.split_evenly((self.lines(), self.abreast));
        for (place, panel) in places.iter().zip(&self.panels) {
            panel.draw(place)?;
        }
        Ok(())
    }
}
