//! The images of a file, solved one after the other.

use crate::cli::input::frames::read_frame;
use crate::cli::input::stdin::is_stdin;
use crate::cli::options::frames::PageChoice;
use crate::cli::solving::result_files::Image;
use starpipe::frame::{Buffers, Frame, FrameError, Pages};
use starpipe::pipeline::{Context, Error, Solution, Workspace, solve_read};
use std::io;
use std::path::Path;

/// A solved image, or why it is none.
pub(super) type SolvedImage = Result<(Solution, Frame<'static>), Error>;

/// Solves the image of the file `path` that is chosen, or all of them, and hands each to `take`.
pub(super) fn solve_images(
    path: &Path,
    choice: Option<PageChoice>,
    context: &Context,
    workspace: &mut Workspace,
    mut take: impl FnMut(Image, SolvedImage, &mut Workspace),
) {
    let number = match choice {
        None => None,
        Some(PageChoice::Number(number)) => Some(number),
        Some(PageChoice::All) => return solve_all_images(path, context, workspace, take),
    };
    let read = |buffers: &mut Buffers| read_frame(path, number, buffers);
    let solved = solve_read(path, read, context, workspace);
    take(Image::of(path), solved, workspace);
}

fn solve_all_images(
    path: &Path,
    context: &Context,
    workspace: &mut Workspace,
    mut take: impl FnMut(Image, SolvedImage, &mut Workspace),
) {
    workspace.begin(context);
    let mut pages = match all_pages(path, &mut workspace.frames) {
        Ok(pages) => pages,
        Err(error) => return take(Image::of(path), Err(error.into()), workspace),
    };
    while let Some(page) = pages.advance() {
        let image = Image {
            path,
            page: Some(page),
        };
        let name = image.name();
        let read = |buffers: &mut Buffers| {
            let frame = pages.image(buffers);
            frame.map_err(|error| error.in_file(&name))
        };
        let solved = solve_read(&name, read, context, workspace);
        take(image, solved, workspace);
    }
}

fn all_pages(path: &Path, buffers: &mut Buffers) -> Result<Pages, FrameError> {
    if is_stdin(path) {
        return Pages::read(io::stdin().lock(), buffers).map_err(|error| error.in_file(path));
    }
    Pages::open(path, buffers)
}
