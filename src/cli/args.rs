//! The command line as it is typed.

use super::defocus::DefocusArgs;
use super::limit::ParameterArgs;
use super::plot::FigureForm;
use super::plot::PlotFile;
use super::setup::SetupArgs;
use super::simulate::ImageKind;
use super::values;
use clap::builder::{PathBufValueParser, PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{ArgGroup, Args, Parser, Subcommand, ValueEnum};
use starpipe::base::epoch::ObservationDate;
use starpipe::camera::data_sheet::Preset;
use starpipe::sky::observer::Site;
use std::num::NonZeroUsize;
use std::path::PathBuf;

/// The longest side of a frame that makes sense, in pixels.
const MAX_SIDE_PX: i64 = 1_000_000;

/// Finds the stars in photographs of the night sky, says which they are and where the camera pointed.
#[derive(Debug, Parser)]
#[command(
    name = "starpipe",
    version,
    arg_required_else_help = true,
    max_term_width = 100,
    after_help = "Examples:\n  \
        starpipe process night.tif\n  \
        starpipe process --fov 11.4 --format json *.tif > night.jsonl\n  \
        starpipe identify --pixel-scale 10.8 centroids.csv\n\n\
        Exit status: 0 all identified, 1 something could not be read or written,\n\
        2 the command line is wrong, 3 some frame was not identified."
)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Find and identify the stars in frames (FITS, TIFF, PNG, JPEG, BMP, PGM)
    #[command(after_help = "Examples:\n  \
        starpipe process night.tif\n  \
        starpipe process --fov 11.4 --near 83.8,-1.2 --radius 10 night.tif\n  \
        starpipe process --date 2019-07-29T22:47+02:00 --site 52.22,4.42 night.tif\n  \
        starpipe process --format json --out results night/ > night.jsonl\n  \
        starpipe process --page 2 night.fits\n  \
        starpipe process --dark master-dark.fits --flat master-flat.fits --hot-pixels hot-pixels.csv night.fits\n  \
        funpack -S night.fits.fz | starpipe process -\n\n\
        The kind of a file is told from its content; any may be compressed with gzip. A date, an exposure,\n\
        a pixel size and a focal length in FITS keywords or Exif are used where no option says otherwise.\n\n\
        --out results makes results/night.json, night.csv, night.wcs and night.png of night.tif, and\n\
        overwrites nothing but such results. Those among the frames of a directory are left out.")]
    Process(ProcessArgs),
    /// Identify the stars in lists of centroids (CSV)
    #[command(after_help = "Examples:\n  \
        starpipe identify centroids.csv\n  \
        starpipe identify --pixel-scale 10.8 --width 752 --height 480 centroids.csv\n\n\
        The columns are x,y (or x_px,y_px) and one of vmag (Johnson V), mag (instrumental) or flux;\n\
        others are ignored. (0, 0) is the centre of the top-left pixel, y runs down.")]
    Identify(IdentifyArgs),
    /// Work with star catalogues
    Catalog(CatalogArgs),
    /// Measure how often identification is right, wrong, or without an answer
    #[command(after_help = "Examples:\n  \
        starpipe robustness\n  \
        starpipe robustness --trials 10000 --stars 20 --format csv > robustness.csv\n  \
        starpipe robustness --sweep centroid-error=0:5:11 --sweep false=0:200:9 --plot robustness.svg\n\n\
        Lists of centroids are drawn from the catalogue, at attitudes uniform over all rotations, with errors, missing\n\
        and false stars, and identified as `starpipe identify` does. Without --sweep the table is the standard\n\
        one: five fields of view, then one thing worse at a time in a field of 10 degrees.")]
    Robustness(RobustnessArgs),
    /// Predict the faintest star that a camera detects
    #[command(after_help = "Examples:\n  \
        starpipe limit --preset experiment-1\n  \
        starpipe limit --camera camera.toml --exposure-s 0.2 --sky-mag-arcsec2 20 --format json\n  \
        starpipe limit --preset experiment-1 --sweep aperture_mm=5:200:40 --plot aperture.svg --format csv\n  \
        starpipe limit --preset imx174-35mm --sweep exposure_s=0.01:10:31:log\n  \
        starpipe limit --figures figures\n\n\
        The rule is that of the paper: the star's brightest pixel stands --snr times its noise above the\n\
        sky. Every number of the camera and of the conditions has an option; docs/sensitivity.md has the\n\
        equations.")]
    Limit(Box<LimitArgs>),
    /// Work with descriptions of cameras
    Camera(CameraArgs),
    /// Do an experiment of the sensitivity paper again: its limit, its stars, and frames like its own
    #[command(after_help = "Examples:\n  \
        starpipe experiment 1\n  \
        starpipe experiment 2 --trials 200 --format json > experiment-2.json\n  \
        starpipe experiment 1 --out results\n\n\
        The paper is Tong, Li & Wang, Acta Optica Sinica 34, 1004003 (2014). The frames are simulated \
        with its camera and sky at the pointing of its table of stars, and identified with nothing \
        known. The stars have numbers of SKY2000: with another --catalog they are found under other numbers.")]
    Experiment(ExperimentArgs),
    /// Make frames of a camera with known truth
    #[command(after_help = "Examples:\n  \
        starpipe simulate --camera camera.toml --ra 83.8 --dec -1.2 --roll 20 --exposure 0.2 --out orion.tif\n  \
        starpipe simulate --camera camera.toml --random-attitude --count 100 --seed 1 --out frames\n  \
        starpipe simulate --preset nanosat-tracker --random-attitude --tumble-deg-s 0.3 --cosmic-rays-cm2-s 5 --out frames\n  \
        starpipe simulate --camera camera.toml --dark --count 20 --out darks\n  \
        starpipe simulate --camera camera.toml --stars list.csv --out field.fits\n\n\
        Each frame comes with a table of what is truly on it, FRAME.csv: stars with their places, magnitudes and electrons,\n\
        false stars, trails, cosmic rays. The header of a FITS file, the description of a TIFF file has all numbers. Frame\n\
        N of --random-attitude is frame N of `starpipe validate` with the same options and the same seed.")]
    Simulate(Box<SimulateArgs>),
    /// Put thousands of simulated frames through the pipeline, and hold what it finds against the truth and against theory
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
    Validate(Box<ValidateArgs>),
    /// Find the spot radius with the best centroids, and how far to defocus for it
    #[command(after_help = "Examples:\n  \
        starpipe defocus --camera camera.toml --vmag 6 --required-error 0.05 --darks 'darks/*.tif'\n  \
        starpipe defocus --preset nanosat-tracker --vmag 4,5,6 --centroid grey-weighted --out defocus\n  \
        starpipe defocus --normalisation peak --trials 1000 --out defocus\n\n\
        The radius is the standard deviation of the spot, the error the root mean square of the distance between \
        centroid and truth. With --normalisation peak it is the experiment of Wang et al., Laser & Optoelectronics Progress \
        56, 101101 (2019), where all spots have the same brightest pixel; with energy a star has the light it has. The \
        two have different answers.\n\n\
        Exit status: 0 done, 1 something could not be read or written, 2 the command line is wrong,\n\
        3 no radius meets a required error.")]
    Defocus(Box<DefocusArgs>),
    /// Measure noise, pattern, dark current and hot pixels on frames taken without light
    #[command(after_help = "Examples:\n  \
        starpipe darks darks/\n  \
        starpipe darks --camera camera.toml --out calibration darks/\n  \
        starpipe darks --exposure 0.1:short/ --exposure 10:long/ --format json short/ long/\n\n\
        --out writes master-dark.fits (of several exposures master-dark-0.1s.fits and so on), noise.fits and \
        hot-pixels.csv, which `starpipe process` takes as --dark and --hot-pixels. Exposures come from the files' headers \
        unless --exposure says otherwise; with two of them there is a dark current.")]
    Darks(DarksArgs),
    /// Make a master flat of evenly lit frames, and measure gain and response
    #[command(after_help = "Examples:\n  \
        starpipe flats --dark master-dark.fits --out calibration flats/\n  \
        starpipe flats --camera camera.toml --format json dim-1.fits dim-2.fits bright-1.fits bright-2.fits\n\n\
        --out writes master-flat.fits, with a mean of 1, which `starpipe process` takes as --flat. The first and the second frame \
        are a pair of the same light, and so on: from the noise of such pairs follows the gain, from pairs of different \
        light without knowing the read noise.")]
    Flats(FlatsArgs),
}

