//! When the work on a frame is to end.

use crate::base::interrupt::{Interrupt, Paused};

/// When the work on a frame is to end.
pub struct FrameLimits {
    /// When all work is.
    pub of_all: Interrupt,
    /// The same, or at the deadline of the frame.
    pub of_frame: Interrupt,
    /// Time that does not count for the frame.
    pub paused: Paused,
}
