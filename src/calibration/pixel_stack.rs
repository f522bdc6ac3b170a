//! Mean and variance of every pixel over any number of frames.

/// There is not enough memory for a [`PixelStack`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("no memory for the statistics of {pixels} pixels")]
pub struct OutOfMemory {
    /// Number of pixels of a frame.
    pub pixels: usize,
}

/// Running mean and variance of every pixel. The frames are not kept. Pixels without a value are
/// skipped.
///
/// # Reference
/// Welford 1962, doi 10.1080/00401706.1962.10490022.
#[derive(Debug, Clone)]
pub struct PixelStack {
    frames: usize,
    counts: Vec<u32>,
    means: Vec<f64>,
    squares: Vec<f64>,
}

impl PixelStack {
    /// An empty stack for frames of `pixels` pixels.
    /// # Errors
    /// [`OutOfMemory`].
    pub fn new(pixels: usize) -> Result<Self, OutOfMemory> {
        fn zeros<T: Clone + Default>(pixels: usize) -> Result<Vec<T>, OutOfMemory> {
            let mut all = Vec::new();
            let reserved = all.try_reserve_exact(pixels);
            reserved.map_err(|_| OutOfMemory { pixels })?;
            all.resize(pixels, T::default());
            Ok(all)
        }
        Ok(Self {
            frames: 0,
            counts: zeros(pixels)?,
            means: zeros(pixels)?,
            squares: zeros(pixels)?,
        })
    }

    /// Adds the pixels of a frame, row-major; NaN is skipped.
    pub fn add(&mut self, pixels: impl Iterator<Item = f32>) {
        self.frames += 1;
        let moments = self.means.iter_mut().zip(&mut self.squares);
        for (pixel, (count, (mean, squares))) in pixels.zip(self.counts.iter_mut().zip(moments)) {
            if pixel.is_nan() {
                continue;
            }
            *count += 1;
            let off = f64::from(pixel) - *mean;
            *mean += off / f64::from(*count);
            *squares += off * (f64::from(pixel) - *mean);
        }
    }

    /// Number of frames added.
    pub fn frames(&self) -> usize {
        self.frames
    }

    /// The mean of every pixel; NaN if it never had a value.
    pub fn means(&self) -> Vec<f32> {
        let mean = |(&mean, &count): (&f64, &u32)| if count == 0 { f32::NAN } else { mean as f32 };
        self.means.iter().zip(&self.counts).map(mean).collect()
    }

    /// The sum of squared deviations of a pixel from its mean, and the degrees of freedom.
    fn squares(&self, pixel: usize) -> (f64, u32) {
        (self.squares[pixel], self.counts[pixel].saturating_sub(1))
    }
}

/// The variance of every pixel, pooled over `stacks`; NaN if no stack has two values of it.
pub(super) fn pooled_variances<'a>(
    stacks: impl Iterator<Item = &'a PixelStack> + Clone,
    pixels: usize,
) -> Vec<f32> {
    let variance = |pixel| {
        let (mut squares, mut freedom) = (0.0, 0);
        for stack in stacks.clone() {
            let (s, f) = stack.squares(pixel);
            squares += s;
            freedom += f;
        }
        if freedom == 0 {
            f32::NAN
        } else {
            (squares / f64::from(freedom)) as f32
        }
    };
    (0..pixels).map(variance).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_moments_are_those_of_two_passes(
            values in prop::collection::vec(-1000..1000_i32, 1..20),
            offset in 0..60_000_i32,
        ) {
            let values: Vec<f64> = values.iter().map(|v| f64::from(v + offset)).collect();
            let mut stack = PixelStack::new(2).unwrap();
            for &value in &values {
                stack.add([value as f32, f32::NAN].into_iter());
            }
            let n = values.len() as f64;
            let mean = values.iter().sum::<f64>() / n;
            let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
            prop_assert!((f64::from(stack.means()[0]) - mean).abs() <= 1e-7 * mean.abs().max(1.0));
            prop_assert!(stack.means()[1].is_nan());
            let variances = pooled_variances([&stack, &stack].into_iter(), 2);
            prop_assert!(variances[1].is_nan());
            if values.len() == 1 {
                prop_assert!(variances[0].is_nan());
            } else {
                let expected = squares / (n - 1.0);
                prop_assert!((f64::from(variances[0]) - expected).abs() <= 1e-6 * expected);
            }
        }
    }

    #[test]
    fn absurd_sizes_are_refused() {
        assert!(matches!(
            PixelStack::new(usize::MAX / 32),
            Err(OutOfMemory { .. })
        ));
    }
}
