//! What `process` and `identify` share: every input is solved, its report printed, its files written.

pub(crate) mod options;
pub(crate) mod output;
mod run;

pub(crate) use run::{Plan, solve_all};
