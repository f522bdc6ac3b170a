//! What `process` and `identify` share: each input is solved, its report printed, its result files
//! written.

pub(crate) mod options;
mod printer;
pub(crate) mod result_files;
mod run;

pub(crate) use run::{Finish, Plan, solve_all, workspace};
