//! The limiting magnitude over one parameter: a panel for each sweep, or the paper's figures.

use crate::cli::exit::CommandError;
use starpipe::base::format::five_digits;
use starpipe::predict::{
    Budget, CurveValues, PaperFigure, Scenario, Spacing, Sweep, SweepCurve, curves,
};
use starpipe::report::figure::{Axis, Dot, Marks, Panel, PlotLayer, Rgb, Sheet};

/// Sweeps side by side.
const SWEEPS_ABREAST: usize = 2;
/// Figures of the paper side by side.
const FIGURES_ABREAST: usize = 3;

/// A panel for each sweep, with a second curve for another exposure or aperture.
pub(super) fn of_sweeps<'a>(
    sweeps: impl Iterator<Item = &'a Sweep>,
    scenario: &Scenario,
) -> Result<Sheet, CommandError> {
    let panel = |sweep: &Sweep| {
        let series = CurveValues::around(scenario, sweep.parameter);
        let curves = curves(scenario, sweep, &series).map_err(CommandError::usage)?;
        let title = format!("Limiting magnitude of {}", scenario.camera.name);
        Ok(panel(title, sweep, curves, scenario))
    };
    let panels = sweeps.map(panel).collect::<Result<_, CommandError>>()?;
    Ok(Sheet::new(panels, SWEEPS_ABREAST))
}

/// Names and contents of the files with the eleven figures, and with a sheet of all of them.
pub(super) fn of_paper(scenario: &Scenario) -> Result<Vec<(String, Vec<u8>)>, CommandError> {
    let mut panels = Vec::new();
    for figure in PaperFigure::ALL {
        let sweep = figure.sweep().map_err(anyhow::Error::from)?;
        let curves = figure
            .curves(scenario, &sweep)
            .map_err(CommandError::usage)?;
        let title = format!("{}  {}", figure.id, figure.title);
        panels.push(panel(title, &sweep, curves, scenario));
    }
    let sheets = PaperFigure::ALL.iter().zip(&panels);
    let mut sheets: Vec<(String, Sheet)> = sheets
        .map(|(figure, panel)| (figure.file_stem(), Sheet::of_one(panel.clone())))
        .collect();
    let mut sheet = Sheet::new(panels, FIGURES_ABREAST);
    sheet.notes = notes(scenario);
    sheets.push(("figures".to_owned(), sheet));
    let files = sheets.into_iter().map(|(name, sheet)| {
        let drawing = sheet.svg().into_bytes();
        (format!("{name}.svg"), drawing)
    });
    Ok(files.collect())
}

/// Curves over one parameter, and a dot for the scenario itself.
fn panel(title: String, sweep: &Sweep, curves: Vec<SweepCurve>, scenario: &Scenario) -> Panel {
    let (first, last) = (sweep.values[0], sweep.values[sweep.values.len() - 1]);
    let value = sweep.parameter.get(scenario);
    let dot = value
        .filter(|value| (first..=last).contains(value))
        .map(|value| (value, Budget::new(scenario).limit_vmag));
    let curves = curves.into_iter().zip([Rgb::BLUE, Rgb::ORANGE]);
    let mut layers: Vec<PlotLayer> = curves
        .map(|(curve, color)| PlotLayer::new(curve.label, color, Marks::Line(curve.points)))
        .collect();
    layers.extend(
        dot.map(|dot| PlotLayer::new("this camera", Rgb::BLACK, Marks::Dots(vec![Dot::from(dot)]))),
    );
    Panel {
        title,
        x: Axis::log(sweep.parameter.title(), sweep.spacing == Spacing::Log).within(first, last),
        y: Axis::new("limiting magnitude (V)"),
        layers,
        ..Panel::default()
    }
}

/// What the figures have in common.
fn notes(scenario: &Scenario) -> Vec<String> {
    let limit_vmag = Budget::new(scenario).limit_vmag;
    vec![
        scenario.camera.name.clone(),
        scenario.reading.words().to_owned(),
        format!(
            "dot: exposure {} s, aperture {} mm,",
            five_digits(scenario.conditions.exposure_s),
            five_digits(scenario.camera.aperture_mm),
        ),
        format!("limit V {limit_vmag:.2}"),
    ]
}
