//! `identify`: lists of centroids.

use super::exit::{CommandError, Exit};
use super::input::centroid_list::{self as centroids, FrameSize};
use super::input::frames as input;
use super::options::values::MAX_SIDE_PX;
use super::solving::options::{LIST_RESULTS, SolvingOptions};
use super::solving::output::Solved;
use super::solving::{Plan, solve_all};
use clap::Args;
use starpipe::pipeline::solve_centroids;
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    starpipe identify centroids.csv\n  \
    starpipe identify --pixel-scale 10.8 --width 752 --height 480 centroids.csv\n\n\
    The columns are x,y (or x_px,y_px) and one of vmag (Johnson V), mag (instrumental) or flux;\n\
    others are ignored. (0, 0) is the centre of the top-left pixel, y runs down.")]
pub(crate) struct IdentifyArgs {
    /// Lists of centroids to identify; - for standard input
    #[arg(value_name = "CENTROIDS.csv", required = true)]
    pub(crate) lists: Vec<PathBuf>,
    /// Width of the frame in pixels [default: as far as the centroids reach]
    #[arg(long, value_name = "PIXELS", help_heading = "Frame", value_parser = clap::value_parser!(u32).range(1..=MAX_SIDE_PX))]
    pub(crate) width: Option<u32>,
    /// Height of the frame in pixels [default: as far as the centroids reach]
    #[arg(long, value_name = "PIXELS", help_heading = "Frame", value_parser = clap::value_parser!(u32).range(1..=MAX_SIDE_PX))]
    pub(crate) height: Option<u32>,
    #[command(flatten)]
    pub(crate) solving: SolvingOptions,
}

/// `starpipe identify`
pub(crate) fn identify(arguments: IdentifyArgs) -> Result<Exit, CommandError> {
    let IdentifyArgs {
        lists,
        width,
        height,
        solving,
    } = arguments;
    input::check(&lists)?;
    let plan = Plan {
        priors: solving.hints.resolve_with_camera()?,
        ..Plan::default()
    };
    let size = FrameSize { width, height };
    let (settings, resources) = solving.resolve(&lists, LIST_RESULTS)?;
    solve_all(&lists, settings, &resources, &plan, |context, path, _| {
        let list = centroids::read(path, size)?;
        let solution = solve_centroids(&list, context);
        Ok(Solved {
            solution,
            frame: None,
        })
    })
}
