//! The options of `simulate`.

use super::files::ImageKind;
use crate::cli::options::catalog::CatalogOptions;
use crate::cli::options::format::PageFormat;
use crate::cli::options::setup::SetupOptions;
use crate::cli::options::values;
use clap::{ArgGroup, Args};
use starpipe::base::epoch::ObservationDate;
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    starpipe simulate --camera camera.toml --ra 83.8 --dec -1.2 --roll 20 --exposure 0.2 --out orion.tif\n  \
    starpipe simulate --camera camera.toml --random-attitude --count 100 --seed 1 --out frames\n  \
    starpipe simulate --preset nanosat-tracker --random-attitude --tumble-deg-s 0.3 --cosmic-rays-cm2-s 5 --out frames\n  \
    starpipe simulate --camera camera.toml --dark --count 20 --out darks\n  \
    starpipe simulate --camera camera.toml --stars list.csv --out field.fits\n\n\
    Each frame comes with a table of what is truly on it, FRAME.csv: stars with their places, magnitudes and electrons,\n\
    false stars, trails, cosmic rays. The header of a FITS file, the description of a TIFF file has all numbers. Frame\n\
    N of --random-attitude is frame N of `starpipe validate` with the same options and the same seed.")]
#[command(group = ArgGroup::new("subject").args(["ra", "random_attitude", "stars", "dark", "flat"]).required(true))]
pub(crate) struct SimulateArgs {
    /// Right ascension of the frame's centre, in degrees
    #[arg(long, value_name = "DEG", value_parser = values::right_ascension, allow_hyphen_values = true, requires = "dec")]
    pub(crate) ra: Option<f64>,
    /// Its declination, in degrees
    #[arg(long, value_name = "DEG", value_parser = values::declination, allow_hyphen_values = true, requires = "ra")]
    pub(crate) dec: Option<f64>,
    /// Position angle of the image's up direction there, from north through east, in degrees
    #[arg(long, value_name = "DEG", default_value_t = 0.0, value_parser = values::finite, allow_hyphen_values = true, requires = "ra")]
    pub(crate) roll: f64,
    /// Point anywhere, in each frame somewhere else
    #[arg(long)]
    pub(crate) random_attitude: bool,
    /// Draw these stars in place of the catalogue's: columns x, y, vmag
    #[arg(long, value_name = "LIST.csv")]
    pub(crate) stars: Option<PathBuf>,
    /// Close the shutter: dark frames
    #[arg(long)]
    pub(crate) dark: bool,
    /// Flat fields: an even light of so many electrons in a pixel
    #[arg(long, value_name = "ELECTRONS", value_parser = values::not_negative)]
    pub(crate) flat: Option<f64>,
    /// When, as ISO 8601: stars move [default: 2000]
    #[arg(long = "date", value_name = "ISO8601", allow_hyphen_values = true)]
    pub(crate) hint_date: Option<ObservationDate>,
    /// Frames to make
    #[arg(long, value_name = "NUMBER", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..=100_000))]
    pub(crate) count: u64,
    /// Number of the first frame, on which its random numbers depend
    #[arg(long, value_name = "NUMBER", default_value_t = 0, value_parser = clap::value_parser!(u64).range(..=1_000_000_000))]
    pub(crate) first: u64,
    /// Seed of the random numbers
    #[arg(long, value_name = "NUMBER", default_value_t = 1)]
    pub(crate) seed: u64,
    /// File for the one frame (.tif, .fits), or directory for any number of them
    #[arg(short, long, value_name = "PATH")]
    pub(crate) out: PathBuf,
    /// Kind of the files in the directory [default: tiff]
    #[arg(long, value_enum)]
    pub(crate) image: Option<ImageKind>,
    /// Compress TIFF files
    #[arg(long)]
    pub(crate) compress: bool,
    /// Overwrite files
    #[arg(long)]
    pub(crate) force: bool,
    /// What to print
    #[arg(long, value_enum, default_value_t = PageFormat::Text)]
    pub(crate) format: PageFormat,
    #[command(flatten)]
    pub(crate) setup: SetupOptions,
    #[command(flatten)]
    pub(crate) resources: CatalogOptions,
}