#[derive(Debug, Args)]
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
    pub(crate) setup: SetupArgs,
    #[command(flatten)]
    pub(crate) resources: ResourceArgs,
}

#[derive(Debug, Args)]
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
    pub(crate) sweep: Vec<values::StudySweep>,
    /// What figures are drawn as
    #[arg(long, value_enum, default_value_t = FigureForm::Svg)]
    pub(crate) figures: FigureForm,
    /// What to print
    #[arg(long, value_enum, default_value_t = PageFormat::Text)]
    pub(crate) format: PageFormat,
    #[command(flatten)]
    pub(crate) setup: SetupArgs,
    #[command(flatten)]
    pub(crate) resources: ResourceArgs,
}

#[derive(Debug, Args)]
pub(crate) struct FlatsArgs {
    /// Evenly lit frames; a directory stands for the frames in it, - for standard input
    #[arg(value_name = "FRAME", required = true)]
    pub(crate) frames: Vec<PathBuf>,
    /// Which image of a file with several, from 1 [default: the first]
    #[arg(long, value_name = "NUMBER")]
    pub(crate) page: Option<NonZeroUsize>,
    /// Frame taken without light, or the mean of many, see `starpipe darks`
    #[arg(long, value_name = "FILE")]
    pub(crate) dark: Option<PathBuf>,
    /// Description of the camera, see `starpipe camera new`: its bias where there is no --dark, and its read noise
    #[arg(long, value_name = "FILE.toml")]
    pub(crate) camera: Option<PathBuf>,
    /// What to print: csv has a row for each frame
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub(crate) format: Format,
    /// Also write master-flat.fits into this directory
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Threads to work with [default: one for each processor]
    #[arg(long, value_name = "NUMBER", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub(crate) threads: Option<u32>,
}

