//! Step 5: fits of the spot model to the pixels.

mod fitter;
mod normal;
mod scene;
mod side_by_side;

pub(crate) use fitter::{
    Fit, FitConfig, MAX_SPOTS, NoiseModel, SPOT_RANGE_PX, Spot, Spots, window_radius,
};
pub(crate) use normal::{Factor, ONE_SPOT, Pixels, SpotLight, linearise, sum_of};
pub(crate) use scene::{FitWork, Scene};
