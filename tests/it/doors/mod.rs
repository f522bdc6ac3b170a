//! Command lines and protocols of other solvers, through the program: what their callers pass, and how they read
//! the answer.

mod astap;
mod serve;
mod solve_field;
