//! The options of `validate`.

use super::sweep::StudySweep;
use crate::cli::options::catalog::CatalogOptions;
use crate::cli::options::format::PageFormat;
use crate::cli::options::setup::SetupOptions;
use crate::cli::plot::FigureForm;
use clap::Args;
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    starpipe validate --camera camera.toml --frames 1000 --seed 1 --out validation\n  \
    starpipe validate --preset nanosat-tracker --exposure-s 0.2 --scale-unknown --out validation\n  \
    starpipe validate --camera camera.toml --frames 500 --sweep read_noise_e=1:30:7:log --out study\n  \
    starpipe validate --camera camera.toml --sweep fov_deg=4:32:8 --out study\n\n\
    Frames are made and worked on in memory, at attitudes that are uniform over all rotations. DIR gets frames.csv and\n\
    stars.csv, a row for each frame and each star, the same as Parquet in frames.parquet/ and stars.parquet/, what\n\
    they say together as summary.json and summary.txt, and figures. A study has all that for each value in\n\
    DIR/NAME=VALUE/, and a row for each in study.csv and study.json.\n\n\
    A run may be ended at any time, with Ctrl-C as well: the same command goes on where it stopped, one with more\n\
    --frames makes it longer, and what comes of it is the same to the last byte on any number of threads.")]
pub(crate) struct ValidateArgs {
    /// Frames, of each value of a study
    #[arg(long, value_name = "NUMBER", default_value_t = 1000, value_parser = clap::value_parser!(u64).range(1..=10_000_000))]
    pub(crate) frames: u64,
    /// Seed of the random numbers
    #[arg(long, value_name = "NUMBER", default_value_t = 1)]
    pub(crate) seed: u64,
    /// Directory for the results; one that holds the beginning of the same run is gone on with
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Keep the camera's description from the pipeline: it knows nothing, not even the scale
    #[arg(long)]
    pub(crate) scale_unknown: bool,
    /// Do it for values of one parameter, named as its option with _ or -, or fov_deg (may be repeated); :log makes even
    /// ratios of the steps
    #[arg(
        long,
        value_name = "NAME=FROM:TO:COUNT[:log]",
        allow_hyphen_values = true
    )]
    pub(crate) sweep: Vec<StudySweep>,
    /// What figures are drawn as
    #[arg(long, value_enum, default_value_t = FigureForm::Svg)]
    pub(crate) figures: FigureForm,
    /// What to print
    #[arg(long, value_enum, default_value_t = PageFormat::Text)]
    pub(crate) format: PageFormat,
    #[command(flatten)]
    pub(crate) setup: SetupOptions,
    #[command(flatten)]
    pub(crate) resources: CatalogOptions,
}
