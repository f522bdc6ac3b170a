//! The frame as grey levels.

use super::options::Stretch;
use crate::base::coords::PixelPoint;
use crate::base::size::Size;
use crate::detect::BackgroundMap;
use crate::frame::Frame;
use crate::pipeline::Background;

/// The levels, over white, to which a dark sky is brightened, and a bright one darkened.
const SKY_LEVELS: [f32; 2] = [0.2, 0.35];

/// The frame as a grey picture.
pub(super) struct Grey {
    /// Columns of the picture.
    pub(super) width: usize,
    /// Rows.
    pub(super) height: usize,
    /// Row-major, `height * width`; 0 is black.
    pub(super) levels: Vec<u8>,
    enlarged: usize,
    reduced: usize,
}

impl Grey {
    /// `frame`, stretched, enlarged or reduced by the smallest whole factor that gives a picture of
    /// suitable size.
    pub(super) fn of(frame: &Frame, background: Option<&Background>, stretch: Stretch) -> Self {
        /// Frames with a shorter longest side are enlarged to at least this.
        const ENLARGE_BELOW_PX: usize = 800;
        /// Frames with a longer longest side are reduced to at most this.
        const REDUCE_ABOVE_PX: usize = 2500;
        let longer = frame.width.max(frame.height);
        let enlarged = if longer < ENLARGE_BELOW_PX {
            ENLARGE_BELOW_PX.div_ceil(longer)
        } else {
            1
        };
        let reduced = longer.div_ceil(REDUCE_ABOVE_PX).max(1);
        let (width, height) = (
            frame.width.div_ceil(reduced),
            frame.height.div_ceil(reduced),
        );
        let size = Size::new(width, height);
        let without_sky = stretch == Stretch::Hard;
        let light = light(frame, reduced, size, without_sky);
        // The mean of n² pixels has 1/n of the noise.
        let noise = background.map_or(0.0, |sky| sky.noise_adu as f32) / reduced as f32;
        let small = match stretch {
            Stretch::None => photograph(&light, None),
            Stretch::Soft => photograph(&light, Some(SKY_LEVELS)),
            Stretch::Hard => greys(&light, noise),
        };
        let levels = if enlarged > 1 {
            enlarge(&small, width, enlarged)
        } else {
            small
        };
        Self {
            width: width * enlarged,
            height: height * enlarged,
            levels,
            enlarged,
            reduced,
        }
    }

    /// Pixels of the picture per pixel of the frame, along one axis.
    pub(super) fn scale(&self) -> f32 {
        self.enlarged as f32 / self.reduced as f32
    }

    /// Size of letters and strokes, relative to those on a picture of ordinary size.
    pub(super) fn stroke_unit(&self) -> f32 {
        /// Letters and strokes grow with pictures that have a longer side above this.
        const LARGE_PICTURE_PX: f32 = 1300.0;
        (self.width.max(self.height) as f32 / LARGE_PICTURE_PX).max(1.0)
    }

    /// Position in the picture of a position in the frame; (0, 0) is the upper left corner.
    pub(super) fn position_of(&self, pixel: &PixelPoint) -> [f32; 2] {
        [pixel.x, pixel.y].map(|along| (along as f32 + 0.5) * self.scale())
    }
}

/// Light: means over squares of `side` pixels, NaN where there is no value; above the background, where
/// that is wanted.
fn light(frame: &Frame, side: usize, size: Size, without_sky: bool) -> Vec<f32> {
    /// Background cells along the longer side: wide enough to keep the glow around bright stars.
    const CELLS: usize = 16;
    const MIN_CELL_PX: usize = 64;
    let cell_px = (frame.width.max(frame.height) / CELLS).max(MIN_CELL_PX);
    let background = without_sky.then(|| BackgroundMap::measure(frame, cell_px));
    let pixels = frame.values();
    let mut levels = vec![0.0; frame.width];
    let mut light = Vec::with_capacity(size.pixels());
    for rows in 0..size.height {
        let mut sums = vec![(0.0_f32, 0_u32); size.width];
        for y in rows * side..((rows + 1) * side).min(frame.height) {
            if let Some(background) = &background {
                background.row(y, &mut levels);
            }
            let row = &pixels[y * frame.width..(y + 1) * frame.width];
            for (x, (pixel, level)) in row.iter().zip(&levels).enumerate() {
                if !pixel.is_nan() {
                    let sum = &mut sums[x / side];
                    *sum = (sum.0 + pixel - level, sum.1 + 1);
                }
            }
        }
        light.extend(sums.iter().map(|(sum, count)| sum / *count as f32));
    }
    light
}

