//! The inputs of `process` and `identify`, and the images in them.

use crate::cli::input::centroid_list;
use crate::cli::input::frames::read_frame;
use crate::cli::input::stdin::is_stdin;
use anyhow::Context as _;
use starpipe::CentroidList;
use starpipe::centroids::{CentroidListOptions, XylistOptions};
use starpipe::frame::{Buffers, Frame, FrameError, ImageName, PageChoice, Pages};
use starpipe::solve::{
    Context, Error, Solution, Workspace, solve_centroids, solve_guarded, solve_read,
};
use std::path::Path;
use std::{io, mem};

/// What the inputs are.
pub(crate) enum Inputs {
    /// Files with frames, of which these images are solved.
    Frames(PageChoice),
    /// Lists of centroids.
    Lists(CentroidListOptions),
    /// Lists of centroids in FITS, as astrometry.net has them.
    Xylists(XylistOptions),
}

impl Inputs {
    /// Whether there are frames to draw.
    pub(super) fn have_pictures(&self) -> bool {
        matches!(self, Self::Frames(_))
    }
}

/// A solved image.
pub(crate) struct SolvedImage {
    pub(crate) solution: Solution,
    /// The frame, if there is one.
    pub(crate) frame: Option<Frame<'static>>,
}

/// The images of an input, solved one after the other.
pub(super) struct Images<'a> {
    inputs: &'a Inputs,
    path: &'a Path,
    left: RemainingInput,
}

/// What is left of an input.
enum RemainingInput {
    All,
    Pages(Pages),
    Nothing,
}

impl<'a> Images<'a> {
    pub(super) fn new(inputs: &'a Inputs, path: &'a Path) -> Self {
        Self {
            inputs,
            path,
            left: RemainingInput::All,
        }
    }

    /// Solves the next image; `None` after the last.
    pub(super) fn solve_next(
        &mut self,
        context: &Context,
        workspace: &mut Workspace,
    ) -> Option<(ImageName<'a>, anyhow::Result<SolvedImage>)> {
        let image = ImageName::new(self.path);
        match (
            mem::replace(&mut self.left, RemainingInput::Nothing),
            self.inputs,
        ) {
            (RemainingInput::Nothing, _) => None,
            (RemainingInput::Pages(pages), _) => self.solve_page(pages, context, workspace),
            (RemainingInput::All, Inputs::Lists(options)) => {
                let read = || centroid_list::read(self.path, options);
                Some((image, solve_list(self.path, read, context, workspace)))
            }
            (RemainingInput::All, Inputs::Xylists(options)) => {
                let read = || {
                    let list = options.read(self.path);
                    list.with_context(|| format!("reading {}", self.path.display()))
                };
                Some((image, solve_list(self.path, read, context, workspace)))
            }
            (RemainingInput::All, Inputs::Frames(PageChoice::All)) => {
                workspace.begin(context);
                match all_pages(self.path, &mut workspace.frames) {
                    Ok(pages) => self.solve_page(pages, context, workspace),
                    Err(error) => Some((image, Err(Error::from(error).into()))),
                }
            }
            (RemainingInput::All, Inputs::Frames(choice)) => {
                let read = |buffers: &mut Buffers| read_frame(self.path, choice.number(), buffers);
                Some((image, solve_frame(&image, read, context, workspace)))
            }
        }
    }

    fn solve_page(
        &mut self,
        mut pages: Pages,
        context: &Context,
        workspace: &mut Workspace,
    ) -> Option<(ImageName<'a>, anyhow::Result<SolvedImage>)> {
        let image = ImageName::new(self.path).page(pages.advance()?);
        let read = |buffers: &mut Buffers| {
            let frame = pages.image(buffers);
            frame.map_err(|error| error.in_file(&image.to_path()))
        };
        let solved = solve_frame(&image, read, context, workspace);
        self.left = RemainingInput::Pages(pages);
        Some((image, solved))
    }
}

fn solve_frame(
    image: &ImageName,
    read: impl FnOnce(&mut Buffers) -> Result<Frame<'static>, FrameError>,
    context: &Context,
    workspace: &mut Workspace,
) -> anyhow::Result<SolvedImage> {
    let name = image.to_path();
    solve_guarded(&name, workspace, |workspace| {
        let (solution, frame) = solve_read(&name, read, context, workspace)?;
        let frame = Some(frame);
        Ok(SolvedImage { solution, frame })
    })
}

fn solve_list(
    path: &Path,
    read: impl FnOnce() -> anyhow::Result<CentroidList>,
    context: &Context,
    workspace: &mut Workspace,
) -> anyhow::Result<SolvedImage> {
    solve_guarded(path, workspace, |workspace| {
        let list = read()?;
        let solution = solve_centroids(&list, context, workspace)
            .with_context(|| format!("reading {}", path.display()))?;
        Ok(SolvedImage {
            solution,
            frame: None,
        })
    })
}

fn all_pages(path: &Path, buffers: &mut Buffers) -> Result<Pages, FrameError> {
    if is_stdin(path) {
        return Pages::read(io::stdin().lock(), buffers).map_err(|error| error.in_file(path));
    }
    Pages::open(path, buffers)
}
