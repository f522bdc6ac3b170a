//! `darks`: measures noise, pattern, dark current and hot pixels on frames taken without light.

mod figure;
mod files;
mod page;

use super::exit::{CommandError, CommandOutput, Exit};
use super::input::frames::{FrameList, for_each_frame};
use super::options::format::OutputFormat;
use super::options::frames::{FrameOptions, PageOption};
use super::options::threads::ThreadOptions;
use super::options::values;
use super::output::files::{NewFile, generated, make_directory, write_each};
use super::output::messages::report_warning;
use super::output::overwrite;
use super::output::rows::{csv_table, json_line};
use super::page::HtmlOption;
use clap::Args;
use starpipe::calibration::darks::{
    DarkConfig, DarkStack, Darks, FrameStatistics, FullScaleSource, HOT_SIGMA,
};
use starpipe::camera::data_sheet::DataSheet;
use starpipe::frame::Frame;
use std::path::{Path, PathBuf};
use std::str::FromStr;

#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    starpipe darks darks/\n  \
    starpipe darks --camera camera.toml --out calibration --html darks/\n  \
    starpipe darks --exposure 0.1:short/ --exposure 10:long/ --format json short/ long/\n\n\
    --out writes master-dark.fits (for several exposures master-dark-0.1s.fits and so on), noise.fits and \
    hot-pixels.csv, for the options --dark and --hot-pixels of `starpipe process`. Exposures come from the files' \
    headers unless --exposure gives them; the dark current needs two different exposures.")]
pub(crate) struct DarksArgs {
    #[command(flatten)]
    frames: FrameOptions,
    #[command(flatten)]
    page: PageOption,
    /// Exposure in seconds, of one file or directory if PATH is given, else of all frames (may be repeated)
    /// [default: the exposure in the file's header]
    #[arg(long, value_name = "SECONDS[:PATH]", allow_hyphen_values = true)]
    exposure: Vec<ExposureOf>,
    /// Bit depth [default: that of --camera, else of the file's format]
    #[arg(long, value_name = "NUMBER", value_parser = clap::value_parser!(u32).range(1..=32))]
    bits: Option<u32>,
    /// Description of the camera, see `starpipe camera new`: its gain converts gray levels to
    /// electrons
    #[arg(long, value_name = "FILE.toml")]
    camera: Option<PathBuf>,
    /// Threshold for hot pixels, in robust standard deviations
    #[arg(long, value_name = "NUMBER", value_parser = values::positive, default_value_t = HOT_SIGMA)]
    hot_sigma: f64,
    /// What to print: csv has a row for each frame
    #[arg(long, value_enum, default_value_t = OutputFormat::Text)]
    format: OutputFormat,
    /// Also write the master dark, the noise of each pixel and the hot pixels into this directory
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    html: HtmlOption,
    #[command(flatten)]
    threads: ThreadOptions,
}

/// An exposure, and the file or directory that has it; without a path, all frames have it.
#[derive(Debug, Clone, PartialEq)]
struct ExposureOf {
    exposure_s: f64,
    path: Option<PathBuf>,
}

impl FromStr for ExposureOf {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (seconds, path) = match text.split_once(':') {
            Some((_, "")) => return Err(values::not_of_form(text, "SECONDS or SECONDS:PATH")),
            Some((seconds, path)) => (seconds, Some(PathBuf::from(path))),
            None => (text, None),
        };
        Ok(Self {
            exposure_s: values::exposure(seconds)?,
            path,
        })
    }
}

