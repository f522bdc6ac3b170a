//! The command line: which commands there are.

use super::camera::CameraArgs;
use super::catalog::CatalogArgs;
use super::darks::DarksArgs;
use super::defocus::DefocusArgs;
use super::experiment::ExperimentArgs;
use super::flats::FlatsArgs;
use super::identify::IdentifyArgs;
use super::limit::LimitArgs;
use super::process::ProcessArgs;
use super::robustness::RobustnessArgs;
use super::simulate::SimulateArgs;
use super::validate::ValidateArgs;
use clap::{Parser, Subcommand};

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
    Process(ProcessArgs),
    /// Identify the stars in lists of centroids (CSV)
    Identify(IdentifyArgs),
    /// Work with star catalogues
    Catalog(CatalogArgs),
    /// Measure how often identification is right, wrong, or without an answer
    Robustness(RobustnessArgs),
    /// Predict the faintest star that a camera detects
    Limit(Box<LimitArgs>),
    /// Work with descriptions of cameras
    Camera(CameraArgs),
    /// Do an experiment of the sensitivity paper again: its limit, its stars, and frames like its own
    Experiment(ExperimentArgs),
    /// Make frames of a camera with known truth
    Simulate(Box<SimulateArgs>),
    /// Put thousands of simulated frames through the pipeline, and hold what it finds against the truth and against theory
    Validate(Box<ValidateArgs>),
    /// Find the spot radius with the best centroids, and how far to defocus for it
    Defocus(Box<DefocusArgs>),
    /// Measure noise, pattern, dark current and hot pixels on frames taken without light
    Darks(DarksArgs),
    /// Make a master flat of evenly lit frames, and measure gain and response
    Flats(FlatsArgs),
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
