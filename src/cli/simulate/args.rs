//! The options of `simulate`.

use crate::cli::options::catalog::CatalogOptions;
use crate::cli::options::format::PageFormat;
use crate::cli::options::observer::ObserverOptions;
use crate::cli::options::setup::SetupOptions;
use crate::cli::options::values;
use clap::{ArgGroup, Args, ValueEnum};
use starpipe::base::epoch::ObservationDate;
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    starpipe simulate --camera camera.toml --ra 83.8 --dec -1.2 --roll 20 --exposure 0.2 --out orion.tif\n  \
    starpipe simulate --camera camera.toml --random-attitude --count 100 --seed 1 --out frames\n  \
    starpipe simulate --preset nanosat-tracker --random-attitude --tumble-deg-s 0.3 --cosmic-rays-cm2-s 5 --out frames\n  \
    starpipe simulate --camera camera.toml --dark --count 20 --out darks\n  \
    starpipe simulate --camera camera.toml --stars list.csv --out field.fits\n\n\
    A table of what each frame contains is written to FRAME.csv: stars with their positions, magnitudes and\n\
    electrons, false stars, trails, cosmic rays. The header of a FITS file or the description of a TIFF\n\
    file lists all parameters.\n\
    With --date 2000-01-01T12:00:00Z, frame N of --random-attitude is frame N of `starpipe validate` with the
    same options and seed.")]
#[command(group = ArgGroup::new("subject").args(["ra", "random_attitude", "stars", "dark", "flat"]).required(true))]
pub(crate) struct SimulateArgs {
    /// Right ascension of the frame's center, in degrees
    #[arg(long, value_name = "DEG", value_parser = values::right_ascension, allow_hyphen_values = true, requires = "dec")]
    pub(super) ra: Option<f64>,
    /// Declination of the frame's center, in degrees
    #[arg(long, value_name = "DEG", value_parser = values::declination, allow_hyphen_values = true, requires = "ra")]
    pub(super) dec: Option<f64>,
    /// Position angle of the image's up direction at its center, from north through east, in
    /// degrees
    #[arg(long, value_name = "DEG", default_value_t = 0.0, value_parser = values::finite, allow_hyphen_values = true, requires = "ra")]
    pub(super) roll: f64,
    /// A random pointing for each frame, uniform over all rotations
    #[arg(long)]
    pub(super) random_attitude: bool,
    /// Simulate these stars in place of the catalog's: a table with the columns x,y,vmag
    #[arg(long, value_name = "LIST.csv")]
    pub(super) stars: Option<PathBuf>,
    /// Simulate dark frames: the shutter is closed
    #[arg(long)]
    pub(super) dark: bool,
    /// Simulate flat fields: the same light on each pixel, in electrons
    #[arg(long, value_name = "ELECTRONS", value_parser = values::not_negative)]
    pub(super) flat: Option<f64>,
    /// Date of the frames, as ISO 8601, for proper motion and aberration [default: 2000, without
    /// aberration]
    #[arg(long, value_name = "ISO8601", allow_hyphen_values = true)]
    pub(super) date: Option<ObservationDate>,
    #[command(flatten)]
    pub(super) observer: ObserverOptions,
    /// Number of frames
    #[arg(long, value_name = "NUMBER", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..=100_000))]
    pub(super) count: u64,
    /// Number of the first frame; a frame's random numbers depend on its number
    #[arg(long, value_name = "NUMBER", default_value_t = 0, value_parser = clap::value_parser!(u64).range(..=1_000_000_000))]
    pub(super) first: u64,
    /// Seed of the random numbers
    #[arg(long, value_name = "NUMBER", default_value_t = 1)]
    pub(super) seed: u64,
    /// File for a single frame (.tif, .fits), or directory for any number of frames
    #[arg(short, long, value_name = "PATH")]
    pub(super) out: PathBuf,
    /// Format of the files in the directory [default: tiff]
    #[arg(long, value_enum)]
    pub(super) image: Option<ImageFormat>,
    /// Compress TIFF files
    #[arg(long)]
    pub(super) compress: bool,
    /// Overwrite files
    #[arg(long)]
    pub(super) force: bool,
    /// What to print
    #[arg(long, value_enum, default_value_t = PageFormat::Text)]
    pub(super) format: PageFormat,
    #[command(flatten)]
    pub(super) setup: SetupOptions,
    #[command(flatten)]
    pub(super) catalog: CatalogOptions,
}

/// Format of an image file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum ImageFormat {
    /// TIFF
    Tiff,
    /// FITS
    Fits,
}
