//! Whether a frame is a mosaic: the backgrounds of its four interleaved frames, in patches all over
//! it.
//!
//! Let a, b; c, d be the levels of 2 × 2 pixels. Readout through two or more amplifiers and noise of
//! columns or rows make columns or rows differ: then b + c − a − d is 0, as it is in a gradient. A
//! mosaic has the same filter twice, on a diagonal. Where more light passes there is more shot noise,
//! as well.

use crate::base::statistics::{clip, mean_and_squares, median_and_sigma};
use crate::frame::Frame;
use crate::frame::bayer_pattern::{BayerPattern, Diagonal};

/// Side of a patch, in pixels: 256 of each filter.
const PATCH_PX: usize = 32;
/// Squares of 2 × 2 pixels along an axis for a first look, which costs a grey frame hardly any time.
const FIRST_SQUARES: usize = 64;
/// Most patches along an axis.
const MAX_PATCHES: usize = 48;
/// Fewer patches prove nothing.
const MIN_PATCHES: usize = 9;
/// A contrast below this many standard errors is chance.
const SIGNIFICANT_SIGMA: f64 = 6.0;
/// Smaller contrasts of levels, in standard deviations of a pixel, do no harm.
const MIN_LEVELS: f64 = 0.1;
/// Those of a frame whose header states a mosaic.
const MIN_OF_STATED: f64 = 0.02;
/// Two filters are alike where their levels differ by less than this share of the contrast.
const ALIKE: f64 = 0.25;

/// The diagonal of the filters that are alike, if the frame is a mosaic for certain; less is needed
/// where its header states a pattern.
pub(super) fn green_diagonal(frame: &Frame, stated: Option<BayerPattern>) -> Option<Diagonal> {
    if let Some(pattern) = stated {
        let found = Contrasts::measure(frame, MAX_PATCHES)?;
        return found
            .is_any()
            .then(|| found.alike().unwrap_or(pattern.green()));
    }
    if !may_be_mosaic(frame) {
        return None;
    }
    let found = Contrasts::measure(frame, MAX_PATCHES)?;
    found.is_by_light().then(|| found.green()).flatten()
}

/// Whether the diagonals of a sample of 2 × 2 pixels differ: a first look, which need not be sure.
fn may_be_mosaic(frame: &Frame) -> bool {
    let starts = |side: usize| {
        let step = (side / FIRST_SQUARES).max(2) / 2 * 2;
        (0..side - 1).step_by(step)
    };
    let contrast = |x: usize, y: usize| {
        let at = |column, row| f64::from(frame.at(x + column, y + row));
        at(1, 0) + at(0, 1) - at(0, 0) - at(1, 1)
    };
    let rows = starts(frame.height);
    let mut contrasts: Vec<f64> = rows
        .flat_map(|y| starts(frame.width).map(move |x| contrast(x, y)))
        .collect();
    // Both the contrast and its noise are twice those of one pixel.
    let found = background_of(&mut contrasts, frame.step_adu.into());
    found.is_some_and(|(mean, variance)| mean.abs() > MIN_LEVELS * variance.sqrt())
}

/// How the interleaved backgrounds of a frame differ.
struct Contrasts {
    /// Of the levels of the two diagonals, in standard deviations of a pixel.
    levels: PatchMedian,
    /// Of their variances, in parts of the variance.
    noise: PatchMedian,
    /// Of the levels on each diagonal.
    falling: PatchMedian,
    rising: PatchMedian,
}

impl Contrasts {
    /// Those of `frame`, in up to `most` patches along each axis.
    fn measure(frame: &Frame, most: usize) -> Option<Self> {
        let patches = patches_of(frame, most);
        if patches.len() < MIN_PATCHES {
            return None;
        }
        let of = |value: fn(&Patch) -> f64, patch_error| {
            PatchMedian::of(patches.iter().map(value).collect(), patch_error)
        };
        Some(Self {
            levels: of(Patch::levels, Patch::LEVEL_ERROR),
            noise: of(Patch::noise, Patch::NOISE_ERROR),
            falling: of(Patch::falling, Patch::LEVEL_ERROR),
            rising: of(Patch::rising, Patch::LEVEL_ERROR),
        })
    }

    /// Whether the diagonals differ at all.
    fn is_any(&self) -> bool {
        self.levels.exceeds(MIN_OF_STATED) || self.noise.exceeds(MIN_OF_STATED)
    }

