//! The rates as a figure: a panel for each parameter that is swept, or the standard table.

use super::rows::SweptRow;
use starpipe::lab::robustness::{CaseResult, VariedParameter};
use starpipe::report::figure::{Axis, Dot, Marks, Panel, PlotLayer, Rgb, Sheet, Spacing};

const PANELS_ABREAST: usize = 2;
/// Width of the table, and height of its rows.
const TABLE_WIDTH_PX: f32 = 560.0;
const ROW_HEIGHT_PX: f32 = 30.0;
const RIGHT: Rgb = Rgb::BLUE;
const WRONG: Rgb = Rgb::ORANGE;

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
        Dot::from((*value, row.right_percent, interval))
    });
    let intervals = Marks::Dots(intervals.collect());
    Panel {
        title: "Answers, with 95 % intervals".to_owned(),
        x: Axis::new(parameter.title()),
        y: Axis::new("% of the trials").within(0.0, 100.0),
        layers: vec![
            line("right", RIGHT, |row| row.right),
            PlotLayer::unnamed(RIGHT, intervals),
            line("none", Rgb::GREY, |row| row.no_answer),
            line("wrong", WRONG, |row| row.wrong),
        ],
        ..Panel::default()
    }
}

/// The standard table: the rate of right answers of each row, the first row at the top.
pub(super) fn rate_table(rows: &[SweptRow]) -> Sheet {
    let counted = rows.iter().map(|swept| &swept.row);
    let counted: Vec<&CaseResult> = counted.filter(|row| row.counted > 0).collect();
    let worst = counted.iter().map(|row| row.right_low_percent);
    let lowest = worst.fold(99.0, f64::min).floor().max(0.0);
    let lines = || (0..).map(f64::from).zip(&counted);
    let names = lines().map(|(line, row)| (line, row.case.to_string()));
    let rates = lines().map(|(line, row)| Dot {
        x_range: Some([row.right_low_percent, row.right_high_percent]),
        ..Dot::from((row.right_percent, line))
    });
    let wrong = lines().filter(|(_, row)| row.wrong_of_all > 0);
    let wrong = wrong.map(|(line, row)| (row.right_percent, line, "×".to_owned()));
    let panel = Panel {
        title: "Correctly identified, with 95 % intervals; ×: wrong answers".to_owned(),
        x: Axis::new("% of the trials").within(lowest, 100.0),
        y: Axis {
            spacing: Spacing::Named(names.collect()),
            ..Axis::new("").within(counted.len() as f64 - 0.5, -0.5)
        },
        layers: vec![
            PlotLayer::unnamed(RIGHT, Marks::Dots(rates.collect())),
            PlotLayer::unnamed(WRONG, Marks::Texts(wrong.collect())),
        ],
        ..Panel::default()
    };
    Sheet {
        frame_px: [TABLE_WIDTH_PX, ROW_HEIGHT_PX * counted.len().max(1) as f32],
        ..Sheet::of_one(panel)
    }
}
