//! The options of `limit`.

use crate::cli::options::format::OutputFormat;
use crate::cli::options::scenario::ScenarioOptions;
use crate::cli::options::steps::named_steps;
use crate::cli::page::HtmlOption;
use crate::cli::plot::PlotFile;
use clap::{ArgGroup, Args};
use starpipe::predict;
use std::path::PathBuf;
use std::str::FromStr;

#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    starpipe limit --preset experiment-1\n  \
    starpipe limit --camera camera.toml --exposure 0.2 --sky-mag-arcsec2 20 --format json\n  \
    starpipe limit --preset experiment-1 --sweep aperture_mm=5:200:40 --plot aperture.svg --format csv\n  \
    starpipe limit --preset imx174-35mm --sweep exposure_s=0.01:10:31:log\n  \
    starpipe limit --preset imx174-35mm --html=limit.html\n  \
    starpipe limit --figures figures\n\n\
    The limit is that of Tong, Li & Wang (2014): the signal of the star's brightest pixel is --snr times\n\
    its noise.\n\
    Every number of the camera and of the conditions has an option; docs/sensitivity.md has the\n\
    equations.")]
#[command(group = ArgGroup::new("scenario").args(["camera", "preset", "figures"]).required(true).multiple(true))]
pub(crate) struct LimitArgs {
    #[command(flatten)]
    pub(crate) scenario: ScenarioOptions,
    /// Repeat the prediction for several values of a parameter, named like its option with _ or -
    /// (may be repeated); :log spaces the values logarithmically
    #[arg(
        long,
        value_name = "NAME=FROM:TO:COUNT[:log]",
        allow_hyphen_values = true
    )]
    pub(crate) sweep: Vec<LimitSweep>,
    /// What to print
    #[arg(long, value_enum, default_value_t = OutputFormat::Text)]
    pub(crate) format: OutputFormat,
    /// Also draw the sweeps into this file, a panel for each, with a second curve for 12.5 times
    /// the exposure (for half the aperture in a sweep of the exposure)
    #[arg(long, value_name = "FILE.svg|png", value_parser = PlotFile::parser(), requires = "sweep")]
    pub(crate) plot: Option<PlotFile>,
    /// Draw the eleven figures of the paper into this directory, for exposures of 0.04 s and 0.5 s
    /// [default camera: experiment-1]
    #[arg(long, value_name = "DIR", conflicts_with_all = ["sweep", "plot", "format", "html"])]
    pub(crate) figures: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) html: HtmlOption,
}

/// A sweep of the prediction.
#[derive(Debug, Clone)]
pub(crate) struct LimitSweep(pub(crate) predict::Sweep);

impl FromStr for LimitSweep {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, steps) = named_steps(text)?;
        predict::Sweep::new(&name, steps.ends, steps.count, steps.spacing)
            .map(Self)
            .map_err(|error| error.to_string())
    }
}
