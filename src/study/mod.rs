//! Is it good enough? Validation with simulated frames, robustness of the identification, and the
//! experiments of a paper.

pub mod defocus;
pub mod experiment;
pub mod robustness;
pub mod validation;
