//! How clouds differ from star to star: how well the stars around a place tell the mean over it.
//!
//! Neighboring stars are behind the same clouds as far as these are even. What their extinctions differ beyond
//! their errors is the clouds' texture.

use super::cases::{CLEAR_MAG, CLOUD_VARIATION};
use crate::base::statistics::Estimate;
use crate::sky::neighbor::neighbor;
use crate::sky::star_counts::{CellStar, CloudInputs};

/// Variance of the extinction from star to star, as in the neighborhood of a cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Texture {
    /// In clear air and thin clouds, in squared magnitudes.
    thin_mag2: f64,
    /// Over the squared extinction, in clouds.
    of_square: f64,
}

impl Texture {
    /// Of the clouds over `sky`.
    pub(super) fn measure(sky: &CloudInputs, cell_stars: &[CellStar]) -> Self {
        /// Larger differences are those of variable stars and wrong names.
        const LARGEST_MAG: f64 = 1.5;
        /// Pairs that a frame has beforehand.
        const BEFOREHAND: f64 = 10.0;
        let dimmed = cell_stars.iter().filter_map(|cell_star| {
            let by = sky.clear_sky.dimmed_by(cell_star.star)?;
            Some(((cell_star.star.direction, by.sigma), by))
        });
        let (places, dimmed): (Vec<_>, Vec<Estimate>) = dimmed.unzip();
        let [mut thin, mut thin_pairs] = [0.0, BEFOREHAND];
        let (mut cloud, mut squares) = (
            BEFOREHAND * (CLOUD_VARIATION * CLEAR_MAG).powi(2),
            BEFOREHAND * CLEAR_MAG.powi(2),
        );
        for (one, star) in dimmed.iter().enumerate() {
            let Some(other) = neighbor(&places, one).map(|other| dimmed[other]) else {
                continue;
            };
            let apart_mag = star.value - other.value;
            let mean_mag = 0.5 * (star.value + other.value);
            if apart_mag.abs() > LARGEST_MAG {
                continue;
            }
            let noise_mag2 = star.sigma.powi(2) + other.sigma.powi(2);
            let excess_mag2 = 0.5 * (apart_mag.powi(2) - noise_mag2);
            if mean_mag < 0.5 * CLEAR_MAG {
                thin += excess_mag2;
                thin_pairs += 1.0;
            } else {
                cloud += excess_mag2;
                squares += mean_mag.powi(2);
            }
        }
        Self {
            thin_mag2: (thin / thin_pairs).max(0.0),
            of_square: (cloud / squares).max(0.0),
        }
    }

    /// The variance from star to star where the mean of the squared extinction is this.
    pub(super) fn variance_mag2(&self, square_mag2: f64) -> f64 {
        self.thin_mag2 + self.of_square * square_mag2
    }
}
