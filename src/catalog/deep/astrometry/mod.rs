//! Index files of astrometry.net: the stars in them, not their quads.
//!
//! A file has a tree of the stars' unit vectors, and a table with what else is known of each, in the same
//! order: magnitudes, and in some series proper motions. Files of the 5200 series without that table have
//! only the rank of each star by brightness, in 256 steps (`sweep`).
//!
//! # Reference
//! The source of astrometry.net (dstndstn/astrometry.net): `libkd`, `util/starkd.c`, `solver/merge-index.c`.

mod index_file;
mod magnitude;
mod tree;

pub use index_file::IndexFile;
