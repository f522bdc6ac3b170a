//! The options of `solve-field`.

use super::without_effect::WithoutEffect;
use crate::cli::options::catalog::CatalogOptions;
use crate::cli::options::values::{declination, positive, right_ascension};
use crate::cli::solving::SolvingPlan;
use clap::Args;
use starpipe::centroids::XylistOptions;
use starpipe::doors::{ScaleRange, ScaleUnit};
use starpipe::identify::ScalePrior;
use starpipe::solve::SolveOptions;
use std::io;
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(
    infer_long_args = true,
    args_override_self = true,
    after_help = "Examples:\n  \
    starpipe solve-field --overwrite --no-plots night.fits\n  \
    starpipe solve-field --scale-units arcsecperpix --scale-low 39 --scale-high 41 --ra 296.8 --dec 11.3 --radius 5 night.jpg\n  \
    starpipe solve-field --width 1024 --height 768 --x-column X_IMAGE --y-column Y_IMAGE stars.xyls\n\n\
    Called by the name solve-field, as by a link, starpipe takes these options at once. Those of solve-field that are\n\
    not listed are known and without effect. A FILE called none is not written; %s in its name stands for the\n\
    directory and the name of the input."
)]
pub(crate) struct SolveFieldArgs {
    /// Images, or lists of centroids (FITS tables with the columns X and Y)
    #[arg(value_name = "INPUT", required_unless_present_any = ["files_on_stdin", "version"])]
    inputs: Vec<PathBuf>,
    /// Read the names of inputs from standard input, one a line
    #[arg(short = 'f', long)]
    files_on_stdin: bool,
    /// Print the version
    #[arg(long)]
    pub(super) version: bool,
    #[command(flatten)]
    pub(super) outputs: OutputOptions,
    #[command(flatten)]
    hints: ScaleAndDirection,
    #[command(flatten)]
    pub(super) tweak: TweakOptions,
    #[command(flatten)]
    pub(super) list: ListOptions,
    #[command(flatten)]
    pub(super) catalog: CatalogOptions,
    #[command(flatten)]
    pub(super) without_effect: WithoutEffect,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Output")]
pub(super) struct OutputOptions {
    #[command(flatten)]
    pub(super) names: OutputNames,
    #[command(flatten)]
    pub(super) existing: Existing,
}

/// Names of files.
#[derive(Debug, Default, Args)]
pub(super) struct OutputNames {
    /// Directory for the files [default: that of the input]
    #[arg(short = 'D', long, value_name = "DIR")]
    pub(super) dir: Option<PathBuf>,
    /// What their names begin with [default: the name of the input without its extension]
    #[arg(short, long, value_name = "NAME")]
    pub(super) out: Option<String>,
    /// The header with the coordinates [default: %s.wcs]
    #[arg(short = 'W', long, value_name = "FILE")]
    pub(super) wcs: Option<String>,
    /// The image with the coordinates [default: %s.new]
    #[arg(short = 'N', long, value_name = "FILE")]
    pub(super) new_fits: Option<String>,
    /// The mark that it is solved [default: %s.solved]
    #[arg(short = 'S', long, value_name = "FILE")]
    pub(super) solved: Option<String>,
    /// A mark that it is solved, for --skip-solved
    #[arg(short = 'I', long, value_name = "FILE")]
    pub(super) solved_in: Option<String>,
    /// How good the identification is [default: %s.match]
    #[arg(short = 'M', long = "match", value_name = "FILE")]
    pub(super) match_file: Option<String>,
    /// Directions of the identified stars [default: %s.rdls]
    #[arg(short = 'R', long, value_name = "FILE")]
    pub(super) rdls: Option<String>,
    /// Pairs of detections and stars [default: %s.corr]
    #[arg(short = 'B', long, value_name = "FILE")]
    pub(super) corr: Option<String>,
    /// Where the identified stars are expected [default: %s-indx.xyls]
    #[arg(short = 'U', long, value_name = "FILE")]
    pub(super) index_xyls: Option<String>,
    /// The detections [default: %s.axy]
    #[arg(long, value_name = "FILE")]
    pub(super) axy: Option<String>,
    /// Do not write that file
    #[arg(long)]
    pub(super) temp_axy: bool,
    /// The detections, once more
    #[arg(short, long, value_name = "FILE")]
    pub(super) keep_xylist: Option<String>,
}

/// What becomes of files of an earlier run.
#[derive(Debug, Args)]
pub(super) struct Existing {
    /// Overwrite files that exist
    #[arg(short = 'O', long)]
    pub(super) overwrite: bool,
    /// Solve although files exist, and keep them if it is not identified
    #[arg(short = 'K', long = "continue")]
    pub(super) continues: bool,
    /// Skip inputs that are marked as solved
    #[arg(short = 'J', long)]
    pub(super) skip_solved: bool,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Hints, which may be wrong")]
struct ScaleAndDirection {
    /// Smallest scale
    #[arg(short = 'L', long, value_name = "SCALE", allow_hyphen_values = true)]
    scale_low: Option<f64>,
    /// Largest scale
    #[arg(short = 'H', long, value_name = "SCALE", allow_hyphen_values = true)]
    scale_high: Option<f64>,
    /// Their unit: degwidth (dw), arcminwidth (aw), arcsecperpix (app) or focalmm
    #[arg(short = 'u', long, value_name = "UNIT", default_value = "degwidth", value_parser = scale_unit)]
    scale_units: ScaleUnit,
    /// Right ascension of the center, in degrees or as H:M:S
    #[arg(short = '3', long, value_name = "RA", allow_hyphen_values = true, value_parser = right_ascension)]
    ra: Option<f64>,
    /// Declination of the center, in degrees or as D:M:S
    #[arg(short = '4', long, value_name = "DEC", allow_hyphen_values = true, value_parser = declination)]
    dec: Option<f64>,
    /// How far from there the center may be, in degrees [default: 10]
    #[arg(short = '5', long, value_name = "DEG", allow_hyphen_values = true)]
    radius: Option<f64>,
    /// Time limit for an input, in seconds
    #[arg(short = 'l', long, value_name = "SECONDS", allow_hyphen_values = true)]
    cpulimit: Option<f64>,
    /// Detection threshold in standard deviations
    #[arg(long, value_name = "NUMBER", value_parser = positive)]
    nsigma: Option<f64>,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Coordinates")]
pub(super) struct TweakOptions {
    /// Highest order of the polynomials of the distortion (SIP) [default: as high as it needs]
    #[arg(short, long, value_name = "ORDER")]
    tweak_order: Option<usize>,
    /// Without a distortion: the linear coordinates that fit best
    #[arg(short = 'T', long)]
    no_tweak: bool,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Lists of centroids")]
pub(super) struct ListOptions {
    /// Width of the frame [default: IMAGEW in the header]
    #[arg(short, long, value_name = "PIXELS")]
    width: Option<u32>,
    /// Height of the frame [default: IMAGEH in the header]
    #[arg(short = 'e', long, value_name = "PIXELS")]
    height: Option<u32>,
    /// Column of x [default: X]
    #[arg(short = 'X', long, value_name = "COLUMN")]
    x_column: Option<String>,
    /// Column of y [default: Y]
    #[arg(short = 'Y', long, value_name = "COLUMN")]
    y_column: Option<String>,
    /// Column of the brightness [default: FLUX, if there is one]
    #[arg(short, long, value_name = "COLUMN")]
    sort_column: Option<String>,
    /// The column of the brightness has magnitudes, not fluxes
    #[arg(short = 'a', long)]
    sort_ascending: bool,
}

impl SolveFieldArgs {
    /// The inputs, as they are named.
    pub(super) fn inputs(&self) -> io::Result<Vec<PathBuf>> {
        let mut inputs = self.inputs.clone();
        if self.files_on_stdin {
            let names = io::stdin().lines().collect::<io::Result<Vec<String>>>()?;
            inputs.extend(
                names
                    .into_iter()
                    .filter(|name| !name.is_empty())
                    .map(PathBuf::from),
            );
        }
        Ok(inputs)
    }

