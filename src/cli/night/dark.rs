//! The level of a pixel without light, by the frames of a night.

use super::run::Run;
use crate::cli::batch::for_each_ordered;
use crate::cli::input::frames::read_frame;
use starpipe::frame::Buffers;
use starpipe::night::{FrameLevel, NightStart, dark_level};
use starpipe::photometry::sky_map::DarkLevel;
use std::ops::ControlFlow;
use std::path::Path;

/// The level by frames of different exposure, where nothing else tells it.
pub(super) fn learn(run: &Run, names: &[String], start: &NightStart) -> Option<DarkLevel> {
    if !start.lacks_dark_level {
        return None;
    }
    let buffers = || {
        let mut buffers = Buffers::new();
        buffers.set_memory(run.plan.memory);
        buffers
    };
    let read = |name: &String, buffers: &mut Buffers| {
        // Frames that cannot be read are reported with their rows.
        let frame = read_frame(Path::new(name), None, buffers).ok()?;
        let level = FrameLevel::of(&frame);
        buffers.recycle(frame);
        level
    };
    let mut levels = Vec::with_capacity(names.len());
    for_each_ordered(run.pool, names, buffers, read, |_, level| {
        levels.extend(level);
        ControlFlow::Continue(())
    });
    dark_level(&levels)
}
