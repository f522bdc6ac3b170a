//! What a camera should see: the sensitivity model, the choice of defocus, and simulated frames.

#[doc(hidden)]
pub mod defocus;
pub mod sensitivity;
pub mod simulate;