#[derive(Debug, Args)]
pub(crate) struct DarksArgs {
    /// Frames taken without light; a directory stands for the frames in it, - for standard input
    #[arg(value_name = "FRAME", required = true)]
    pub(crate) frames: Vec<PathBuf>,
    /// Which image of a file with several, from 1 [default: the first]
    #[arg(long, value_name = "NUMBER")]
    pub(crate) page: Option<NonZeroUsize>,
    /// How long frames were exposed, in seconds: those of a file or directory, else all (may be repeated) [default: the
    /// exposure in the file's header]
    #[arg(long, value_name = "SECONDS[:PATH]", allow_hyphen_values = true)]
    pub(crate) exposure: Vec<values::ExposureOf>,
    /// Bits of a grey level [default: those of --camera, else of the file's format]
    #[arg(long, value_name = "NUMBER", value_parser = clap::value_parser!(u32).range(1..=32))]
    pub(crate) bits: Option<u32>,
    /// Description of the camera, see `starpipe camera new`: its gain makes electrons of grey levels
    #[arg(long, value_name = "FILE.toml")]
    pub(crate) camera: Option<PathBuf>,
    /// Robust standard deviations from which on a pixel is hot
    #[arg(long, value_name = "NUMBER", value_parser = values::positive, default_value_t = starpipe::calibration::darks::HOT_SIGMA)]
    pub(crate) hot_sigma: f64,
    /// What to print: csv has a row for each frame
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub(crate) format: Format,
    /// Also write the master dark, the noise of each pixel and the hot pixels into this directory
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Threads to work with [default: one for each processor]
    #[arg(long, value_name = "NUMBER", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub(crate) threads: Option<u32>,
}

