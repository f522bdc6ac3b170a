//! Step 3: the threshold, from the wanted number of false detections and the noise of the frame.

pub(crate) mod false_alarms;
pub(crate) mod pixel_noise;

pub(crate) use pixel_noise::{NoiseWork, PixelNoise, StarFree, Weights, threshold_for_photons};
