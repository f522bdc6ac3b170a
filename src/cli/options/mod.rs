//! Options that several commands share, with what they stand for.

pub(crate) mod calibration;
pub(crate) mod catalog;
pub(crate) mod format;
pub(crate) mod frames;
pub(crate) mod hints;
pub(crate) mod observer;
pub(crate) mod parameters;
pub(crate) mod scenario;
pub(crate) mod setup;
pub(crate) mod stated;
pub(crate) mod steps;
pub(crate) mod threads;
pub(crate) mod values;
