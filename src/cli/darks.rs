//! `darks`: frames taken without light.

use super::exit::{CommandError, Exit};
use super::input::frames::{self as input, for_each_frame};
use super::options::catalog::thread_pool;
use super::options::format::Format;
use super::options::values;
use super::output::files::save;
use super::output::master::{header, image};
use super::output::messages::{one_line, report_error, report_warning};
use super::output::overwrite;
use super::output::rows::csv_table;
use super::output::stdout::print;
use anyhow::Context;
use clap::Args;
use starpipe::calibration::darks::{
    DarkConfig, DarkStack, Darks, FrameStatistics, FullScaleSource, HotPixelRow,
};
use starpipe::camera::data_sheet::DataSheet;
use starpipe::frame::Buffers;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::str::FromStr;

#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    starpipe darks darks/\n  \
    starpipe darks --camera camera.toml --out calibration darks/\n  \
    starpipe darks --exposure 0.1:short/ --exposure 10:long/ --format json short/ long/\n\n\
    --out writes master-dark.fits (of several exposures master-dark-0.1s.fits and so on), noise.fits and \
    hot-pixels.csv, which `starpipe process` takes as --dark and --hot-pixels. Exposures come from the files' headers \
    unless --exposure says otherwise; with two of them there is a dark current.")]
pub(crate) struct DarksArgs {
    /// Frames taken without light; a directory stands for the frames in it, - for standard input
    #[arg(value_name = "FRAME", required = true)]
    pub(crate) frames: Vec<PathBuf>,
    /// Which image of a file with several, from 1 [default: the first]
    #[arg(long, value_name = "NUMBER")]
    pub(crate) page: Option<NonZeroUsize>,
    /// How long frames were exposed, in seconds: those of a file or directory, else all (may be repeated) [default: the
    /// exposure in the file's header]
    #[arg(long, value_name = "SECONDS[:PATH]", allow_hyphen_values = true)]
    pub(crate) exposure: Vec<ExposureOf>,
    /// Bits of a grey level [default: those of --camera, else of the file's format]
    #[arg(long, value_name = "NUMBER", value_parser = clap::value_parser!(u32).range(1..=32))]
    pub(crate) bits: Option<u32>,
    /// Description of the camera, see `starpipe camera new`: its gain makes electrons of grey levels
    #[arg(long, value_name = "FILE.toml")]
    pub(crate) camera: Option<PathBuf>,
    /// Robust standard deviations from which on a pixel is hot
    #[arg(long, value_name = "NUMBER", value_parser = values::positive, default_value_t = starpipe::calibration::darks::HOT_SIGMA)]
    pub(crate) hot_sigma: f64,
    /// What to print: csv has a row for each frame
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub(crate) format: Format,
    /// Also write the master dark, the noise of each pixel and the hot pixels into this directory
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Threads to work with [default: one for each processor]
    #[arg(long, value_name = "NUMBER", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub(crate) threads: Option<u32>,
}

/// An exposure, and the file or directory whose frames have it; else all.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ExposureOf {
    pub(crate) exposure_s: f64,
    pub(crate) path: Option<PathBuf>,
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
pub(crate) fn darks(arguments: DarksArgs) -> Result<Exit, CommandError> {
    input::check(&arguments.frames)?;
    let (frames, troubles) = input::frames(arguments.frames.clone());
    for trouble in &troubles {
        report_error(one_line(trouble));
    }
    check_exposures(&arguments.exposure, &frames)?;
    let config = config(&arguments)?;
    let pool = thread_pool(arguments.threads)?;
    let mut stack = DarkStack::new();
    let read = |path: &PathBuf| -> anyhow::Result<_> {
        let frame =
            input::read_frame(path, arguments.page, &mut Buffers::new()).context("reading")?;
        let name = path.display().to_string();
        let exposure_s = exposure_of(path, &arguments.exposure);
        let statistics = FrameStatistics::of(&name, &frame, exposure_s);
        Ok((frame, statistics))
    };
    let unread = for_each_frame(&pool, &frames, read, |(frame, statistics)| {
        Ok(stack.add(&frame, statistics)?)
    })?;
    let failed = unread > 0 || !troubles.is_empty();
    if unread == frames.len() {
        return Ok(Exit::Failure);
    }
    let darks = stack.measure(&config).map_err(anyhow::Error::from)?;
    for warning in &darks.warnings {
        report_warning(warning);
    }
    if let Some(directory) = &arguments.out {
        let files = files(&darks, directory)?;
        let results: Vec<_> = files.iter().map(|(path, _)| path.clone()).collect();
        overwrite::check_results(&frames, &results)?;
        save(directory, &files)?;
    }
    let text = match arguments.format {
        Format::Text => darks.report().to_text(),
        Format::Json => serde_json::to_string(&darks.report()).context("writing JSON")? + "\n",
        Format::Csv => csv_table(darks.frame_rows())?,
    };
    // Nobody left to read it: nothing is lost.
    let _ = print(&text)?;
    Ok(if failed { Exit::Failure } else { Exit::Success })
}

