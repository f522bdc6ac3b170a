//! The frame as a picture.

use super::canvas::STRIP_HEIGHT;
use super::options::{OverlayOptions, PictureCut, Stretch};
use super::shown::Shown;
use crate::base::coords::PixelPoint;
use crate::base::size::Size;
use crate::detect::BackgroundMap;
use crate::frame::{Colors, Frame, luminance};
use crate::solve::Background;
use image::RgbImage;
use image::imageops::{FilterType, resize};

/// The levels, over white, to which a dark sky is brightened, and a bright one darkened.
const SKY_LEVELS: [f32; 2] = [0.2, 0.35];

/// Size of letters and strokes of cuts for sharing, which are looked at on phones.
const CUT_UNIT: f32 = 1.6;

/// The frame as a picture.
pub(super) struct Picture {
    /// Columns of the picture.
    pub(super) width: usize,
    /// Rows.
    pub(super) height: usize,
    /// Red, green and blue; row-major, `height * width`.
    pub(super) pixels: Vec<[u8; 3]>,
    /// Pixels of the picture per pixel of the frame, along one axis.
    scale: f32,
    /// What is cut off at the left and at the top, in pixels of the picture.
    cut_off: [f32; 2],
    /// Whether it is a cut for sharing.
    is_cut: bool,
}

/// By which whole factors a frame is enlarged and reduced: the smallest that give a picture of suitable
/// size, or the ones nearest to a width that is not exceeded.
fn factors(frame: &Frame<'_>, width_px: Option<u32>) -> (usize, usize) {
    /// Frames with a shorter longest side are enlarged to at least this.
    const ENLARGE_BELOW_PX: usize = 800;
    /// Frames with a longer longest side are reduced to at most this.
    const REDUCE_ABOVE_PX: usize = 2500;
    if let Some(width_px) = width_px {
        let width_px = (width_px as usize).max(1);
        return (
            (width_px / frame.width).max(1),
            (frame.width / width_px).max(1),
        );
    }
    let longer = frame.width.max(frame.height);
    let enlarged = if longer < ENLARGE_BELOW_PX {
        ENLARGE_BELOW_PX.div_ceil(longer)
    } else {
        1
    };
    (enlarged, longer.div_ceil(REDUCE_ABOVE_PX).max(1))
}

impl Picture {
    /// `frame`, stretched, and enlarged or reduced to a suitable size or to that which is wanted.
    pub(super) fn draw(
        shown: &Shown<'_>,
        background: Option<&Background>,
        options: &OverlayOptions,
    ) -> Self {
        if let Some(cut) = options.cut {
            return Self::draw_cut(shown, background, options, cut);
        }
        let frame = shown.frame;
        let (enlarged, reduced) = factors(frame, options.width_px);
        let squares = Squares::new(frame, reduced);
        let Size { width, height } = squares.size;
        let small = match options.stretch {
            Stretch::None => photograph(&squares, shown.colors, None),
            Stretch::Auto if is_finished(frame) => as_it_is(&squares, shown.colors),
            Stretch::Soft | Stretch::Auto => photograph(&squares, shown.colors, Some(SKY_LEVELS)),
            Stretch::Hard => {
                // The mean of n² pixels has 1/n of the noise.
                let noise = background.map_or(0.0, |sky| sky.noise_adu as f32) / reduced as f32;
                grey(&above_sky(&squares, noise))
            }
        };
        let pixels = if enlarged > 1 {
            enlarge(&small, width, enlarged)
        } else {
            small
        };
        let picture = Self {
            width: width * enlarged,
            height: height * enlarged,
            pixels,
            scale: enlarged as f32 / reduced as f32,
            cut_off: [0.0; 2],
            is_cut: false,
        };
        match options.width_px {
            Some(wanted) => picture.with_width(wanted.max(1)),
            None => picture,
        }
    }