#[derive(Debug, Args)]
pub(crate) struct ExperimentArgs {
    /// Which of the paper's two
    #[arg(value_name = "1|2", value_parser = clap::value_parser!(u8).range(1..=2))]
    pub(crate) number: u8,
    /// Frames to simulate
    #[arg(long, value_name = "NUMBER", default_value_t = 50, value_parser = clap::value_parser!(u64).range(1..=100_000))]
    pub(crate) trials: u64,
    /// Seed of the random numbers
    #[arg(long, value_name = "NUMBER", default_value_t = 1)]
    pub(crate) seed: u64,
    /// What to print
    #[arg(long, value_enum, default_value_t = PageFormat::Text)]
    pub(crate) format: PageFormat,
    /// Also write, into this directory, the first frame simulated as experiment-1.png or -2.png, its stars ringed and named
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) resources: ResourceArgs,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum PageFormat {
    /// A page for people
    Text,
    /// One JSON object
    Json,
}

#[derive(Debug, Args)]
pub(crate) struct ProcessArgs {
    /// Frames to process; a directory stands for the frames in it, - for standard input
    #[arg(value_name = "FRAME", required = true)]
    pub(crate) frames: Vec<PathBuf>,
    /// Which image of a file with several, from 1: a TIFF's page, a FITS image or plane [default: the first]
    #[arg(long, value_name = "NUMBER", help_heading = "Frame")]
    pub(crate) page: Option<NonZeroUsize>,
    #[command(flatten)]
    pub(crate) calibration: CalibrationArgs,
    #[command(flatten)]
    pub(crate) detection: DetectionArgs,
    #[command(flatten)]
    pub(crate) light: LightArgs,
    #[command(flatten)]
    pub(crate) solving: SolvingArgs,
}

#[derive(Debug, Args)]
pub(crate) struct IdentifyArgs {
    /// Lists of centroids to identify; - for standard input
    #[arg(value_name = "CENTROIDS.csv", required = true)]
    pub(crate) lists: Vec<PathBuf>,
    /// Width of the frame in pixels [default: as far as the centroids reach]
    #[arg(long, value_name = "PIXELS", help_heading = "Frame", value_parser = clap::value_parser!(u32).range(1..=MAX_SIDE_PX))]
    pub(crate) width: Option<u32>,
    /// Height of the frame in pixels [default: as far as the centroids reach]
    #[arg(long, value_name = "PIXELS", help_heading = "Frame", value_parser = clap::value_parser!(u32).range(1..=MAX_SIDE_PX))]
    pub(crate) height: Option<u32>,
    #[command(flatten)]
    pub(crate) solving: SolvingArgs,
}

/// What `process` and `identify` share.
#[derive(Debug, Args)]
pub(crate) struct SolvingArgs {
    #[command(flatten)]
    pub(crate) hints: HintArgs,
    #[command(flatten)]
    pub(crate) output: OutputArgs,
    #[command(flatten)]
    pub(crate) resources: ResourceArgs,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Calibration")]
pub(crate) struct CalibrationArgs {
    /// Frame taken without light, or the mean of many: its pattern is subtracted, see `starpipe darks`
    #[arg(long, value_name = "FILE")]
    pub(crate) dark: Option<PathBuf>,
    /// Mean of evenly lit frames: what is above the dark level is divided by it, see `starpipe flats`
    #[arg(long, value_name = "FILE")]
    pub(crate) flat: Option<PathBuf>,
    /// Pixels not to be believed: a table with the columns x,y, see `starpipe darks`
    #[arg(long, value_name = "FILE.csv")]
    pub(crate) hot_pixels: Option<PathBuf>,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Detection")]
pub(crate) struct DetectionArgs {
    /// Detection threshold in standard deviations of the background, in place of --false-alarms
    #[arg(long, value_name = "NUMBER", value_parser = values::positive, allow_hyphen_values = true,
          conflicts_with = "false_alarms")]
    pub(crate) sigma: Option<f64>,
    /// False detections to accept in a million pixels of noise [default: 0.1]
    #[arg(long, value_name = "NUMBER", value_parser = values::positive, allow_hyphen_values = true)]
    pub(crate) false_alarms: Option<f64>,
    /// How to measure a star's position
    #[arg(long, value_name = "METHOD", value_enum)]
    pub(crate) centroid: Option<Centroid>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Centroid {
    /// Fit of a Gaussian spot: the most accurate
    GaussianFit,
    /// Centre of the light above a threshold: the fastest
    GreyWeighted,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "What is known of the frames")]
