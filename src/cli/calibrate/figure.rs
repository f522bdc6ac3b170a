//! The figure of a calibration: stars over the frame, and their mean residuals.

use starpipe::base::format::counted;
use starpipe::identify::lens::{Coverage, CoverageCell, LensCalibration};
use starpipe::report::figure::{
    Area, Axis, ColorScale, Dot, Marks, Panel, PanelKind, PlotLayer, Rgb, Sheet,
};

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
        Axis::new("y (px)").within(height, 0.0),
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
    let scale = ColorScale {
        title: "stars".to_owned(),
        ends: [0.0, most as f64],
        is_log: false,
        // From white without stars to blue.
        palette: |part| Rgb::PAPER.mixed(Rgb::BLUE, part),
    };
    let half = half_cell_px(coverage);
    let cell = |of: &CoverageCell| {
        let across = |axis: usize| {
            [
                of.centre_px[axis] - half[axis],
                of.centre_px[axis] + half[axis],
            ]
        };
        Area {
            note: counted(of.stars, "star"),
            ..Area::rectangle(across(0), across(1), scale.color(of.stars as f64))
        }
    };
    let cells = coverage.cells.iter().map(cell).collect();
    let counts = coverage.cells.iter().map(|cell| {
        let [x, y] = cell.centre_px;
        (x, y, cell.stars.to_string())
    });
    let [x, y] = axes(coverage);
    Panel {
        title: format!("Stars in {:.0} % of the frame", 100.0 * coverage.share()),
        x,
        y,
        layers: vec![
            PlotLayer::colored(cells, scale),
            PlotLayer::unnamed(Rgb::BLACK, Marks::Texts(counts.collect())),
        ],
        kind: PanelKind::Map,
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
        vec![(x, y), (x + scale * dx, y + scale * dy)]
    };
    let [x, y] = axes(coverage);
    let tails = known().map(|cell| Dot {
        note: format!("{:.3} px, {:.3} px", cell.mean_px[0], cell.mean_px[1]),
        ..Dot::from((cell.centre_px[0], cell.centre_px[1]))
    });
    Panel {
        title: format!("Mean residuals as lines from the dots; the longest is {longest_px:.3} px"),
        x,
        y,
        layers: vec![
            PlotLayer::unnamed(Rgb::BLUE, Marks::Lines(known().map(arrow).collect())),
            PlotLayer::unnamed(Rgb::BLUE, Marks::Dots(tails.collect())),
        ],
        kind: PanelKind::Map,
    }
}
