//! Frames named on the command line: files, directories of frames, and `-` for standard input.

use super::stdin::{check_once, is_stdin};
use crate::cli::batch::for_each_ordered;
use crate::cli::exit::CommandError;
use crate::cli::output::messages::report_error;
use crate::cli::progress::frames_bar;
use anyhow::Context;
use starpipe::calibration::Master;
use starpipe::frame::{self, Buffers, Frame, FrameError};
use starpipe::pipeline;
use std::io;
use std::num::NonZeroUsize;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// The frames that the command line names.
pub(crate) struct FrameList {
    pub(crate) paths: Vec<PathBuf>,
    /// One for each directory that could not be read or has no frames.
    pub(crate) errors: Vec<pipeline::Error>,
}

impl FrameList {
    /// Replaces each directory by the frames in it.
    pub(crate) fn of(inputs: Vec<PathBuf>) -> Result<Self, CommandError> {
        check_once(&inputs)?;
        let mut list = Self {
            paths: Vec::new(),
            errors: Vec::new(),
        };
        for input in inputs {
            if !input.is_dir() {
                list.paths.push(input);
                continue;
            }
            match frame::files_in(&input) {
                Ok(found) => list.paths.extend(found),
                Err(error) => list.errors.push(error.into()),
            }
        }
        Ok(list)
    }

    /// The frames, and whether a directory failed; the errors are reported.
    pub(crate) fn reported(self) -> (Vec<PathBuf>, bool) {
        for error in &self.errors {
            report_error(error);
        }
        (self.paths, !self.errors.is_empty())
    }
}

/// Reads the frame in the file `input`, or in standard input. It may take as much memory as the
/// buffers say.
pub(crate) fn read_frame(
    input: &Path,
    page: Option<NonZeroUsize>,
    buffers: &mut Buffers,
) -> Result<Frame<'static>, FrameError> {
    if !is_stdin(input) {
        return frame::read_page_with(input, page, buffers);
    }
    frame::read_stream(io::stdin().lock(), page, buffers).map_err(|error| error.in_file(input))
}

/// Reads a master dark or a master flat.
pub(crate) fn read_master(path: &Path) -> anyhow::Result<Master> {
    Ok(Master {
        name: path.display().to_string(),
        frame: frame::read(path).context("reading")?,
    })
}

/// Reads and measures frames of the detector, in the rows of their files, on all threads, and hands the results to `take` in input order.
/// Returns the number of frames that could not be read, which are reported.
///
/// # Errors
/// The first error of `take`, which stops reading.
pub(crate) fn for_each_frame<R: Send>(
    pool: &rayon::ThreadPool,
    paths: &[PathBuf],
    page: Option<NonZeroUsize>,
    measure: impl Fn(&Path, Frame<'static>) -> R + Sync,
    mut take: impl FnMut(R) -> anyhow::Result<()>,
) -> anyhow::Result<usize> {
    let progress = frames_bar(paths.len() as u64);
    let read = |path: &PathBuf, (): &mut ()| -> anyhow::Result<R> {
        let frame = read_frame(path, page, &mut Buffers::new()).context("reading")?;
        Ok(measure(path, frame.into_stored()))
    };
    let mut unread = 0;
    let mut refused = None;
    for_each_ordered(
        pool,
        paths,
        || (),
        read,
        |_, result| {
            progress.inc(1);
            let taken = match result {
                Ok(frame) => take(frame),
                Err(error) => {
                    unread += 1;
                    progress.suspend(|| report_error(error.as_ref()));
                    Ok(())
                }
            };
            match taken {
                Ok(()) => ControlFlow::Continue(()),
                Err(error) => {
                    refused = Some(error);
                    ControlFlow::Break(())
                }
            }
        },
    );
    progress.finish_and_clear();
    refused.map_or(Ok(unread), Err)
}