    /// The middle of `frame` in the size of a cut, without the height of its caption.
    fn draw_cut(
        shown: &Shown<'_>,
        background: Option<&Background>,
        options: &OverlayOptions,
        cut: PictureCut,
    ) -> Self {
        let [width, height] = cut.size_px();
        let height = height - (STRIP_HEIGHT * CUT_UNIT) as u32;
        let frame = shown.frame;
        let by_height = (u64::from(height) * frame.width as u64).div_ceil(frame.height as u64);
        let whole_width = u32::try_from(by_height)
            .unwrap_or(u32::MAX)
            .clamp(width, 8 * width);
        let options = OverlayOptions {
            cut: None,
            width_px: Some(whole_width),
            ..*options
        };
        let whole = Self::draw(shown, background, &options);
        let [width, height] = [
            whole.width.min(width as usize),
            whole.height.min(height as usize),
        ];
        let [left, top] = [(whole.width - width) / 2, (whole.height - height) / 2];
        let rows = whole.pixels.chunks(whole.width).skip(top).take(height);
        Self {
            width,
            height,
            pixels: rows
                .flat_map(|row| &row[left..left + width])
                .copied()
                .collect(),
            scale: whole.scale,
            cut_off: [left as f32, top as f32],
            is_cut: true,
        }
    }

    /// The picture at exactly this width.
    fn with_width(self, width: u32) -> Self {
        if self.width == width as usize {
            return self;
        }
        let factor = width as f32 / self.width as f32;
        let height = ((self.height as f32 * factor).round() as u32).max(1);
        let scale = self.scale * factor;
        let resized = resize(&self.into_image(), width, height, FilterType::Triangle);
        let pixels = resized.pixels().map(|pixel| pixel.0).collect();
        Self {
            width: width as usize,
            height: height as usize,
            pixels,
            scale,
            cut_off: [0.0; 2],
            is_cut: false,
        }
    }

    /// The place of a frame of this size, pixel by pixel, with nothing in it.
    #[cfg(feature = "page")]
    pub(super) fn empty(size: Size) -> Self {
        Self {
            width: size.width,
            height: size.height,
            pixels: Vec::new(),
            scale: 1.0,
            cut_off: [0.0; 2],
            is_cut: false,
        }
    }

    /// `frame` in grey, with a dark sky brightened, each `side` × `side` pixels as one.
    #[cfg(feature = "page")]
    pub(super) fn reduced(frame: &Frame<'_>, side: usize) -> Self {
        let squares = Squares::new(frame, side);
        Self {
            width: squares.size.width,
            height: squares.size.height,
            pixels: photograph(&squares, None, Some(SKY_LEVELS)),
            scale: 1.0 / side as f32,
            cut_off: [0.0; 2],
            is_cut: false,
        }
    }

    /// Whether it is a cut for sharing.
    pub(super) fn is_cut(&self) -> bool {
        self.is_cut
    }

    /// The picture without marks.
    pub(super) fn into_image(self) -> RgbImage {
        let size = [self.width as u32, self.height as u32];
        RgbImage::from_raw(size[0], size[1], self.pixels.into_flattened())
            .expect("three bytes a pixel")
    }

    /// Pixels of the picture per pixel of the frame, along one axis.
    pub(super) fn scale(&self) -> f32 {
        self.scale
    }

    /// Size of letters and strokes, relative to those on a picture of ordinary size.
    pub(super) fn stroke_unit(&self) -> f32 {
        /// Letters and strokes grow with pictures that have a longer side above this.
        const LARGE_PICTURE_PX: f32 = 1300.0;
        if self.is_cut {
            return CUT_UNIT;
        }
        (self.width.max(self.height) as f32 / LARGE_PICTURE_PX).max(1.0)
    }

    /// Whether a position in the picture is within it.
    pub(super) fn shows(&self, [x, y]: [f32; 2]) -> bool {
        (0.0..self.width as f32).contains(&x) && (0.0..self.height as f32).contains(&y)
    }

    /// Position in the picture of a position in the frame; (0, 0) is the upper left corner.
    pub(super) fn position_of(&self, pixel: &PixelPoint) -> [f32; 2] {
        let whole = [pixel.x, pixel.y].map(|along| (along as f32 + 0.5) * self.scale());
        [whole[0] - self.cut_off[0], whole[1] - self.cut_off[1]]
    }
}

/// The squares of pixels that the picture's pixels are.
struct Squares<'a> {
    frame: &'a Frame<'a>,
    /// Pixels a side.
    side: usize,
    /// Squares in a row, and rows of them.
    size: Size,
}

impl<'a> Squares<'a> {
    /// Those of a frame.
    fn new(frame: &'a Frame<'a>, side: usize) -> Self {
        let size = Size::new(frame.width.div_ceil(side), frame.height.div_ceil(side));
        Self { frame, side, size }
    }

