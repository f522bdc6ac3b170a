//! Solves many inputs on all threads.

use super::images::{Images, Inputs, SolvedImage};
use crate::cli::batch::for_each_ordered;
use starpipe::frame::{ImageName, MemoryLimit};
use starpipe::solve::{Context, Workspace, solve_guarded};
use std::num::NonZeroUsize;
use std::ops::ControlFlow;
use std::path::Path;

/// What is made of a solved image, on the thread that solved it.
pub(crate) trait Sink: Sync {
    /// What is made.
    type Made: Send;

    /// Makes it.
    fn make(&self, image: &ImageName, solved: &SolvedImage) -> Self::Made;
}

/// Solves inputs, and makes of each image what the sink makes.
pub(crate) struct InputSolver<'a, S> {
    pub(crate) pool: &'a rayon::ThreadPool,
    pub(crate) inputs: &'a Inputs,
    pub(crate) context: Context<'a>,
    pub(crate) memory: MemoryLimit,
    pub(crate) sink: S,
}

impl<S: Sink> InputSolver<'_, S> {
    /// Hands what is made of the images of each input, or why nothing is, to `take`, in the order of
    /// the inputs. If `take` breaks, the remaining inputs are skipped.
    pub(crate) fn solve_all<P: AsRef<Path> + Sync>(
        &self,
        paths: &[P],
        mut take: impl FnMut(Vec<(String, anyhow::Result<S::Made>)>) -> ControlFlow<()>,
    ) {
        let work = |path: &P, workspace: &mut Workspace| self.solve(path.as_ref(), workspace);
        let workspace = || self.workspace(paths.len());
        for_each_ordered(self.pool, paths, workspace, work, |_, made| take(made));
    }

    fn solve(
        &self,
        path: &Path,
        workspace: &mut Workspace,
    ) -> Vec<(String, anyhow::Result<S::Made>)> {
        let mut images = Images::new(self.inputs, path);
        let mut all = Vec::new();
        while let Some((image, solved)) = images.solve_next(&self.context, workspace) {
            let made = solved.and_then(|solved| self.make(&image, solved, workspace));
            all.push((image.to_string(), made));
        }
        all
    }

    fn make(
        &self,
        image: &ImageName,
        solved: SolvedImage,
        workspace: &mut Workspace,
    ) -> anyhow::Result<S::Made> {
        let name = image.to_path();
        let made = solve_guarded(&name, workspace, |_| Ok(self.sink.make(image, &solved)));
        // Frames are large: their buffers are used again.
        if let Some(frame) = solved.frame {
            workspace.frames.recycle(frame);
        }
        made
    }

    /// A workspace of one thread. A single input is solved on all threads.
    fn workspace(&self, inputs: usize) -> Workspace {
        let mut workspace = Workspace::new();
        workspace.frames.set_memory(self.memory);
        if let (1, Some(threads)) = (inputs, NonZeroUsize::new(self.pool.current_num_threads())) {
            workspace.detect = workspace.detect.on_threads(threads);
        }
        workspace
    }
}
