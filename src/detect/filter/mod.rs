//! Step 2: the matched filter: the frame in units of its noise, correlated with the spot.
//!
//! For a faint star in white noise the best statistic is `Σ P_p r_p / √ΣP²`, where `r` is the frame
//! less its background over its noise, and `P` the spot; it has unit variance. The spot is
//! separable: each row is filtered once along x, and the result along y. At the border both sums
//! run over the pixels that exist, so the variance stays one. NaN pixels count as background.

mod band;
mod convolution;
mod kernel;

pub(crate) use band::FilteredBand;
pub(crate) use convolution::normalise;
pub(crate) use kernel::Kernel;
