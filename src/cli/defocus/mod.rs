//! `defocus`: the error of centroids over spot radius and noise, and the radius to set.

mod args;
mod darks;
mod figures;
mod page;
mod plan;
mod tables;

pub(crate) use args::DefocusArgs;

use super::exit::{CommandError, CommandOutput, Exit};
use super::options::format::OutputFormat;
use super::output::files::{generated, write_each, write_into};
use super::output::messages::report_warning;
use super::output::rows::{json_indented, json_line};
use super::progress::bar;
use starpipe::Interrupt;
use starpipe::lab::defocus::DefocusLens;
use starpipe::lab::spot_radius::{Caller, DefocusPlan, DefocusReport, StarStudy};
use std::path::PathBuf;
use tables::{curve_table, grid_table};

/// `starpipe defocus`
pub(crate) fn defocus(arguments: &DefocusArgs) -> Result<CommandOutput, CommandError> {
    let pool = arguments.threads.pool()?;
    let page_path = page_path(arguments)?;
    let plan = plan::plan(arguments, &pool)?;
    let studies = run(&plan, &pool)?;
    let report = DefocusReport::new(&plan, &studies);
    let mut warnings = too_sharp(&report);
    if !report.is_met() {
        warnings.push("no radius meets a required error".to_owned());
    }
    for warning in &warnings {
        report_warning(warning);
    }
    let results = arguments.out.as_ref().is_none_or(|directory| {
        write_into(directory, generated(files(arguments, &report, &studies)))
    });
    let page = page_path.map(|path| {
        let page = page::build(arguments, &report, &studies, warnings)?;
        crate::cli::page::file(&path, &page)
    });
    let all_written = write_each(page) && results;
    let text = match arguments.format {
        OutputFormat::Text => report.to_text(),
        OutputFormat::Json => json_line(&report)?,
        OutputFormat::Csv => grid_table(&studies)?,
    };
    let exit = if report.is_met() {
        Exit::Success
    } else {
        Exit::Unmet
    };
    Ok(CommandOutput { text, exit }.if_written(all_written))
}

/// The file of the page, if there is to be one.
fn page_path(arguments: &DefocusArgs) -> Result<Option<PathBuf>, CommandError> {
    let scenario = arguments.scenario.files().cloned();
    let inputs: Vec<PathBuf> = scenario.chain(arguments.darks.iter().cloned()).collect();
    let directory = arguments.out.clone().unwrap_or_default();
    let default = || directory.join("defocus.html");
    arguments.html.checked_path(&inputs, default)
}

fn run(plan: &DefocusPlan, pool: &rayon::ThreadPool) -> anyhow::Result<Vec<StarStudy>> {
    let progress = bar(
        plan.point_count() as u64,
        "radii and noises {wide_bar} {pos}/{len} {eta}",
    );
    let caller = Caller {
        done: &|| progress.inc(1),
        interrupt: &Interrupt::default(),
    };
    let studies = pool.install(|| plan.run(&caller));
    progress.finish_and_clear();
    Ok(studies?)
}

/// No lens makes a spot that is sharper than diffraction: a warning for each star with such a best spot.
fn too_sharp(report: &DefocusReport) -> Vec<String> {
    let Some(least_px) = report.lens.as_ref().map(DefocusLens::diffraction_px) else {
        return Vec::new();
    };
    let best = report.stars.iter().map(|star| star.best.radius.radius_px);
    let too_sharp = best.filter(|radius_px| *radius_px < least_px);
    let warning = |radius_px| {
        format!(
            "the best radius, {radius_px:.2} px, is smaller than the diffraction limit, {least_px:.2} px"
        )
    };
    too_sharp.map(warning).collect()
}

/// Names and contents of the files for `--out`.
fn files(
    arguments: &DefocusArgs,
    report: &DefocusReport,
    studies: &[StarStudy],
) -> anyhow::Result<Vec<(String, Vec<u8>)>> {
    let texts = [
        ("grid.csv", grid_table(studies)?),
        ("curve.csv", curve_table(report)?),
        ("defocus.json", json_indented(report)?),
        ("defocus.txt", report.to_text()),
    ];
    let texts = texts.map(|(name, text)| (name.to_owned(), text.into_bytes()));
    let figures = figures::draw(report, studies, arguments.figures)?;
    Ok(texts.into_iter().chain(figures).collect())
}
