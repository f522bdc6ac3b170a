//! `process` and `identify`.

use super::args::{IdentifyArgs, OutputArgs, ProcessArgs, ResourceArgs, SolvingArgs};
use super::centroids::{self, FrameSize};
use super::input::{self, is_stdin, read_stdin};
use super::output::Output;
use super::{Exit, Fault, batch, cache, chained, complain, warn};
use anyhow::Context;
use indicatif::{ProgressBar, ProgressStyle};
use starpipe::catalog::{self, Catalog};
use starpipe::detect::Workspace;
use starpipe::identify::Sky;
use starpipe::pipeline::{Pipeline, Solution, SolveConfig};
use starpipe::report::FrameReport;
use std::borrow::Cow;
use std::io::IsTerminal;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// `starpipe process`
pub(crate) fn process(arguments: ProcessArgs) -> Result<Exit, Fault> {
    let ProcessArgs {
        frames,
        page,
        detection,
        solving,
    } = arguments;
    let config = SolveConfig {
        detect: detection.resolve(),
        knowledge: solving.hints.resolve()?,
        page,
    };
    input::check(&frames)?;
    let (frames, troubles) = input::frames(frames);
    for trouble in &troubles {
        complain(chained(trouble));
    }
    let exit = solve_all(&frames, solving, |pipeline, path, workspace| {
        if is_stdin(path) {
            return Ok(pipeline.solve_bytes(path, &read_stdin()?, &config, workspace)?);
        }
        Ok(pipeline.solve_file(path, &config, workspace)?)
    })?;
    Ok(if troubles.is_empty() {
        exit
    } else {
        Exit::Failure
    })
}

/// `starpipe identify`
pub(crate) fn identify(arguments: IdentifyArgs) -> Result<Exit, Fault> {
    let IdentifyArgs {
        lists,
        width,
        height,
        solving,
    } = arguments;
    input::check(&lists)?;
    let knowledge = solving.hints.resolve()?;
    let size = FrameSize { width, height };
    solve_all(&lists, solving, |pipeline, path, _| {
        let list = centroids::read(path, size)?;
        Ok(pipeline.solve_centroids(&list, &knowledge))
    })
}

/// Solves every input and prints its report; one that cannot be read does not disturb the others.
fn solve_all(
    inputs: &[PathBuf],
    solving: SolvingArgs,
    solve: impl Fn(&Pipeline, &Path, &mut Workspace) -> anyhow::Result<Solution> + Sync,
) -> Result<Exit, Fault> {
    let SolvingArgs {
        output, resources, ..
    } = solving;
    let mut run = Run::new(output, inputs)?;
    if inputs.is_empty() {
        return Ok(run.exit());
    }
    let pool = thread_pool(resources.threads)?;
    let catalog = pool.install(|| read_catalog(resources.catalog.as_deref()))?;
    let sky = pool.install(|| sky(&catalog, &resources));
    let pipeline = Pipeline::new(sky);
    let report = |input: &PathBuf, workspace: &mut Workspace| {
        let solution = solve(&pipeline, input, workspace)?;
        let name = input.display().to_string();
        Ok(FrameReport::new(&name, &solution, pipeline.catalog()))
    };
    batch::for_each_ordered(
        &pool,
        inputs,
        Workspace::default,
        report,
        |input, result| run.take(input, result),
    );
    Ok(run.exit())
}

/// What has become of the inputs so far.
struct Run {
    output: Output,
    progress: ProgressBar,
    failed: bool,
    unidentified: bool,
}

impl Run {
    fn new(output: OutputArgs, inputs: &[PathBuf]) -> Result<Self, Fault> {
        // Between results on the same terminal a bar would only be in the way.
        let progress = if inputs.len() > 1 && !std::io::stdout().is_terminal() {
            bar(inputs.len() as u64, "frames {wide_bar} {pos}/{len} {eta}")
        } else {
            ProgressBar::hidden()
        };
        Ok(Self {
            output: Output::new(output.resolve(inputs)?)?,
            progress,
            failed: false,
            unidentified: false,
        })
    }

    fn take(&mut self, input: &Path, result: anyhow::Result<FrameReport>) -> ControlFlow<()> {
        self.progress.inc(1);
        let printed = result.and_then(|report| {
            self.unidentified |= !report.is_identified();
            self.output.save(input, &report)?;
            self.output.print(&report)
        });
        printed.unwrap_or_else(|error| {
            self.failed = true;
            self.progress.suspend(|| complain(chained(error.as_ref())));
            ControlFlow::Continue(())
        })
    }

    fn exit(self) -> Exit {
        self.progress.finish_and_clear();
        match (self.failed, self.unidentified) {
            (true, _) => Exit::Failure,
            (false, true) => Exit::NotIdentified,
            (false, false) => Exit::Success,
        }
    }
}

fn thread_pool(threads: Option<u32>) -> anyhow::Result<rayon::ThreadPool> {
    rayon::ThreadPoolBuilder::new()
        // None at all stands for one for each processor.
        .num_threads(threads.unwrap_or(0) as usize)
        .build()
        .context("starting threads")
}

/// The catalogue that is asked for, kept by the caller if it is not the built-in one.
fn read_catalog(path: Option<&Path>) -> anyhow::Result<Cow<'static, Catalog>> {
    Ok(match path {
        Some(path) => {
            let reading = catalog::read(path)?;
            for file in &reading.files {
                if let Some(reasons) = file.summary.left_out() {
                    let (path, records) = (file.path.display(), file.summary.records);
                    warn(format_args!(
                        "{path}: not every one of {records} records is a star: {reasons}"
                    ));
                }
            }
            Cow::Owned(reading.catalog)
        }
        None => Cow::Borrowed(Catalog::built_in()),
    })
}

/// The index comes from the cache where it is there and whole; a cache of no use costs time, not results.
fn sky<'a>(catalog: &'a Catalog, resources: &ResourceArgs) -> Sky<'a> {
    let progress = bar(100, "indexing the catalogue {wide_bar} {percent} %");
    let show = |part: f64| progress.set_position((part * 100.0) as u64);
    let Some(directory) = cache::directory(resources.cache_dir.clone()) else {
        return Sky::build(catalog, &show);
    };
    let (sky, troubles) = Sky::open(catalog, &directory, &show);
    progress.finish_and_clear();
    for trouble in troubles {
        let trouble = chained(&trouble);
        warn(format_args!("{trouble}; the index was made anew"));
    }
    sky
}

/// A bar on standard error, which stays empty where that is no terminal.
fn bar(length: u64, template: &str) -> ProgressBar {
    let style =
        ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(length).with_style(style)
}
