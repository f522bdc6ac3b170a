//! The list of commands.

use super::archive::ArchiveArgs;
use super::calibrate::CalibrateArgs;
use super::camera::CameraArgs;
use super::catalog::CatalogArgs;
use super::darks::DarksArgs;
use super::defocus::DefocusArgs;
use super::doors::astap::AstapArgs;
#[cfg(feature = "serve")]
use super::doors::serve::ServeArgs;
use super::doors::solve_field::SolveFieldArgs;
use super::experiment::ExperimentArgs;
use super::flats::FlatsArgs;
use super::identify::IdentifyArgs;
use super::limit::LimitArgs;
use super::night::NightArgs;
use super::process::ProcessArgs;
#[cfg(feature = "shell")]
use super::shell::{CompletionsArgs, ManArgs};
use super::simulate::SimulateArgs;
use super::track::TrackArgs;
use super::validate::{ClutterArgs, HardArgs, RobustnessArgs, SkyArgs, ValidateArgs};
use clap::{Parser, Subcommand};

/// The version with what it was built from.
fn long_version() -> String {
    format!(
        "{}\ncommit {}\ncatalog SKY2000 version 5 revision 4, built in",
        env!("CARGO_PKG_VERSION"),
        option_env!("STARPIPE_COMMIT").unwrap_or("unknown")
    )
}

/// Finds and identifies the stars in photographs of the night sky, and determines where the camera
/// pointed
#[derive(Debug, Parser)]
#[command(
    name = "starpipe",
    version,
    long_version = long_version(),
    arg_required_else_help = true,
    max_term_width = 100,
    after_help = "Examples:\n  \
        starpipe night.tif\n  \
        starpipe process --fov 11.4 --format json *.tif > night.jsonl\n  \
        starpipe identify --pixel-scale 10.8 centroids.csv\n\n\
        Without a command, frames are processed: starpipe night.tif means starpipe process night.tif.\n\
        Exit status: 0 every frame was identified, 1 something could not be read or written,\n\
        2 the command line is wrong, 3 at least one frame was not identified."
)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Find and identify the stars in frames (FITS, TIFF, PNG, JPEG, BMP, PGM)
    Process(Box<ProcessArgs>),
    /// Measure sky brightness, extinction, clouds and limiting magnitude in each part of the sky
    #[command(after_help = "Examples:\n  \
        starpipe sky --site 52.22,4.42 --dark master-dark.fits night.fits\n  \
        starpipe sky --site 52.22,4.42 --camera camera.toml --format json night.fits > sky.jsonl\n\n\
        Options and report are those of `starpipe process`, with the sky added. --out also writes FRAME.sky.svg.\n\
        If site and time are known, the sky of a wide field is divided by altitude and azimuth, otherwise by\n\
        columns and rows of the frame. The brightness needs the dark level (bias and dark current): from\n\
        --dark or --camera, or from the corners of the frame if an all-sky lens leaves them unlit.")]
    Sky(Box<ProcessArgs>),
    /// Measure a night of a fixed camera: sky, clouds, limiting magnitude, pointing, and when they changed
    Night(Box<NightArgs>),
    /// Show the progress of an archive run, merge its tables, and report each night
    Archive(ArchiveArgs),
    /// Identify the stars in lists of centroids (CSV)
    Identify(Box<IdentifyArgs>),
    #[cfg(feature = "serve")]
    /// Answer programs that ask nova.astrometry.net, and others, over HTTP
    Serve(Box<ServeArgs>),
    /// Follow the attitude of a camera from frame to frame
    Track(Box<TrackArgs>),
    /// Measure the lens of a camera in several of its frames
    Calibrate(Box<CalibrateArgs>),
    /// Convert star catalogs
    Catalog(CatalogArgs),
    /// Predict the faintest star that a camera detects
    Limit(Box<LimitArgs>),
    /// Write and list descriptions of cameras
    Camera(CameraArgs),
    /// Repeat an experiment of Tong, Li & Wang (2014): limiting magnitude, stars, and simulated frames
    Experiment(ExperimentArgs),
    /// Simulate frames of a camera, with tables of the stars and other objects in them
    Simulate(Box<SimulateArgs>),
    /// Simulate and process thousands of frames, and compare the results with the truth and with
    /// theory
    Validate(Box<ValidateArgs>),
    /// Simulate lenses, spots and detectors that differ from the pipeline's model, and compare the results with
    /// the truth
    #[command(hide = true)]
    ValidateHard(Box<HardArgs>),
    /// Simulate skies over an all-sky camera that points to the zenith, and compare what `starpipe sky` measures with
    /// the truth
    #[command(hide = true)]
    ValidateSky(Box<SkyArgs>),
    /// Measure how often identification is right, wrong or fails, on simulated lists of centroids
    #[command(hide = true, alias = "robustness")]
    ValidateRobustness(RobustnessArgs),
    /// Measure how often names are wrong, on simulated frames with foliage, clouds, trails and the
    /// like, and whether pictures without sky are identified
    #[command(hide = true, alias = "clutter")]
    ValidateClutter(Box<ClutterArgs>),
    /// Find the spot radius with the smallest centroid error, and the defocus that gives it
    Defocus(Box<DefocusArgs>),
    /// Measure read noise, fixed-pattern noise, dark current and hot pixels on dark frames
    Darks(DarksArgs),
    /// Make a master flat from flat-field frames, and measure the gain and the pixel response
    Flats(FlatsArgs),
    /// Solve images and lists of centroids as solve-field of astrometry.net does: its options, lines and files
    SolveField(Box<SolveFieldArgs>),
    /// Answer in the place of ASTAP: its options, its files, its exit statuses
    Astap(Box<AstapArgs>),
    #[cfg(feature = "shell")]
    /// Write a script that completes commands and options in a shell
    Completions(CompletionsArgs),
    #[cfg(feature = "shell")]
    /// Write a manual page
    Man(ManArgs),
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_definition_is_valid() {
        Arguments::command().debug_assert();
    }

    #[test]
    fn every_command_shows_an_example() {
        fn check(command: &clap::Command) {
            let help = command.clone().render_long_help().to_string();
            assert!(help.contains("Example"), "{}", command.get_name());
            command.get_subcommands().for_each(check);
        }
        check(&Arguments::command());
    }
}
