//! `experiment`: the paper's experiments, done again.

use super::args::{ExperimentArgs, PageFormat};
use super::output::{print, write_whole};
use super::resources::{bar, read_catalog, sky, thread_pool, warn_of};
use super::settings::output_path;
use super::{Exit, Fault, overwrite};
use anyhow::Context;
use starpipe::pipeline::Pipeline;
use starpipe::report::overlay;
use starpipe::study::experiment::{Published, Run, Trials, run};
use std::path::{Path, PathBuf};

/// `starpipe experiment`
pub(crate) fn experiment(arguments: &ExperimentArgs) -> Result<Exit, Fault> {
    let Some(published) = Published::experiment(arguments.number) else {
        return Err(Fault::Usage("the paper has experiments 1 and 2".into()));
    };
    let name = PathBuf::from(format!("experiment-{}", published.number));
    if let Some(directory) = &arguments.out {
        overwrite::check(std::slice::from_ref(&name), directory, &["png"])?;
        std::fs::create_dir_all(directory)
            .with_context(|| format!("making the directory {}", directory.display()))?;
    }
    let pool = thread_pool(arguments.resources.threads)?;
    let catalog = pool.install(|| read_catalog(arguments.resources.catalog.as_deref()))?;
    let pipeline = Pipeline::new(pool.install(|| sky(&catalog, &arguments.resources)));
    let trials = Trials {
        count: arguments.trials,
        seed: arguments.seed,
    };
    let progress = bar(trials.count, "frames {wide_bar} {pos}/{len} {eta}");
    let done = pool.install(|| run(&published, &pipeline, trials, &|| progress.inc(1)));
    progress.finish_and_clear();
    warn_of(pipeline.sky().take_troubles());
    let done = done.map_err(anyhow::Error::from)?;
    if let Some(directory) = &arguments.out {
        save(&done, &pipeline, directory, &name)?;
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
fn save(done: &Run, pipeline: &Pipeline, directory: &Path, name: &Path) -> anyhow::Result<()> {
    let Some((frame, solution)) = &done.first else {
        return Ok(());
    };
    let title = format!("{}, simulated", name.display());
    let picture = overlay::draw(&title, frame, solution, pipeline.catalog());
    let path = output_path(directory, name, "png");
    write_whole(&[(path, overlay::to_png(&picture)?)])
}
