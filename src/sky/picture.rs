//! The pixels in which the sky is measured.

use super::curve_evidence::CurveEvidence;
use super::dark_level::DarkLevel;
use crate::base::coords::{Icrs, UnitVector};
use crate::frame::Frame;
use crate::photometry::PictureColors;

/// A frame's pixels, and what is known of their light.
pub(crate) struct SkyPicture<'a, 'p> {
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
    /// What other frames tell of its tone curve.
    pub usual_curves: Option<&'a CurveEvidence>,
    /// Whether the loss of light towards the corners is known, and was removed or is stated.
    pub is_flat: bool,
    /// Where the Moon is, where the date is known.
    pub moon: Option<UnitVector<Icrs>>,
}

impl SkyPicture<'_, '_> {
    /// Whether it has eight bits: most files of so few have a tone curve.
    pub(super) fn has_eight_bits(&self) -> bool {
        self.frame.saturation_adu == Some(f32::from(u8::MAX))
    }
}
