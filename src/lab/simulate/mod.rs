//! What frame would a camera record of known stars? Simulated frames with ground truth.
//!
//! [`Setup`] (scenario, [`Scene`]), catalogue stars, [`Pointing`], seed → [`Simulator`] →
//! [`Frame`](crate::frame::Frame), [`Truth`]
//!
//! 1. The position of each star on the detector at the date, through the lens with its distortion;
//!    its expected electrons by the sensitivity model
//!    ([`StarLight`](crate::predict::StarLight): magnitude and color), reduced by
//!    clouds and vignetting.
//! 2. The sky in each pixel: uniform, with a gradient, moonlight, clouds.
//! 3. The spot of each star, integrated over pixels, along its path while the camera turns;
//!    satellite trails likewise.
//! 4. The response of each pixel, and its dark current.
//! 5. Whole electrons (Poisson), cosmic rays, and blooming of full pixels.
//! 6. Read-out: read noise, gain, bias, quantisation.
//!
//! Random numbers depend on the seed only, those of the detector's fixed pattern on the camera's
//! pattern seed only: a frame is the same on any number of threads. Mathematical functions are
//! those of [`libm`], so a frame is the same on every machine.
//!
//! Caveats: aberrations are those of rays, without diffraction. Pixels are square ([`camera_of`]). Sky,
//! stars and angular rate are constant during the exposure. Charge blooms along columns only.

mod aberrations;
mod camera;
mod color_camera;
mod equivalent_spot;
mod image;
mod lights;
mod milky_way;
mod motion;
mod pattern;
mod poisson;
mod radial_profile;
mod readout;
mod scene;
mod setup;
mod simulator;
mod sky;
mod skyline;
mod spot;
mod stars;
mod strays;
mod true_sky;
mod truth;
mod truth_table;

pub use camera::Pointing;
pub use camera::camera_of;
pub(crate) use color_camera::{color, decoded_jpeg, demosaiced};
pub use scene::Scene;
pub use setup::Setup;
pub use setup::SetupParameter;
pub use simulator::Simulator;
pub use simulator::star_field;
pub use strays::{CosmicRay, Trail};
pub(crate) use true_sky::TrueSky;
pub use truth::{TrueStar, Truth};
pub use truth_table::{TruthRow, truth_table};
