//! The options of `validate`: those of its runs, and those of the suites of simulated frames.

use super::sweep::StudySweep;
use crate::cli::exit::CommandError;
use crate::cli::options::catalog::CatalogOptions;
use crate::cli::options::format::PageFormat;
use crate::cli::options::setup::SetupOptions;
use crate::cli::page::HtmlOption;
use crate::cli::plot::FigureForm;
use clap::builder::{PossibleValue, PossibleValuesParser};
use clap::{Arg, Args};
use starpipe::lab::validation::ValidationProtocol;
use std::path::PathBuf;

/// Suites by name. `validate --suite NAME` is the hidden command `validate-NAME`, as each has options of its own.
const SUITES: [(&str, &str); 4] = [
    (
        "hard",
        "Lenses, spots and detectors that differ from the pipeline's model",
    ),
    (
        "sky",
        "Skies with Moon, clouds and extinction over an all-sky camera that points to the zenith",
    ),
    (
        "robustness",
        "Lists of centroids with errors, missing and false stars: how often identification is right",
    ),
    (
        "clutter",
        "Frames with foliage, clouds, trails and the like, and pictures without sky: how often names are wrong",
    ),
];

/// The option that chooses a suite, for help and for names that are none.
fn suite() -> Arg {
    let names = SUITES.map(|(name, about)| PossibleValue::new(name).help(about));
    Arg::new("suite")
        .long("suite")
        .value_name("SUITE")
        .help("Run a suite of tests. Each suite has its own options: starpipe validate --suite NAME --help")
        .help_heading(None::<&str>)
        .display_order(0)
        .value_parser(PossibleValuesParser::new(names))
}

#[derive(Debug, Args)]
#[command(arg = suite())]
#[command(after_help = "Examples:\n  \
    starpipe validate --camera camera.toml --count 1000 --seed 1 --out validation\n  \
    starpipe validate --preset nanosat-tracker --exposure 0.2 --scale-unknown --out validation --html\n  \
    starpipe validate --camera camera.toml --count 500 --sweep read_noise_e=1:30:7:log --out study\n  \
    starpipe validate --camera camera.toml --sweep fov_deg=4:32:8 --out study\n  \
    starpipe validate --suite clutter --help\n\n\
    Frames are simulated and processed in memory, at attitudes that are uniform over all rotations. DIR\n\
    gets frames.csv and stars.csv with a row for each frame and each star, the same as Parquet in\n\
    frames.parquet/ and stars.parquet/, a summary in summary.json and summary.txt, and figures. With\n\
    --sweep, DIR/NAME=VALUE/ gets all of this for each value, and study.csv and study.json get a row for\n\
    each value.\n\n\
    A run may be stopped at any time, also by Ctrl-C. The same command continues it, and the same command\n\
    with a larger --count extends it. The results do not depend on the number of threads.\n\n\
    These are the options without --suite. For the options of a suite (hard, sky, robustness or clutter),\n\
    see starpipe validate --suite NAME --help.")]
pub(crate) struct ValidateArgs {
    /// Do not give the camera's description to the pipeline: it has no hints, not even the scale
    #[arg(long)]
    pub(super) scale_unknown: bool,
    /// Repeat the run for several values of a parameter, named like its option with _ or -, or
    /// fov_deg (may be repeated); :log spaces the values logarithmically
    #[arg(
        long,
        value_name = "NAME=FROM:TO:COUNT[:log]",
        allow_hyphen_values = true
    )]
    pub(super) sweep: Vec<StudySweep>,
    #[command(flatten)]
    pub(super) run: RunOptions,
}

#[derive(Debug, Args)]
#[command(
    override_usage = "starpipe validate --suite hard [OPTIONS] --out <DIR> <--camera <camera.toml>|--preset <NAME>>"
)]
#[command(after_help = "Examples:\n  \
    starpipe validate --suite hard --camera camera.toml --count 200 --out hard\n\n\
    Each case is a run of starpipe validate. Its results are in DIR/CASE/, and a row for each case is in\n\
    suite.csv, suite.json and suite.txt. The same command continues a run that was stopped.")]
pub(crate) struct HardArgs {
    /// Do not give the camera's description to the pipeline: it has no hints, not even the scale
    #[arg(long)]
    pub(super) scale_unknown: bool,
    #[command(flatten)]
    pub(super) run: RunOptions,
}

#[derive(Debug, Args)]
#[command(
    override_usage = "starpipe validate --suite sky [OPTIONS] --out <DIR> <--camera <camera.toml>|--preset <NAME>>"
)]
#[command(after_help = "Examples:\n  \
    starpipe validate --suite sky --camera all-sky.toml --count 300 --out sky\n\n\
    Date, Moon, clouds, brightness, extinction, exposure, gain, bits and bias are random for each frame. DIR gets\n\
    frames.csv and cells.csv with true and measured values, suite.csv, suite.json and suite.txt with the errors in\n\
    groups of frames, and a figure. The same command continues a run that was stopped.")]
pub(crate) struct SkyArgs {
    #[command(flatten)]
    pub(super) run: RunOptions,
}

/// Options of all runs with simulated frames whose results a directory keeps.
#[derive(Debug, Args)]
pub(super) struct RunOptions {
    /// Number of frames; with --sweep or --suite hard, for each value or case
    #[arg(long, alias = "frames", value_name = "NUMBER", default_value_t = 1000, value_parser = clap::value_parser!(u64).range(1..=10_000_000))]
    pub(super) count: u64,
    /// Seed of the random numbers
    #[arg(long, value_name = "NUMBER", default_value_t = 1)]
    pub(super) seed: u64,
    /// Directory for the results; an interrupted run in this directory is continued
    #[arg(short, long, value_name = "DIR")]
    pub(super) out: PathBuf,
    /// Format of the figures
    #[arg(long, value_enum, default_value_t = FigureForm::Svg)]
    pub(super) figures: FigureForm,
    #[command(flatten)]
    pub(super) html: HtmlOption,
    /// What to print
    #[arg(long, value_enum, default_value_t = PageFormat::Text)]
    pub(super) format: PageFormat,
    #[command(flatten)]
    setup: SetupOptions,
    #[command(flatten)]
    pub(super) catalog: CatalogOptions,
}

impl RunOptions {
    /// What is simulated; whether the pipeline is given the camera's description.
    pub(super) fn protocol(&self, scale_known: bool) -> Result<ValidationProtocol, CommandError> {
        Ok(ValidationProtocol {
            setup: self.setup.setup()?,
            scale_known,
            site: None,
            seed: self.seed,
        })
    }
}