/// `starpipe darks`
pub(crate) fn darks(arguments: DarksArgs) -> Result<CommandOutput, CommandError> {
    let (frames, failed) = FrameList::expand(arguments.frames.frames.clone())?.reported();
    check_exposures(&arguments.exposure, &frames)?;
    let page_path = arguments.page_path(&frames)?;
    let config = arguments.config()?;
    let pool = arguments.threads.pool()?;
    let mut stack = DarkStack::new();
    let measure = |path: &Path, frame: Frame<'static>| {
        let name = path.display().to_string();
        let exposure_s = exposure_of(path, &arguments.exposure);
        let statistics = FrameStatistics::measure(&name, &frame, exposure_s);
        (frame, statistics)
    };
    let take = |(frame, statistics): (Frame, FrameStatistics)| Ok(stack.add(&frame, statistics)?);
    let unread = for_each_frame(&pool, &frames, arguments.page.page, measure, take)?;
    if unread == frames.len() {
        return Ok(Exit::Failure.into());
    }
    let darks = stack.measure(&config)?;
    for warning in &darks.warnings {
        report_warning(warning);
    }
    let results = match &arguments.out {
        Some(directory) => results(directory, &darks, &frames)?,
        None => Vec::new(),
    };
    let page = page_path.map(|path| super::page::file(&path, &page::build(&darks, unread)?));
    let all_written = write_each(results.into_iter().chain(page));
    let outcome = CommandOutput {
        text: match arguments.format {
            OutputFormat::Text => darks.report().to_text(),
            OutputFormat::Json => json_line(&darks.report())?,
            OutputFormat::Csv => csv_table(darks.frame_rows())?,
        },
        exit: Exit::failure_if(failed || unread > 0),
    };
    Ok(outcome.if_written(all_written))
}

impl DarksArgs {
    /// The file of the page, if there is to be one.
    fn page_path(&self, frames: &[PathBuf]) -> Result<Option<PathBuf>, CommandError> {
        let camera = self.camera.iter().cloned();
        let inputs: Vec<PathBuf> = frames.iter().cloned().chain(camera).collect();
        let directory = self.out.clone().unwrap_or_default();
        self.html
            .checked_path(&inputs, || directory.join("darks.html"))
    }

    fn config(&self) -> anyhow::Result<DarkConfig> {
        let sheet = self.camera.as_deref().map(DataSheet::read).transpose()?;
        let stated = self.bits.map(|bits| (bits, FullScaleSource::Option));
        let described = sheet
            .as_ref()
            .map(|sheet| (sheet.bits, FullScaleSource::Camera));
        Ok(DarkConfig {
            bits: stated.or(described),
            gain_e_per_adu: sheet.map(|sheet| sheet.gain_e_per_adu),
            hot_sigma: self.hot_sigma,
        })
    }
}

/// Refuses exposures of frames that are not given.
fn check_exposures(exposures: &[ExposureOf], frames: &[PathBuf]) -> Result<(), CommandError> {
    for path in exposures.iter().filter_map(|e| e.path.as_ref()) {
        if !frames.iter().any(|frame| frame.starts_with(path)) {
            return Err(CommandError::Usage(format!(
                "--exposure gives the exposure of {}, but no frame in it is processed",
                path.display()
            )));
        }
    }
    Ok(())
}

/// The exposure given for `frame`: that of the longest path that leads to it, else that of all
/// frames.
fn exposure_of(frame: &Path, exposures: &[ExposureOf]) -> Option<f64> {
    let applies = exposures.iter().filter(|of| {
        let path = of.path.as_ref();
        path.is_none_or(|path| frame.starts_with(path))
    });
    let depth = |of: &&ExposureOf| of.path.as_ref().map_or(0, |path| path.components().count());
    applies.max_by_key(depth).map(|of| of.exposure_s)
}

/// The files for `--out`, which overwrite nothing but such files.
fn results(
    directory: &Path,
    darks: &Darks,
    frames: &[PathBuf],
) -> Result<Vec<anyhow::Result<NewFile>>, CommandError> {
    let files = make_directory(directory).and_then(|()| files::build(darks));
    let placed = |(name, content)| (directory.join::<String>(name), content);
    let files = files.map(|files| files.into_iter().map(placed).collect::<Vec<NewFile>>());
    let paths: Vec<PathBuf> = files
        .iter()
        .flatten()
        .map(|(path, _)| path.clone())
        .collect();
    overwrite::check_results(frames, &paths)?;
    Ok(generated(files))
}
