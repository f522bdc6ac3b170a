//! `flats`: evenly lit frames.

use super::exit::{CommandError, Exit};
use super::input::frames::{self as input, for_each_frame, read_master};
use super::options::catalog::thread_pool;
use super::options::format::Format;
use super::output::files::save;
use super::output::master::{header, image};
use super::output::messages::{one_line, report_error, report_warning};
use super::output::overwrite;
use super::output::rows::csv_table;
use super::output::stdout::print;
use anyhow::Context;
use clap::Args;
use starpipe::calibration::flats::{FlatConfig, FlatStack, Flats};
use starpipe::camera::data_sheet::DataSheet;
use starpipe::frame::Buffers;
use std::num::NonZeroUsize;
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    starpipe flats --dark master-dark.fits --out calibration flats/\n  \
    starpipe flats --camera camera.toml --format json dim-1.fits dim-2.fits bright-1.fits bright-2.fits\n\n\
    --out writes master-flat.fits, with a mean of 1, which `starpipe process` takes as --flat. The first and the second frame \
    are a pair of the same light, and so on: from the noise of such pairs follows the gain, from pairs of different \
    light without knowing the read noise.")]
pub(crate) struct FlatsArgs {
    /// Evenly lit frames; a directory stands for the frames in it, - for standard input
    #[arg(value_name = "FRAME", required = true)]
    pub(crate) frames: Vec<PathBuf>,
    /// Which image of a file with several, from 1 [default: the first]
    #[arg(long, value_name = "NUMBER")]
    pub(crate) page: Option<NonZeroUsize>,
    /// Frame taken without light, or the mean of many, see `starpipe darks`
    #[arg(long, value_name = "FILE")]
    pub(crate) dark: Option<PathBuf>,
    /// Description of the camera, see `starpipe camera new`: its bias where there is no --dark, and its read noise
    #[arg(long, value_name = "FILE.toml")]
    pub(crate) camera: Option<PathBuf>,
    /// What to print: csv has a row for each frame
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub(crate) format: Format,
    /// Also write master-flat.fits into this directory
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Threads to work with [default: one for each processor]
    #[arg(long, value_name = "NUMBER", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub(crate) threads: Option<u32>,
}

/// `starpipe flats`
pub(crate) fn flats(arguments: FlatsArgs) -> Result<Exit, CommandError> {
    input::check(&arguments.frames)?;
    let (frames, troubles) = input::frames(arguments.frames.clone());
    for trouble in &troubles {
        report_error(one_line(trouble));
    }
    let output = arguments
        .out
        .as_ref()
        .map(|directory| directory.join("master-flat.fits"));
    if let Some(output) = &output {
        let inputs: Vec<_> = frames.iter().chain(&arguments.dark).cloned().collect();
        overwrite::check_results(&inputs, std::slice::from_ref(output))?;
    }
    let pool = thread_pool(arguments.threads)?;
    let mut stack = FlatStack::new(config(&arguments)?);
    let read = |path: &PathBuf| -> anyhow::Result<_> {
        let frame =
            input::read_frame(path, arguments.page, &mut Buffers::new()).context("reading")?;
        Ok((path.display().to_string(), frame))
    };
    let unread = for_each_frame(&pool, &frames, read, |(name, frame)| {
        Ok(stack.add(&name, &frame)?)
    })?;
    if unread == frames.len() {
        return Ok(Exit::Failure);
    }
    let flats = stack.measure().map_err(anyhow::Error::from)?;
    if let (Some(directory), Some(output)) = (&arguments.out, output) {
        save(directory, &[(output, master(&flats, &arguments)?)])?;
    }
    let text = match arguments.format {
        Format::Text => flats.report().to_text(),
        Format::Json => serde_json::to_string(&flats.report()).context("writing JSON")? + "\n",
        Format::Csv => csv_table(flats.frame_rows())?,
    };
    // Nobody left to read it: nothing is lost.
    let _ = print(&text)?;
    let failed = unread > 0 || !troubles.is_empty();
    Ok(if failed { Exit::Failure } else { Exit::Success })
}

fn config(arguments: &FlatsArgs) -> anyhow::Result<FlatConfig> {
    let sheet = arguments
        .camera
        .as_deref()
        .map(DataSheet::read)
        .transpose()?;
    let dark = arguments.dark.as_deref().map(read_master).transpose()?;
    if sheet.is_none() && dark.is_none() {
        report_warning(
            "the level without light is taken to be 0: --dark or --camera says what it is",
        );
    }
    Ok(FlatConfig {
        dark: dark.map(|dark| (dark.name, dark.frame)),
        bias_adu: sheet.as_ref().map_or(0.0, |sheet| sheet.bias_adu),
        read_noise_e: sheet.map(|sheet| sheet.read_noise_e),
    })
}

fn master(flats: &Flats, arguments: &FlatsArgs) -> anyhow::Result<Vec<u8>> {
    let mut header = header("FLAT", flats.frames.len());
    if let Some(gain) = flats.gain {
        header.real("GAIN", gain.e_per_adu, "[e/ADU] by photon transfer");
    }
    header.real("RMS", flats.nonuniformity, "of the response, of its mean");
    let dark = arguments.dark.as_ref();
    header.history(&format!(
        "Mean response of each pixel over {} frames, by starpipe flats {}; dark: {}",
        flats.frames.len(),
        env!("CARGO_PKG_VERSION"),
        dark.map_or("none".to_owned(), |dark| dark.display().to_string())
    ));
    image((flats.width, flats.height), &flats.master, &header)
}
