//! The options of `validate`.

use super::sweep::StudySweep;
use crate::cli::options::catalog::CatalogOptions;
use crate::cli::options::format::PageFormat;
use crate::cli::options::setup::SetupOptions;
use crate::cli::page::HtmlOption;
use crate::cli::plot::FigureForm;
use clap::{Args, ValueEnum};
use std::path::PathBuf;

/// Cases that are run together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Suite {
    /// Lenses, spots and detectors that are not what the pipeline assumes
    Hard,
    /// Skies with Moon, clouds and extinction over an all-sky camera, which looks at the zenith
    Sky,
}

#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    starpipe validate --camera camera.toml --count 1000 --seed 1 --out validation\n  \
    starpipe validate --preset nanosat-tracker --exposure 0.2 --scale-unknown --out validation --html\n  \
    starpipe validate --camera camera.toml --count 500 --sweep read_noise_e=1:30:7:log --out study\n  \
    starpipe validate --camera camera.toml --sweep fov_deg=4:32:8 --out study\n  \
    starpipe validate --camera camera.toml --count 200 --suite hard --out hard\n  \
    starpipe validate --camera all-sky.toml --count 300 --suite sky --out sky\n\n\
    Frames are simulated and processed in memory, at attitudes that are uniform over all rotations. DIR\n\
    gets frames.csv and stars.csv with a row for each frame and each star, the same as Parquet in\n\
    frames.parquet/ and stars.parquet/, a summary in summary.json and summary.txt, and figures. A study\n\
    writes all this for each value into DIR/NAME=VALUE/, and a row for each into study.csv and study.json;\n\
    the hard suite does so in DIR/CASE/, suite.csv, suite.json and suite.txt. The sky suite writes frames.csv,\n\
    cells.csv and the same summary.\n\n\
    A run may be stopped at any time, also by Ctrl-C. The same command continues it, and one with more\n\
    --count extends it. The results are the same to the last byte on any number of threads.")]
pub(crate) struct ValidateArgs {
    /// Frames; in a study, of each value
    #[arg(long, alias = "frames", value_name = "NUMBER", default_value_t = 1000, value_parser = clap::value_parser!(u64).range(1..=10_000_000))]
    pub(crate) count: u64,
    /// Seed of the random numbers
    #[arg(long, value_name = "NUMBER", default_value_t = 1)]
    pub(crate) seed: u64,
    /// Directory for the results; an interrupted run in it is continued
    #[arg(short, long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Do not give the camera's description to the pipeline: it has no hints, not even the scale
    #[arg(long)]
    pub(crate) scale_unknown: bool,
    /// Study: a run for each value of one parameter, named as its option with _ or -, or fov_deg
    /// (may be repeated); :log spaces the values by even ratios
    #[arg(
        long,
        value_name = "NAME=FROM:TO:COUNT[:log]",
        allow_hyphen_values = true
    )]
    pub(crate) sweep: Vec<StudySweep>,
    /// A run for each case of a suite
    #[arg(long, value_enum, conflicts_with = "sweep")]
    pub(crate) suite: Option<Suite>,
    /// Format of the figures
    #[arg(long, value_enum, default_value_t = FigureForm::Svg)]
    pub(crate) figures: FigureForm,
    #[command(flatten)]
    pub(crate) html: HtmlOption,
    /// What to print
    #[arg(long, value_enum, default_value_t = PageFormat::Text)]
    pub(crate) format: PageFormat,
    #[command(flatten)]
    pub(crate) setup: SetupOptions,
    #[command(flatten)]
    pub(crate) catalog: CatalogOptions,
}