    /// Means over the squares of what `fill` writes for a row of pixels; NaN where there is no value.
    fn means(&self, mut fill: impl FnMut(usize, &mut [f32])) -> Vec<f32> {
        let Self { frame, side, size } = *self;
        let mut values = vec![0.0; frame.width];
        let mut means = Vec::with_capacity(size.pixels());
        for rows in 0..size.height {
            let mut sums = vec![(0.0_f32, 0_u32); size.width];
            for y in rows * side..((rows + 1) * side).min(frame.height) {
                fill(y, &mut values);
                for (x, value) in values.iter().enumerate().filter(|(_, v)| !v.is_nan()) {
                    let sum = &mut sums[x / side];
                    *sum = (sum.0 + value, sum.1 + 1);
                }
            }
            means.extend(sums.iter().map(|(sum, count)| sum / *count as f32));
        }
        means
    }

    /// Means of the frame.
    fn light(&self) -> Vec<f32> {
        let pixels = self.frame.values();
        let width = self.frame.width;
        self.means(|y, row| row.copy_from_slice(&pixels[y * width..(y + 1) * width]))
    }

    /// Means of the frame above its background.
    fn light_above_sky(&self) -> Vec<f32> {
        /// Background cells along the longer side: wide enough to keep the glow around bright stars.
        const CELLS: usize = 16;
        const MIN_CELL_PX: usize = 64;
        let Frame { width, height, .. } = *self.frame;
        let cell_px = (width.max(height) / CELLS).max(MIN_CELL_PX);
        let background = BackgroundMap::measure(self.frame, cell_px);
        let pixels = self.frame.values();
        self.means(|y, row| {
            background.row(y, row);
            for (value, pixel) in row.iter_mut().zip(&pixels[y * width..]) {
                *value = pixel - *value;
            }
        })
    }

    /// Means of each color.
    fn colors(&self, colors: &Colors) -> [Vec<f32>; 3] {
        let width = self.frame.width;
        [0, 1, 2].map(|channel| {
            self.means(|y, row| {
                for (value, color) in row.iter_mut().zip(&colors.pixels[y * width..]) {
                    *value = f32::from(color[channel]);
                }
            })
        })
    }
}

/// The frame in its own colors, or in grey: in proportion, or between the levels that nearly all pixels lie
/// between, with the curve that brings the sky between `sky_levels`. All colors have the same curve.
fn photograph(
    squares: &Squares<'_>,
    colors: Option<&Colors>,
    sky_levels: Option<[f32; 2]>,
) -> Vec<[u8; 3]> {
    let Some(colors) = colors else {
        let light = squares.light();
        let curve = StretchCurve::of(&light, squares.frame.step_adu, sky_levels);
        let levels: Vec<u8> = light.iter().map(|level| curve.apply(*level)).collect();
        return grey(&levels);
    };
    let [red, green, blue] = squares.colors(colors);
    let all = red.iter().zip(&green).zip(&blue);
    let pixels: Vec<[f32; 3]> = all.map(|((r, g), b)| [*r, *g, *b]).collect();
    let luminance = |pixel: &[f32; 3]| luminance(*pixel, f32::INFINITY);
    let light: Vec<f32> = pixels.iter().map(luminance).collect();
    let curve = StretchCurve::of(&light, colors.step, sky_levels);
    let color = |pixel: &[f32; 3]| pixel.map(|level| curve.apply(level));
    pixels.iter().map(color).collect()
}

/// Whether a frame is a picture that was made to be looked at: its levels are those of a screen.
fn is_finished(frame: &Frame<'_>) -> bool {
    frame.saturation_adu == Some(255.0)
}

/// A picture of 8 bits with its own levels.
fn as_it_is(squares: &Squares<'_>, colors: Option<&Colors>) -> Vec<[u8; 3]> {
    /// Levels of colors per level of 8 bits.
    const OF_COLORS: f32 = 257.0;
    let level = |light: f32, unit: f32| (light / unit).round().clamp(0.0, 255.0) as u8;
    let Some(colors) = colors else {
        let levels: Vec<u8> = squares
            .light()
            .iter()
            .map(|&light| level(light, 1.0))
            .collect();
        return grey(&levels);
    };
    let [red, green, blue] = squares.colors(colors);
    let all = red.iter().zip(&green).zip(&blue);
    all.map(|((r, g), b)| [*r, *g, *b].map(|light| level(light, OF_COLORS)))
        .collect()
}

/// Grey levels as colors.
fn grey(levels: &[u8]) -> Vec<[u8; 3]> {
    levels.iter().map(|&level| [level; 3]).collect()
}

/// A curve from light to levels of a picture.
struct StretchCurve {
    black: f32,
    range: f32,
    middle: f32,
}

