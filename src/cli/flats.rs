//! `flats`: makes a master flat of evenly lit frames, and measures gain and response.

use super::exit::{CommandError, CommandOutput, Exit};
use super::input::frames::{FrameList, for_each_frame, read_master};
use super::options::format::OutputFormat;
use super::options::frames::{FrameOptions, PageOption};
use super::options::threads::ThreadOptions;
use super::output::files::write_into;
use super::output::master::{fits_image, header};
use super::output::messages::report_warning;
use super::output::overwrite;
use super::output::rows::{csv_table, json_line};
use clap::Args;
use starpipe::base::size::Size;
use starpipe::calibration::flats::{FlatConfig, FlatStack, Flats};
use starpipe::camera::data_sheet::DataSheet;
use starpipe::frame::Frame;
use std::path::{Path, PathBuf};

/// The file that `--out` writes.
const MASTER: &str = "master-flat.fits";

#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    starpipe flats --dark master-dark.fits --out calibration flats/\n  \
    starpipe flats --camera camera.toml --format json dim-1.fits dim-2.fits bright-1.fits bright-2.fits\n\n\
    --out writes master-flat.fits, with a mean of 1, for the option --flat of `starpipe process`. Frames \
    are taken in pairs (first and second, third and fourth, ...) with equal illumination within a pair. The \
    gain follows from the noise of the pairs. If the illumination differs from pair to pair, the read noise \
    need not be known.")]
pub(crate) struct FlatsArgs {
    #[command(flatten)]
    frames: FrameOptions,
    #[command(flatten)]
    page: PageOption,
    /// Dark frame or master dark to subtract; see `starpipe darks`
    #[arg(long, value_name = "FILE")]
    dark: Option<PathBuf>,
    /// Description of the camera, see `starpipe camera new`: its bias is used if there is no --dark,
    /// and its read noise
    #[arg(long, value_name = "FILE.toml")]
    camera: Option<PathBuf>,
    /// What to print: csv has a row for each frame
    #[arg(long, value_enum, default_value_t = OutputFormat::Text)]
    format: OutputFormat,
    /// Also write master-flat.fits into this directory
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    threads: ThreadOptions,
}

/// `starpipe flats`
pub(crate) fn flats(arguments: FlatsArgs) -> Result<CommandOutput, CommandError> {
    let (frames, failed) = FrameList::expand(arguments.frames.frames.clone())?.reported();
    if let Some(directory) = &arguments.out {
        let inputs: Vec<_> = frames.iter().chain(&arguments.dark).cloned().collect();
        overwrite::check_results(&inputs, &[directory.join(MASTER)])?;
    }
    let pool = arguments.threads.pool()?;
    let mut stack = FlatStack::new(arguments.config()?);
    let named = |path: &Path, frame: Frame<'static>| (path.display().to_string(), frame);
    let take = |(name, frame): (String, Frame)| Ok(stack.add(&name, &frame)?);
    let unread = for_each_frame(&pool, &frames, arguments.page.page, named, take)?;
    if unread == frames.len() {
        return Ok(Exit::Failure.into());
    }
    let flats = stack.measure()?;
    let all_written = arguments.out.as_ref().is_none_or(|directory| {
        let master = master(&flats, arguments.dark.as_deref());
        write_into(
            directory,
            [master.map(|master| (MASTER.to_owned(), master))],
        )
    });
    let outcome = CommandOutput {
        text: match arguments.format {
            OutputFormat::Text => flats.report().to_text(),
            OutputFormat::Json => json_line(&flats.report())?,
            OutputFormat::Csv => csv_table(flats.frame_rows())?,
        },
        exit: Exit::failure_if(failed || unread > 0),
    };
    Ok(outcome.if_written(all_written))
}

impl FlatsArgs {
    fn config(&self) -> anyhow::Result<FlatConfig> {
        let sheet = self.camera.as_deref().map(DataSheet::read).transpose()?;
        let dark = self.dark.as_deref().map(read_master).transpose()?;
        if sheet.is_none() && dark.is_none() {
            report_warning("the dark level is assumed to be 0: give --dark or --camera");
        }
        Ok(FlatConfig {
            dark: dark.map(|dark| (dark.name, dark.frame)),
            bias_adu: sheet.as_ref().map_or(0.0, |sheet| sheet.bias_adu),
            read_noise_e: sheet.map(|sheet| sheet.read_noise_e),
        })
    }
}

/// The master flat as a FITS file.
fn master(flats: &Flats, dark: Option<&Path>) -> anyhow::Result<Vec<u8>> {
    let mut header = header("FLAT", flats.frames.len());
    if let Some(gain) = flats.gain {
        header.real("GAIN", gain.e_per_adu, "[e/ADU] by photon transfer");
    }
    header.real(
        "RMS",
        flats.nonuniformity,
        "standard deviation of the response",
    );
    header.history(&format!(
        "Mean response of each pixel over {} frames, by starpipe flats {}; dark: {}",
        flats.frames.len(),
        env!("CARGO_PKG_VERSION"),
        dark.map_or("none".to_owned(), |dark| dark.display().to_string())
    ));
    fits_image(Size::new(flats.width, flats.height), &flats.master, &header)
}
