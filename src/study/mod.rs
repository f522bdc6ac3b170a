//! How good is it? Validation with simulated frames, robustness of identification, and the
//! experiments of the paper.

pub mod defocus;
pub mod experiment;
pub mod robustness;
pub mod validation;
