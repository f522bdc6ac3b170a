//! `process` and `identify`.

use super::args::{IdentifyArgs, ProcessArgs, ResourceArgs, SolvingArgs};
use super::centroids::{self, FrameSize};
use super::input;
use super::output::{OutputSettings, Printer, ResultFiles, Solved};
use super::resources::{bar, read_catalog, sky, thread_pool, warn_of};
use super::settings::{FRAME_RESULTS, LIST_RESULTS};
use super::{Exit, Fault, batch, chained, complain};
use indicatif::ProgressBar;
use starpipe::frame::Buffers;
use starpipe::pipeline::{Knowledge, Pipeline, SolveConfig, Workspace};
use starpipe::report::FrameReport;
use std::num::NonZeroUsize;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// `starpipe process`
pub(crate) fn process(arguments: ProcessArgs) -> Result<Exit, Fault> {
    let ProcessArgs {
        frames,
        page,
        calibration,
        detection,
        light,
        solving,
    } = arguments;
    let sensor = solving.hints.sensor()?;
    let config = SolveConfig {
        detect: detection.resolve(),
        knowledge: Knowledge {
            exposure_s: light.exposure,
            ..solving.hints.resolve()?
        },
        calibration: calibration.resolve(sensor.as_ref())?.map(Arc::new),
        description: sensor.map(|sensor| light.description(sensor)),
        page,
    };
    input::check(&frames)?;
    let (frames, troubles) = input::frames(frames);
    for trouble in &troubles {
        complain(chained(trouble));
    }
    let (settings, resources) = solving.resolve(&frames, FRAME_RESULTS)?;
    // Frames are large: one is kept only where it is drawn.
    let keep = settings.directory.is_some();
    let exit = solve_all(
        &frames,
        settings,
        &resources,
        |pipeline, path, workspace| {
            let read = |buffers: &mut Buffers| input::read_frame(path, page, buffers);
            let (solution, frame) = pipeline.solve_read(path, &config, workspace, read)?;
            let frame = if keep {
                Some(frame)
            } else {
                workspace.frames.recycle(frame);
                None
            };
            Ok(Solved { solution, frame })
        },
    )?;
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
    let knowledge = solving.hints.resolve_with_camera()?;
    let size = FrameSize { width, height };
    let (settings, resources) = solving.resolve(&lists, LIST_RESULTS)?;
    solve_all(&lists, settings, &resources, |pipeline, path, _| {
        let list = centroids::read(path, size)?;
        let solution = pipeline.solve_centroids(&list, &knowledge);
        Ok(Solved {
            solution,
            frame: None,
        })
    })
}

impl SolvingArgs {
    fn resolve(
        self,
        inputs: &[PathBuf],
        extensions: &[&str],
    ) -> Result<(OutputSettings, ResourceArgs), Fault> {
        Ok((self.output.resolve(inputs, extensions)?, self.resources))
    }
}

/// Solves every input, prints its report, and writes its files; one that cannot be read does not disturb the others.
fn solve_all(
    inputs: &[PathBuf],
    settings: OutputSettings,
    resources: &ResourceArgs,
    solve: impl Fn(&Pipeline, &Path, &mut Workspace) -> anyhow::Result<Solved> + Sync,
) -> Result<Exit, Fault> {
    let mut run = Run::new(&settings, inputs);
    let files = ResultFiles::new(settings)?;
    if inputs.is_empty() {
        return Ok(run.exit());
    }
    let pool = thread_pool(resources.threads)?;
    let catalog = pool.install(|| read_catalog(resources.catalog.as_deref()))?;
    let sky = pool.install(|| sky(&catalog, resources));
    let pipeline = Pipeline::new(sky);
    // The threads that solve also draw and write: the one that prints waits for nothing else.
    let report = |input: &PathBuf, workspace: &mut Workspace| {
        let solved = solve(&pipeline, input, workspace)?;
        let name = input.display().to_string();
        let report = FrameReport::new(&name, &solved.solution, pipeline.catalog());
        let saved = files.save(input, &solved, &report, pipeline.catalog());
        Ok(Answer { report, saved })
    };
    // An input that is alone has all threads for itself.
    let threads = match inputs.len() {
        1 => NonZeroUsize::new(pool.current_num_threads()),
        _ => None,
    };
    let workspace = || {
        let mut workspace = Workspace::new();
        if let Some(threads) = threads {
            workspace.detect = workspace.detect.on_threads(threads);
        }
        workspace
    };
    batch::for_each_ordered(&pool, inputs, workspace, report, |_, result| {
        run.take(result)
    });
    let exit = run.exit();
    warn_of(pipeline.sky().take_troubles());
    Ok(exit)
}

/// What is told of an input, and whether it is in its files as well.
struct Answer {
    report: FrameReport,
    saved: anyhow::Result<()>,
}

/// What has become of the inputs so far.
struct Run {
    printer: Printer,
    progress: ProgressBar,
    failed: bool,
    unidentified: bool,
}

impl Run {
    fn new(settings: &OutputSettings, inputs: &[PathBuf]) -> Self {
        let progress = if inputs.len() > 1 {
            bar(inputs.len() as u64, "frames {wide_bar} {pos}/{len} {eta}")
        } else {
            ProgressBar::hidden()
        };
        Self {
            printer: Printer::new(settings),
            progress,
            failed: false,
            unidentified: false,
        }
    }

    fn take(&mut self, result: anyhow::Result<Answer>) -> ControlFlow<()> {
        self.progress.inc(1);
        let answer = match result {
            Ok(answer) => answer,
            Err(error) => {
                self.complain(&error);
                return ControlFlow::Continue(());
            }
        };
        self.unidentified |= !answer.report.is_identified();
        if let Err(error) = answer.saved {
            self.complain(&error);
        }
        // The bar steps aside: results may go to the same terminal.
        let printed = self.progress.suspend(|| self.printer.print(&answer.report));
        printed.unwrap_or_else(|error| {
            self.complain(&error);
            ControlFlow::Continue(())
        })
    }

    fn complain(&mut self, error: &anyhow::Error) {
        self.failed = true;
        self.progress.suspend(|| complain(chained(error.as_ref())));
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
