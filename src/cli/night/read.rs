//! What frames tell by themselves, before they are solved.

use crate::cli::batch::for_each_ordered;
use crate::cli::input::frames::read_frame;
use starpipe::frame::{Buffers, Frame, MemoryLimit};
use std::ops::ControlFlow;
use std::path::Path;

/// Reads frames and returns what `tell` makes of each, in their order. Frames that cannot be read tell nothing: why
/// is said when they are solved.
pub(super) fn of_each<N: AsRef<Path> + Sync, T: Send>(
    names: &[N],
    pool: &rayon::ThreadPool,
    memory: MemoryLimit,
    tell: impl Fn(&Path, Frame<'static>) -> Option<T> + Sync,
) -> Vec<Option<T>> {
    let buffers = || {
        let mut buffers = Buffers::new();
        buffers.set_memory(memory);
        buffers
    };
    let read = |name: &N, buffers: &mut Buffers| {
        let path = name.as_ref();
        tell(path, read_frame(path, None, buffers).ok()?)
    };
    let mut frames = Vec::with_capacity(names.len());
    for_each_ordered(pool, names, buffers, read, |_, one| {
        frames.push(one);
        ControlFlow::Continue(())
    });
    frames
}
