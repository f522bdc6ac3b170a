//! Tests of the program and of the public library: one test program, since each would be linked with
//! everything.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on should stop")]

mod accuracy;
mod apparent;
mod archive;
mod brightest_stars;
mod calibrate;
mod catalog;
mod catalog_kinds;
mod cli;
mod clutter;
mod common;
mod comparison;
mod completeness;
mod darks;
mod defocus;
mod detect;
mod diagnosis;
mod experiment;
mod faults;
mod fixtures;
mod frames;
mod identify;
mod interrupt;
mod layering;
mod lenses;
mod limit;
mod limits;
mod no_sky;
mod odd_use;
mod orientation;
mod output_files;
mod photometry;
mod real_sky;
mod robustness;
mod schema;
mod simulate;
mod simulate_files;
mod sky_area;
mod solar_system;
mod spots;
mod terminal;
mod tiles;
mod track;
mod validate;
