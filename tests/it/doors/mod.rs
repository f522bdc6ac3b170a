//! The commands that answer in place of other solvers.

mod serve;
