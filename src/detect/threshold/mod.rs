//! The threshold: wanted number of false detections, and noise of the frame -> standard deviations
//! of the filtered noise.
//!
//! 1. Gaussian noise: the rate of local maxima above a threshold, solved for the threshold
//!    (`false_alarms`).
//! 2. Other noise has longer tails. Photon noise is skewed (`photons`); noise below a quantisation
//!    step, and noise of which little is cut off at zero, are measured whole (`pixel_noise`). Both
//!    are measured where no star is (`star_free`); what they make of the tail of the filtered noise
//!    is in `saddlepoint`.
//! 3. Where much of the noise is cut off, each cell gets a threshold of its own (`cut_off_noise`).
//! 4. Coarse noise that is correlated, as in JPEGs, has the tail that the negative of the frame shows
//!    (`negative`).
//! 5. `frame_threshold` decides which of these holds for a frame.

mod cut_off_noise;
mod false_alarms;
mod filter_weights;
mod frame_threshold;
mod negative;
mod photons;
mod pixel_noise;
mod saddlepoint;
mod star_free;

pub(crate) use cut_off_noise::raise_filtered_noise;
pub(crate) use filter_weights::FilterWeights;
pub(crate) use frame_threshold::{FrameNoise, gaussian_threshold};
pub(crate) use negative::Extrema;
pub(crate) use photons::threshold_for_photons;
pub(crate) use star_free::NoiseBuffers;
