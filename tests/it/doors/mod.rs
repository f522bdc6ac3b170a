//! Command lines and protocols of other solvers, through the program.

mod solve_field;
