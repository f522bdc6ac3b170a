//! `process`: finds and identifies the stars in frames.

mod args;
mod configuration;
mod images;
mod parts;

pub(crate) use args::{CalibrationOptions, ProcessArgs};

use super::exit::{CommandError, Exit, Outcome};
use super::input::frames::FrameList;
use super::solving::options::FRAME_RESULTS;
use super::solving::result_files::{Image, Solved};
use super::solving::{Finish, solve_all};
use images::solve_images;
use parts::process_parts;
use starpipe::pipeline::{Context, Workspace};
use std::path::Path;

/// `starpipe process`
pub(crate) fn process(arguments: ProcessArgs) -> Result<Outcome, CommandError> {
    if let Some(directory) = &arguments.parts.out_parquet {
        return process_parts(&arguments, directory);
    }
    let plan = arguments.plan()?;
    let page = arguments.page;
    let (frames, failed) = FrameList::of(arguments.frames.frames)?.reported();
    // Frames are large: one is kept only to be drawn.
    let keep = arguments.solving.writes_files();
    let solve = |context: &Context, path: &Path, workspace: &mut Workspace, finish: Finish| {
        let finish = |image: Image, mut solved: Solved, workspace: &mut Workspace| {
            if !keep {
                solved.recycle_frame(workspace);
            }
            finish(image, solved)
        };
        let images = solve_images(path, page, context, workspace, finish).into_iter();
        images.map(|(_, answer)| Ok(answer?)).collect()
    };
    let exit = solve_all(&frames, arguments.solving, FRAME_RESULTS, &plan, solve)?;
    Ok(if failed { Exit::Failure } else { exit }.into())
}
