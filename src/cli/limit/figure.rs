//! The limiting magnitude over one parameter or several: a panel for each.

use crate::cli::plot::{
    Area, BLUE, FONT, Figure, LETTERS_PX, MARGIN_PX, ORANGE, chart_on, draw_words, said,
};
use plotters::coord::ranged1d::{AsRangedCoord, ValueFormatter};
use plotters::prelude::*;
use plotters::style::text_anchor::HPos;
use starpipe::base::format::five_digits as number;
use starpipe::model::sensitivity::{Budget, Curve, Scenario, Spacing, Sweep};
use std::ops::Range;

const PANEL_PX: (u32, u32) = (440, 310);
/// A panel that stands alone.
const ALONE_PX: (u32, u32) = (640, 440);
const SWEEPS_ABREAST: usize = 2;
const FIGURES_ABREAST: usize = 3;
const TITLE_PX: u32 = 18;
/// Above a panel: its title and what its curves are.
const HEAD_PX: u32 = 48;
/// Below the axis of x, and left of that of y.
const AXIS_PX: (u32, u32) = (44, 56);
const COLOURS: [RGBColor; 2] = [BLUE, ORANGE];
/// Magnitudes above and below the curves.
const ROOM_MAG: f64 = 0.04;

/// The curves over one parameter.
#[derive(Debug, Clone)]
pub(super) struct Panel {
    title: Option<String>,
    axis: String,
    spacing: Spacing,
    curves: Vec<Curve>,
    /// The scenario itself, where it lies within.
    here: Option<(f64, f64)>,
}

impl Panel {
    pub(super) fn new(
        title: Option<String>,
        sweep: &Sweep,
        curves: Vec<Curve>,
        scenario: &Scenario,
    ) -> Self {
        let (first, last) = (sweep.values[0], sweep.values[sweep.values.len() - 1]);
        let value = sweep.parameter.get(scenario);
        let limit = Budget::new(scenario).limit_vmag;
        Self {
            title,
            axis: sweep.parameter.title(),
            spacing: sweep.spacing,
            curves,
            here: value
                .filter(|value| (first..=last).contains(value))
                .map(|value| (value, limit)),
        }
    }

    fn points(&self) -> impl Iterator<Item = (f64, f64)> {
        self.curves
            .iter()
            .flat_map(|curve| curve.points.iter().copied())
            .chain(self.here)
    }

    fn draw<B: DrawingBackend>(&self, area: &Area<B>) -> anyhow::Result<()> {
        let (head, body) = area.split_vertically(HEAD_PX);
        self.draw_head(&head)?;
        let within = |of: fn((f64, f64)) -> f64| -> Range<f64> {
            let values = || self.points().map(of);
            values().fold(f64::INFINITY, f64::min)..values().fold(f64::NEG_INFINITY, f64::max)
        };
        let (x, y) = (within(|point| point.0), within(|point| point.1));
        // A flat curve has a height as well.
        let room = ((y.end - y.start) * ROOM_MAG).max(0.01);
        let y = y.start - room..y.end + room;
        match self.spacing {
            Spacing::Linear => self.draw_over(&body, x, y),
            Spacing::Log => self.draw_over(&body, x.log_scale(), y),
        }
    }

    /// The title, and below it what the curves are: above the panel they hide nothing.
    fn draw_head<B: DrawingBackend>(&self, area: &Area<B>) -> anyhow::Result<()> {
        let width = area.dim_in_pixel().0 as i32;
        let left = (MARGIN_PX + AXIS_PX.1) as i32;
        if let Some(title) = &self.title {
            let place = ((width + left) / 2, HEAD_PX as i32 / 4);
            draw_words(area, title, (TITLE_PX, HPos::Center), place)?;
        }
        let step = (width - left) / self.curves.len().max(1) as i32;
        let y = HEAD_PX as i32 * 3 / 4;
        for (place, (curve, colour)) in self.curves.iter().zip(COLOURS).enumerate() {
            let x = left + place as i32 * step;
            let stroke = PathElement::new([(x, y), (x + 20, y)], colour.stroke_width(2));
            area.draw(&stroke).map_err(said)?;
            draw_words(area, &curve.label, (LETTERS_PX, HPos::Left), (x + 28, y))?;
        }
        Ok(())
    }

    fn draw_over<B: DrawingBackend, X>(
        &self,
        area: &Area<B>,
        x: X,
        y: Range<f64>,
    ) -> anyhow::Result<()>
    where
        X: AsRangedCoord<Value = f64>,
        X::CoordDescType: ValueFormatter<f64>,
    {
        let mut builder = chart_on(area, AXIS_PX);
        let mut chart = builder.build_cartesian_2d(x, y).map_err(said)?;
        chart
            .configure_mesh()
            .x_desc(&self.axis)
            .y_desc("limiting magnitude (V)")
            .x_label_formatter(&|value| number(*value))
            .x_labels(8)
            .y_labels(8)
            .label_style((FONT, LETTERS_PX))
            .max_light_lines(1)
            .draw()
            .map_err(said)?;
        for (curve, colour) in self.curves.iter().zip(COLOURS) {
            let points = curve.points.iter().copied();
            chart
                .draw_series(LineSeries::new(points, colour.stroke_width(2)))
                .map_err(said)?;
        }
        let here = self.here.map(|point| Circle::new(point, 4, BLACK.filled()));
        chart.draw_series(here).map_err(said)?;
        Ok(())
    }
}

/// Panels side by side.
pub(super) struct Sheet {
    panels: Vec<Panel>,
    abreast: usize,
    panel_px: (u32, u32),
    /// Lines in the place after the last panel.
    words: Vec<String>,
}

impl Sheet {
    /// One panel alone.
    pub(super) fn of_one(panel: Panel) -> Self {
        Self {
            panels: vec![panel],
            abreast: 1,
            panel_px: ALONE_PX,
            words: Vec::new(),
        }
    }

    /// The panels of sweeps.
    pub(super) fn of_sweeps(mut panels: Vec<Panel>) -> Self {
        match (panels.len(), panels.pop()) {
            (1, Some(panel)) => Self::of_one(panel),
            (_, last) => Self {
                panels: panels.into_iter().chain(last).collect(),
                abreast: SWEEPS_ABREAST,
                panel_px: PANEL_PX,
                words: Vec::new(),
            },
        }
    }

    /// The paper's figures, all of them.
    pub(super) fn of_figures(panels: Vec<Panel>, words: Vec<String>) -> Self {
        Self {
            panels,
            abreast: FIGURES_ABREAST,
            panel_px: PANEL_PX,
            words,
        }
    }

    fn lines(&self) -> usize {
        self.panels.len().div_ceil(self.abreast)
    }
}

impl Figure for Sheet {
    fn size_px(&self) -> (u32, u32) {
        let (width, height) = self.panel_px;
        (width * self.abreast as u32, height * self.lines() as u32)
    }

    fn draw<B: DrawingBackend>(&self, area: &Area<B>) -> anyhow::Result<()> {
        let places = area.split_evenly((self.lines(), self.abreast));
        for (place, panel) in places.iter().zip(&self.panels) {
            panel.draw(place)?;
        }
        let Some(rest) = places.get(self.panels.len()) else {
            return Ok(());
        };
        for (line, words) in self.words.iter().enumerate() {
            let y = HEAD_PX as i32 + line as i32 * (LETTERS_PX as i32 + 8);
            let x = AXIS_PX.1 as i32;
            draw_words(rest, words, (LETTERS_PX, HPos::Left), (x, y))?;
        }
        Ok(())
    }
}
