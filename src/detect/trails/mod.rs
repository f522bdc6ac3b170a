//! Light along lines: stars of frames during which the camera or the sky moved ([`stars`]), and what crosses
//! a frame ([`satellites`]).

mod satellites;
mod stars;

pub use satellites::Trail;
pub(super) use satellites::TrailSearch;
pub(super) use stars::{Trails, measure_trailed};
