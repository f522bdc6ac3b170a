//! From a photograph of the night sky to the stars in it, where the camera pointed, and how sure that is.

pub mod base;
pub mod calibration;
pub mod camera;
pub mod detect;
pub mod frame;
pub mod identify;
pub mod model;
pub mod photometry;
pub mod pipeline;
pub mod report;
pub mod sky;
pub mod study;

#[doc = include_str!("../docs/conventions.md")]
pub mod conventions {}

/// The README's code, compiled.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadmeExamples;
