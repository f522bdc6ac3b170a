//! The spot size and the noise model of a frame, from its own bright stars.

pub(crate) mod calibrate;
