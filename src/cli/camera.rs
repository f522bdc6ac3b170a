//! `camera new` and `camera list`: descriptions of cameras.

use super::exit::{CommandError, CommandOutput};
use super::options::scenario::preset;
use super::output::files::write_whole;
use clap::{Args, Subcommand};
use starpipe::camera::data_sheet::{Preset, template};
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    starpipe camera list\n  \
    starpipe camera new --preset imx174-35mm > camera.toml")]
pub(crate) struct CameraArgs {
    #[command(subcommand)]
    command: CameraCommand,
}

#[derive(Debug, Subcommand)]
enum CameraCommand {
    /// Write a description of a camera, with a comment for each key, as a file to edit
    New(NewArgs),
    /// List the built-in cameras
    #[command(after_help = "Example:\n  starpipe camera list")]
    List,
}

#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    starpipe camera new -o camera.toml\n  \
    starpipe camera new --preset imx174-35mm > camera.toml")]
struct NewArgs {
    /// Camera whose values are written
    #[arg(long, value_name = "NAME", value_parser = preset(), default_value = "experiment-1")]
    preset: Preset,
    /// File to write [default: standard output]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Overwrite the file
    #[arg(long, requires = "output")]
    force: bool,
}

/// `starpipe camera`
pub(crate) fn camera(arguments: &CameraArgs) -> Result<CommandOutput, CommandError> {
    match &arguments.command {
        CameraCommand::New(arguments) => new(arguments),
        CameraCommand::List => Ok(CommandOutput::success(list())),
    }
}

fn new(arguments: &NewArgs) -> Result<CommandOutput, CommandError> {
    let text = template(arguments.preset);
    let Some(path) = &arguments.output else {
        return Ok(CommandOutput::success(text));
    };
    // A link counts as existing even if its target does not exist.
    if !arguments.force && path.symlink_metadata().is_ok() {
        return Err(CommandError::Usage(format!(
            "{} exists; --force overwrites it",
            path.display()
        )));
    }
    write_whole(path, text.as_bytes())?;
    Ok(CommandOutput::success(String::new()))
}

fn list() -> String {
    Preset::ALL
        .map(|preset| format!("{:<17} {}\n", preset.name(), preset.about()))
        .concat()
}