pub(crate) struct HintArgs {
    /// Horizontal field of view in degrees
    #[arg(long, value_name = "DEG", value_parser = values::field_of_view, allow_hyphen_values = true,
          conflicts_with = "pixel_scale")]
    pub(crate) fov: Option<f64>,
    /// Angle of a pixel in arcseconds
    #[arg(long, value_name = "ARCSEC", value_parser = values::pixel_scale, allow_hyphen_values = true)]
    pub(crate) pixel_scale: Option<f64>,
    /// How far --fov or --pixel-scale may be off, in percent [default: 10]
    #[arg(long, value_name = "PERCENT", value_parser = values::percent, allow_hyphen_values = true)]
    pub(crate) scale_error: Option<f64>,
    /// Direction near which the frame's centre lies, in degrees
    #[arg(long, value_name = "RA,DEC", value_parser = values::direction, allow_hyphen_values = true,
          requires = "radius")]
    pub(crate) near: Option<values::Direction>,
    /// How far from --near the frame's centre may lie, in degrees
    #[arg(long, value_name = "DEG", value_parser = values::radius, allow_hyphen_values = true,
          requires = "near")]
    pub(crate) radius: Option<f64>,
    /// When the frames were taken, as ISO 8601, in UTC unless it says otherwise: stars move [default: for
    /// frames, the date in the file's header, else in its name; else 2000]
    #[arg(long, value_name = "ISO8601", allow_hyphen_values = true)]
    pub(crate) date: Option<ObservationDate>,
    /// Where they were taken: latitude and longitude (north and east positive) in degrees, and height in metres; with
    /// the time, that gives zenith distance and airmass
    #[arg(long, value_name = "LAT,LON[,HEIGHT_M]", allow_hyphen_values = true)]
    pub(crate) site: Option<Site>,
    /// Description of the camera, see `starpipe camera new`: gives the scale where no option does and, of frames whose
    /// exposure is known, what they should show
    #[arg(long, value_name = "FILE.toml")]
    pub(crate) camera: Option<PathBuf>,
}

/// What is known of the light in a frame; lists of centroids have none.
#[derive(Debug, Args)]
#[command(next_help_heading = "What is known of the frames")]
pub(crate) struct LightArgs {
    /// How long the frames were exposed, in seconds [default: the exposure in the file's header]
    #[arg(long, value_name = "SECONDS", value_parser = values::exposure, allow_hyphen_values = true)]
    pub(crate) exposure: Option<f64>,
    /// With --camera, zenith distance of the frames' centres in degrees [default: by --site and the date, else by
    /// the header, else 0]
    #[arg(long, value_name = "DEG", value_parser = values::zenith_distance, allow_hyphen_values = true,
          requires = "camera")]
    pub(crate) zenith_distance: Option<f64>,
    /// With --camera, extinction in magnitudes for each airmass [default: the law of the sensitivity paper, 0.35
    /// in V]
    #[arg(long, value_name = "MAG", value_parser = values::extinction, allow_hyphen_values = true,
          requires = "camera")]
    pub(crate) extinction: Option<f64>,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Output")]
