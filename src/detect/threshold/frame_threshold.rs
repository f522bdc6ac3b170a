//! The threshold for a frame: for Gaussian noise first, then raised for the noise that the frame
//! has.

use super::false_alarms::{for_estimated_noise, threshold_for_rate};
use super::filter_weights::FilterWeights;
use super::photons::{photon_skewness, threshold_for_photons};
use super::pixel_noise::PixelNoise;
use super::star_free::{NoiseBuffers, StarFree};
use crate::base::size::Size;
use crate::detect::background::{FrameBackground, Mesh, median};
use crate::detect::config::DetectConfig;
use crate::detect::detection::NoiseTail;
use crate::detect::filter::Kernel;
use crate::detect::pixels::{BlockMaxima, View};
use crate::detect::psf::PIXEL_VARIANCE_PX2;

/// Coarse noise is measured again where it raises the threshold by more than this.
const REPEAT_AT_RAISE: f64 = 0.2;

/// The threshold for Gaussian noise that is measured on the frame itself, in standard deviations.
pub(crate) fn gaussian_threshold(
    config: &DetectConfig,
    size: Size,
    cell_px: usize,
    spot_px: f64,
    kernel: &Kernel,
) -> f64 {
    let u = threshold_for_rate(config.false_alarms_per_mpx, kernel.rho, kernel.rho);
    for_estimated_noise(u, noise_degrees(size, cell_px, spot_px))
}

/// The degrees of freedom of the local noise estimate: the independent samples in a cell (a value
/// of the filtered frame is correlated with 2πs² pixels), and a gain of 5 from the median of 3x3
/// cells.
fn noise_degrees(size: Size, cell_px: usize, spot_px: f64) -> f64 {
    const SMOOTHING_GAIN: f64 = 5.0;
    const EFFICIENCY: f64 = 0.8;
    let cell = (size.width.min(cell_px) * size.height.min(cell_px)) as f64;
    let cells = (size.pixels() as f64 / cell).max(1.0);
    let correlated = std::f64::consts::TAU * (spot_px.powi(2) + PIXEL_VARIANCE_PX2);
    (EFFICIENCY * cell / correlated.max(1.0) * SMOOTHING_GAIN.min(cells)).max(3.0)
}

/// A filtered frame whose threshold is wanted.
pub(crate) struct FrameNoise<'a> {
    /// The frame.
    pub view: &'a View<'a>,
    /// Its background and noise.
    pub background: &'a FrameBackground,
    /// Mean and noise of the filtered frame.
    pub filtered_mesh: &'a Mesh,
    /// The maxima of the blocks of the filtered frame that hold candidates.
    pub filtered_maxima: &'a BlockMaxima,
}

impl FrameNoise<'_> {
    /// The threshold `u` for Gaussian noise, raised for the longer tail that the frame's noise has.
    pub fn raised_threshold(
        &self,
        u: f64,
        spot_px: f64,
        filter: &FilterWeights,
        buffers: &mut NoiseBuffers,
    ) -> f64 {
        let mesh = &self.background.mesh;
        if self.background.is_coarse || self.background.cut_off.is_any() {
            return self.raised_for_histogram(u, filter, buffers);
        }
        let star_free = self.star_free(u);
        let skewness = photon_skewness(self.view, mesh, &star_free, spot_px, buffers);
        skewness.map_or(u, |s| threshold_for_photons(u, s, filter))
    }

    /// What may make large values of the filtered noise more frequent than in independent noise.
    pub fn tail(&self, buffers: &mut NoiseBuffers) -> Option<NoiseTail> {
        if self.background.cut_off.is_any() {
            Some(NoiseTail::CutOff)
        } else if self.background.is_coarse {
            Some(NoiseTail::Coarse)
        } else {
            let is_correlated = self.is_correlated(buffers);
            is_correlated.then_some(NoiseTail::Correlated)
        }
    }

    fn is_correlated(&self, buffers: &mut NoiseBuffers) -> bool {
        /// Noise of the filtered frame, in units of that of independent pixels.
        const INDEPENDENT: std::ops::RangeInclusive<f64> = 0.85..=1.15;
        /// Clouds and crowded stars reach 0.25, JPEGs have 0.3 to 0.8.
        const MIN_CORRELATION: f64 = 0.3;
        let of_filtered = median(&self.filtered_mesh.sigma, &mut buffers.sorted);
        let sigma_adu = self.background.median_sigma_adu as f32;
        !INDEPENDENT.contains(&of_filtered)
            && correlation_of_neighbors(self.view, sigma_adu, &mut buffers.row) > MIN_CORRELATION
    }

    /// The threshold `u` raised for noise that is coarse or cut off, by the distribution of the
    /// pixels: where it is cut off, of those of which little is.
    fn raised_for_histogram(
        &self,
        u: f64,
        filter: &FilterWeights,
        buffers: &mut NoiseBuffers,
    ) -> f64 {
        let floor = f64::from(self.filtered_mesh.sigma_floor);
        let is_at_floor = median(&self.filtered_mesh.sigma, &mut buffers.sorted) <= floor * 1.001;
        let mut raised = |limit: f64| {
            let star_free = self.star_free(limit);
            let noise = PixelNoise::measure(self.view, &self.background.mesh, &star_free, buffers);
            noise.map_or(u, |n| {
                let known_sigma = is_at_floor.then_some(floor / n.sigma);
                n.threshold(u, filter, known_sigma)
            })
        };
        // The isolated pixels of coarse noise are high, but they are not stars.
        let limit = if self.background.is_coarse {
            2.0 * u
        } else {
            u
        };
        let first = raised(limit);
        if first > limit + REPEAT_AT_RAISE {
            // Pixels between the two limits were left out, but are noise.
            raised(first)
        } else {
            first
        }
    }

    /// The part of the frame where the filtered frame stays below `limit` standard deviations.
    fn star_free(&self, limit: f64) -> StarFree<'_> {
        StarFree {
            maxima: self.filtered_maxima,
            filtered_mesh: self.filtered_mesh,
            cut_off: &self.background.cut_off,
            limit: limit as f32,
        }
    }
}

/// The correlation of the noise of pixels that are next to each other in a row, less that of
/// pixels three columns apart, which a structured background has as well: from the mean absolute
/// differences, in a sample of rows. `sigma` is the noise.
fn correlation_of_neighbors(view: &View<'_>, sigma: f32, row: &mut Vec<f32>) -> f64 {
    const SAMPLED_ROWS: usize = 32;
    const FAR_PX: usize = 3;
    /// Larger differences are those of stars and edges.
    const MAX_SIGMAS: f32 = 4.0;
    let largest = MAX_SIGMAS * sigma;
    let (mut near, mut far) = (0.0, 0.0);
    for y in (0..view.height).step_by((view.height / SAMPLED_ROWS).max(1)) {
        for pixels in view.row(y).as_floats(row).windows(FAR_PX + 1) {
            let to_next = (pixels[1] - pixels[0]).abs();
            let to_far = (pixels[FAR_PX] - pixels[0]).abs();
            if to_next < largest && to_far < largest {
                near += f64::from(to_next);
                far += f64::from(to_far);
            }
        }
    }
    if far > 0.0 {
        1.0 - (near / far).powi(2)
    } else {
        0.0
    }
}
