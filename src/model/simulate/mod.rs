//! Frames with truth: what a camera would make of known stars.
//!
//! [`Simulator`] of a [`Scenario`], a [`Scene`] and catalogue stars; [`Pointing`], seed → [`Frame`], [`Truth`]
//!
//! 1. Each star's place on the detector, at the date, through the lens with its distortion; its expected electrons by the
//!    sensitivity model ([`StarLight`]: magnitude and colour), less what clouds and vignetting take.
//! 2. The sky in each pixel: even, with a gradient, moonlight, clouds.
//! 3. Each star's spot, integrated over each pixel, along its way while the camera turns; trails of satellites likewise.
//! 4. The response of each pixel, and its dark current.
//! 5. Whole electrons (Poisson), cosmic rays, and what flows out of a full pixel.
//! 6. What is read out: noise of reading, gain, bias, whole grey levels of so many bits.
//!
//! The random numbers depend on the seed alone, those of the detector's pattern on the camera's own: the same frame on any
//! number of threads. Where a function of the mathematical library decides, it is that of [`libm`], which is the same on
//! every machine.
//!
//! Caveats: one spot for the whole field. Pixels are square ([`camera_of`]). A sky, a star and an angular rate do not vary
//! during the exposure. Charge flows along columns only.

mod camera;
mod image;
mod motion;
mod pattern;
mod poisson;
mod readout;
mod scene;
mod setup;
mod simulator;
mod sky;
mod spot;
mod stars;
mod strays;
mod truth;

pub use camera::{Pointing, camera_of};
pub use scene::{SCENE_KEYS, Scene};
pub use setup::{Setup, SetupParameter};
pub use simulator::{Simulator, star_field};
pub use strays::{CosmicRay, Trail};
pub use truth::{TrueStar, Truth};
