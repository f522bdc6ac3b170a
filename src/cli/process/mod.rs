//! `process`: finds and identifies the stars in frames.

mod args;
mod configuration;
mod parts;

pub(crate) use args::{CalibrationOptions, ProcessArgs};

use super::exit::{CommandError, Exit, Outcome};
use super::input::frames::{FrameList, read_frame};
use super::solving::options::FRAME_RESULTS;
use super::solving::result_files::Solved;
use super::solving::solve_all;
use parts::process_parts;
use starpipe::frame::Buffers;
use starpipe::pipeline::{Context, Workspace, solve_read};
use std::path::Path;

/// `starpipe process`
pub(crate) fn process(arguments: ProcessArgs) -> Result<Outcome, CommandError> {
    if let Some(directory) = &arguments.parts.out_parquet {
        return process_parts(&arguments, directory);
    }
    let plan = arguments.plan()?;
    let page = arguments.frames.page;
    let (frames, failed) = FrameList::of(arguments.frames.frames)?.reported();
    // Frames are large: one is kept only to be drawn.
    let keep = arguments.solving.writes_files();
    let solve = |context: &Context, path: &Path, workspace: &mut Workspace| {
        let read = |buffers: &mut Buffers| read_frame(path, page, buffers);
        let (solution, frame) = solve_read(path, read, context, workspace)?;
        let frame = if keep {
            Some(frame)
        } else {
            workspace.frames.recycle(frame);
            None
        };
        Ok(Solved { solution, frame })
    };
    let exit = solve_all(&frames, arguments.solving, FRAME_RESULTS, &plan, solve)?;
    Ok(if failed { Exit::Failure } else { exit }.into())
}