impl StretchCurve {
    /// The curve for a picture with this light.
    fn of(light: &[f32], step: f32, sky_levels: Option<[f32; 2]>) -> Self {
        /// Most levels of the picture between two of the frame: more are seen as edges.
        const MAX_LEVELS: f32 = 10.0;
        /// Share of the pixels that are black, and that are white.
        const BLACK_FRACTION: f32 = 2e-3;
        const WHITE_FRACTION: f32 = 5e-4;
        /// Share of the pixels above the level of the sky: the rest may be trees or the ground.
        const SKY_FRACTION: f32 = 0.25;
        let shares = match sky_levels {
            Some(_) => [1.0 - BLACK_FRACTION, WHITE_FRACTION],
            None => [1.0, 0.0],
        };
        let [black, white] = shares.map(|share| level_exceeded_by(light, share));
        let mut curve = Self {
            black,
            range: (white - black).max(f32::MIN_POSITIVE),
            middle: 0.5,
        };
        let sky = curve.fraction(level_exceeded_by(light, SKY_FRACTION));
        if let Some([dark, bright]) = sky_levels.filter(|_| sky > 0.0 && sky < 1.0) {
            // The curve is steepest at black.
            let steepest =
                (MAX_LEVELS / 255.0 * curve.range / step.max(f32::MIN_POSITIVE)).max(1.0);
            curve.middle = midtones(sky.clamp(dark, bright), sky).max(1.0 / (1.0 + steepest));
        }
        curve
    }

    fn fraction(&self, level: f32) -> f32 {
        ((level - self.black) / self.range).clamp(0.0, 1.0)
    }

    /// The level of the picture; black for NaN.
    fn apply(&self, level: f32) -> u8 {
        (255.0 * midtones(self.middle, self.fraction(level))).round() as u8
    }
}

/// The curve from 0 over (`middle`, ½) to 1.
///
/// # Reference
/// Midtones transfer function, PixInsight's XISF specification 1.0, § 11.5.7.
fn midtones(middle: f32, x: f32) -> f32 {
    (middle - 1.0) * x / ((2.0 * middle - 1.0) * x - middle)
}

