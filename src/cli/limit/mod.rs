//! `limit`: a scenario, its prediction, sweeps over its parameters, and their figures.

mod args;
mod figure;
mod text;

pub(crate) use args::LimitArgs;

use super::exit::{CommandError, Exit};
use super::options::format::Format;
use super::options::scenario::usage;
use super::output::files::write_whole;
use super::output::messages::report_warning;
use super::output::rows::{csv_table, json_lines};
use super::output::stdout::print;
use super::plot::{self, Form};
use anyhow::Context;
use figure::{Panel, Sheet};
use rayon::prelude::*;
use serde::Serialize;
use starpipe::camera::data_sheet::{DataSheet, Preset};
use starpipe::model::sensitivity::{
    Detector, Faintest, Figure, Prediction, Scenario, Series, Sweep, curves,
};
use starpipe::sky::catalog::Catalog;
use std::path::{Path, PathBuf};

/// More sweeps than this in one run are a mistake, and their figure would be of no use.
const MAX_SWEEPS: usize = 64;

/// `starpipe limit`
pub(crate) fn limit(arguments: &LimitArgs) -> Result<Exit, CommandError> {
    let sweeps = arguments.sweep.len();
    if sweeps > MAX_SWEEPS {
        return Err(CommandError::Usage(format!(
            "--sweep is given {sweeps} times, expected at most {MAX_SWEEPS}"
        )));
    }
    check_plot(arguments)?;
    let scenario = arguments.scenario.scenario()?;
    if let Some(directory) = &arguments.figures {
        return papers_figures(directory, &scenario);
    }
    let rows = rows(arguments, &scenario)?;
    if let Some(plot) = &arguments.plot {
        let panels = arguments
            .sweep
            .iter()
            .map(|sweep| panel(&sweep.0, &scenario));
        let sheet = Sheet::of_sweeps(panels.collect::<Result<_, _>>()?);
        let file = plot.with(&sheet).context("drawing the figure")?;
        write_whole(&[file])?;
    }
    // Nobody left to read it: nothing is lost.
    let _ = print(&rendered(arguments.format, &rows)?)?;
    Ok(Exit::Success)
}

/// Refuses to draw over a file that is read.
fn check_plot(arguments: &LimitArgs) -> Result<(), CommandError> {
    let Some(Ok(plot)) = arguments.plot.as_ref().map(|p| p.path.canonicalize()) else {
        return Ok(());
    };
    let mut read = arguments.scenario.files();
    match read.find(|path| path.canonicalize().is_ok_and(|path| path == plot)) {
        Some(path) => Err(CommandError::Usage(format!(
            "--plot would overwrite the input {}",
            path.display()
        ))),
        None => Ok(()),
    }
}

/// A prediction, and for which value of which parameter it is.
#[derive(Serialize)]
struct Row {
    #[serde(flatten)]
    prediction: Prediction,
    /// The faintest star to be expected among those of the catalogue, on average over the sky.
    faintest: Option<Faintest>,
    preset: Option<&'static str>,
    swept: Option<Swept>,
}

#[derive(Serialize, Clone, Copy)]
struct Swept {
    parameter: &'static str,
    value: f64,
}

fn rows(arguments: &LimitArgs, scenario: &Scenario) -> Result<Vec<Row>, CommandError> {
    let preset = arguments.scenario.preset.map(Preset::name);
    let row = |scenario: &Scenario, swept: Option<Swept>| {
        let (prediction, detector) =
            Prediction::with_detector(scenario).map_err(|error| match swept {
                Some(Swept { parameter, value }) => {
                    CommandError::Usage(format!("{parameter} of {value}: {error}"))
                }
                None => usage(&error),
            })?;
        Ok::<_, CommandError>(Row {
            // For its own sake only: in a sweep it would cost more than all the rest.
            faintest: match swept {
                None => faintest(&scenario.camera, &detector),
                Some(_) => None,
            },
            prediction,
            preset,
            swept,
        })
    };
    if arguments.sweep.is_empty() {
        return Ok(vec![row(scenario, None)?]);
    }
    let mut rows = Vec::new();
    for sweep in arguments.sweep.iter().map(|sweep| &sweep.0) {
        let parameter = sweep.parameter.name();
        let before = rows.len();
        let scenarios = sweep.scenarios(scenario).map_err(|error| usage(&error))?;
        let swept: Vec<_> = scenarios
            .par_iter()
            .zip(&sweep.values)
            .map(|(scenario, &value)| row(scenario, Some(Swept { parameter, value })))
            .collect();
        for row in swept {
            rows.push(row?);
        }
        warn_if_flat(parameter, &rows[before..]);
    }
    Ok(rows)
}

