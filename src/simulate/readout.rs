//! From expected electrons to grey levels.

use crate::sensor::Sensor;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Poisson, StandardNormal};

/// The level of a full pixel varies with the noise of reading: so many standard deviations below its mean a pixel counts as
/// saturated.
const FULL_WELL_SIGMAS: f64 = 4.0;

/// What becomes of the charge in a pixel.
#[derive(Debug, Clone)]
pub(super) struct Readout {
    full_well_e: f64,
    read_noise_e: f64,
    gain_e_per_adu: f64,
    bias_adu: f64,
    full_scale_adu: f64,
}

impl Readout {
    pub(super) fn of(sensor: &Sensor) -> Self {
        Self {
            full_well_e: sensor.full_well_e,
            read_noise_e: sensor.read_noise_e,
            gain_e_per_adu: sensor.gain_e_per_adu,
            bias_adu: sensor.bias_adu,
            full_scale_adu: sensor.full_scale_adu(),
        }
    }

    /// The grey level from which on a pixel is taken to be saturated.
    pub(super) fn saturation_adu(&self) -> f64 {
        let surely_full_e = self.full_well_e - FULL_WELL_SIGMAS * self.read_noise_e;
        let full_adu = self.bias_adu + surely_full_e / self.gain_e_per_adu;
        full_adu.floor().min(self.full_scale_adu)
    }

    /// The grey levels of pixels in which so many electrons are expected.
    pub(super) fn grey_levels(&self, expected_e: &[f64], seed: u64) -> Vec<f32> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut charge = Charge::default();
        let level = |&mean_e: &f64| {
            let collected_e = charge.sample(mean_e, &mut random).min(self.full_well_e);
            let noise_e = self.read_noise_e * normal(&mut random);
            let level_adu = self.bias_adu + (collected_e + noise_e) / self.gain_e_per_adu;
            level_adu.round().clamp(0.0, self.full_scale_adu) as f32
        };
        expected_e.iter().map(level).collect()
    }
}

fn normal(random: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(random)
}

/// Electrons where a number of them is expected. Most pixels expect the same: its distribution is kept.
#[derive(Default)]
struct Charge {
    mean_e: f64,
    distribution: Option<Poisson<f64>>,
}

impl Charge {
    fn sample(&mut self, mean_e: f64, random: &mut ChaCha8Rng) -> f64 {
        if mean_e != self.mean_e {
            self.mean_e = mean_e;
            // There is none for a mean of 0, whose electrons are none, nor beyond 10¹⁹, which fills any pixel.
            self.distribution = Poisson::new(mean_e).ok();
        }
        self.distribution
            .as_ref()
            .map_or(mean_e, |poisson| poisson.sample(random))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sensor::Preset;

    #[test]
    fn charge_has_the_mean_and_variance_of_a_poisson_distribution() {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let mut charge = Charge::default();
        let count = 100_000;
        for mean_e in [0.0, 0.3, 5.0, 80.0, 4e4] {
            let samples: Vec<f64> = (0..count)
                .map(|_| charge.sample(mean_e, &mut random))
                .collect();
            let mean = samples.iter().sum::<f64>() / f64::from(count);
            let squares = samples.iter().map(|sample| (sample - mean).powi(2));
            let variance = squares.sum::<f64>() / f64::from(count - 1);
            // Five standard errors; the variance's own is √(2 + 1/mean) of it.
            let n = f64::from(count);
            assert!((mean - mean_e).abs() <= 5.0 * (mean_e / n).sqrt(), "{mean}");
            let error = mean_e * ((2.0 + 1.0 / mean_e.max(1e-9)) / n).sqrt();
            assert!((variance - mean_e).abs() <= 5.0 * error, "{variance}");
        }
    }

    #[test]
    fn a_full_pixel_and_the_end_of_the_scale_saturate() {
        let mut sensor = Preset::Experiment1.sensor();
        let levels = |sensor: &Sensor| {
            let readout = Readout::of(sensor);
            let levels = readout.grey_levels(&[1e6; 10_000], 1);
            (readout.saturation_adu() as f32, levels)
        };
        let (saturation, full) = levels(&sensor);
        let below = full.iter().filter(|level| **level < saturation).count();
        assert!(below < 5 && saturation < 4095.0, "{below}");
        sensor.full_well_e = 1e7;
        let (saturation, clipped) = levels(&sensor);
        assert_eq!(saturation, 4095.0);
        assert!(clipped.iter().all(|level| *level == 4095.0));
    }
}
