//! The light of the sky itself: day, aurora, clouds, or none at all.

use super::cells::Cells;
use super::light::Light;
use super::shapes::shapes;
use crate::base::coords::PixelPoint;
use crate::base::statistics::{median_of, quantile};
use crate::detect::{Detection, Detections};
use nalgebra::{SMatrix, SVector};

/// Levels of red, green and blue in a cell.
type Color = [f32; 3];
/// A surface of second order.
const TERMS: usize = 6;

/// A detection that noise does not make.
pub(super) fn is_bright_star(source: &Detection) -> bool {
    const MIN_SNR: f64 = 10.0;
    source.snr > MIN_SNR && source.flags.is_star_like()
}

/// Whether a part of the picture is bright and blue as the sky by day, and has no stars: air scatters blue light.
pub(super) fn is_day(
    cells: &Cells,
    colors: &[Color],
    light: &Light,
    detections: &Detections,
) -> bool {
    /// Level over full scale, and blue over red.
    const BRIGHT: f32 = 0.3;
    const BLUE: f32 = 1.3;
    /// Share of the picture.
    const SHARE: f64 = 0.2;
    /// Stars in it: a blue nebula has many. They are above the noise, and by a share of full scale.
    const MOST_STARS: usize = 5;
    const MIN_SNR: f64 = 10.0;
    const PEAK: f32 = 0.1;
    let dark = light.lowest.min(0.0);
    let is_sky = |&[red, green, blue]: &Color| {
        let is_blue = blue - dark > BLUE * (red - dark) && blue > green;
        let level = (red + green + blue) / 3.0 - dark;
        is_blue && level > BRIGHT * light.range()
    };
    let share = colors.iter().filter(|color| is_sky(color)).count() as f64 / colors.len() as f64;
    let is_star = |source: &&Detection| {
        let stands_out = source.snr > MIN_SNR && source.peak_adu > f64::from(PEAK * light.range());
        let is_point = !(source.flags.hot_pixel || source.flags.trail);
        stands_out && is_point && is_sky(&colors[cells.at(source.position.x, source.position.y)])
    };
    let stars = detections.sources.iter().filter(is_star);
    share > SHARE && stars.count() <= MOST_STARS && is_smooth(cells, |index| is_sky(&colors[index]))
}

/// Whether the level hardly changes from a cell of a part of the picture to the next: air is smooth, a nebula is not.
fn is_smooth(cells: &Cells, is_part: impl Fn(usize) -> bool) -> bool {
    /// Difference over the level, and the share of pairs that differ by less.
    const DIFFERENCE: f32 = 0.06;
    const SHARE: f64 = 0.7;
    let is_pair = |index: &usize| {
        index % cells.columns + 1 < cells.columns && is_part(*index) && is_part(index + 1)
    };
    let is_even = |index: &usize| {
        let [level, next] = [index, &(index + 1)].map(|&index| cells.levels[index]);
        (next - level).abs() < DIFFERENCE * level
    };
    let pairs = || (0..cells.levels.len()).filter(is_pair);
    pairs().filter(is_even).count() as f64 >= SHARE * pairs().count() as f64
}

/// Whether light is added to the sky in a part of the picture that is green, as oxygen shines at 557.7 nm. What lamps
/// add is white or yellow.
pub(super) fn is_aurora(colors: &[Color], light: &Light) -> bool {
    /// Excess of green over full scale, and over that of red and of blue.
    const EXCESS: f32 = 0.03;
    const OVER_RED: f32 = 1.5;
    const OVER_BLUE: f32 = 1.25;
    /// Share of the picture, and of what has an excess.
    const SHARE: f64 = 0.06;
    const OF_BRIGHT: f64 = 0.6;
    let darkest = [0, 1, 2].map(|channel| {
        let mut levels: Vec<f64> = colors.iter().map(|color| color[channel].into()).collect();
        levels.sort_by(f64::total_cmp);
        quantile(&levels, 0.1).unwrap_or_default() as f32
    });
    let (mut bright, mut greenish) = (0, 0);
    for color in colors {
        let [red, green, blue] = [0, 1, 2].map(|channel| color[channel] - darkest[channel]);
        if red.max(green).max(blue) > EXCESS * light.range() {
            bright += 1;
            greenish += usize::from(green > OVER_RED * red && green > OVER_BLUE * blue);
        }
    }
    greenish as f64 > SHARE * colors.len() as f64 && greenish as f64 > OF_BRIGHT * f64::from(bright)
}