/// The faintest star to be expected in a field, with as many stars as the built-in catalogue has in one on average.
fn faintest(sheet: &DataSheet, detector: &Detector) -> Option<Faintest> {
    let field_sr = sheet.pixel_solid_angle_sr() * (sheet.width_px * sheet.height_px) as f64;
    let part_of_sky = (field_sr / (4.0 * std::f64::consts::PI)).min(1.0);
    let stars = Catalog::built_in().stars().iter();
    Faintest::in_part_of_sky(
        stars.map(|star| f64::from(star.v_mag)),
        part_of_sky,
        detector,
    )
}

/// Some parameters count in one reading only, or not for the brightest pixel.
fn warn_if_flat(parameter: &str, rows: &[Row]) {
    let limits = |row: &Row| {
        let prediction = &row.prediction;
        (prediction.limit_vmag, prediction.detector.limit50_vmag)
    };
    if rows
        .windows(2)
        .all(|pair| limits(&pair[0]) == limits(&pair[1]))
    {
        report_warning(format_args!(
            "{parameter} changes nothing: the limits are the same at each of its values"
        ));
    }
}

/// A panel with the curves of a sweep.
fn panel(sweep: &Sweep, scenario: &Scenario) -> Result<Panel, CommandError> {
    let series = Series::around(scenario, sweep.parameter);
    let curves = curves(scenario, sweep, &series).map_err(|error| usage(&error))?;
    Ok(Panel::new(None, sweep, curves, scenario))
}

/// The eleven figures, and a sheet of all of them.
fn papers_figures(directory: &Path, scenario: &Scenario) -> Result<Exit, CommandError> {
    let mut panels = Vec::new();
    for figure in Figure::ALL {
        let sweep = figure.sweep().map_err(anyhow::Error::from)?;
        let curves = figure
            .curves(scenario, &sweep)
            .map_err(|error| usage(&error))?;
        let title = format!("{}  {}", figure.id, figure.title);
        panels.push(Panel::new(Some(title), &sweep, curves, scenario));
    }
    std::fs::create_dir_all(directory)
        .with_context(|| format!("making the directory {}", directory.display()))?;
    let file = |stem: &str, sheet: &Sheet| -> anyhow::Result<(PathBuf, Vec<u8>)> {
        let drawing = plot::rendered(sheet, Form::Svg).context("drawing the figure")?;
        Ok((directory.join(format!("{stem}.svg")), drawing))
    };
    let mut files = Vec::new();
    for (figure, panel) in Figure::ALL.iter().zip(&panels) {
        files.push(file(&figure.file_stem(), &Sheet::of_one(panel.clone()))?);
    }
    let sheet = Sheet::of_figures(panels, text::caption(scenario));
    files.push(file("figures", &sheet)?);
    write_whole(&files)?;
    let paths = files
        .iter()
        .map(|(path, _)| format!("{}\n", path.display()));
    let _ = print(&paths.collect::<String>())?;
    Ok(Exit::Success)
}

/// A row of the table for programs.
#[derive(Serialize)]
struct TableRow<'a> {
    parameter: Option<&'a str>,
    value: Option<f64>,
    limit_vmag: f64,
    star_e: f64,
    background_e: f64,
    noise_e: f64,
    snr: f64,
    airmass: f64,
    detector_limit50_vmag: Option<f64>,
    detector_limit90_vmag: Option<f64>,
    peak_limit50_vmag: Option<f64>,
    dark_e: f64,
    sensor_noise_e: f64,
    background_noise_e: f64,
    atmosphere_transmission: f64,
    sky_mag_arcsec2: f64,
    pixel_area_arcsec2: f64,
    peak_share: f64,
    mag_0_e_s: f64,
}

impl<'a> TableRow<'a> {
    fn new(row: &'a Row) -> Self {
        let budget = &row.prediction.budget;
        Self {
            parameter: row.swept.as_ref().map(|swept| swept.parameter),
            value: row.swept.map(|swept| swept.value),
            limit_vmag: budget.limit_vmag,
            star_e: budget.star_e,
            background_e: budget.background_e,
            noise_e: budget.noise_e,
            snr: budget.snr,
            airmass: budget.airmass,
            detector_limit50_vmag: row.prediction.detector.limit50_vmag,
            detector_limit90_vmag: row.prediction.detector.limit90_vmag,
            peak_limit50_vmag: row.prediction.peak_pixel.limit50_vmag,
            dark_e: budget.dark_e,
            sensor_noise_e: budget.sensor_noise_e,
            background_noise_e: budget.background_noise_e,
            atmosphere_transmission: budget.atmosphere_transmission,
            sky_mag_arcsec2: budget.sky_mag_arcsec2,
            pixel_area_arcsec2: budget.pixel_area_arcsec2,
            peak_share: budget.peak_share,
            mag_0_e_s: budget.mag_0_e_s,
        }
    }
}

fn rendered(format: Format, rows: &[Row]) -> anyhow::Result<String> {
    match format {
        Format::Text => Ok(text::rendered(rows)),
        Format::Json => json_lines(rows.iter()),
        Format::Csv => csv_table(rows.iter().map(TableRow::new)),
    }
}
