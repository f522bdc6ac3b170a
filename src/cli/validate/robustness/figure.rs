//! The rates as a figure: a panel for each parameter that is swept, or the standard table.

use super::rows::SweptRow;
use crate::cli::plot::{
    Area, Axis, BLACK, BLUE as RIGHT, FONT, Figure, LETTERS_PX, Marks, ORANGE as WRONG, Panel,
    PlotLayer, Scale, Sheet, chart_on, plot_error,
};
use plotters::prelude::*;
use starpipe::lab::robustness::{CaseResult, VariedParameter};

const PANELS_ABREAST: usize = 2;
const TABLE_WIDTH_PX: u32 = 900;
const ROW_HEIGHT_PX: u32 = 34;
/// Height above and below the rows of the table.
const FRAME_HEIGHT_PX: u32 = 110;
/// Below the x axis, and left of the y axis: the names of the rows.
const BELOW_PX: u32 = 44;
const LEFT_PX: u32 = 230;
const NO_ANSWER: RGBColor = RGBColor(120, 120, 120);

/// A panel for each parameter that is swept; none if none is.
pub(super) fn sweeps(rows: &[SweptRow]) -> Option<Sheet> {
    let mut parameters: Vec<VariedParameter> = Vec::new();
    for (parameter, _) in rows.iter().filter_map(|row| row.swept) {
        if !parameters.contains(&parameter) {
            parameters.push(parameter);
        }
    }
    let panels: Vec<Panel> = parameters
        .into_iter()
        .map(|parameter| panel(parameter, rows))
        .collect();
    (!panels.is_empty()).then(|| Sheet::new(panels, PANELS_ABREAST))
}

/// The rates over the values of one parameter.
fn panel(parameter: VariedParameter, rows: &[SweptRow]) -> Panel {
    let of_parameter = |row: &SweptRow| row.swept.filter(|(swept, _)| *swept == parameter);
    let mut points: Vec<(f64, &CaseResult)> = rows
        .iter()
        .filter_map(|row| of_parameter(row).map(|(_, value)| (value, &row.row)))
        .collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let line = |label: &str, color, count: fn(&CaseResult) -> usize| {
        let percent = |row: &CaseResult| 100.0 * count(row) as f64 / row.counted.max(1) as f64;
        let line = points.iter().map(|(value, row)| (*value, percent(row)));
        PlotLayer::new(label, color, Marks::Line(line.collect()))
    };
    let intervals = points.iter().map(|(value, row)| {
        let interval = [row.right_low_percent, row.right_high_percent];
        (*value, row.right_percent, interval)
    });
    let intervals = Marks::Dots(intervals.collect());
    Panel {
        title: "Answers, with 95 % intervals".to_owned(),
        x: Axis::new(parameter.title()),
        y: Axis::new("% of the trials").within(0.0, 104.0),
        layers: vec![
            line("right", RIGHT, |row| row.right),
            PlotLayer::unnamed(RIGHT, intervals),
            line("none", NO_ANSWER, |row| row.no_answer),
            line("wrong", WRONG, |row| row.wrong),
        ],
    }
}

/// The standard table: the rate of right answers of each row, the first row at the top.
pub(super) struct RateTable<'a>(pub(super) &'a [SweptRow]);

impl Figure for RateTable<'_> {
    fn size_px(&self) -> (u32, u32) {
        let rows = self.0.len() as u32;
        (TABLE_WIDTH_PX, FRAME_HEIGHT_PX + ROW_HEIGHT_PX * rows)
    }

    fn draw<B: DrawingBackend>(&self, area: &Area<B>) -> anyhow::Result<()> {
        let counted = self.0.iter().map(|swept| &swept.row);
        let counted: Vec<&CaseResult> = counted.filter(|row| row.counted > 0).collect();
        let worst = counted.iter().map(|row| row.right_low_percent);
        let lowest = (worst.fold(99.0, f64::min) - 0.2).max(0.0);
        let last = counted.len() as f64;
        let mut builder = chart_on(area, BELOW_PX, LEFT_PX);
        let mut chart = builder
            .build_cartesian_2d(Scale::linear(lowest..100.05), Scale::linear(last..0.0))
            .map_err(plot_error)?;
        chart
            .configure_mesh()
            .disable_y_mesh()
            .disable_y_axis()
            .x_desc("correctly identified, % of the trials, with 95 % intervals; ×: wrong answers")
            .label_style((FONT, LETTERS_PX))
            .draw()
            .map_err(plot_error)?;
        let style = (FONT, LETTERS_PX).into_text_style(area).color(&BLACK);
        for (line, row) in counted.iter().enumerate() {
            let height = line as f64 + 0.5;
            let at = |percent: f64| (percent, height);
            let ends = [at(row.right_low_percent), at(row.right_high_percent)];
            let interval = PathElement::new(ends, RIGHT.stroke_width(2));
            let dot = Circle::new(at(row.right_percent), 4, RIGHT.filled());
            let cross = Cross::new(at(row.right_percent), 7, WRONG.stroke_width(2));
            chart.draw_series([interval]).map_err(plot_error)?;
            chart.draw_series([dot]).map_err(plot_error)?;
            chart
                .draw_series((row.wrong_of_all > 0).then_some(cross))
                .map_err(plot_error)?;
            let (_, y) = chart.backend_coord(&at(lowest));
            area.draw_text(&row.case, &style, (12, y - 8))
                .map_err(plot_error)?;
        }
        Ok(())
    }
}
