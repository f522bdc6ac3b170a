//! Step 5: least-squares fits of pixel-integrated Gaussians and a local background.
//!
//! Where the frame's spots are no round Gaussians, its effective PSF takes their place.
//!
//! Parameters: x, y and flux of each spot, one background, and optionally one spot size.
//! Gauss-Newton with weights 1/v from the model of the step before: `v = n² + g·m + (ε·m)²`, where
//! m is the light of the spots, n the background noise, g the shot noise per ADU and ε the relative
//! error of the spot model. The background map enters as a measurement of the background with its
//! standard error. For Gaussian and Poisson noise this is maximum likelihood to leading order, and
//! reaches the Cramér-Rao bound for signal-to-noise ratios above about 9.
//!
//! # Reference
//! Mighell 2005, doi 10.1111/j.1365-2966.2005.09208.x, for PSF fitting and its error budget.

mod background_plane;
mod batch;
mod buffers;
mod edge;
mod fitter;
mod frame_maps;
mod gauss_newton;
mod light;
mod mixture_light;
mod normal;
mod parameters;
mod ring;
mod sums;
mod window;

pub(crate) use batch::{BatchStart, MAX_BATCH_COMPONENTS};
pub(crate) use buffers::FitBuffers;
pub(crate) use fitter::AnyLight;
pub(crate) use frame_maps::FrameMaps;
pub(crate) use light::{GaussianLight, SpotLight, linearise};
pub(crate) use normal::{CholeskyFactor, NormalEquations};
pub(crate) use parameters::{
    FitConfig, MAX_SPOTS, NoiseModel, ONE_SPOT, SPOT_RANGE_PX, SpotEstimate, SpotFit, SpotGroup,
};
pub(crate) use sums::{BLOCK, Block, WindowPixels, products_in_lanes, sum_of};
pub(crate) use window::{Window, window_radius};
