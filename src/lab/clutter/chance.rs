//! Random numbers that several drawings need.

use super::canvas::ClutterCanvas;
use crate::base::coords::PixelPoint;
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// A number between the two, uniform in its logarithm.
pub(super) fn log_uniform(random: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    low * libm::pow(high / low, random.random())
}

/// A normal deviate.
pub(super) fn normal(random: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(random)
}

/// A place on the frame.
pub(super) fn place(canvas: &ClutterCanvas, random: &mut ChaCha8Rng) -> PixelPoint {
    PixelPoint::new(
        random.random_range(0.0..canvas.width as f64),
        random.random_range(0.0..canvas.height as f64),
    )
}
