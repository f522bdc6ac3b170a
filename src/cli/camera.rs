//! `camera new`, `camera list`.

use super::exit::{CommandError, Exit};
use super::options::scenario::preset;
use super::output::files::write_whole;
use super::output::stdout::print;
use clap::{Args, Subcommand};
use starpipe::camera::data_sheet::{Preset, template};
use std::fmt::Write as _;
use std::path::PathBuf;

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

/// `starpipe camera`
pub(crate) fn camera(arguments: &CameraArgs) -> Result<Exit, CommandError> {
    match &arguments.command {
        CameraCommand::New(arguments) => new(arguments),
        CameraCommand::List => list(),
    }
}

fn new(arguments: &CameraNewArgs) -> Result<Exit, CommandError> {
    let text = template(arguments.preset);
    let Some(path) = &arguments.output else {
        // Nobody left to read it: nothing is lost.
        let _ = print(&text)?;
        return Ok(Exit::Success);
    };
    // A link that leads nowhere is there as well.
    if !arguments.force && path.symlink_metadata().is_ok() {
        return Err(CommandError::Usage(format!(
            "{} is there already; --force overwrites it",
            path.display()
        )));
    }
    write_whole(&[(path.clone(), text.into_bytes())])?;
    Ok(Exit::Success)
}

fn list() -> Result<Exit, CommandError> {
    let mut text = String::new();
    for preset in Preset::ALL {
        let _ = writeln!(text, "{:<17} {}", preset.name(), preset.about());
    }
    let _ = print(&text)?;
    Ok(Exit::Success)
}