fn config(arguments: &DarksArgs) -> anyhow::Result<DarkConfig> {
    let sheet = arguments
        .camera
        .as_deref()
        .map(DataSheet::read)
        .transpose()?;
    let stated = arguments.bits.map(|bits| (bits, FullScaleSource::Option));
    let described = sheet
        .as_ref()
        .map(|sheet| (sheet.bits, FullScaleSource::Camera));
    Ok(DarkConfig {
        bits: stated.or(described),
        gain_e_per_adu: sheet.map(|sheet| sheet.gain_e_per_adu),
        hot_sigma: arguments.hot_sigma,
    })
}

/// Refuses an exposure for frames that are not there.
fn check_exposures(exposures: &[ExposureOf], frames: &[PathBuf]) -> Result<(), CommandError> {
    for path in exposures.iter().filter_map(|e| e.path.as_ref()) {
        if !frames.iter().any(|frame| frame.starts_with(path)) {
            return Err(CommandError::Usage(format!(
                "--exposure is given for {}, of which no frame is given",
                path.display()
            )));
        }
    }
    Ok(())
}

/// The exposure said of `frame`: that of the longest path that it is in, else that of all frames.
fn exposure_of(frame: &Path, exposures: &[ExposureOf]) -> Option<f64> {
    let applies = exposures.iter().filter(|of| {
        let path = of.path.as_ref();
        path.is_none_or(|path| frame.starts_with(path))
    });
    let depth = |of: &&ExposureOf| of.path.as_ref().map_or(0, |path| path.components().count());
    applies.max_by_key(depth).map(|of| of.exposure_s)
}

/// What is written: their names and contents.
fn files(darks: &Darks, directory: &Path) -> anyhow::Result<Vec<(PathBuf, Vec<u8>)>> {
    let mut files = Vec::new();
    let size = (darks.width, darks.height);
    for group in &darks.groups {
        let name = match group.exposure_s {
            _ if darks.groups.len() == 1 => "master-dark.fits".to_owned(),
            Some(exposure_s) => format!("master-dark-{exposure_s}s.fits"),
            None => "master-dark-unknown.fits".to_owned(),
        };
        let mut header = header("DARK", group.frames);
        if let Some(exposure_s) = group.exposure_s {
            header.real("EXPTIME", exposure_s, "[s] exposure");
        }
        header.real("MEAN", group.level_adu, "[ADU] mean of the frames' means");
        let noise = group.temporal_noise_adu.unwrap_or(f64::NAN);
        header.real("NOISE", noise, "[ADU] of a pixel in one frame");
        header.history(&format!(
            "Mean of each pixel over {} frames, by starpipe darks {}",
            group.frames,
            env!("CARGO_PKG_VERSION")
        ));
        files.push((directory.join(name), image(size, &group.means, &header)?));
    }
    if let Some(noise) = &darks.noise_adu {
        let mut header = header("NOISE", darks.frames.len());
        header.text("BUNIT", "ADU", "");
        header.history("Standard deviation of each pixel over frames of one exposure, pooled over the exposures");
        files.push((directory.join("noise.fits"), image(size, noise, &header)?));
    }
    files.push((directory.join("hot-pixels.csv"), hot_pixels_table(darks)?));
    Ok(files)
}

fn hot_pixels_table(darks: &Darks) -> anyhow::Result<Vec<u8>> {
    let mut writer = csv::WriterBuilder::new()
        .has_headers(false)
        .from_writer(Vec::new());
    // A heading also where there is no row.
    writer.write_record(HotPixelRow::COLUMNS)?;
    for hot in &darks.hot_pixels {
        writer.serialize(HotPixelRow::from(hot))?;
    }
    writer
        .into_inner()
        .map_err(|error| error.into_error().into())
}
