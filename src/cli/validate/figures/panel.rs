//! A panel with dots, lines and bars over two axes, and sheets of such panels.

use crate::cli::limit::number;
use crate::cli::plot::{Area, FONT, Figure, draw_words, said};
use plotters::coord::ranged1d::{AsRangedCoord, ValueFormatter};
use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

const PANEL_PX: (u32, u32) = (440, 330);
/// A panel that stands alone.
const ALONE_PX: (u32, u32) = (640, 440);
const MARGIN_PX: u32 = 10;
const LETTERS_PX: u32 = 15;
const TITLE_PX: u32 = 17;
/// Above a panel: its title and what its marks are.
const HEAD_PX: u32 = 50;
/// Below the axis of x, and left of that of y.
const AXIS_PX: (u32, u32) = (44, 66);
/// Room beyond the marks on either side, as a part of the axis.
const ROOM: f64 = 0.04;

/// What is drawn in a panel.
pub(super) struct Layer {
    /// What it is; layers without a label are not told of.
    pub label: Option<String>,
    pub colour: RGBColor,
    pub marks: Marks,
}

/// x and y, and the ends of an interval of y.
pub(super) type Dot = (f64, f64, [f64; 2]);

/// Marks at (x, y).
pub(super) enum Marks {
    Line(Vec<(f64, f64)>),
    Dots(Vec<Dot>),
    /// From x to x, and how high.
    Bars(Vec<([f64; 2], f64)>),
    /// A line from side to side at each y.
    Levels(Vec<f64>),
}

impl Layer {
    pub(super) fn new(label: impl Into<String>, colour: RGBColor, marks: Marks) -> Self {
        Self {
            label: Some(label.into()),
            colour,
            marks,
        }
    }

    /// A grey line that tells how it should be.
    pub(super) fn guide(marks: Marks) -> Self {
        Self {
            label: None,
            colour: RGBColor(130, 130, 130),
            marks,
        }
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
            Marks::Levels(_) => Vec::new(),
        }
    }
}

/// An axis; it reaches over all marks unless it is bounded.
#[derive(Default)]
pub(super) struct Axis {
    pub words: String,
    pub is_log: bool,
    pub from: Option<f64>,
    pub to: Option<f64>,
}

impl Axis {
    pub(super) fn of(words: impl Into<String>) -> Self {
        Self {
            words: words.into(),
            ..Self::default()
        }
    }

    pub(super) fn log(words: impl Into<String>, is_log: bool) -> Self {
        Self {
            is_log,
            ..Self::of(words)
        }
    }

    pub(super) fn within(self, from: f64, to: f64) -> Self {
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
pub(super) struct Panel {
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
            (true, false) => self.draw_over(&body, (x.log_scale(), y), ends),
            (false, true) => self.draw_over(&body, (x, y.log_scale()), ends),
            (true, true) => self.draw_over(&body, (x.log_scale(), y.log_scale()), ends),
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
        let mut builder = ChartBuilder::on(area);
        builder
            .margin(MARGIN_PX)
            .margin_top(2)
            // The last number of the axis is as wide.
            .margin_right(2 * MARGIN_PX)
            .x_label_area_size(AXIS_PX.0)
            .y_label_area_size(AXIS_PX.1);
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

/// Panels side by side, so many abreast.
pub(super) struct Sheet {
    pub panels: Vec<Panel>,
    pub abreast: usize,
}

impl Sheet {
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
