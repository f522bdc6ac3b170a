//! The options of `robustness`.

use super::sweep::Sweep;
use crate::cli::options::catalog::CatalogOptions;
use crate::cli::options::format::Format;
use crate::cli::options::values::{self, MAX_SIDE_PX};
use crate::cli::plot::PlotFile;
use clap::{Args, ValueEnum};

#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    starpipe robustness\n  \
    starpipe robustness --trials 10000 --stars 20 --format csv > robustness.csv\n  \
    starpipe robustness --sweep centroid-error=0:5:11 --sweep false=0:200:9 --plot robustness.svg\n\n\
    Lists of centroids are drawn from the catalogue, at attitudes uniform over all rotations, with errors, missing\n\
    and false stars, and identified as `starpipe identify` does. Without --sweep the table is the standard\n\
    one: five fields of view, then one thing worse at a time in a field of 10 degrees.")]
pub(crate) struct RobustnessArgs {
    /// Trials in each row of the table
    #[arg(long, value_name = "NUMBER", default_value_t = 2000, value_parser = clap::value_parser!(u64).range(1..=100_000_000))]
    pub(crate) trials: u64,
    /// Seed of the random numbers
    #[arg(long, value_name = "NUMBER", default_value_t = 1)]
    pub(crate) seed: u64,
    #[command(flatten)]
    pub(crate) protocol: ProtocolOptions,
    /// Trials with fewer true stars than this count only where the answer is wrong
    #[arg(long, value_name = "NUMBER", default_value_t = 8)]
    pub(crate) least_true_stars: usize,
    /// Vary one thing from one value to another in so many steps, in place of the standard table (fov, stars,
    /// centroid-error, mag-error, missing or false; may be repeated)
    #[arg(long, value_name = "NAME=FROM:TO:COUNT")]
    pub(crate) sweep: Vec<Sweep>,
    /// What to print
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub(crate) format: Format,
    /// Also draw the rates into this file
    #[arg(long, value_name = "FILE.svg|png", value_parser = PlotFile::parser())]
    pub(crate) plot: Option<PlotFile>,
    #[command(flatten)]
    pub(crate) resources: CatalogOptions,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "What is drawn")]
pub(crate) struct ProtocolOptions {
    /// Horizontal field of view in degrees, for sweeps
    #[arg(long, value_name = "DEG", default_value_t = 10.0, value_parser = values::field_of_view, allow_hyphen_values = true)]
    pub(crate) fov: f64,
    /// Width of the frame in pixels
    #[arg(long, value_name = "PIXELS", default_value_t = 1024, value_parser = clap::value_parser!(u32).range(3..=MAX_SIDE_PX))]
    pub(crate) width: u32,
    /// Height of the frame in pixels
    #[arg(long, value_name = "PIXELS", default_value_t = 1024, value_parser = clap::value_parser!(u32).range(3..=MAX_SIDE_PX))]
    pub(crate) height: u32,
    /// Catalogue stars on a frame on average over the sky, which sets the limiting magnitude
    #[arg(long, value_name = "NUMBER", default_value_t = 30.0, value_parser = values::star_count)]
    pub(crate) stars: f64,
    /// Standard deviation of a centroid on each axis, in pixels
    #[arg(long, value_name = "PIXELS", default_value_t = 0.3, value_parser = values::not_negative)]
    pub(crate) centroid_error: f64,
    /// Standard deviation of a magnitude
    #[arg(long, value_name = "MAG", default_value_t = 0.2, value_parser = values::not_negative)]
    pub(crate) mag_error: f64,
    /// Stars that are missing, in percent
    #[arg(long, value_name = "PERCENT", default_value_t = 15.0, value_parser = values::part)]
    pub(crate) missing: f64,
    /// False stars, in percent of the true ones
    #[arg(long = "false", value_name = "PERCENT", default_value_t = 15.0, value_parser = values::multiple)]
    pub(crate) false_stars: f64,
    /// How far off the stated field of view may be, in percent
    #[arg(long, value_name = "PERCENT", default_value_t = 10.0, value_parser = values::percent, conflicts_with = "scale_unknown")]
    pub(crate) scale_error: f64,
    /// State no field of view
    #[arg(long)]
    pub(crate) scale_unknown: bool,
    /// Which frames are mirrored
    #[arg(long, value_enum, default_value_t = MirroredArg::Half)]
    pub(crate) mirrored: MirroredArg,
    /// Give magnitudes as Johnson V, and not as fluxes with an unknown zero point
    #[arg(long)]
    pub(crate) vmag: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum MirroredArg {
    /// None
    Never,
    /// Every second one, at random
    Half,
    /// All
    Always,
}
