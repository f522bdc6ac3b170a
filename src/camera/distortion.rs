//! What a lens does beyond the pinhole.

/// The departure of a lens from the pinhole camera, as a polynomial in the pixel offset from the centre.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Distortion {}
