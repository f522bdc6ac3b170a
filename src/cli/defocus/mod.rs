//! `defocus`: the error of centroids over spot radius and noise, and the radius to set.

mod args;
mod darks;
mod figures;
mod plan;

pub(crate) use args::DefocusArgs;

use super::exit::{CommandError, Exit, Outcome};
use super::options::format::Format;
use super::output::files::write_into;
use super::output::messages::report_warning;
use super::output::rows::{csv_table, json_indented, json_line};
use super::progress::bar;
use starpipe::Interrupt;
use starpipe::model::defocus::Lens;
use starpipe::study::defocus::{Caller, DefocusReport, GridRow, Plan, StarStudy};
use std::path::Path;

/// `starpipe defocus`
pub(crate) fn defocus(arguments: &DefocusArgs) -> Result<Outcome, CommandError> {
    let pool = arguments.threads.pool()?;
    let plan = plan::plan(arguments, &pool)?;
    let studies = run(&plan, &pool)?;
    let report = DefocusReport::new(&plan, &studies);
    warn_if_too_sharp(&report);
    if let Some(directory) = &arguments.out {
        save(directory, arguments, &report, &studies)?;
    }
    let text = match arguments.format {
        Format::Text => report.to_text(),
        Format::Json => json_line(&report)?,
        Format::Csv => grid_table(&studies)?,
    };
    let exit = if report.is_met() {
        Exit::Success
    } else {
        report_warning("no radius meets a required error");
        Exit::Unmet
    };
    Ok(Outcome { text, exit })
}

fn run(plan: &Plan, pool: &rayon::ThreadPool) -> anyhow::Result<Vec<StarStudy>> {
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

/// No lens makes a spot that is sharper than diffraction.
fn warn_if_too_sharp(report: &DefocusReport) {
    let Some(least_px) = report.lens.as_ref().map(Lens::diffraction_px) else {
        return;
    };
    for star in &report.stars {
        if star.best.radius.radius_px < least_px {
            report_warning(format_args!(
                "the best radius, {:.2} px, is below that of diffraction, {least_px:.2} px",
                star.best.radius.radius_px
            ));
        }
    }
}

fn grid_table(studies: &[StarStudy]) -> anyhow::Result<String> {
    csv_table(studies.iter().flat_map(GridRow::rows))
}

/// Writes all files, or none.
fn save(
    directory: &Path,
    arguments: &DefocusArgs,
    report: &DefocusReport,
    studies: &[StarStudy],
) -> anyhow::Result<()> {
    let curve = csv_table(report.stars.iter().flat_map(|star| &star.curve))?;
    let texts = [
        ("grid.csv", grid_table(studies)?),
        ("curve.csv", curve),
        ("defocus.json", json_indented(report)?),
        ("defocus.txt", report.to_text()),
    ];
    let texts = texts.map(|(name, text)| (name.to_owned(), text.into_bytes()));
    let figures = figures::of(report, studies, arguments.figures)?;
    write_into(directory, texts.into_iter().chain(figures))?;
    Ok(())
}
