//! The rates as a figure: one panel for each parameter that is swept, or the standard table row by row.

use super::SweptRow;
use crate::cli::plot::{Area, BLUE as RIGHT, FONT, Figure, ORANGE as WRONG, said};
use plotters::prelude::*;
use starpipe::study::robustness::{Parameter, Row};

const WIDTH_PX: u32 = 900;
const PANEL_HEIGHT_PX: u32 = 300;
const PANELS_ABREAST: usize = 2;
const ROW_HEIGHT_PX: u32 = 34;
/// Above and below the rows of the table.
const FRAME_HEIGHT_PX: u32 = 110;
const MARGIN_PX: u32 = 12;
const NO_ANSWER: RGBColor = RGBColor(120, 120, 120);

/// A line of a panel: its name, its colour, and what it counts.
type Series = (&'static str, RGBColor, fn(&Row) -> usize);

/// The rates of these rows.
pub(super) struct Rates<'a>(pub(super) &'a [SweptRow]);

impl Rates<'_> {
    /// Lines and columns of panels.
    fn panels(&self) -> (usize, usize) {
        let swept = parameters(self.0).len();
        let columns = swept.clamp(1, PANELS_ABREAST);
        (swept.div_ceil(columns), columns)
    }
}

impl Figure for Rates<'_> {
    fn size_px(&self) -> (u32, u32) {
        let height_px = match self.panels() {
            (0, _) => FRAME_HEIGHT_PX + ROW_HEIGHT_PX * self.0.len() as u32,
            (lines, _) => PANEL_HEIGHT_PX * lines as u32,
        };
        (WIDTH_PX, height_px)
    }

    fn draw<B: DrawingBackend>(&self, area: &Area<B>) -> anyhow::Result<()> {
        let swept = parameters(self.0);
        if swept.is_empty() {
            return draw_table(area, self.0);
        }
        for (panel, parameter) in area.split_evenly(self.panels()).iter().zip(swept) {
            draw_sweep(panel, parameter, self.0)?;
        }
        Ok(())
    }
}

/// The parameters that are swept, each once, in their order.
fn parameters(rows: &[SweptRow]) -> Vec<Parameter> {
    let mut parameters: Vec<Parameter> = Vec::new();
    for (parameter, _) in rows.iter().filter_map(|row| row.swept) {
        if !parameters.contains(&parameter) {
            parameters.push(parameter);
        }
    }
    parameters
}

fn draw_sweep<B: DrawingBackend>(
    area: &Area<B>,
    parameter: Parameter,
    rows: &[SweptRow],
) -> anyhow::Result<()> {
    let of_parameter = |row: &SweptRow| row.swept.filter(|(swept, _)| *swept == parameter);
    let mut points: Vec<(f64, &Row)> = rows
        .iter()
        .filter_map(|row| of_parameter(row).map(|(_, value)| (value, &row.row)))
        .collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (first, last) = (points[0].0, points[points.len() - 1].0);
    let room = ((last - first) * 0.02).max(1e-6);
    let mut chart = ChartBuilder::on(area)
        .margin(MARGIN_PX)
        .x_label_area_size(44)
        .y_label_area_size(56)
        .build_cartesian_2d(first - room..last + room, 0.0..104.0)
        .map_err(said)?;
    chart
        .configure_mesh()
        .x_desc(parameter.title())
        .y_desc("% of the trials")
        .label_style((FONT, 15))
        .max_light_lines(1)
        .draw()
        .map_err(said)?;
    let share = |count: usize, row: &Row| 100.0 * count as f64 / row.counted.max(1) as f64;
    let series: [Series; 3] = [
        ("right, with 95 % intervals", RIGHT, |row| row.right),
        ("not identified", NO_ANSWER, |row| row.no_answer),
        ("wrong", WRONG, |row| row.wrong),
    ];
    for (name, color, count) in series {
        let line = points
            .iter()
            .map(|(value, row)| (*value, share(count(row), row)));
        chart
            .draw_series(LineSeries::new(line, color.stroke_width(2)).point_size(3))
            .map_err(said)?
            .label(name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 20, y)], color.stroke_width(2)));
    }
    let intervals = points.iter().map(|(value, row)| {
        let ends = [
            (*value, row.right_low_percent),
            (*value, row.right_high_percent),
        ];
        PathElement::new(ends, RIGHT.stroke_width(1))
    });
    chart.draw_series(intervals).map_err(said)?;
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::MiddleLeft)
        .background_style(WHITE.mix(0.8))
        .label_font((FONT, 15))
        .draw()
        .map_err(said)
}

/// Each row of the table at its height, the first at the top: the rate of right answers and its interval.
fn draw_table<B: DrawingBackend>(area: &Area<B>, rows: &[SweptRow]) -> anyhow::Result<()> {
    let counted: Vec<&Row> = rows
        .iter()
        .map(|swept| &swept.row)
        .filter(|row| row.counted > 0)
        .collect();
    let worst = counted.iter().map(|row| row.right_low_percent);
    let lowest = (worst.fold(99.0, f64::min) - 0.2).max(0.0);
    let last = counted.len() as f64;
    let mut chart = ChartBuilder::on(area)
        .margin(MARGIN_PX)
        // The last number of the axis is as wide.
        .margin_right(2 * MARGIN_PX)
        .x_label_area_size(44)
        .y_label_area_size(230)
        .build_cartesian_2d(lowest..100.05, last..0.0)
        .map_err(said)?;
    chart
        .configure_mesh()
        .disable_y_mesh()
        .disable_y_axis()
        .x_desc("identified rightly, % of the trials, with 95 % intervals; × has wrong answers")
        .label_style((FONT, 15))
        .draw()
        .map_err(said)?;
    for (place, row) in counted.iter().enumerate() {
        let height = place as f64 + 0.5;
        let ends = [
            (row.right_low_percent, height),
            (row.right_high_percent, height),
        ];
        let interval = PathElement::new(ends, RIGHT.stroke_width(2));
        let dot = Circle::new((row.right_percent, height), 4, RIGHT.filled());
        chart.draw_series([interval]).map_err(said)?;
        chart.draw_series([dot]).map_err(said)?;
        if row.wrong_of_all > 0 {
            let cross = Cross::new((row.right_percent, height), 7, WRONG.stroke_width(2));
            chart.draw_series([cross]).map_err(said)?;
        }
        let (_, y) = chart.backend_coord(&(lowest, height));
        let style = (FONT, 15).into_text_style(area).color(&BLACK);
        area.draw_text(&row.case, &style, (MARGIN_PX as i32, y - 8))
            .map_err(said)?;
    }
    Ok(())
}
