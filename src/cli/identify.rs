//! `identify`: identifies the stars in lists of centroids.

use super::exit::{CommandError, CommandOutput};
use super::input::stdin;
use super::options::values::MAX_SIDE_PX;
use super::solving::options::SolvingOptions;
use super::solving::{Inputs, SolvingPlan, report_all};
use clap::Args;
use starpipe::camera::data_sheet::CameraDescription;
use starpipe::centroids::CentroidListOptions;
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    starpipe identify centroids.csv\n  \
    starpipe identify --pixel-scale 10.8 --width 752 --height 480 centroids.csv\n  \
    starpipe process --format csv a.fits b.fits > stars.csv; starpipe identify --frame a.fits stars.csv\n\n\
    The columns are x,y (or x_px,y_px) and one of vmag (Johnson V), mag (instrumental) or flux, or as\n\
    photutils, SEP and SExtractor name them; others are ignored. The tables of starpipe process are read\n\
    with their errors and flags. (0, 0) is the center of the top-left pixel, y points down.")]
pub(crate) struct IdentifyArgs {
    /// Lists of centroids to identify; - for standard input
    #[arg(value_name = "CENTROIDS.csv", required = true)]
    lists: Vec<PathBuf>,
    /// Width of the frame in pixels [default: that of --camera, else the extent of the centroids]
    #[arg(long, value_name = "PIXELS", help_heading = "Frame", value_parser = clap::value_parser!(u32).range(1..=MAX_SIDE_PX))]
    width: Option<u32>,
    /// Height of the frame in pixels [default: that of --camera, else the extent of the centroids]
    #[arg(long, value_name = "PIXELS", help_heading = "Frame", value_parser = clap::value_parser!(u32).range(1..=MAX_SIDE_PX))]
    height: Option<u32>,
    /// Frame whose rows to use, if a table of starpipe process has several frames
    #[arg(long, value_name = "NAME", help_heading = "Frame")]
    frame: Option<String>,
    #[command(flatten)]
    solving: SolvingOptions,
}

/// `starpipe identify`
pub(crate) fn identify(arguments: IdentifyArgs) -> Result<CommandOutput, CommandError> {
    let IdentifyArgs {
        lists,
        width,
        height,
        frame,
        solving,
    } = arguments;
    stdin::check_once(&lists)?;
    let stated = solving.options()?;
    let camera = solving.hints.description()?;
    let mut options = CentroidListOptions::default();
    [options.width, options.height] = frame_size([width, height], camera.as_ref())?;
    options.frame = frame;
    let plan = SolvingPlan {
        options: stated,
        camera,
        ..SolvingPlan::default()
    };
    Ok(report_all(&Inputs::Lists(options), &lists, solving, &plan)?.into())
}

/// The size of the frames, as far as it is stated or the camera tells it.
fn frame_size(
    stated: [Option<u32>; 2],
    camera: Option<&CameraDescription>,
) -> Result<[Option<u32>; 2], CommandError> {
    let Some(camera) = camera else {
        return Ok(stated);
    };
    let size = camera
        .frame_size(stated.map(|side| side.map(|side| side as usize)))
        .map_err(|error| CommandError::usage(format!("--width, --height, --camera: {error}")))?;
    Ok(size.map(|side| side.and_then(|side| u32::try_from(side).ok())))
}
