//! What numbers mean: units, angles, directions, dates, statistics, least squares, and how numbers are written.

pub mod angle;
pub mod clock;
pub mod coords;
pub(crate) mod differences;
pub mod epoch;
pub(crate) mod exponential;
pub(crate) mod file_ranges;
pub mod files;
pub(crate) mod fits_tables;
pub(crate) mod fits_types;
pub mod format;
pub mod interrupt;
pub(crate) mod least_squares;
pub(crate) mod neighbors;
pub mod panics;
pub mod remedy;
pub mod sealed;
pub mod size;
pub mod statistics;
pub mod table;
pub mod units;
pub mod user_folders;
