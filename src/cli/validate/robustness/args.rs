//! The options of the suite of robustness.

use super::sweep::RobustnessSweep;
use crate::cli::options::catalog::CatalogOptions;
use crate::cli::options::format::OutputFormat;
use crate::cli::options::values::{self, MAX_SIDE_PX};
use crate::cli::plot::PlotFile;
use clap::{Args, ValueEnum};
use starpipe::identify::Photometry;
use starpipe::lab::robustness::{Mirrored, TrialProtocol};

/// So many centroids a frame has at most.
const MAX_BRIGHT_FALSE: i64 = 100_000;

#[derive(Debug, Args)]
#[command(override_usage = "starpipe validate --suite robustness [OPTIONS]")]
#[command(after_help = "Examples:\n  \
    starpipe validate --suite robustness\n  \
    starpipe validate --suite robustness --count 10000 --stars 20 --format csv > robustness.csv\n  \
    starpipe validate --suite robustness --sweep centroid-error=0:5:11 --sweep false=0:200:9 --plot robustness.svg\n\n\
    Lists of centroids are drawn from the catalog, at attitudes uniform over all rotations, with errors, missing\n\
    and false stars, and identified like those of `starpipe identify`. Without --sweep the standard\n\
    table is computed: five fields of view, then a field of 10 degrees with one condition at a time made\n\
    worse, and wide fields of unknown size.")]
pub(crate) struct RobustnessArgs {
    /// Trials in each row of the table
    #[arg(long, alias = "trials", value_name = "NUMBER", default_value_t = 2000, value_parser = clap::value_parser!(u64).range(1..=100_000_000))]
    pub(super) count: u64,
    /// Seed of the random numbers
    #[arg(long, value_name = "NUMBER", default_value_t = 1)]
    pub(super) seed: u64,
    #[command(flatten)]
    pub(super) protocol: ProtocolOptions,
    /// Trials with fewer true stars than this are counted only if the identification is wrong
    #[arg(long, value_name = "NUMBER", default_value_t = 8)]
    pub(super) least_true_stars: usize,
    /// Vary one parameter over COUNT values, in place of the standard table (fov, stars,
    /// centroid-error, mag-error, missing or false; may be repeated)
    #[arg(long, value_name = "NAME=FROM:TO:COUNT")]
    pub(super) sweep: Vec<RobustnessSweep>,
    /// What to print
    #[arg(long, value_enum, default_value_t = OutputFormat::Text)]
    pub(super) format: OutputFormat,
    /// Also draw the rates into this file
    #[arg(long, value_name = "FILE.svg|png", value_parser = PlotFile::parser())]
    pub(super) plot: Option<PlotFile>,
    #[command(flatten)]
    pub(super) catalog: CatalogOptions,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Simulated lists")]
pub(super) struct ProtocolOptions {
    /// Horizontal field of view in degrees, for sweeps
    #[arg(long, value_name = "DEG", default_value_t = 10.0, value_parser = values::field_of_view, allow_hyphen_values = true)]
    pub(super) fov: f64,
    /// Width of the frame in pixels
    #[arg(long, value_name = "PIXELS", default_value_t = 1024, value_parser = clap::value_parser!(u32).range(3..=MAX_SIDE_PX))]
    pub(super) width: u32,
    /// Height of the frame in pixels
    #[arg(long, value_name = "PIXELS", default_value_t = 1024, value_parser = clap::value_parser!(u32).range(3..=MAX_SIDE_PX))]
    pub(super) height: u32,
    /// Mean number of catalog stars on a frame, which sets the limiting magnitude
    #[arg(long, value_name = "NUMBER", default_value_t = 30.0, value_parser = values::star_count)]
    pub(super) stars: f64,
    /// Standard deviation of centroids on each axis, in pixels
    #[arg(long, value_name = "PIXELS", default_value_t = 0.3, value_parser = values::not_negative)]
    pub(super) centroid_error: f64,
    /// Standard deviation of magnitudes
    #[arg(long, value_name = "MAG", default_value_t = 0.2, value_parser = values::not_negative)]
    pub(super) mag_error: f64,
    /// Stars that are missing, in percent
    #[arg(long, value_name = "PERCENT", default_value_t = 15.0, value_parser = values::part)]
    pub(super) missing: f64,
    /// False stars, in percent of the true ones
    #[arg(long = "false", value_name = "PERCENT", default_value_t = 15.0, value_parser = values::multiple)]
    pub(super) false_stars: f64,
    /// Number of additional false stars, brighter than all true ones
    #[arg(long, value_name = "NUMBER", default_value_t = 0, value_parser = clap::value_parser!(u32).range(..=MAX_BRIGHT_FALSE))]
    pub(super) bright_false: u32,
    /// Largest error of the stated field of view, in percent
    #[arg(long, value_name = "PERCENT", default_value_t = 10.0, value_parser = values::percent, conflicts_with = "scale_unknown")]
    pub(super) scale_error: f64,
    /// Do not give the field of view
    #[arg(long)]
    pub(super) scale_unknown: bool,
    /// Which frames are mirrored
    #[arg(long, value_enum, default_value_t = MirroredArg::Half)]
    pub(super) mirrored: MirroredArg,
    /// Give Johnson V magnitudes, not fluxes with an unknown zero point
    #[arg(long)]
    pub(super) vmag: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum MirroredArg {
    /// None
    Never,
    /// Half of them, chosen at random
    Half,
    /// All
    Always,
}

impl ProtocolOptions {
    /// The protocol that the options describe.
    pub(super) fn protocol(&self) -> TrialProtocol {
        TrialProtocol {
            fov_deg: self.fov,
            width_px: self.width as usize,
            height_px: self.height as usize,
            mean_stars: self.stars,
            centroid_sigma_px: self.centroid_error,
            mag_sigma: self.mag_error,
            missing: self.missing / 100.0,
            false_stars: self.false_stars / 100.0,
            bright_false_stars: self.bright_false as usize,
            scale_error: (!self.scale_unknown).then_some(self.scale_error / 100.0),
            mirrored: self.mirrored.into(),
            photometry: if self.vmag {
                Photometry::JohnsonV
            } else {
                Photometry::Instrumental
            },
        }
    }
}

impl From<MirroredArg> for Mirrored {
    fn from(argument: MirroredArg) -> Self {
        match argument {
            MirroredArg::Never => Self::Never,
            MirroredArg::Half => Self::Half,
            MirroredArg::Always => Self::Always,
        }
    }
}
