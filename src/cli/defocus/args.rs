//! The options of `defocus`.

use crate::cli::options::format::OutputFormat;
use crate::cli::options::scenario::ScenarioOptions;
use crate::cli::options::steps::Steps;
use crate::cli::options::threads::ThreadOptions;
use crate::cli::options::values;
use crate::cli::page::HtmlOption;
use crate::cli::plot::FigureForm;
use clap::{Args, ValueEnum};
use starpipe::lab::defocus::Centroiding;
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    starpipe defocus --camera camera.toml --vmag 6 --required-error 0.05 --darks 'darks/*.tif'\n  \
    starpipe defocus --preset nanosat-tracker --vmag 4,5,6 --centroid grey-weighted --out defocus\n  \
    starpipe defocus --normalisation peak --count 1000 --out defocus\n\n\
    The radius is the standard deviation of the spot. The error is the root mean square distance \
    between centroid and truth. --normalisation peak repeats the experiment of Wang et al., Laser & \
    Optoelectronics Progress 56, 101101 (2019): all spots have the same brightest pixel. With \
    --normalisation energy, all spots have the same total light. The best radius is different in the two \
    cases.\n\n\
    Exit status: 0 done, 1 something could not be read or written, 2 the command line is wrong,\n\
    3 no radius meets a required error.")]
pub(crate) struct DefocusArgs {
    /// Quantity that is the same for all spots [default: energy with a camera, else peak]
    #[arg(long, value_enum)]
    pub(super) normalisation: Option<Normalisation>,
    #[command(flatten)]
    pub(super) scenario: ScenarioOptions,
    /// Johnson V of the star, or several separated by commas; energy only [default: 1.5 mag brighter
    /// than the camera's limit]
    #[arg(long, value_name = "V[,V...]", value_delimiter = ',', value_parser = values::finite, allow_hyphen_values = true)]
    pub(super) vmag: Vec<f64>,
    /// Required error in pixels, or several separated by commas: report the radii that meet it
    #[arg(long, value_name = "PX[,PX...]", value_delimiter = ',', value_parser = values::positive, allow_hyphen_values = true)]
    pub(super) required_error: Vec<f64>,
    /// Measure the noise on dark frames: files, directories, or patterns such as 'darks/*.tif'
    #[arg(long, value_name = "FRAME", num_args = 1..)]
    pub(super) darks: Vec<PathBuf>,
    /// Noise for which radii are reported, as a fraction of full scale; peak only [default: that of
    /// --darks, else the paper's 9.32e-4]
    #[arg(long, value_name = "NUMBER", value_parser = values::positive, allow_hyphen_values = true, conflicts_with = "darks")]
    pub(super) at_noise: Option<f64>,
    /// Spot radii (standard deviations), in pixels [default: 0.4:2.4:200 for peak, 0.2:2.4:45
    /// for energy]
    #[arg(long, value_name = "FROM:TO:COUNT[:log]", value_parser = radii, allow_hyphen_values = true)]
    pub(super) radius_px: Option<Range>,
    /// Noise levels as fractions of full scale; peak only [default: 2e-4:20e-4:100]
    #[arg(long, value_name = "FROM:TO:COUNT[:log]", value_parser = range, allow_hyphen_values = true)]
    pub(super) noise_relative: Option<Range>,
    /// Noise levels of a dark pixel, in electrons; energy only [default: nine levels, from 1/4 to 4
    /// times the camera's]
    #[arg(long, value_name = "FROM:TO:COUNT[:log]", value_parser = range, allow_hyphen_values = true, conflicts_with = "noise_relative")]
    pub(super) noise_e: Option<Range>,
    /// Stars at each point of the grid [default: 20 for peak, as in the paper, 400 for energy]
    #[arg(long, alias = "trials", value_name = "NUMBER", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub(super) count: Option<u32>,
    /// Seed of the random numbers
    #[arg(long, value_name = "NUMBER", default_value_t = 1)]
    pub(super) seed: u64,
    /// Peak of a spot centered on a pixel, as a fraction of full scale; peak only [default: 0.675]
    #[arg(long, value_name = "PART", value_parser = values::share, allow_hyphen_values = true)]
    pub(super) peak: Option<f64>,
    /// Half-width of the fixed window: pixels on each side of its central pixel
    #[arg(long, value_name = "PX", default_value_t = 7, value_parser = clap::value_parser!(u8).range(1..=15))]
    pub(super) half_window_px: u8,
    /// How to measure a star's position [default: fixed-window for peak, gaussian-fit for energy]
    #[arg(long, value_enum, value_name = "METHOD")]
    pub(super) centroid: Option<CentroidingArg>,
    /// Standard deviation of the lens's spot in focus, in pixels; geometric blur adds to it
    #[arg(long, value_name = "PX", default_value_t = 0.0, value_parser = values::not_negative, allow_hyphen_values = true)]
    pub(super) focused_px: f64,
    /// What to print: csv has a row for each point of the grid
    #[arg(long, value_enum, default_value_t = OutputFormat::Text)]
    pub(super) format: OutputFormat,
    /// Also write grid.csv, curve.csv, defocus.json, defocus.txt and figures into this directory
    #[arg(short, long, value_name = "DIR")]
    pub(super) out: Option<PathBuf>,
    /// Format of the figures
    #[arg(long, value_enum, default_value_t = FigureForm::Svg, requires = "out")]
    pub(super) figures: FigureForm,
    #[command(flatten)]
    pub(super) html: HtmlOption,
    #[command(flatten)]
    pub(super) threads: ThreadOptions,
}

/// What all spots have in common.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Normalisation {
    /// The brightest pixel, as in the paper: a wider spot then has more light
    Peak,
    /// The total light, as for a real star
    Energy,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum CentroidingArg {
    /// Fit of a Gaussian spot
    GaussianFit,
    /// Center of the light above a threshold
    GreyWeighted,
    /// Center of the light in a fixed window, without a threshold, as in the paper
    FixedWindow,
}

impl From<CentroidingArg> for Centroiding {
    fn from(argument: CentroidingArg) -> Self {
        match argument {
            CentroidingArg::GaussianFit => Self::GaussianFit,
            CentroidingArg::GreyWeighted => Self::GreyWeighted,
            CentroidingArg::FixedWindow => Self::FixedWindow,
        }
    }
}

/// Values above 0 of an axis of the grid.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Range(pub(super) Vec<f64>);

/// Valid radii: a narrower spot is a point, a wider one does not fit into a window.
const RADII_PX: std::ops::RangeInclusive<f64> = 0.1..=5.0;

fn radii(text: &str) -> Result<Range, String> {
    let range = range(text)?;
    match range.0.iter().find(|radius| !RADII_PX.contains(radius)) {
        Some(radius) => Err(format!(
            "found a radius of {radius} px, expected 0.1 to 5 px"
        )),
        None => Ok(range),
    }
}

fn range(text: &str) -> Result<Range, String> {
    let steps: Steps = text.parse()?;
    let [first, _] = steps.ends;
    if first <= 0.0 {
        return Err(format!(
            "found {first} as the first value, expected a number above 0"
        ));
    }
    steps.values().map(Range)
}
