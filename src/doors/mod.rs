//! What do the programs that people have already ask, and what do they read?
//!
//! Hints in the form of another solver → [`SolveOptions`](crate::solve::SolveOptions) and [`ScaleRange`];
//! [`Solution`](crate::solve::Solution) → the [`Field`], the files and the lines of that solver.
//!
//! The answers are those of [`solve`](mod@crate::solve) and [`report`](mod@crate::report); a door only translates.

pub mod astap;
mod field;
mod fits_header;
pub mod nova;
mod scale;
pub mod solve_field;

pub use field::Field;
pub use fits_header::FitsFileHeader;
pub use scale::{ScaleRange, ScaleUnit};