pub(crate) struct OutputArgs {
    /// What to print
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub(crate) format: Format,
    /// With --format text, list every identified star and not just the brightest
    #[arg(long)]
    pub(crate) all_stars: bool,
    /// Also write, into this directory, FRAME.json, FRAME.csv (its stars), FRAME.wcs (a FITS header, where
    /// it is identified) and, of frames, FRAME.png (the stars ringed and named)
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Format {
    /// A report for people
    Text,
    /// One JSON object a line
    Json,
    /// A table
    Csv,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Resources")]
pub(crate) struct ResourceArgs {
    /// Star catalogue to use in place of the built-in one: SKY2000, Tycho-2 (a directory of its files), a table
    /// (CSV, TSV, from VizieR), or what `starpipe catalog import` makes of one, which loads fastest
    #[arg(long, value_name = "PATH")]
    pub(crate) catalog: Option<PathBuf>,
    /// Where to keep the index of the catalogue [default: $STARPIPE_CACHE_DIR, else the user's cache
    /// directory]
    #[arg(long, value_name = "DIR")]
    pub(crate) cache_dir: Option<PathBuf>,
    /// Threads to work with [default: one for each processor]
    #[arg(long, value_name = "NUMBER", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub(crate) threads: Option<u32>,
}

#[derive(Debug, Args)]
pub(crate) struct CatalogArgs {
    #[command(subcommand)]
    pub(crate) command: CatalogCommand,
}

#[derive(Debug, Subcommand)]
pub(crate) enum CatalogCommand {
    /// Turn a catalogue as it is distributed into the compact form that --catalog takes
    #[command(after_help = "Examples:\n  \
        starpipe catalog import SKYMAP_SKY2000_V5R4.gz --vmag-limit 8 -o bright.cat\n  \
        starpipe catalog import tycho2/ -o tycho2.cat\n  \
        starpipe catalog import hipparcos.tsv -o hipparcos.cat\n\n\
        Kinds, plain or gzip, found out from the content: SKY2000 records; the files of Tycho-2 (tyc2.dat*, \
        suppl_1.dat), one or a directory of them; tables, CSV or TSV, with a heading for each of identifier (id, \
        hip, tyc, source_id, name, ...), position (ra and dec, raj2000 and dej2000, ra_hours, ... in degrees or \
        as 05:34:48.0), magnitude (vmag, mag, vtmag, phot_g_mean_mag, ...) and, where there are such, proper \
        motion (pmra, pmdec in mas a year) and epoch (ref_epoch).")]
    Import(ImportArgs),
}

#[derive(Debug, Args)]
pub(crate) struct ImportArgs {
    /// Catalogue to read, a file or a directory
    pub(crate) file: PathBuf,
    /// File to write
    #[arg(short, long, value_name = "OUT")]
    pub(crate) output: PathBuf,
    /// Leave out stars fainter than this Johnson V magnitude
    #[arg(long, value_name = "MAG", value_parser = values::finite, allow_hyphen_values = true)]
    pub(crate) vmag_limit: Option<f64>,
}

#[derive(Debug, Args)]
pub(crate) struct RobustnessArgs {
    /// Trials in each row of the table
    #[arg(long, value_name = "NUMBER", default_value_t = 2000, value_parser = clap::value_parser!(u64).range(1..=100_000_000))]
    pub(crate) trials: u64,
    /// Seed of the random numbers
    #[arg(long, value_name = "NUMBER", default_value_t = 1)]
    pub(crate) seed: u64,
    #[command(flatten)]
    pub(crate) protocol: ProtocolArgs,
    /// Trials with fewer true stars than this count only where the answer is wrong
    #[arg(long, value_name = "NUMBER", default_value_t = 8)]
    pub(crate) least_true_stars: usize,
    /// Vary one thing from one value to another in so many steps, in place of the standard table (fov, stars,
    /// centroid-error, mag-error, missing or false; may be repeated)
    #[arg(long, value_name = "NAME=FROM:TO:COUNT")]
    pub(crate) sweep: Vec<values::Sweep>,
    /// What to print
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub(crate) format: Format,
    /// Also draw the rates into this file
    #[arg(long, value_name = "FILE.svg|png", value_parser = plot_file())]
    pub(crate) plot: Option<PlotFile>,
    #[command(flatten)]
    pub(crate) resources: ResourceArgs,
}

#[derive(Debug, Args)]
#[command(group = ArgGroup::new("scenario").args(["camera", "preset", "figures"]).required(true).multiple(true))]
pub(crate) struct LimitArgs {
    /// Camera to predict the limit of, as `starpipe camera new` writes one
    #[arg(long, value_name = "camera.toml", conflicts_with = "preset")]
    pub(crate) camera: Option<PathBuf>,
    /// A camera that is built in, and its conditions
    #[arg(long, value_name = "NAME", value_parser = preset())]
    pub(crate) preset: Option<Preset>,
    /// Which equations [default: as the paper has them for its experiments, else physical]
    #[arg(long, value_enum)]
    pub(crate) reading: Option<ReadingArg>,
    /// Repeat the prediction over one parameter, named as its option with _ or - (may be repeated); :log makes even ratios
    /// of the steps
    #[arg(
        long,
        value_name = "NAME=FROM:TO:COUNT[:log]",
        allow_hyphen_values = true
    )]
    pub(crate) sweep: Vec<values::LimitSweep>,
    /// What to print
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub(crate) format: Format,
    /// Also draw the sweeps into this file, a panel for each, with a second curve for 12.5 times the exposure (over the
    /// exposure: for half the aperture)
    #[arg(long, value_name = "FILE.svg|png", value_parser = plot_file(), requires = "sweep")]
    pub(crate) plot: Option<PlotFile>,
    /// Draw the eleven figures of the paper into this directory, for exposures of 0.04 s and 0.5 s [default camera:
    /// experiment-1]
    #[arg(long, value_name = "DIR", conflicts_with_all = ["sweep", "plot", "format"])]
    pub(crate) figures: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) parameters: ParameterArgs,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum ReadingArg {
    /// Equations (1) to (12) of Tong, Li & Wang 2014 as their authors used them
    Paper,
    /// The same budget with the physics put right
    Physical,
}

