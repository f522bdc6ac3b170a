//! What instrument: its geometry (which direction each pixel looks in) and its data sheet.

pub mod data_sheet;
mod geometry;

pub use geometry::*;
