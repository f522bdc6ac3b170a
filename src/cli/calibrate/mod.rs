//! `calibrate`: measures the lens of a camera in several of its frames.

mod exports;
mod figure;
mod lens_file;
mod page;

use super::exit::{CommandError, CommandOutput, Exit};
use super::input::frames::FrameList;
use super::options::calibration::CalibrationOptions;
use super::options::catalog::CatalogOptions;
use super::options::format::PageFormat;
use super::options::frames::{FrameOptions, MemoryOption};
use super::options::hints::HintOptions;
use super::output::files::{NewFile, write_each};
use super::output::messages::report_error;
use super::output::rows::json_line;
use super::page::HtmlOption;
use super::plot::PlotFile;
use super::progress::frames_bar;
use super::solving::{InputSolver, Inputs, Sink, SolvedImage, SolvingPlan};
use clap::Args;
use exports::ExportOptions;
use starpipe::frame::{Cameras, ImageName, PageChoice};
use starpipe::identify::lens::{LeftOutFrame, LensCalibration, LensFrame, calibrate as measure};
use starpipe::report::LensReport;
use starpipe::report::page::Fact;
use std::ops::ControlFlow;
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    starpipe calibrate night/ -o camera.toml\n  \
    starpipe calibrate --site 52.22,4.42 --camera camera.toml night/*.fits -o camera.toml --force\n  \
    starpipe calibrate night/ -o camera.toml --html\n  \
    starpipe calibrate night/ --opencv lens.yaml\n  \
    starpipe process --camera camera.toml night.fits\n\n\
    Use twenty frames or more, with stars all over the frame. `process`, `track` and `identify` use the lens\n\
    in the file given with --camera.")]
pub(crate) struct CalibrateArgs {
    #[command(flatten)]
    frames: FrameOptions,
    #[command(flatten)]
    calibration: CalibrationOptions,
    #[command(flatten)]
    memory: MemoryOption,
    #[command(flatten)]
    hints: HintOptions,
    /// File for the lens: a copy of the description given with --camera, if any, with a table [lens]
    #[arg(short, long, value_name = "FILE.toml")]
    out: Option<PathBuf>,
    /// Overwrite files
    #[arg(long)]
    force: bool,
    /// Write a figure of the stars in the frame and of their residuals
    #[arg(long, value_name = "FILE.svg|png", value_parser = PlotFile::parser())]
    plot: Option<PlotFile>,
    #[command(flatten)]
    html: HtmlOption,
    /// What to print
    #[arg(long, value_enum, default_value_t = PageFormat::Text)]
    format: PageFormat,
    #[command(flatten)]
    exports: ExportOptions,
    #[command(flatten)]
    catalog: CatalogOptions,
}

/// `starpipe calibrate`
pub(crate) fn calibrate(arguments: CalibrateArgs) -> Result<CommandOutput, CommandError> {
    if !arguments.force {
        let files = arguments.out.as_deref().into_iter();
        let files = files.chain(arguments.exports.paths());
        lens_file::check(files.chain(arguments.page_path().as_deref()))?;
    }
    let plan = arguments.plan()?;
    let (paths, failed) =
        FrameList::of_sky(arguments.frames.frames.clone(), Cameras::One)?.reported();
    if arguments.force {
        arguments
            .html
            .checked_path(&paths, || arguments.default_page())?;
    }
    let SolvedFrames {
        frames,
        left_out,
        unread,
        catalog,
    } = solve(&arguments, &plan, &paths)?;
    if unread == paths.len() {
        return Ok(Exit::Failure.into());
    }
    let measured = measure(frames, left_out).map_err(anyhow::Error::from)?;
    let report = LensReport::new(&measured);
    let page = arguments.page_path().map(|path| {
        let page = page::build(&measured, &report, unread, catalog)?;
        super::page::file(&path, &page)
    });
    let all_written = write_each(files(&arguments, &measured, page));
    let has_failed = failed || unread > 0;
    let outcome = CommandOutput {
        text: match arguments.format {
            PageFormat::Text => report.to_text(),
            PageFormat::Json => json_line(&report)?,
        },
        exit: match measured.left_out.is_empty() {
            _ if has_failed => Exit::Failure,
            true => Exit::Success,
            false => Exit::NotIdentified,
        },
    };
    Ok(outcome.if_written(all_written))
}

impl CalibrateArgs {
    /// The file of the page, if there is to be one.
    fn page_path(&self) -> Option<PathBuf> {
        self.html.path(|| self.default_page())
    }

    /// Beside the file of the lens, if there is one.
    fn default_page(&self) -> PathBuf {
        let lens = self.out.as_ref();
        lens.map_or("calibrate.html".into(), |path| path.with_extension("html"))
    }

    fn plan(&self) -> Result<SolvingPlan, CommandError> {
        let mut options = self.hints.options()?;
        let camera = self.hints.description()?;
        // The lens is what is to be measured.
        options.refine_lens = true;
        Ok(SolvingPlan {
            options,
            calibration: self.calibration.read(camera.as_ref())?,
            camera,
            memory: self.memory.limit(),
        })
    }
}

/// The stars of a frame, or why it is left out.
type Taken = Result<LensFrame, LeftOutFrame>;

/// Takes the stars of frames.
struct LensFrameSink;

impl Sink for LensFrameSink {
    type Made = Taken;

    fn make(&self, image: &ImageName, solved: &SolvedImage) -> Taken {
        let name = image.to_string();
        solved
            .solution
            .lens_frame(&name)
            .map_err(|why| LeftOutFrame { name, why })
    }
}

/// What a lens is measured in.
struct SolvedFrames {
    frames: Vec<LensFrame>,
    left_out: Vec<LeftOutFrame>,
    /// Files that are no frames.
    unread: usize,
    /// Where their stars are from.
    catalog: Fact,
}

fn solve(
    arguments: &CalibrateArgs,
    plan: &SolvingPlan,
    paths: &[PathBuf],
) -> Result<SolvedFrames, CommandError> {
    let progress = frames_bar(paths.len() as u64);
    let (mut frames, mut left_out, mut unread) = (Vec::new(), Vec::new(), 0);
    let catalog = arguments.catalog.with_index(|pool, indexed| {
        let solver = InputSolver {
            pool,
            inputs: &Inputs::Frames(PageChoice::default()),
            context: plan.context(indexed),
            memory: plan.memory,
            sink: LensFrameSink,
        };
        solver.solve_all(paths, |images| {
            progress.inc(1);
            for (_, taken) in images {
                match taken {
                    Ok(Ok(frame)) => frames.push(frame),
                    Ok(Err(unfit)) => left_out.push(unfit),
                    Err(error) => {
                        unread += 1;
                        progress.suspend(|| report_error(error.as_ref()));
                    }
                }
            }
            ControlFlow::Continue(())
        });
        Ok(super::page::catalog(indexed.catalog()))
    })?;
    progress.finish_and_clear();
    Ok(SolvedFrames {
        frames,
        left_out,
        unread,
        catalog,
    })
}

/// The files that are asked for, the lens first.
fn files(
    arguments: &CalibrateArgs,
    measured: &LensCalibration,
    page: Option<anyhow::Result<NewFile>>,
) -> Vec<anyhow::Result<NewFile>> {
    let lens = arguments.out.as_ref().map(|path| {
        let text = lens_file::text(arguments.hints.camera.as_deref(), measured)?;
        Ok((path.clone(), text.into_bytes()))
    });
    let plot = arguments.plot.as_ref();
    let plot = plot.map(|plot| plot.with(&figure::sheet(measured)));
    let exports = arguments.exports.files(measured);
    lens.into_iter()
        .chain(exports)
        .chain(plot)
        .chain(page)
        .collect()
}
