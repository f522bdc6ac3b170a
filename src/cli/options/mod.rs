//! Options that several commands have, and what their values stand for.

pub(crate) mod catalog;
pub(crate) mod format;
pub(crate) mod hints;
pub(crate) mod parameters;
pub(crate) mod scenario;
pub(crate) mod setup;
pub(crate) mod steps;
pub(crate) mod values;
