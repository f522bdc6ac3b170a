//! Narrow fields: which stars of deep catalogues are searched, and in what order.
//!
//! Deep catalogues and priors → [`attempts`](plan) → the stars of a part of the sky, indexed
//! ([`DeepSky`]) → the frame's pointing → all stars around it (`around`) → the answer.

mod around;
mod plan;
mod search;
mod sky;

pub(super) use search::{Answered, InAll, identify_in_all};
pub use sky::{DeepProgress, DeepSky, IndexingWork, OnProgress};
