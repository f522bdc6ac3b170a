//! The spot size and the noise model of a frame: peaks -> [`StarModel`].
//!
//! 1. Bright, isolated stars are fitted with a free size (`bright_stars`).
//! 2. The mode of the sizes is the frame's spot size (`spot_size`).
//! 3. The residuals of the stars of that size give the noise model (`noise_model`).

mod bright_stars;
mod noise_model;
mod non_gaussian;
mod spot_size;

pub(crate) use bright_stars::{BrightPeak, fit_bright_stars, isolated_peaks};
pub(crate) use noise_model::{StarModel, noise_of, rough_star_model, star_model};
pub(crate) use spot_size::{
    BrightStars, DEFAULT_SPOT_PX, MAX_STARS, SpotSize, spot_size, weighted_size,
};
