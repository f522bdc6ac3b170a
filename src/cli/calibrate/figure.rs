//! The figure of a calibration: stars over the frame, and their mean residuals.

use crate::cli::plot::{Axis, BLACK, BLUE, FilledRectangle, Marks, Panel, PlotLayer, Sheet};
use plotters::style::RGBColor;
use starpipe::identify::lens::{Coverage, CoverageCell, LensCalibration};

/// Length of the longest arrow, in cells.
const LONGEST: f64 = 0.9;
/// Fewest stars whose mean residual is drawn.
const MIN_STARS: usize = 3;

/// The figure of a calibration.
pub(super) fn sheet(measured: &LensCalibration) -> Sheet {
    Sheet::new(vec![stars(&measured.coverage), residuals(measured)], 2)
}

/// The frame as it is displayed: y runs down.
fn axes(coverage: &Coverage) -> [Axis; 2] {
    let [width, height] = size_px(coverage);
    [
        Axis::new("x (px)").within(0.0, width),
        Axis::new("−y (px)").within(-height, 0.0),
    ]
}

fn size_px(coverage: &Coverage) -> [f64; 2] {
    let last = coverage
        .cells
        .last()
        .map_or([0.0; 2], |cell| cell.centre_px);
    let half = half_cell_px(coverage);
    [last[0] + half[0], last[1] + half[1]]
}

fn half_cell_px(coverage: &Coverage) -> [f64; 2] {
    coverage
        .cells
        .first()
        .map_or([0.5; 2], |cell| cell.centre_px.map(|along| along + 0.5))
}

fn stars(coverage: &Coverage) -> Panel {
    let most = coverage
        .cells
        .iter()
        .map(|cell| cell.stars)
        .max()
        .unwrap_or(0)
        .max(1);
    let half = half_cell_px(coverage);
    let cell = |of: &CoverageCell| {
        let [x, y] = of.centre_px;
        // From white without stars to blue.
        let share = of.stars as f64 / most as f64;
        let mixed = |to: u8| (255.0 + (f64::from(to) - 255.0) * share).round() as u8;
        FilledRectangle {
            x: [x - half[0], x + half[0]],
            y: [-y - half[1], -y + half[1]],
            color: RGBColor(mixed(BLUE.0), mixed(BLUE.1), mixed(BLUE.2)),
        }
    };
    let [x, y] = axes(coverage);
    let counts = coverage.cells.iter().map(|cell| {
        (
            cell.centre_px[0],
            -cell.centre_px[1],
            cell.stars.to_string(),
        )
    });
    // From left to right and then upwards.
    let rows = coverage.cells.chunks(coverage.columns).rev().flatten();
    Panel {
        title: format!("Stars in {:.0} % of the frame", 100.0 * coverage.share()),
        x,
        y,
        layers: vec![
            PlotLayer::unnamed(BLACK, Marks::Cells(rows.map(cell).collect())),
            PlotLayer::unnamed(BLACK, Marks::Texts(counts.collect())),
        ],
    }
}

fn residuals(measured: &LensCalibration) -> Panel {
    let coverage = &measured.coverage;
    let known = || coverage.cells.iter().filter(|cell| cell.stars >= MIN_STARS);
    let longest_px = known()
        .map(|cell| cell.mean_px[0].hypot(cell.mean_px[1]))
        .fold(0.0, f64::max);
    let scale = LONGEST * 2.0 * half_cell_px(coverage)[0] / longest_px.max(1e-9);
    let arrow = |cell: &CoverageCell| {
        let ([x, y], [dx, dy]) = (cell.centre_px, cell.mean_px);
        vec![(x, -y), (x + scale * dx, -(y + scale * dy))]
    };
    let [x, y] = axes(coverage);
    // Where an arrow begins.
    let tails = known().map(|cell| (cell.centre_px[0], -cell.centre_px[1], "·".to_owned()));
    Panel {
        title: format!("Mean residuals, the longest {longest_px:.3} px"),
        x,
        y,
        layers: vec![
            PlotLayer::unnamed(BLUE, Marks::Lines(known().map(arrow).collect())),
            PlotLayer::unnamed(BLACK, Marks::Texts(tails.collect())),
        ],
    }
}
