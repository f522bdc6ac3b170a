//! What `process` and `identify` share: each input is solved, its report printed, its result files
//! written.

mod frame_table;
mod images;
pub(crate) mod options;
mod overlay_args;
mod printer;
mod reports;
mod result_files;
mod solver;

pub(crate) use images::{Inputs, SolvedImage};
pub(crate) use reports::{SolvingPlan, report_all};
pub(crate) use solver::{InputSolver, Sink};
