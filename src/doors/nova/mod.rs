//! What do callers of nova.astrometry.net ask and read?
//!
//! The body of a request → the parts of its form ([`form`]); the settings of an upload → its hints, or its list
//! of stars ([`Upload`]); ([`FrameReport`](crate::report::FrameReport), [`Solution`](crate::solve::Solution)) →
//! what the routes of a job answer ([`JobAnswers`]).
//!
//! # Reference
//! astrometry.net: `doc/net/api.rst`, `net/api.py` and `net/client/client.py` of 2023.

mod answers;
pub mod form;
mod upload;

pub use answers::{Calibration, JobAnswers, MarkedObject, NoteOfJob};
pub use upload::{SettingError, Upload};
