//! Frames named on the command line: files, directories of frames, and `-` for standard input.

use super::stdin::{check_once, is_stdin};
use crate::cli::batch::try_for_each_ordered;
use crate::cli::exit::CommandError;
use crate::cli::input::names::report_passed_over;
use crate::cli::output::messages::report_error;
use crate::cli::progress::frames_bar;
use anyhow::Context;
use starpipe::calibration::Master;
use starpipe::frame::{self, Buffers, Cameras, Folder, Frame, FrameError, PassedOver};
use starpipe::solve;
use std::io;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

/// The frames that the command line names.
pub(crate) struct FrameList {
    pub(crate) paths: Vec<PathBuf>,
    /// One for each directory that could not be read or has no frames.
    pub(crate) errors: Vec<solve::Error>,
    /// What is no frame of the sky in the directories.
    pub(crate) passed_over: Vec<PassedOver>,
}

impl FrameList {
    /// Replaces each directory by the frames in it, whatever they are of.
    pub(crate) fn expand(inputs: Vec<PathBuf>) -> Result<Self, CommandError> {
        Self::with(inputs, |directory| {
            let frames = frame::files_in(directory)?;
            Ok(Folder {
                frames,
                ..Folder::default()
            })
        })
    }

    /// Replaces each directory by the frames of the sky in it.
    pub(crate) fn of_sky(inputs: Vec<PathBuf>, cameras: Cameras) -> Result<Self, CommandError> {
        Self::with(inputs, |directory| Folder::read(directory, cameras))
    }

    fn with(
        inputs: Vec<PathBuf>,
        list: impl Fn(&Path) -> Result<Folder, FrameError>,
    ) -> Result<Self, CommandError> {
        check_once(&inputs)?;
        let mut all = Self {
            paths: Vec::new(),
            errors: Vec::new(),
            passed_over: Vec::new(),
        };
        for input in inputs {
            if !input.is_dir() {
                all.paths.push(input);
                continue;
            }
            match list(&input) {
                Ok(found) => {
                    all.paths.extend(found.frames);
                    all.passed_over.extend(found.passed_over);
                }
                Err(error) => all.errors.push(error.into()),
            }
        }
        Ok(all)
    }

    /// The frames, and whether a directory failed; the errors, and what is passed over, are reported.
    pub(crate) fn reported(self) -> (Vec<PathBuf>, bool) {
        report_passed_over(&self.passed_over);
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
    let taken = try_for_each_ordered(
        pool,
        paths,
        || (),
        read,
        |_, result| {
            progress.inc(1);
            match result {
                Ok(frame) => take(frame),
                Err(error) => {
                    unread += 1;
                    progress.suspend(|| report_error(error.as_ref()));
                    Ok(())
                }
            }
        },
    );
    progress.finish_and_clear();
    taken.map(|()| unread)
}
