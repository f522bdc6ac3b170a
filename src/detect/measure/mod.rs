//! Step 6: positions, fluxes and flags of the sources.

mod brightest;
mod centroid;
mod core;
mod estimate;
mod known_spots;
mod measurement;
mod pairs;
mod ring;
mod saturated_area;
mod shape;
mod star_shape;

pub(crate) use brightest::{BrightestStars, spot_size_px};
pub(crate) use estimate::clamp_to_frame;
pub(crate) use measurement::{MeasureBuffers, Measurement};
pub(crate) use ring::Ring;
pub(crate) use shape::sharpest_px;
pub(crate) use star_shape::{StarShape, ellipticity_of};
