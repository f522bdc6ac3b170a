//! The point spread function: how the light of a star falls on the pixels.
//!
//! `gaussian`: a round Gaussian integrated over the pixels, and sums of such. `effective`: the spot
//! of a frame whose stars are not round, as it changes over the field; `table` and `field_tables`
//! tabulate it, and `taps` finds the samples that a pixel takes. `lanes`: arithmetic of groups of
//! pixels. `measured`: the PSF of a frame, measured on its bright stars.

mod effective;
mod field_tables;
mod gaussian;
mod lanes;
pub(super) mod measured;
mod table;
mod taps;

pub(crate) use effective::{
    EffectivePsf, FIELD_TERMS, FieldComponent, FieldForm, FieldFrame, FieldMoments, LocalPsf,
    SpotMoments, covariance, covariance_by, inverse, polynomials, stretch_by,
};
pub(crate) use field_tables::FieldTables;
pub(crate) use gaussian::{
    AxisProfile, Cumulative, GROUP_PX, GaussianComponent, LitPart, MAX_TAPS, MAX_WINDOW_PX,
    NarrowProfiles, PIXEL_VARIANCE_PX2, PixelGroup, ProfilePart, centered_profile, erf_and_gauss,
};
pub(crate) use lanes::{each, each_of, plus, times};
pub(crate) use table::{DrawBuffers, LIGHT, LIGHT_BY_ALL, LIGHT_BY_PLACE, ShareGroup};
