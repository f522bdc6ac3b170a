//! starpipe finds the stars in a photograph of the night sky, names them, determines where the
//! camera pointed, and says how certain each of these is.
//!
//! It is for frames of star sensors and cameras with fields from about 1.5° to the whole sky: lost in
//! space, with nothing known beforehand, or with priors, or tracked from frame to frame. Around that it
//! predicts what a camera should see, simulates frames, and validates cameras and itself on them. It
//! is not a tool for galaxies and nebulae, or for spectra.
//!
//! # The way of a frame
//!
//! ```text
//! file ─ frame ─ calibration ─ detect ─ identify ─ photometry ─ report
//!                                │         │           │
//!                             sources   catalog   predict:
//!                                      of stars   what should
//!                                                  be seen
//! ```
//!
//! [`solve`] runs the stages in this order, [`report`] presents the [`Solution`].
//!
//! # A first program
//!
//! ```no_run
//! use starpipe::{Context, FrameReport, IndexedCatalog, TextOptions, Workspace};
//!
//! fn main() -> Result<(), Box<dyn std::error::Error>> {
//!     let indexed = IndexedCatalog::built_in();
//!     let context = Context::new(&indexed);
//!     let solution = starpipe::solve_file("night.tif", None, &context, &mut Workspace::new())?;
//!     let report = FrameReport::new("night.tif", &solution, indexed.catalog());
//!     print!("{}", report.to_text(TextOptions::default()));
//!     Ok(())
//! }
//! ```
//!
//! The programs in `examples/` go on from here: `solve.rs`, `simulate.rs` and `track.rs`.
//!
//! # The rooms
//!
//! Each uses only those above it in this table.
//!
//! | module | answers |
//! |---|---|
//! | `base` | what numbers mean: units, directions, dates, statistics |
//! | [`catalog`] | which stars there are |
//! | `flight` | what does a flight computer read: stars and triangles in one block of bytes, and what that costs |
//! | [`ephemeris`] | from where and when one looks: observer, places of stars, Moon and planets |
//! | [`frame`] | what a file holds: readers, writers, metadata |
//! | [`camera`] | what instrument: geometry, data sheet, lenses in files of other programs |
//! | [`calibration`] | what the detector does to a frame: darks, flats, hot pixels |
//! | [`detect`](mod@detect) | where is light: background, threshold, centroids |
//! | [`identify`](mod@identify) | which stars, which attitude, or why not; which lens, from several frames |
//! | [`predict`] | what should be seen: the sensitivity model |
//! | [`photometry`] | how bright, how faint: zero point, completeness, comparison with the prediction |
//! | [`sky`] | how bright is the sky, how clear, and how faint do stars go at each place |
//! | [`centroids`] | what does a list of centroids hold |
//! | [`solve`] | what does a frame show: the stages in order |
//! | [`mod@track`] | where does the camera point now: from frame to frame |
//! | `annotate` | what is in a frame: names by the pose, constellations, one sentence |
//! | [`report`] | how to present it: JSON, text, tables, overlays, world coordinates |
//! | `doors` | what do other solvers' callers ask and read: solve-field, ASTAP, nova.astrometry.net |
//! | `night` | what does a night of one camera show: its series, and what changes when |
//! | `store` | results of many frames: runs that can be resumed, and their tables |
//! | [`lab`] | is it good enough: simulated frames, validation, robustness, defocus, the papers' experiments |
//!
//! Pixels, angles and coordinate systems: [`conventions`].
//!
//! # What is stable
//!
//! What these pages show changes only with the version, as semantic versioning has it;
//! `docs/public-api.txt` lists it. What is public but hidden here serves the program, the Python
//! package and their tests, and may change at any time.

// The same frame gives the same bytes on every system.
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

mod annotate;
#[doc(hidden)]
pub mod base;
pub mod calibration;
pub mod camera;
pub mod catalog;
pub mod centroids;
pub mod detect;
#[doc(hidden)]
pub mod doors;
pub mod ephemeris;
#[doc(hidden)]
pub mod flight;
pub mod frame;
pub mod identify;
pub mod lab;
#[doc(hidden)]
pub mod night;
pub mod photometry;
pub mod predict;
pub mod report;
pub mod sky;
pub mod solve;
#[doc(hidden)]
pub mod store;
pub mod track;

pub use base::clock::UtcOffset;
pub use base::coords::{Camera, Icrs, PixelPoint, Rotation, UnitVector};
pub use base::epoch::{DateError, ObservationDate};
pub use base::interrupt::{Interrupt, Interrupted};
pub use base::remedy::{OptionNames, Remedy};
pub use base::size::Size;
pub use calibration::Calibration;
pub use camera::CameraModel;
pub use catalog::{Catalog, Star};
pub use centroids::CentroidList;
pub use detect::{DetectConfig, Detection, Detections, detect};
pub use ephemeris::observer::Site;
pub use frame::Frame;
pub use identify::{
    Identification, IndexedCatalog, Priors, ScalePrior, SkyRegion, StarMatch, identify,
};
pub use nalgebra;
pub use report::{FrameReport, TextOptions};
pub use solve::{
    Context, Error, Note, Outcome, Reason, Solution, SolveOptions, Source, Workspace,
    find_pointing_in, solve_centroids, solve_file, solve_frame,
};
pub use track::{Track, Tracker};

#[doc = include_str!("../docs/conventions.md")]
pub mod conventions {}

/// The README's code, compiled.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadmeExamples;
