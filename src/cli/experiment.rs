//! `experiment`: repeats the experiments of the sensitivity paper.

use super::exit::{CommandError, CommandOutput, Exit};
use super::options::catalog::CatalogOptions;
use super::options::format::PageFormat;
use super::output::files::{NewFile, make_directory, write_each};
use super::output::overwrite;
use super::output::paths::output_path;
use super::output::rows::json_line;
use super::progress::frames_bar;
use clap::Args;
use starpipe::identify::IndexedCatalog;
use starpipe::lab::experiment::{ExperimentRun, Published, TrialSettings, run};
use starpipe::report::overlay::{self, OverlayOptions, Shown};
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    starpipe experiment 1\n  \
    starpipe experiment 2 --count 200 --format json > experiment-2.json\n  \
    starpipe experiment 1 --out results\n\n\
    The paper is Tong, Li & Wang, Acta Optica Sinica 34, 1004003 (2014). Frames are simulated with the \
    camera and the sky of the paper, at the pointing of its table of stars, and identified without hints. \
    Stars are listed by their SKY2000 numbers; with another --catalog the numbers differ.")]
pub(crate) struct ExperimentArgs {
    /// Which of the paper's two experiments
    #[arg(value_name = "1|2", value_parser = clap::value_parser!(u8).range(1..=2))]
    number: u8,
    /// Frames to simulate
    #[arg(long, alias = "trials", value_name = "NUMBER", default_value_t = 50, value_parser = clap::value_parser!(u64).range(1..=100_000))]
    count: u64,
    /// Seed of the random numbers
    #[arg(long, value_name = "NUMBER", default_value_t = 1)]
    seed: u64,
    /// What to print
    #[arg(long, value_enum, default_value_t = PageFormat::Text)]
    format: PageFormat,
    /// Also write the first simulated frame, its stars marked and named, as experiment-1.png or
    /// -2.png into this directory
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    catalog: CatalogOptions,
}

/// `starpipe experiment`
pub(crate) fn experiment(arguments: &ExperimentArgs) -> Result<CommandOutput, CommandError> {
    let published = Published::experiment(arguments.number)
        .ok_or_else(|| CommandError::usage("the paper has experiments 1 and 2"))?;
    let name = PathBuf::from(format!("experiment-{}", published.number));
    if let Some(directory) = &arguments.out {
        overwrite::check(std::slice::from_ref(&name), directory, &["png"])?;
        make_directory(directory)?;
    }
    let trials = TrialSettings {
        count: arguments.count,
        seed: arguments.seed,
    };
    let (report, all_written) = arguments.catalog.with_index(|pool, indexed| {
        let progress = frames_bar(trials.count);
        let done = pool.install(|| run(&published, indexed, trials, &|| progress.inc(1)));
        progress.finish_and_clear();
        let done = done?;
        let directory = arguments.out.as_ref();
        let picture =
            directory.and_then(|directory| first_picture(&done, indexed, directory, &name));
        Ok((done.report, write_each(picture)))
    })?;
    let json = || json_line(&report);
    let outcome = CommandOutput {
        text: arguments.format.of(|| report.to_text(), json)?,
        exit: if report.is_identified() {
            Exit::Success
        } else {
            Exit::NotIdentified
        },
    };
    Ok(outcome.if_written(all_written))
}

/// The picture of the first frame, if there is one.
fn first_picture(
    done: &ExperimentRun,
    indexed: &IndexedCatalog,
    directory: &Path,
    name: &Path,
) -> Option<anyhow::Result<NewFile>> {
    let (frame, solution) = done.first.as_ref()?;
    let title = format!("{}, simulated", name.display());
    let options = OverlayOptions::default();
    let picture = overlay::encoded(
        &Shown::new(&title, frame),
        solution,
        indexed.catalog(),
        &options,
    );
    let path = output_path(directory, name, None, "png");
    Some(picture.map(|picture| (path, picture)).map_err(Into::into))
}
