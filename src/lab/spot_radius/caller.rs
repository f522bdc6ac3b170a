//! Who waits for a study.

use crate::base::interrupt::Interrupt;

/// Who waits for a study.
pub struct Caller<'a> {
    /// Called after each point.
    pub done: &'a (dyn Fn() + Sync),
    /// Ends the study early.
    pub interrupt: &'a Interrupt,
}
