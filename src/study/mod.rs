//! How good is it? Validation with simulated frames, robustness of identification, frames with
//! clutter, skies, the radius of a defocused star's spot, and the experiments of the paper.

pub mod clutter;
pub mod defocus;
pub mod experiment;
pub mod night_sky;
pub mod robustness;
mod trials;
pub mod validation;

pub use trials::StudyError;