#[derive(Debug, Args)]
pub(crate) struct CameraArgs {
    #[command(subcommand)]
    pub(crate) command: CameraCommand,
}

#[derive(Debug, Subcommand)]
pub(crate) enum CameraCommand {
    /// Write the description of a camera, with a comment at each key, to be changed
    #[command(after_help = "Examples:\n  \
        starpipe camera new -o camera.toml\n  \
        starpipe camera new --preset imx174-35mm > camera.toml")]
    New(CameraNewArgs),
    /// List the cameras that are built in
    #[command(after_help = "Example:\n  starpipe camera list")]
    List,
}

#[derive(Debug, Args)]
pub(crate) struct CameraNewArgs {
    /// The camera whose values to write
    #[arg(long, value_name = "NAME", value_parser = preset(), default_value = "experiment-1")]
    pub(crate) preset: Preset,
    /// File to write [default: standard output]
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Overwrite the file
    #[arg(long, requires = "output")]
    pub(crate) force: bool,
}

/// A preset by its name.
pub(crate) fn preset() -> impl TypedValueParser<Value = Preset> {
    let names = Preset::ALL.map(|preset| PossibleValue::new(preset.name()).help(preset.about()));
    PossibleValuesParser::new(names).try_map(|name| Preset::named(&name).ok_or("no such preset"))
}

/// A file for a figure, of a kind that can be drawn.
fn plot_file() -> impl TypedValueParser<Value = PlotFile> {
    PathBufValueParser::new().try_map(PlotFile::new)
}

#[derive(Debug, Args)]
#[command(next_help_heading = "What is drawn")]
pub(crate) struct ProtocolArgs {
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

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_definition_is_sound() {
        Arguments::command().debug_assert();
    }

    #[test]
    fn every_command_shows_an_example() {
        fn check(command: &clap::Command) {
            let help = command.clone().render_long_help().to_string();
            assert!(
                command.get_subcommands().count() > 0 || help.contains("Example"),
                "{}",
                command.get_name()
            );
            command.get_subcommands().for_each(check);
        }
        check(&Arguments::command());
    }
}
