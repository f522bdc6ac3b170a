//! The pixels in which the sky is measured.

use crate::base::coords::{Icrs, UnitVector};
use crate::frame::Frame;

/// A frame's pixels, and what is known of their light.
#[doc(hidden)]
pub struct Picture<'a> {
    /// The calibrated frame.
    pub frame: &'a Frame<'a>,
    /// Level of a pixel without light, in ADU, where it is known.
    pub dark_adu: Option<f64>,
    /// Whether the loss of light towards the corners is known, and was removed or is stated.
    pub is_flat: bool,
    /// Where the Moon is, where the date is known.
    pub moon: Option<UnitVector<Icrs>>,
}
