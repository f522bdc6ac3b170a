//! What inputs may be named: files, directories of frames, and `-` for standard input.

use crate::cli::batch;
use crate::cli::exit::CommandError;
use crate::cli::output::messages::{one_line, report_error};
use crate::cli::progress::bar;
use anyhow::Context;
use starpipe::calibration::Master;
use starpipe::frame::{self, Buffers, Frame, FrameError};
use starpipe::pipeline::Error;
use std::io;
use std::num::NonZeroUsize;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// Whether `input` stands for standard input.
pub(crate) fn is_stdin(input: &Path) -> bool {
    input.as_os_str() == "-"
}

/// The frame in the file `input`, or in standard input.
pub(crate) fn read_frame(
    input: &Path,
    page: Option<NonZeroUsize>,
    buffers: &mut Buffers,
) -> Result<Frame, FrameError> {
    if !is_stdin(input) {
        return frame::read_page_with(input, page, buffers);
    }
    frame::read_stream(io::stdin().lock(), page).map_err(|error| error.in_file(input))
}

/// Refuses to read standard input twice.
pub(crate) fn check(inputs: &[PathBuf]) -> Result<(), CommandError> {
    if inputs.iter().filter(|input| is_stdin(input)).count() > 1 {
        return Err(CommandError::Usage(
            "- stands for standard input, which can be read only once; it is given twice".into(),
        ));
    }
    Ok(())
}

/// The frames that `inputs` stand for, a directory for those in it; and which directories have none.
pub(crate) fn frames(inputs: Vec<PathBuf>) -> (Vec<PathBuf>, Vec<Error>) {
    let mut frames = Vec::new();
    let mut troubles = Vec::new();
    for input in inputs {
        if input.is_dir() {
            match frame::files_in(&input) {
                Ok(found) => frames.extend(found),
                Err(error) => troubles.push(error.into()),
            }
        } else {
            frames.push(input);
        }
    }
    (frames, troubles)
}

/// Reads frames on all threads and takes them in their order; tells how many could not be read. What `take` refuses ends it.
pub(crate) fn for_each_frame<R: Send>(
    pool: &rayon::ThreadPool,
    frames: &[PathBuf],
    read: impl Fn(&PathBuf) -> anyhow::Result<R> + Sync,
    mut take: impl FnMut(R) -> anyhow::Result<()>,
) -> anyhow::Result<usize> {
    let progress = bar(frames.len() as u64, "frames {wide_bar} {pos}/{len} {eta}");
    let mut unread = 0;
    let mut refused = None;
    let read = |path: &PathBuf, (): &mut ()| read(path);
    batch::for_each_ordered(
        pool,
        frames,
        || (),
        read,
        |_, result| {
            progress.inc(1);
            match result {
                Err(error) => {
                    unread += 1;
                    progress.suspend(|| report_error(one_line(error.as_ref())));
                    ControlFlow::Continue(())
                }
                Ok(frame) => match take(frame) {
                    Ok(()) => ControlFlow::Continue(()),
                    Err(error) => {
                        refused = Some(error);
                        ControlFlow::Break(())
                    }
                },
            }
        },
    );
    progress.finish_and_clear();
    refused.map_or(Ok(unread), Err)
}

/// A master frame of any kind of file.
pub(crate) fn read_master(path: &Path) -> anyhow::Result<Master> {
    Ok(Master {
        name: path.display().to_string(),
        frame: frame::read(path).context("reading")?,
    })
}
