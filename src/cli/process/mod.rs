//! `process`: finds and identifies the stars in frames.

mod args;
mod parts;

pub(crate) use args::ProcessArgs;

use super::exit::{CommandError, CommandOutput, Exit};
use super::input::frames::FrameList;
use super::solving::{Inputs, report_all};
use parts::process_parts;
use starpipe::frame::Cameras;

/// `starpipe process`
pub(crate) fn process(arguments: ProcessArgs) -> Result<CommandOutput, CommandError> {
    if let Some(directory) = &arguments.parts.out_parquet {
        return process_parts(&arguments, directory);
    }
    let plan = arguments.plan()?;
    let inputs = Inputs::Frames(arguments.page.unwrap_or_default());
    let (frames, failed) = FrameList::of_sky(arguments.frames.frames, Cameras::Any)?.reported();
    let exit = report_all(&inputs, &frames, arguments.solving, &plan)?;
    Ok(if failed { Exit::Failure } else { exit }.into())
}