    /// Whether they differ in the light that passes: where the level is higher there is more noise.
    fn is_by_light(&self) -> bool {
        let has_shot_noise = self.noise.exceeds(0.0) && self.noise.value * self.levels.value > 0.0;
        self.levels.exceeds(MIN_LEVELS) && has_shot_noise
    }

    /// The one diagonal whose filters are alike; `None` if both are, or neither.
    fn alike(&self) -> Option<Diagonal> {
        match [&self.falling, &self.rising].map(|on| self.is_small(on)) {
            [true, false] => Some(Diagonal::Falling),
            [false, true] => Some(Diagonal::Rising),
            _ => None,
        }
    }

    /// The green diagonal; `None` if no filters are alike.
    fn green(&self) -> Option<Diagonal> {
        if self.is_small(&self.falling) && self.is_small(&self.rising) {
            // Red and blue are alike as well; more light passes green filters.
            let is_rising = self.levels.value > 0.0;
            return Some(if is_rising {
                Diagonal::Rising
            } else {
                Diagonal::Falling
            });
        }
        self.alike()
    }

    fn is_small(&self, difference: &PatchMedian) -> bool {
        difference.value.abs() < ALIKE * self.levels.value.abs()
    }
}

/// The median over the patches, and its standard error.
struct PatchMedian {
    value: f64,
    sigma: f64,
}

impl PatchMedian {
    /// `patch_error`: the least standard error of one of `values`.
    fn of(mut values: Vec<f64>, patch_error: f64) -> Self {
        /// Standard error of a median over that of a mean, for Gaussian errors.
        const OF_MEDIAN: f64 = 1.2533;
        let (value, scatter) = median_and_sigma(&mut values);
        let sigma = OF_MEDIAN * scatter.max(patch_error) / (values.len() as f64).sqrt();
        Self { value, sigma }
    }

    /// Whether it is certain, and above `least`.
    fn exceeds(&self, least: f64) -> bool {
        self.value.abs() > least.max(SIGNIFICANT_SIGMA * self.sigma)
    }
}

/// Level and variance of the pixels of each filter in a patch: a, b; c, d.
struct Patch {
    levels: [f64; 4],
    variances: [f64; 4],
}

impl Patch {
    /// Standard error of a contrast of levels, in standard deviations of a pixel: of four means of
    /// 256, halved.
    const LEVEL_ERROR: f64 = 1.0 / 16.0;
    /// Standard error of a contrast of variances, in parts of the variance.
    const NOISE_ERROR: f64 = 0.044;

    fn sigma(&self) -> f64 {
        (self.variances.iter().sum::<f64>() / 4.0).sqrt()
    }

    /// How much higher the levels on the rising diagonal are.
    fn levels(&self) -> f64 {
        let [a, b, c, d] = self.levels;
        (b + c - a - d) / (2.0 * self.sigma())
    }

    /// How much larger the variances there are.
    fn noise(&self) -> f64 {
        let [a, b, c, d] = self.variances;
        (b + c - a - d) / (a + b + c + d)
    }

    fn falling(&self) -> f64 {
        (self.levels[3] - self.levels[0]) / self.sigma()
    }

    fn rising(&self) -> f64 {
        (self.levels[2] - self.levels[1]) / self.sigma()
    }
}

/// Patches all over the frame, without those that have no noise.
fn patches_of(frame: &Frame, most: usize) -> Vec<Patch> {
    let starts = |side: usize| {
        let count = (side / PATCH_PX).min(most);
        // Even, so that each patch begins with the same filter.
        (0..count).map(move |i| (side - PATCH_PX) * i / count.max(2).saturating_sub(1) / 2 * 2)
    };
    let rows = starts(frame.height);
    let places = rows.flat_map(|y| starts(frame.width).map(move |x| (x, y)));
    let mut values = Vec::new();
    places
        .filter_map(|(x, y)| patch_at(frame, x, y, &mut values))
        .collect()
}

fn patch_at(frame: &Frame, x0: usize, y0: usize, values: &mut Vec<f64>) -> Option<Patch> {
    let mut patch = Patch {
        levels: [0.0; 4],
        variances: [0.0; 4],
    };
    for filter in 0..4 {
        values.clear();
        for y in (y0 + filter / 2..y0 + PATCH_PX).step_by(2) {
            let row = (x0 + filter % 2..x0 + PATCH_PX).step_by(2);
            values.extend(row.map(|x| f64::from(frame.at(x, y))));
        }
        (patch.levels[filter], patch.variances[filter]) =
            background_of(values, frame.step_adu.into())?;
    }
    (patch.sigma() > 0.0).then_some(patch)
}

