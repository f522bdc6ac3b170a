//! What do flats say about a detector? Response of each pixel, gain and read noise.
//!
//! [`Frame`](crate::frame::Frame)s and a dark → [`FlatStack`] → [`Flats`]
//!
//! 1. The dark is subtracted from each frame, and the frame is divided by its mean: the light may
//!    change from frame to frame.
//! 2. Mean and variance of every pixel over the frames. The mean, normalized to 1 over the frame,
//!    is the master flat.
//! 3. The gain g by photon transfer: the variance of the difference of two frames of the same light
//!    is twice that of a pixel, V = R² + S / g, with read noise R and signal S in ADU. The first
//!    and second frame are a pair, the third and fourth, and so on. Pairs of different light give a
//!    straight line, with g from its slope and R from its intercept; with one light, R must be
//!    known.
//! 4. The nonuniformity of the response: over the frame, including lens and light, and from pixel
//!    to pixel.
//!
//! Caveats: the light must be even over the field, as from the sky or a screen; any unevenness goes
//! into the flat. A nonlinear response gives a wrong gain.
//!
//! # Reference
//! Janesick 2007, Photon Transfer, doi 10.1117/3.725073, ch. 5; EMVA Standard 1288, release 4.0
//! (2021), sect. 6.6 and 8.

mod error;
mod report;
mod stack;
mod transfer;

pub use error::{FlatsError, MAX_SATURATED_FRACTION};
pub use report::{FlatRow, FlatsReport, PairReport};
pub use stack::{FlatConfig, FlatFrame, FlatStack, Flats};
pub use transfer::{Gain, GainMethod, PairPoint};

#[cfg(test)]
mod tests;
