//! The light of a frame above its background.

use crate::detect::BackgroundMap;
use crate::frame::Frame;

/// Cell size of the background mesh, in pixels.
const CELL_PX: usize = 64;

/// The frame without its background; row-major, `height * width`.
pub(super) fn above_background(frame: &Frame) -> Vec<f32> {
    let background = BackgroundMap::measure(frame, CELL_PX);
    let mut above = frame.values().into_owned();
    let mut levels = vec![0.0; frame.width];
    for (y, row) in above.chunks_mut(frame.width).enumerate() {
        background.row(y, &mut levels);
        row.iter_mut()
            .zip(&levels)
            .for_each(|(pixel, level)| *pixel -= level);
    }
    above
}