    /// What is known of them besides the scale.
    pub(super) fn plan(&self) -> SolvingPlan {
        let is_above_0 = |value: &f64| *value > 0.0;
        let hints = &self.hints;
        let mut options = SolveOptions::default();
        options.near_deg = hints.ra.zip(hints.dec).map(<[f64; 2]>::from);
        if let Some(radius_deg) = hints.radius.filter(is_above_0) {
            options.radius_deg = radius_deg.min(180.0);
        }
        options.sigma = hints.nsigma;
        if let Some(limit_s) = hints.cpulimit.filter(is_above_0) {
            options.time_limit_s = Some(limit_s);
        }
        SolvingPlan {
            options,
            ..SolvingPlan::default()
        }
    }

    /// The scale to try first.
    pub(super) fn scale(&self) -> Option<ScalePrior> {
        let hints = &self.hints;
        let is_above_0 = |value: &f64| *value > 0.0;
        ScaleRange {
            unit: hints.scale_units,
            // As in C, 0 is what is not stated.
            low: hints.scale_low.filter(is_above_0),
            high: hints.scale_high.filter(is_above_0),
        }
        .prior()
    }
}

impl TweakOptions {
    /// The highest order of a distortion; 1 where there is to be none.
    pub(super) fn max_order(&self) -> usize {
        match (self.no_tweak, self.tweak_order) {
            (true, _) => 1,
            (false, order) => order.unwrap_or(usize::MAX).max(1),
        }
    }
}

impl ListOptions {
    pub(super) fn options(&self) -> XylistOptions {
        XylistOptions {
            x: self.x_column.clone(),
            y: self.y_column.clone(),
            sort: self.sort_column.clone(),
            is_ascending: self.sort_ascending,
            size: [self.width, self.height],
        }
    }
}

fn scale_unit(text: &str) -> Result<ScaleUnit, String> {
    match text.to_ascii_lowercase().as_str() {
        "degwidth" | "degw" | "dw" => Ok(ScaleUnit::DegreesWide),
        "arcminwidth" | "amw" | "aw" => Ok(ScaleUnit::ArcminutesWide),
        "arcsecperpix" | "app" => Ok(ScaleUnit::ArcsecondsPerPixel),
        "focalmm" => Ok(ScaleUnit::FocalLengthMm),
        _ => Err("expected degwidth, arcminwidth, arcsecperpix or focalmm".to_owned()),
    }
}
