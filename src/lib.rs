//! From a photograph of the night sky to the stars in it, where the camera pointed, and how sure that is.

pub mod angle;
pub mod attitude;
pub mod calibration;
pub mod camera;
pub mod catalog;
pub mod comparison;
pub mod coords;
pub mod darks;
pub mod defocus;
pub mod detect;
pub mod diagnosis;
pub mod epoch;
pub mod experiment;
pub mod files;
pub mod flats;
pub mod frame;
pub mod identify;
pub mod observer;
#[cfg(feature = "overlay")]
pub mod overlay;
pub mod photometry;
pub mod pipeline;
pub mod report;
pub mod robustness;
pub mod sensitivity;
pub mod sensor;
pub mod simulate;
pub mod statistics;
pub mod units;
pub mod validation;
pub mod wcs;

#[doc = include_str!("../docs/conventions.md")]
pub mod conventions {}

/// The README's code, compiled.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadmeExamples;
