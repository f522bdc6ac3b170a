//! The images of a file, solved one after the other.

use crate::cli::input::frames::read_frame;
use crate::cli::input::stdin::is_stdin;
use crate::cli::options::frames::PageChoice;
use crate::cli::solving::result_files::{Image, Solved};
use starpipe::frame::{Buffers, Frame, FrameError, Pages};
use starpipe::pipeline::{Context, Error, Workspace, solve_guarded, solve_read};
use std::io;
use std::path::Path;

/// The images of a file, each with what was made of it.
pub(super) type Images<'a, R> = Vec<(Image<'a>, Result<R, Error>)>;

/// Solves the image of the file `path` that is chosen, or all of them. Returns what `finish` makes of
/// each, or why it could not be made.
pub(super) fn solve_images<'a, R>(
    path: &'a Path,
    choice: Option<PageChoice>,
    context: &Context,
    workspace: &mut Workspace,
    finish: impl Fn(Image, Solved, &mut Workspace) -> R,
) -> Images<'a, R> {
    let number = match choice {
        None => None,
        Some(PageChoice::Number(number)) => Some(number),
        Some(PageChoice::All) => return solve_all_images(path, context, workspace, finish),
    };
    let image = Image::of(path);
    let read = |buffers: &mut Buffers| read_frame(path, number, buffers);
    vec![(image, solve_image(image, read, context, workspace, finish))]
}

fn solve_all_images<'a, R>(
    path: &'a Path,
    context: &Context,
    workspace: &mut Workspace,
    finish: impl Fn(Image, Solved, &mut Workspace) -> R,
) -> Images<'a, R> {
    workspace.begin(context);
    let mut pages = match all_pages(path, &mut workspace.frames) {
        Ok(pages) => pages,
        Err(error) => return vec![(Image::of(path), Err(error.into()))],
    };
    let mut images = Vec::new();
    while let Some(page) = pages.advance() {
        let page = Some(page);
        let image = Image { path, page };
        let read = |buffers: &mut Buffers| {
            let frame = pages.image(buffers);
            frame.map_err(|error| error.in_file(&image.name()))
        };
        images.push((image, solve_image(image, read, context, workspace, &finish)));
    }
    images
}

fn solve_image<R>(
    image: Image,
    read: impl FnOnce(&mut Buffers) -> Result<Frame<'static>, FrameError>,
    context: &Context,
    workspace: &mut Workspace,
    finish: impl FnOnce(Image, Solved, &mut Workspace) -> R,
) -> Result<R, Error> {
    let name = image.name();
    solve_guarded(&name, workspace, |workspace| {
        let (solution, frame) = solve_read(&name, read, context, workspace)?;
        let frame = Some(frame);
        Ok(finish(image, Solved { solution, frame }, workspace))
    })
}

fn all_pages(path: &Path, buffers: &mut Buffers) -> Result<Pages, FrameError> {
    if is_stdin(path) {
        return Pages::read(io::stdin().lock(), buffers).map_err(|error| error.in_file(path));
    }
    Pages::open(path, buffers)
}