/// Mean and variance of the pixels without stars; `None` where hardly any has a value.
fn background_of(values: &mut Vec<f64>, step_adu: f64) -> Option<(f64, f64)> {
    const MIN: usize = PATCH_PX * PATCH_PX / 8;
    values.retain(|value| !value.is_nan());
    if values.len() < MIN {
        return None;
    }
    clip(values, 0.5 * step_adu);
    let (mean, squares) = mean_and_squares(values);
    Some((mean, squares / values.len() as f64))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    const SIDE: usize = 320;

    /// A frame of these levels and standard deviations in 2 × 2 pixels, in whole numbers, on a
    /// gradient.
    fn frame(levels: [f64; 4], sigmas: [f64; 4], seed: u64) -> Frame<'static> {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let pixels = (0..SIDE * SIDE).map(|i| {
            let (x, y) = (i % SIDE, i / SIDE);
            let filter = 2 * (y % 2) + x % 2;
            let noise: f64 = StandardNormal.sample(&mut rng);
            let gradient = 0.05 * (x + 2 * y) as f64;
            (levels[filter] + gradient + sigmas[filter] * noise).round() as u16
        });
        Frame::from_samples(SIDE, SIDE, pixels.collect::<Vec<u16>>()).unwrap()
    }

    /// Levels and noise behind filters that let red, green, green and blue pass, 1 e⁻ per ADU.
    fn under_filters([red, green, blue]: [f64; 3], read_noise: f64) -> ([f64; 4], [f64; 4]) {
        let light = [red, green, green, blue];
        let sigma = |e: f64| (e + read_noise * read_noise).sqrt();
        (light.map(|e| 200.0 + e), light.map(sigma))
    }

    #[test]
    fn four_interleaved_backgrounds_are_a_mosaic_wherever_it_begins() {
        let skies = [
            [60.0, 100.0, 50.0],
            [30.0, 60.0, 60.0],
            [900.0, 400.0, 300.0],
        ];
        for (seed, (sky, read_noise)) in (1..).zip(skies.into_iter().zip([3.0, 1.0, 5.0])) {
            let ([a, b, c, d], [i, j, k, l]) = under_filters(sky, read_noise);
            let rising = frame([a, b, c, d], [i, j, k, l], seed);
            assert_eq!(
                green_diagonal(&rising, None),
                Some(Diagonal::Rising),
                "{sky:?}"
            );
            let falling = frame([b, a, d, c], [j, i, l, k], seed + 10);
            assert_eq!(
                green_diagonal(&falling, None),
                Some(Diagonal::Falling),
                "{sky:?}"
            );
        }
    }

    #[test]
    fn grey_frames_are_none_with_whatever_pattern_of_columns_and_rows() {
        for (seed, levels) in (1..).zip([
            [100.0; 4],
            [100.0, 130.0, 100.0, 130.0],
            [100.0, 100.0, 90.0, 90.0],
            // Four amplifiers.
            [100.0, 130.0, 120.0, 150.0],
            [100.0, 140.0, 140.0, 90.0],
        ]) {
            let grey = frame(levels, [6.0; 4], seed);
            assert_eq!(green_diagonal(&grey, None), None, "{levels:?}");
        }
        // Noise differs where pixels between others were interpolated; levels do not.
        let interpolated = frame([100.0; 4], [6.0, 4.2, 4.2, 3.0], 9);
        assert_eq!(green_diagonal(&interpolated, None), None);
    }

    #[test]
    fn a_stated_pattern_needs_less_to_be_believed_but_something() {
        let stated = Some(BayerPattern::Rggb);
        let grey = frame([100.0; 4], [6.0; 4], 1);
        assert_eq!(green_diagonal(&grey, stated), None);
        let columns = frame([100.0, 104.0, 100.0, 104.0], [6.0; 4], 2);
        assert_eq!(green_diagonal(&columns, stated), None);
        let (levels, sigmas) = under_filters([1.0, 3.0, 1.0], 9.0);
        let dark = frame(levels, sigmas, 3);
        assert_eq!(green_diagonal(&dark, None), None);
        assert_eq!(green_diagonal(&dark, stated), Some(Diagonal::Rising));
    }
}
