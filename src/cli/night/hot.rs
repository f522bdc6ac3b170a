//! Hot pixels of a night.

use super::run::Run;
use crate::cli::batch::for_each_ordered;
use crate::cli::input::frames::read_frame;
use crate::cli::output::rows::csv_table;
use starpipe::frame::Buffers;
use starpipe::night::{NightHotPixel, NightStart, Standouts, hot_pixels, probe_order};
use std::ops::ControlFlow;
use std::path::Path;

/// Frames that are looked at.
const FRAMES: usize = 12;

/// The hot pixels that frames all over the night show; `None` where too few can be read.
pub(super) fn learn(run: &Run, names: &[String], start: &NightStart) -> Option<Vec<NightHotPixel>> {
    let order = probe_order(names.len());
    let chosen: Vec<&String> = order.iter().take(FRAMES).map(|at| &names[*at]).collect();
    let read = |name: &&String, (): &mut ()| {
        let mut buffers = Buffers::new();
        buffers.set_memory(run.plan.memory);
        // Frames that cannot be read are reported with their rows.
        let frame = read_frame(Path::new(name), None, &mut buffers).ok()?;
        let mjd = frame
            .metadata
            .date
            .and_then(|date| date.modified_julian_date());
        Some(Standouts::of(&frame.into_stored(), mjd))
    };
    let mut found = Vec::new();
    for_each_ordered(
        run.pool,
        &chosen,
        || (),
        read,
        |_, standouts| {
            found.extend(standouts);
            ControlFlow::Continue(())
        },
    );
    hot_pixels(&found, start.held.as_ref(), start.site)
}

/// The list, as `--hot-pixels` reads it.
pub(super) fn table(pixels: &[NightHotPixel]) -> anyhow::Result<String> {
    if pixels.is_empty() {
        return Ok("x,y,share,excess_adu\n".to_owned());
    }
    csv_table(pixels.iter())
}