/// Light above the sky as grey with an asinh stretch, from just below the background to the level of
/// bright stars.
///
/// # Reference
/// Lupton, Gunn & Szalay 1999, AJ 118, 1406, for asinh.
fn above_sky(squares: &Squares<'_>, noise: f32) -> Vec<u8> {
    /// Black is this many standard deviations of the noise below the background.
    const BLACK_SIGMA: f32 = 1.5;
    /// The stretch is linear up to this many standard deviations above black, then logarithmic.
    const LINEAR_SIGMA: f32 = 4.0;
    /// White is the level that this share of the pixels exceeds, ...
    const WHITE_FRACTION: f32 = 5e-4;
    /// ... but at least this many standard deviations.
    const MIN_WHITE_SIGMA: f32 = 40.0;
    /// Entries of the table from level to grey.
    const STEPS: usize = 4096;
    let light = squares.light_above_sky();
    let bright = level_exceeded_by(&light, WHITE_FRACTION);
    let brightest = light.iter().copied().fold(0.0, f32::max);
    // Without noise, as in a drawing, the range of the frame sets the scale.
    let noise = noise.max(brightest * 1e-3).max(f32::MIN_POSITIVE * 1e6);
    let white = (bright.max(MIN_WHITE_SIGMA * noise)).min(brightest.max(noise));
    let black = -BLACK_SIGMA * noise;
    let stretch = |above: f32| libm::asinhf(above / (LINEAR_SIGMA * noise));
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
fn enlarge(pixels: &[[u8; 3]], width: usize, factor: usize) -> Vec<[u8; 3]> {
    let mut enlarged = Vec::with_capacity(pixels.len() * factor * factor);
    for row in pixels.chunks(width) {
        let wide: Vec<[u8; 3]> = row
            .iter()
            .flat_map(|&pixel| std::iter::repeat_n(pixel, factor))
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

    fn with(stretch: Stretch) -> OverlayOptions {
        OverlayOptions {
            stretch,
            ..OverlayOptions::default()
        }
    }

    #[test]
    fn a_picture_has_the_width_that_is_wanted() {
        for (width, height, wanted) in [
            (640, 480, 1000),
            (640, 480, 100),
            (640, 480, 640),
            (50, 7, 333),
        ] {
            let options = OverlayOptions {
                width_px: Some(wanted),
                ..OverlayOptions::default()
            };
            let frame = frame(width, height);
            let picture = Picture::draw(&Shown::new("", &frame), None, &options);
            assert_eq!(picture.width, wanted as usize);
            assert_eq!(picture.pixels.len(), picture.width * picture.height);
            let far = PixelPoint::new(width as f64 - 0.5, height as f64 - 0.5);
            let [x, y] = picture.position_of(&far);
            assert!((x - wanted as f32).abs() < 0.01 * wanted as f32, "{x}");
            assert!(
                (y - picture.height as f32).abs() < 1.0 + 0.01 * wanted as f32,
                "{y}"
            );
        }
    }

    #[test]
    fn small_frames_are_enlarged_and_large_ones_reduced_by_whole_factors() {
        for (size, expected, scale) in [
            ((640, 480), (1280, 960), 2.0),
            ((1024, 768), (1024, 768), 1.0),
            ((300, 799), (600, 1598), 2.0),
            ((3, 3), (801, 801), 267.0),
            ((2600, 100), (1300, 50), 0.5),
            ((5001, 3), (1667, 1), 1.0 / 3.0),
        ] {
            let picture = Picture::draw(
                &Shown::new("", &frame(size.0, size.1)),
                None,
                &with(Stretch::Soft),
            );
            assert_eq!((picture.width, picture.height), expected, "{size:?}");
            assert_eq!(picture.pixels.len(), picture.width * picture.height);
            assert_eq!(picture.scale(), scale, "{size:?}");
        }
    }

    #[test]
    fn the_centre_of_the_first_pixel_is_the_middle_of_its_square() {
        let picture = Picture::draw(
            &Shown::new("", &frame(400, 400)),
            None,
            &with(Stretch::None),
        );
        assert_eq!(
            picture.position_of(&PixelPoint::new(0.0, 399.0)),
            [1.0, 799.0]
        );
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
        let picture = Picture::draw(&Shown::new("", &frame), Some(&sky), &with(Stretch::Hard));
        assert_eq!(picture.pixels[315 * width + 415], [255; 3]);
        assert_eq!(picture.pixels[5], [0; 3]);
        let mean = |from: usize| {
            let column = |x: usize| (0..200).map(move |y| x + y * width);
            let indices = (from..from + 100).flat_map(column);
            indices
                .map(|i| f32::from(picture.pixels[i][1]))
                .sum::<f32>()
                / 20_000.0
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
        // The level that a quarter of the picture exceeds.
        let sky_of = |light: &[f32], sky_levels| {
            let curve = StretchCurve::of(light, 0.0, sky_levels);
            let mut levels: Vec<u8> = light.iter().map(|level| curve.apply(*level)).collect();
            levels.sort_unstable();
            levels[light.len() * 3 / 4]
        };
        assert_eq!(sky_of(&with_sky(10.0), Some(SKY_LEVELS)), 51);
        assert_eq!(sky_of(&with_sky(10.0), None), 1);
        // Half of the frame is trees.
        let mut behind_trees = with_sky(10.0);
        behind_trees[..50_000].fill(0.0);
        behind_trees[60_000..60_100].fill(1000.0);
        assert_eq!(sky_of(&behind_trees, Some(SKY_LEVELS)), 51);
        let day: Vec<f32> = (0..100_000)
            .map(|i| 90.0 + noise(i) * 10.0 - noise(7 * i) * 90.0)
            .collect();
        assert_eq!(sky_of(&day, Some(SKY_LEVELS)), 89);
    }

    #[test]
    fn all_colors_have_the_curve_of_their_luminance() {
        let (width, height) = (820, 30);
        let frame = frame(width, height);
        // An orange sky.
        let level = |i: usize| 1000 + 40 * (i * 7919 % 101) as u16;
        let pixels = (0..width * height).map(|i| [level(i) + 900, level(i) + 300, level(i)]);
        let colors = Colors {
            pixels: pixels.collect(),
            step: 1.0,
        };
        let shown = Shown {
            colors: Some(&colors),
            ..Shown::new("", &frame)
        };
        let picture = Picture::draw(&shown, None, &with(Stretch::Soft));
        let ordered = |[r, g, b]: &&[u8; 3]| r >= g && g >= b && r > b;
        assert!(picture.pixels.iter().filter(ordered).count() > width * height * 9 / 10);
        let grey = Picture::draw(&shown, None, &with(Stretch::Hard));
        assert!(grey.pixels.iter().all(|[r, g, b]| r == g && g == b));
    }
}
