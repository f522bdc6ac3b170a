//! Is it good enough: validation over simulated frames, robustness of identification, and the paper's experiments.

pub mod defocus;
pub mod experiment;
pub mod robustness;
pub mod validation;
