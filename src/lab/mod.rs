//! The laboratory: simulated frames, and what they prove. Validation, robustness of identification, frames with
//! clutter, skies, the radius of a defocused star's spot, and the experiments of the paper.

#[doc(hidden)]
pub mod clutter;
#[doc(hidden)]
pub mod defocus;
#[doc(hidden)]
pub mod experiment;
#[doc(hidden)]
pub mod night_sky;
#[doc(hidden)]
pub mod robustness;
pub mod simulate;
#[doc(hidden)]
pub mod spot_radius;
mod trials;
#[doc(hidden)]
pub mod validation;

#[doc(hidden)]
pub use trials::StudyError;
