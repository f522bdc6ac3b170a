//! How faint a star does the camera detect?

use crate::Config;
use core::f64::consts::PI;

/// V magnitude at which half of the stars are detected.
///
/// The filter of the detection sees a star of E electrons with the signal-to-noise ratio
/// E / √(4π σ² n² + 4/3 E), where n² is the variance of a pixel in electrons and σ the star's standard deviation in
/// pixels: its own noise counts with the weights of the filter, whose squares are those of a Gaussian narrower by √2, and
/// seen through the star 4/3 of it remain.
pub fn limiting_v_mag(config: &Config) -> f64 {
    const OWN_NOISE: f64 = 4.0 / 3.0;
    let sensor = &config.sensor;
    let rounding = sensor.gain_e_per_adu * sensor.gain_e_per_adu / 12.0;
    let pixel = sensor.background_e_s * sensor.exposure_s
        + sensor.read_noise_e * sensor.read_noise_e
        + rounding;
    let noise = 4.0 * PI * config.spot_sigma_px * config.spot_sigma_px * pixel;
    let square = config.detection_sigma * config.detection_sigma;
    // E² = k² (noise + OWN_NOISE E).
    let half = 0.5 * square * OWN_NOISE;
    let electrons = half + libm::sqrt(half * half + square * noise);
    sensor.zero_point_mag - 2.5 * libm::log10(electrons / sensor.exposure_s)
}
