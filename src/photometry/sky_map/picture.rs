//! The pixels in which the sky is measured.

use super::dark_level::DarkLevel;
use crate::base::coords::{Icrs, UnitVector};
use crate::frame::Frame;
use crate::photometry::PictureColors;

/// A frame's pixels, and what is known of their light.
#[doc(hidden)]
pub struct Picture<'a, 'p> {
    /// The calibrated frame, without a mosaic.
    pub frame: &'a Frame<'a>,
    /// What fluxes were multiplied with: levels are as well.
    pub flux_scale: f64,
    /// Reads its colors, where it has some.
    pub colors: &'a dyn Fn() -> Option<PictureColors<'p>>,
    /// Level of a pixel without light, where it is stated.
    pub dark: Option<DarkLevel>,
    /// The same by other frames, where this one does not tell it.
    pub usual_dark: Option<DarkLevel>,
    /// Whether the loss of light towards the corners is known, and was removed or is stated.
    pub is_flat: bool,
    /// Where the Moon is, where the date is known.
    pub moon: Option<UnitVector<Icrs>>,
}
