//! `experiment`: the paper's experiments, done again.

use super::exit::{CommandError, Exit};
use super::options::catalog::CatalogOptions;
use super::options::catalog::{index_catalog, read_catalog, thread_pool, warn_of_cache};
use super::options::format::PageFormat;
use super::output::files::write_whole;
use super::output::overwrite;
use super::output::paths::output_path;
use super::output::stdout::print;
use super::progress::bar;
use anyhow::Context;
use clap::Args;
use starpipe::identify::IndexedCatalog;
use starpipe::report::overlay;
use starpipe::study::experiment::{Published, Run, Trials, run};
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    starpipe experiment 1\n  \
    starpipe experiment 2 --trials 200 --format json > experiment-2.json\n  \
    starpipe experiment 1 --out results\n\n\
    The paper is Tong, Li & Wang, Acta Optica Sinica 34, 1004003 (2014). The frames are simulated \
    with its camera and sky at the pointing of its table of stars, and identified with nothing \
    known. The stars have numbers of SKY2000: with another --catalog they are found under other numbers.")]
pub(crate) struct ExperimentArgs {
    /// Which of the paper's two
    #[arg(value_name = "1|2", value_parser = clap::value_parser!(u8).range(1..=2))]
    pub(crate) number: u8,
    /// Frames to simulate
    #[arg(long, value_name = "NUMBER", default_value_t = 50, value_parser = clap::value_parser!(u64).range(1..=100_000))]
    pub(crate) trials: u64,
    /// Seed of the random numbers
    #[arg(long, value_name = "NUMBER", default_value_t = 1)]
    pub(crate) seed: u64,
    /// What to print
    #[arg(long, value_enum, default_value_t = PageFormat::Text)]
    pub(crate) format: PageFormat,
    /// Also write, into this directory, the first frame simulated as experiment-1.png or -2.png, its stars ringed and named
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) resources: CatalogOptions,
}

/// `starpipe experiment`
pub(crate) fn experiment(arguments: &ExperimentArgs) -> Result<Exit, CommandError> {
    let Some(published) = Published::experiment(arguments.number) else {
        return Err(CommandError::Usage(
            "the paper has experiments 1 and 2".into(),
        ));
    };
    let name = PathBuf::from(format!("experiment-{}", published.number));
    if let Some(directory) = &arguments.out {
        overwrite::check(std::slice::from_ref(&name), directory, &["png"])?;
        std::fs::create_dir_all(directory)
            .with_context(|| format!("making the directory {}", directory.display()))?;
    }
    let pool = thread_pool(arguments.resources.threads)?;
    let catalog = pool.install(|| read_catalog(arguments.resources.catalog.as_deref()))?;
    let indexed = pool.install(|| index_catalog(&catalog, &arguments.resources));
    let trials = Trials {
        count: arguments.trials,
        seed: arguments.seed,
    };
    let progress = bar(trials.count, "frames {wide_bar} {pos}/{len} {eta}");
    let done = pool.install(|| run(&published, &indexed, trials, &|| progress.inc(1)));
    progress.finish_and_clear();
    warn_of_cache(&indexed);
    let done = done.map_err(anyhow::Error::from)?;
    if let Some(directory) = &arguments.out {
        save(&done, &indexed, directory, &name)?;
    }
    let text = match arguments.format {
        PageFormat::Text => done.report.to_text(),
        PageFormat::Json => done.report.to_json_line().context("writing JSON")? + "\n",
    };
    // Nobody left to read it: nothing is lost.
    let _ = print(&text)?;
    Ok(if done.report.is_identified() {
        Exit::Success
    } else {
        Exit::NotIdentified
    })
}

/// Draws the first frame, where there is one.
fn save(done: &Run, indexed: &IndexedCatalog, directory: &Path, name: &Path) -> anyhow::Result<()> {
    let Some((frame, solution)) = &done.first else {
        return Ok(());
    };
    let title = format!("{}, simulated", name.display());
    let picture = overlay::draw(&title, frame, solution, indexed.catalog());
    let path = output_path(directory, name, "png");
    write_whole(&[(path, overlay::to_png(&picture)?)])
}