/// Converts light to grey: in proportion, or between the levels that nearly all pixels lie between, with the
/// curve that brings the sky between these levels.
fn photograph(light: &[f32], sky_levels: Option<[f32; 2]>) -> Vec<u8> {
    /// Share of the pixels that are black, and that are white.
    const BLACK_SHARE: f32 = 2e-3;
    const WHITE_SHARE: f32 = 5e-4;
    let shares = match sky_levels {
        Some(_) => [1.0 - BLACK_SHARE, WHITE_SHARE],
        None => [1.0, 0.0],
    };
    let [black, white] = shares.map(|share| level_exceeded_by(light, share));
    let range = (white - black).max(f32::MIN_POSITIVE);
    let share = |level: f32| ((level - black) / range).clamp(0.0, 1.0);
    let sky = share(level_exceeded_by(light, 0.5));
    let middle = match sky_levels {
        Some([dark, bright]) if sky > 0.0 && sky < 1.0 => midtones(sky.clamp(dark, bright), sky),
        _ => 0.5,
    };
    // NaN is black, too.
    let grey = |level: &f32| (255.0 * midtones(middle, share(*level))).round() as u8;
    light.iter().map(grey).collect()
}

/// The curve from 0 over (`middle`, ½) to 1.
///
/// # Reference
/// Midtones transfer function, PixInsight's XISF specification 1.0, § 11.5.7.
fn midtones(middle: f32, x: f32) -> f32 {
    (middle - 1.0) * x / ((2.0 * middle - 1.0) * x - middle)
}

/// Converts light to grey with an asinh stretch, from just below the background to the level of
/// bright stars.
///
/// # Reference
/// Lupton, Gunn & Szalay 1999, AJ 118, 1406, for asinh.
fn greys(light: &[f32], noise: f32) -> Vec<u8> {
    /// Black is this many standard deviations of the noise below the background.
    const BLACK_SIGMA: f32 = 1.5;
    /// The stretch is linear up to this many standard deviations above black, then logarithmic.
    const LINEAR_SIGMA: f32 = 4.0;
    /// White is the level that this share of the pixels exceeds, ...
    const WHITE_SHARE: f32 = 5e-4;
    /// ... but at least this many standard deviations.
    const MIN_WHITE_SIGMA: f32 = 40.0;
    /// Entries of the table from level to grey.
    const STEPS: usize = 4096;
    let bright = level_exceeded_by(light, WHITE_SHARE);
    let brightest = light.iter().copied().fold(0.0, f32::max);
    // Without noise, as in a drawing, the range of the frame sets the scale.
    let noise = noise.max(brightest * 1e-3).max(f32::MIN_POSITIVE * 1e6);
    let white = (bright.max(MIN_WHITE_SIGMA * noise)).min(brightest.max(noise));
    let black = -BLACK_SIGMA * noise;
    let stretch = |above: f32| (above / (LINEAR_SIGMA * noise)).asinh();
    let most = stretch(white - black);
    // The table is even in the square root of the level, hence fine where the curve is steep.
    let table: Vec<u8> = (0..STEPS)
        .map(|step| {
            let above = (step as f32 / (STEPS - 1) as f32).powi(2) * (white - black);
            (stretch(above) / most * 255.0).round() as u8
        })
        .collect();
    let grey = |level: &f32| {
        let share = (level - black) / (white - black);
        if share > 0.0 {
            table[(share.min(1.0).sqrt() * (STEPS - 1) as f32) as usize]
        } else {
            // Also NaN.
            0
        }
    };
    light.iter().map(grey).collect()
}

/// The level that a share of all values exceeds.
fn level_exceeded_by(values: &[f32], share: f32) -> f32 {
    let mut finite: Vec<f32> = values.iter().copied().filter(|v| v.is_finite()).collect();
    if finite.is_empty() {
        return 0.0;
    }
    let above = (finite.len() as f32 * share) as usize;
    let index = finite.len() - 1 - above.min(finite.len() - 1);
    *finite.select_nth_unstable_by(index, f32::total_cmp).1
}

