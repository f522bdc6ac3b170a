//! Fixed pattern: the variation of the pixels' means over the detector, its columns and its rows.

use crate::calibration::robust::RobustMoments;

/// Standard deviations of the pixels' means, in ADU, without outliers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pattern {
    /// Of all means: pattern, and the noise left in the means.
    pub spatial_adu: f64,
    /// Of the pattern alone, columns and rows included. `None` from one frame, which does not
    /// separate pattern from noise.
    pub fixed_adu: Option<f64>,
    /// Of the columns.
    pub column_adu: f64,
    /// Of the rows.
    pub row_adu: f64,
}

impl Pattern {
    /// Measures the pattern in `means`, row-major with rows of `width`. `noise_left` is the
    /// variance of the noise left in the means, `step` the step between grey levels.
    ///
    /// The variance is the sum of those of pixels, columns and rows: s² = sₚ² + s_c² + s_r². The
    /// mean of a column has the variance s_c² + sₚ²/height, that of a row s_r² + sₚ²/width.
    ///
    /// Differences from the source: outliers are clipped, and there is no high-pass filter, so a
    /// glow or a gradient counts as columns and rows.
    /// # Reference
    /// EMVA Standard 1288, release 4.0 (2021), sect. 8.2.
    pub(super) fn measure(
        means: &[f32],
        width: usize,
        noise_left: Option<f64>,
        step: f64,
    ) -> Option<Self> {
        let floor = step / 2.0;
        let moments = RobustMoments::clipped(means, floor)?;
        let height = means.len() / width;
        let mut columns = vec![(0.0, 0_u32); width];
        let mut rows = vec![(0.0, 0_u32); height];
        for (y, row) in means.chunks(width).enumerate() {
            for (x, &mean) in row.iter().enumerate() {
                let off = f64::from(mean) - moments.mean;
                if moments.includes(f64::from(mean), floor) {
                    for (sum, count) in [&mut columns[x], &mut rows[y]] {
                        *sum += off;
                        *count += 1;
                    }
                }
            }
        }
        let variance = |lines: &[(f64, u32)]| {
            let known = lines.iter().filter(|(_, count)| *count > 0);
            let sigma = RobustMoments::of(known.map(|(sum, count)| sum / f64::from(*count))).sigma;
            sigma * sigma
        };
        let (of_columns, of_rows) = (variance(&columns), variance(&rows));
        let all = moments.sigma * moments.sigma;
        let (in_column, in_row) = (1.0 / height as f64, 1.0 / width as f64);
        let of_pixels = ((all - of_columns - of_rows) / (1.0 - in_column - in_row)).max(0.0);
        let root = |variance: f64| variance.max(0.0).sqrt();
        Some(Self {
            spatial_adu: moments.sigma,
            fixed_adu: noise_left.map(|noise| root(all - noise)),
            column_adu: root(of_columns - of_pixels * in_column),
            row_adu: root(of_rows - of_pixels * in_row),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    #[test]
    fn columns_rows_and_pixels_are_separated() {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let mut normal = |sigma: f64| -> f64 {
            sigma * Distribution::<f64>::sample(&StandardNormal, &mut random)
        };
        let (width, height) = (400, 300);
        let columns: Vec<f64> = (0..width).map(|_| normal(2.0)).collect();
        let rows: Vec<f64> = (0..height).map(|_| normal(1.0)).collect();
        let mut means: Vec<f32> = (0..width * height)
            .map(|i| (100.0 + columns[i % width] + rows[i / width] + normal(3.0)) as f32)
            .collect();
        means[7] = 4000.0;
        means[8] = f32::NAN;
        let found = Pattern::measure(&means, width, Some(1.0), 1.0).unwrap();
        // The sigma of n columns is known to 1/√(2n).
        assert!(
            (found.column_adu - 2.0).abs() < 5.0 * 2.0 / 800f64.sqrt(),
            "{found:?}"
        );
        assert!(
            (found.row_adu - 1.0).abs() < 5.0 / 600f64.sqrt(),
            "{found:?}"
        );
        assert!(
            (found.fixed_adu.unwrap() - 13f64.sqrt()).abs() < 0.15,
            "{found:?}"
        );
        let flat: Vec<f32> = (0..width * height).map(|_| normal(3.0) as f32).collect();
        let found = Pattern::measure(&flat, width, Some(9.0), 1.0).unwrap();
        assert!(
            found.column_adu < 0.1 && found.row_adu < 0.1 && found.fixed_adu.unwrap() < 0.4,
            "{found:?}"
        );
    }
}
