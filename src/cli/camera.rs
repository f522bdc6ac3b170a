//! `camera new`, `camera list`.

use super::args::{CameraArgs, CameraCommand, CameraNewArgs};
use super::output::{print, write_whole};
use super::{Exit, Fault};
use starpipe::camera::data_sheet::{Preset, template};
use std::fmt::Write as _;

/// `starpipe camera`
pub(crate) fn camera(arguments: &CameraArgs) -> Result<Exit, Fault> {
    match &arguments.command {
        CameraCommand::New(arguments) => new(arguments),
        CameraCommand::List => list(),
    }
}

fn new(arguments: &CameraNewArgs) -> Result<Exit, Fault> {
    let text = template(arguments.preset);
    let Some(path) = &arguments.output else {
        // Nobody left to read it: nothing is lost.
        let _ = print(&text)?;
        return Ok(Exit::Success);
    };
    // A link that leads nowhere is there as well.
    if !arguments.force && path.symlink_metadata().is_ok() {
        return Err(Fault::Usage(format!(
            "{} is there already; --force overwrites it",
            path.display()
        )));
    }
    write_whole(&[(path.clone(), text.into_bytes())])?;
    Ok(Exit::Success)
}

fn list() -> Result<Exit, Fault> {
    let mut text = String::new();
    for preset in Preset::ALL {
        let _ = writeln!(text, "{:<17} {}", preset.name(), preset.about());
    }
    let _ = print(&text)?;
    Ok(Exit::Success)
}