/// Enlarges every pixel to a square of `factor` pixels a side.
fn enlarge(levels: &[u8], width: usize, factor: usize) -> Vec<u8> {
    let mut enlarged = Vec::with_capacity(levels.len() * factor * factor);
    for row in levels.chunks(width) {
        let wide: Vec<u8> = row
            .iter()
            .flat_map(|&level| std::iter::repeat_n(level, factor))
            .collect();
        for _ in 0..factor {
            enlarged.extend_from_slice(&wide);
        }
    }
    enlarged
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    fn frame(width: usize, height: usize) -> Frame<'static> {
        let noise = |i: usize| 50.0 + ((i * 7919) % 101) as f32 * 0.1;
        Frame::new(width, height, (0..width * height).map(noise).collect()).unwrap()
    }

    #[test]
    fn small_frames_are_enlarged_and_large_ones_reduced_by_whole_factors() {
        for (size, picture, scale) in [
            ((640, 480), (1280, 960), 2.0),
            ((1024, 768), (1024, 768), 1.0),
            ((300, 799), (600, 1598), 2.0),
            ((3, 3), (801, 801), 267.0),
            ((2600, 100), (1300, 50), 0.5),
            ((5001, 3), (1667, 1), 1.0 / 3.0),
        ] {
            let grey = Grey::of(&frame(size.0, size.1), None, Stretch::Soft);
            assert_eq!((grey.width, grey.height), picture, "{size:?}");
            assert_eq!(grey.levels.len(), grey.width * grey.height);
            assert_eq!(grey.scale(), scale, "{size:?}");
        }
    }

    #[test]
    fn the_centre_of_the_first_pixel_is_the_middle_of_its_square() {
        let grey = Grey::of(&frame(400, 400), None, Stretch::None);
        assert_eq!(grey.position_of(&PixelPoint::new(0.0, 399.0)), [1.0, 799.0]);
    }

    #[test]
    fn stars_are_white_the_sky_is_dark_and_a_gradient_does_not_show() {
        let (width, height) = (900, 700);
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let mut noise = || -> f32 { random.sample::<f32, _>(StandardNormal) * 2.9 };
        let mut pixels: Vec<f32> = (0..width * height)
            .map(|i| noise() + 0.05 * (i % width) as f32)
            .collect();
        for dy in 0..30 {
            for dx in 0..30 {
                pixels[(300 + dy) * width + 400 + dx] = 5000.0;
            }
        }
        pixels[5] = f32::NAN;
        let frame = Frame::new(width, height, pixels).unwrap();
        let sky = Background {
            level_adu: 22.0,
            noise_adu: 2.9,
            sky_share: 1.0,
        };
        let grey = Grey::of(&frame, Some(&sky), Stretch::Hard);
        assert_eq!(grey.levels[315 * width + 415], 255);
        assert_eq!(grey.levels[5], 0);
        let mean = |from: usize| {
            let column = |x: usize| (0..200).map(move |y| x + y * width);
            let indices = (from..from + 100).flat_map(column);
            indices.map(|i| f32::from(grey.levels[i])).sum::<f32>() / 20_000.0
        };
        let (left, right) = (mean(0), mean(width - 100));
        assert!((10.0..60.0).contains(&left), "{left}");
        assert!((left - right).abs() < 8.0, "{left} {right}");
    }

    #[test]
    fn a_dark_sky_is_brightened_and_a_bright_one_darkened() {
        assert!((midtones(midtones(0.2, 0.01), 0.01) - 0.2).abs() < 1e-6);
        let noise = |i: usize| ((i * 7919) % 101) as f32 / 101.0;
        let with_sky = |level: f32| -> Vec<f32> {
            let star = |i: usize| if i.is_multiple_of(1000) { 1000.0 } else { 0.0 };
            (0..100_000)
                .map(|i| level + 4.0 * noise(i) + star(i))
                .collect()
        };
        let middle = |greys: Vec<u8>| {
            greys[50_001..50_102]
                .iter()
                .map(|g| f64::from(*g))
                .sum::<f64>()
                / 101.0
        };
        let dark = middle(photograph(&with_sky(10.0), Some(SKY_LEVELS)));
        assert!((40.0..60.0).contains(&dark), "{dark}");
        let plain = middle(photograph(&with_sky(10.0), None));
        assert!(plain < 2.0, "{plain}");
        let day: Vec<f32> = (0..100_000)
            .map(|i| 90.0 + noise(i) * 10.0 - noise(7 * i) * 90.0)
            .collect();
        let sky = middle(photograph(&day, Some(SKY_LEVELS)));
        assert!((60.0..110.0).contains(&sky), "{sky}");
    }
}