/// Whether nothing but noise and hot pixels is in a picture near the lowest levels.
pub(super) fn is_black(cells: &Cells, light: &Light, detections: &Detections) -> bool {
    /// The sky over full scale, and the brightest cell above it.
    const BLACK: f32 = 0.04;
    const EVEN: f32 = 0.02;
    let highest = cells
        .levels
        .iter()
        .fold(f32::MIN, |most, &level| most.max(level));
    let is_dark = light.sky - light.lowest.min(0.0) < BLACK * light.range();
    let is_even = highest - light.sky < EVEN * light.range();
    // JPEG files have spots of one level.
    let is_thing = |source: &Detection| {
        source.peak_adu > f64::from(3.0 * light.step)
            && (is_bright_star(source) || source.flags.extended)
    };
    is_dark && is_even && light.spots().is_empty() && !detections.sources.iter().any(is_thing)
}

/// By how much the brightness of the sky varies from place to place, over its level, where it is patchy as clouds make
/// it: several brighter and darker patches are left beside a surface of second order, as twilight, the light of a city
/// and the lens make it.
pub(super) fn patchiness(cells: &Cells, light: &Light, detections: &Detections) -> Option<f64> {
    /// Smallest variation, and largest: more is of a thing before a black ground.
    const LEAST: f64 = 0.12;
    const MOST: f64 = 1.5;
    /// Fewest patches.
    const MIN_PATCHES: usize = 5;
    /// Stars that clouds leave, and detections, some of them of clouds.
    const MOST_STARS: usize = 12;
    const MOST_SOURCES: usize = 60;
    /// Share of the picture that shows the sky.
    const SKY: f64 = 0.6;
    let sources = &detections.sources;
    let stars = sources
        .iter()
        .filter(|source| is_bright_star(source))
        .count();
    let is_sky = |index: &usize| {
        let [x, y] = cells.middle_px(*index);
        detections.shows_sky(&PixelPoint::new(x, y))
    };
    let shown: Vec<usize> = (0..cells.levels.len()).filter(is_sky).collect();
    if stars > MOST_STARS
        || sources.len() > MOST_SOURCES
        || (shown.len() as f64) < SKY * cells.levels.len() as f64
    {
        return None;
    }
    let left = without_surface(cells, &shown)?;
    let squares: f64 = shown.iter().map(|&index| left[index] * left[index]).sum();
    let rms = (squares / shown.len() as f64).sqrt();
    let dark = f64::from(light.lowest.min(0.0));
    let level = median_of(shown.iter().map(|&index| f64::from(cells.levels[index])))? - dark;
    let share = rms / level.max(f64::from(light.frame.step_adu));
    let is_above_noise = rms > f64::from(light.noise);
    let is_patchy = (LEAST..MOST).contains(&share)
        && is_above_noise
        && patches(cells, &left, rms) >= MIN_PATCHES;
    is_patchy.then_some(share)
}

/// Number of patches that are brighter or darker than around.
fn patches(cells: &Cells, left: &[f64], rms: f64) -> usize {
    /// Smallest patch, in cells.
    const MIN_CELLS: f64 = 12.0;
    let count = |sign: f64| {
        let is_patch = left.iter().map(|value| sign * value > 0.5 * rms);
        let regions = shapes(is_patch, cells.columns);
        regions
            .iter()
            .filter(|region| region.area() >= MIN_CELLS)
            .count()
    };
    count(1.0) + count(-1.0)
}

/// The levels of cells without the surface of second order that fits those shown; 0 elsewhere.
fn without_surface(cells: &Cells, shown: &[usize]) -> Option<Vec<f64>> {
    let terms = |index: usize| {
        let x = (index % cells.columns) as f64 / cells.columns as f64 - 0.5;
        let y = (index / cells.columns) as f64 / cells.rows as f64 - 0.5;
        SVector::<f64, TERMS>::from([1.0, x, y, x * x, x * y, y * y])
    };
    let mut matrix = SMatrix::<f64, TERMS, TERMS>::zeros();
    let mut vector = SVector::<f64, TERMS>::zeros();
    for &index in shown {
        let terms = terms(index);
        matrix += terms * terms.transpose();
        vector += terms * f64::from(cells.levels[index]);
    }
    let surface = matrix.cholesky()?.solve(&vector);
    let mut left = vec![0.0; cells.levels.len()];
    for &index in shown {
        left[index] = f64::from(cells.levels[index]) - surface.dot(&terms(index));
    }
    Some(left)
}
