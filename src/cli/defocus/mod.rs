//! `defocus`: the error of centroids over spot radius and noise, and the radius to set.

mod answer;
mod args;
mod figures;
mod noise;
mod study;
mod text;

pub(crate) use args::DefocusArgs;

use super::exit::{CommandError, Exit};
use super::options::catalog::thread_pool;
use super::options::format::Format;
use super::output::files::write_whole;
use super::output::messages::report_warning;
use super::output::rows::{csv_table, json_lines};
use super::output::stdout::print;
use answer::{Answer, grid_rows};
use anyhow::Context;
use starpipe::model::defocus::Lens;
use std::path::{Path, PathBuf};
use study::{Plan, Study};

/// `starpipe defocus`
pub(crate) fn defocus(arguments: &DefocusArgs) -> Result<Exit, CommandError> {
    let pool = thread_pool(arguments.threads)?;
    let plan = Plan::of(arguments, &pool)?;
    let studies = plan.run(&pool)?;
    let answer = Answer::of(&plan, &studies);
    warn_if_too_sharp(&answer);
    if let Some(directory) = &arguments.out {
        save(directory, arguments, &answer, &studies)?;
    }
    let text = match arguments.format {
        Format::Text => text::rendered(&answer),
        Format::Json => json_lines(std::iter::once(&answer))?,
        Format::Csv => csv_table(studies.iter().flat_map(grid_rows))?,
    };
    // Nobody left to read it: nothing is lost.
    let _ = print(&text)?;
    Ok(match answer.is_met() {
        true => Exit::Success,
        false => {
            report_warning("no radius meets a required error");
            Exit::Unmet
        }
    })
}

/// No lens makes a spot that is sharper than diffraction.
fn warn_if_too_sharp(answer: &Answer) {
    let Some(least_px) = answer.lens.as_ref().map(Lens::diffraction_px) else {
        return;
    };
    for star in &answer.stars {
        if star.best.radius.radius_px < least_px {
            report_warning(format_args!(
                "the best radius, {:.2} px, is below that of diffraction, {least_px:.2} px",
                star.best.radius.radius_px
            ));
        }
    }
}

/// Writes all files, or none.
fn save(
    directory: &Path,
    arguments: &DefocusArgs,
    answer: &Answer,
    studies: &[Study],
) -> anyhow::Result<()> {
    let json = serde_json::to_string_pretty(answer).context("writing JSON")? + "\n";
    let curve = answer.stars.iter().flat_map(|star| &star.curve);
    let mut files = vec![
        (
            "grid.csv".to_owned(),
            csv_table(studies.iter().flat_map(grid_rows))?.into_bytes(),
        ),
        ("curve.csv".to_owned(), csv_table(curve)?.into_bytes()),
        ("defocus.json".to_owned(), json.into_bytes()),
        (
            "defocus.txt".to_owned(),
            text::rendered(answer).into_bytes(),
        ),
    ];
    files.extend(figures::of(answer, studies, arguments.figures)?);
    std::fs::create_dir_all(directory)
        .with_context(|| format!("making the directory {}", directory.display()))?;
    let placed: Vec<(PathBuf, Vec<u8>)> = files
        .into_iter()
        .map(|(name, content)| (directory.join(name), content))
        .collect();
    write_whole(&placed)
}
