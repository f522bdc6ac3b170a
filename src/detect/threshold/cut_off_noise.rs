//! The threshold where the noise is cut off at the frame's lowest value.
//!
//! What is left of such noise is skewed, the more the deeper the cut is. So each cell gets a factor
//! of its own: the quantile of the filtered noise that is left, by the saddlepoint approximation,
//! over that of Gaussian noise.

use super::filter_weights::FilterWeights;
use super::saddlepoint::{CumulantTable, saddlepoint_quantile};
use crate::detect::background::{CensoredNoise, CutOff, MAX_DEPTH, Mesh, REACH_SIGMA};

/// Steps of depth at which the factor is computed; between, it is linear.
const STEPS: usize = 18;

/// Raises the noise in the mesh of the filtered frame where the noise of the frame is cut off, so
/// that the filtered noise exceeds `u` there as often as Gaussian noise does.
///
/// Clipping at ±3σ leaves too little of skewed noise: its standard deviation is at least that of
/// independent pixels, 1.
pub(crate) fn raise_filtered_noise(
    cut_off: &CutOff,
    filtered_mesh: &mut Mesh,
    u: f64,
    filter: &FilterWeights,
) {
    if !cut_off.is_any() {
        return;
    }
    let first = -f64::from(REACH_SIGMA);
    let step = (MAX_DEPTH - first) / STEPS as f64;
    let factor_at = |depth: f64| -> f64 {
        let noise = CensoredNoise::new(depth, cut_off.step_sigma);
        let table_step = CumulantTable::step_for(filter);
        let table = CumulantTable::new(table_step, |i| noise.cumulants(table_step * i as f64));
        let quantile = |weights: &[(f64, f64)]| saddlepoint_quantile(&table, weights, u);
        let of_frame = filter.quantile_of_frame(u, 0.0, quantile);
        (of_frame.unwrap_or(u) / u).max(1.0)
    };
    let factors: [f64; STEPS + 1] = std::array::from_fn(|i| factor_at(first + i as f64 * step));
    for (&depth, sigma) in cut_off.depth.iter().zip(&mut filtered_mesh.sigma) {
        if depth.is_finite() {
            let at = ((f64::from(depth) - first) / step).clamp(0.0, STEPS as f64);
            let lower = (at as usize).min(STEPS - 1);
            let part = at - lower as f64;
            let factor = factors[lower] + part * (factors[lower + 1] - factors[lower]);
            *sigma = sigma.max(1.0) * factor as f32;
        }
    }
}
