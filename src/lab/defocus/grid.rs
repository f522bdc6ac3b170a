//! The grid of spot radii and noises, and the centroid errors on it.

use crate::base::statistics::mean_and_squares;
use crate::predict::Spacing;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::Serialize;

/// Radii and noises at which errors are measured.
#[derive(Debug, Clone, PartialEq)]
pub struct SpotNoiseGrid {
    /// Standard deviations of the spot, increasing, in pixels.
    #[doc(alias = "sigma_s")]
    pub spots_px: Vec<f64>,
    /// Noises, increasing: fractions of full scale, or electrons.
    #[doc(alias = "sigma_g")]
    pub noises: Vec<f64>,
}

impl SpotNoiseGrid {
    /// Radii and noises of the paper, as parts of full scale.
    pub fn of_paper() -> Self {
        Self {
            spots_px: Spacing::Linear.values(0.4, 2.4, 200),
            noises: Spacing::Linear.values(2e-4, 20e-4, 100),
        }
    }

    /// Radii of usual lenses, and noises from a quarter to four times `noise_e` electrons.
    pub fn around(noise_e: f64) -> Self {
        Self {
            spots_px: Spacing::Linear.values(0.2, 2.4, 45),
            noises: Spacing::Log.values(0.25 * noise_e, 4.0 * noise_e, 9),
        }
    }
}

/// Centroid error at one radius and one noise.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ErrorPoint {
    /// Number of stars.
    pub trials: usize,
    /// Number of detected stars.
    pub found: usize,
    /// RMS distance between centroid and true position of the detected stars, in pixels (eq. 8);
    /// NaN if there are none.
    #[doc(alias = "sigma_e")]
    pub rms_px: f64,
    /// Standard error of the RMS, from the scatter of the trials.
    pub rms_sigma_px: f64,
}

impl ErrorPoint {
    /// From the squared distances of the detected stars.
    pub fn of_squares(trials: usize, squares_px2: &[f64]) -> Self {
        let count = squares_px2.len() as f64;
        let (mean, spread) = mean_and_squares(squares_px2);
        let variance = spread / (count - 1.0).max(1.0);
        let rms_px = mean.sqrt();
        Self {
            trials,
            found: squares_px2.len(),
            rms_px,
            // Propagated from the mean square through the root.
            rms_sigma_px: (variance / count).sqrt() / (2.0 * rms_px),
        }
    }

    /// Whether enough stars were detected for an unbiased error.
    pub fn is_sound(&self) -> bool {
        /// Minimum number of detected stars.
        const MIN: usize = 10;
        /// Minimum detected fraction; below, noise selects the stars.
        const MIN_PART: f64 = 0.5;
        let fewest = self.trials.min(MIN);
        self.found >= fewest
            && self.found as f64 >= MIN_PART * self.trials as f64
            && self.rms_px > 0.0
    }
}

/// The errors on a grid.
#[derive(Debug, Clone, PartialEq)]
pub struct ErrorGrid {
    /// Radii and noises.
    pub grid: SpotNoiseGrid,
    /// Row-major: all noises of the first radius, then of the next.
    pub points: Vec<ErrorPoint>,
}

impl ErrorGrid {
    /// Measures all points on the threads of the current pool and calls `done` after each.
    ///
    /// The random numbers of a point depend only on `seed` and its index.
    ///
    /// # Errors
    /// The first error of `measure`.
    pub fn measure<E: Send>(
        grid: SpotNoiseGrid,
        seed: u64,
        measure: impl Fn(f64, f64, &mut ChaCha8Rng) -> Result<ErrorPoint, E> + Sync,
        done: impl Fn() + Sync,
    ) -> Result<Self, E> {
        let noises = grid.noises.len();
        let points = (0..grid.spots_px.len() * noises)
            .into_par_iter()
            .map(|number| {
                let mut random = ChaCha8Rng::seed_from_u64(seed);
                random.set_stream(number as u64);
                let (spot_px, noise) =
                    (grid.spots_px[number / noises], grid.noises[number % noises]);
                let point = measure(spot_px, noise, &mut random);
                done();
                point
            })
            .collect::<Result<_, E>>()?;
        Ok(Self { grid, points })
    }

    /// Radius, noise and error of every point.
    pub fn rows(&self) -> impl Iterator<Item = (f64, f64, &ErrorPoint)> {
        let places = self.grid.spots_px.iter().flat_map(|&spot_px| {
            let noises = self.grid.noises.iter();
            noises.map(move |&noise| (spot_px, noise))
        });
        places
            .zip(&self.points)
            .map(|((spot_px, noise), point)| (spot_px, noise, point))
    }

    /// Errors over the radius at the noise of this index.
    pub fn at_noise(&self, number: usize) -> impl Iterator<Item = (f64, &ErrorPoint)> {
        let points = self.points[number..].iter().step_by(self.grid.noises.len());
        self.grid.spots_px.iter().copied().zip(points)
    }

    /// RMS of the errors' standard errors, in pixels: the statistical scatter of the points.
    pub fn scatter_px(&self) -> f64 {
        let squares = self.points.iter().map(|point| point.rms_sigma_px.powi(2));
        (squares.sum::<f64>() / self.points.len() as f64).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::Rng;

    #[test]
    fn an_error_has_the_standard_error_of_its_scatter() {
        // Squared distances of two normal axes are exponential: the relative standard error of the
        // root is 1/(2 √n).
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let squares: Vec<f64> = (0..40_000)
            .map(|_| -2.0 * (1.0 - random.random::<f64>()).ln())
            .collect();
        let point = ErrorPoint::of_squares(50_000, &squares);
        assert!((point.rms_px / 2f64.sqrt() - 1.0).abs() < 0.01);
        assert!((point.rms_sigma_px / point.rms_px * 400.0 - 1.0).abs() < 0.03);
        assert_eq!((point.trials, point.found), (50_000, 40_000));
        assert!(point.is_sound());
        assert!(!ErrorPoint::of_squares(100_000, &squares).is_sound());
        assert!(!ErrorPoint::of_squares(20, &[]).is_sound());
    }

    #[test]
    fn points_lie_where_the_grid_has_them() {
        let grid = SpotNoiseGrid {
            spots_px: vec![1.0, 2.0],
            noises: vec![10.0, 20.0, 30.0],
        };
        let measured = ErrorGrid::measure(
            grid,
            1,
            |spot, noise, _| Ok::<_, ()>(ErrorPoint::of_squares(1, &[(spot + noise).powi(2)])),
            || (),
        )
        .unwrap();
        for (spot, noise, point) in measured.rows() {
            assert!((point.rms_px - spot - noise).abs() < 1e-12);
        }
        let at: Vec<f64> = measured
            .at_noise(1)
            .map(|(_, point)| point.rms_px)
            .collect();
        assert_eq!(at, [21.0, 22.0]);
    }
}
