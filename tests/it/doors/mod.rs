//! Programs that call other solvers: what they pass, and how they read the answer.

mod astap;
