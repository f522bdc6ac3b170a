//! From the raw pixels to grey ones: a binomial kernel, in which every filter has a quarter of the
//! weight wherever it lies.

use crate::base::size::Size;
use crate::frame::Frame;

/// Fractions of a grey level that the kernel makes of one.
const LEVEL_PARTS: f32 = 16.0;

/// The smoothed frame. Rows and columns beyond the border are the mirror image of those inside,
/// which keeps their filters. A pixel beside one without a value has none.
pub(super) fn smoothed(raw: &Frame, saturation_adu: f32) -> Frame<'static> {
    let (width, height) = (raw.width, raw.height);
    let values = raw.values();
    let mut pixels = vec![0.0; values.len()];
    let mut down = vec![0.0; width];
    let row = |y: usize| &values[y * width..][..width];
    for (y, out) in pixels.chunks_exact_mut(width).enumerate() {
        let [above, below] = neighbors(y, height);
        let rows = row(above).iter().zip(row(y)).zip(row(below));
        for (sum, ((above, own), below)) in down.iter_mut().zip(rows) {
            *sum = above + 2.0 * own + below;
        }
        for (x, pixel) in out.iter_mut().enumerate() {
            let [left, right] = neighbors(x, width);
            *pixel = (down[left] + 2.0 * down[x] + down[right]) / LEVEL_PARTS;
        }
    }
    mark_saturated(&values, raw.size(), saturation_adu, &mut pixels);
    let saturation = saturation_adu.is_finite().then_some(saturation_adu);
    Frame::from_checked(width, height, pixels)
        .with_levels(raw.step_adu / LEVEL_PARTS, saturation)
        .with_metadata(raw.metadata.clone())
}

/// The places before and after `at`, along an axis of `side` pixels.
fn neighbors(at: usize, side: usize) -> [usize; 2] {
    let before = if at == 0 { 1 } else { at - 1 };
    let after = if at + 1 == side { side - 2 } else { at + 1 };
    [before, after]
}

/// Saturates the pixels around saturated ones: part of their light is unknown.
fn mark_saturated(values: &[f32], size: Size, saturation_adu: f32, pixels: &mut [f32]) {
    let Size { width, height } = size;
    let saturated = values.iter().enumerate();
    for (i, _) in saturated.filter(|(_, value)| **value >= saturation_adu) {
        let (x, y) = (i % width, i / width);
        for row in y.saturating_sub(1)..(y + 2).min(height) {
            for column in x.saturating_sub(1)..(x + 2).min(width) {
                let pixel = &mut pixels[row * width + column];
                // NaN stays.
                if *pixel < saturation_adu {
                    *pixel = saturation_adu;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn frame(width: usize, height: usize, value: impl Fn(usize, usize) -> f32) -> Frame<'static> {
        let pixels = (0..width * height).map(|i| value(i % width, i / width));
        Frame::new(width, height, pixels.collect()).unwrap()
    }

    proptest! {
        #[test]
        fn four_levels_become_one_at_every_pixel(
            levels in proptest::array::uniform4(0.0f32..1000.0),
            width in 4usize..20,
            height in 4usize..20,
        ) {
            let raw = frame(width, height, |x, y| levels[2 * (y % 2) + x % 2]);
            let mean = levels.iter().sum::<f32>() / 4.0;
            for value in smoothed(&raw, f32::INFINITY).values().iter() {
                prop_assert!((value - mean).abs() < 1e-3, "{value} for {mean}");
            }
        }

        #[test]
        fn light_is_kept_and_its_centre_stays(x in 2usize..9, y in 2usize..7, light in 1.0f32..1e4) {
            let raw = frame(12, 10, |i, j| if (i, j) == (x, y) { light } else { 0.0 });
            let grey = smoothed(&raw, f32::INFINITY);
            let sum = |of: &dyn Fn(usize, usize) -> f32| -> f32 {
                (0..120).map(|i| of(i % 12, i / 12) * grey.at(i % 12, i / 12)).sum()
            };
            let total = sum(&|_, _| 1.0);
            prop_assert!((total / light - 1.0).abs() < 1e-4);
            prop_assert!((sum(&|i, _| i as f32) / total - x as f32).abs() < 1e-3);
            prop_assert!((sum(&|_, j| j as f32) / total - y as f32).abs() < 1e-3);
        }
    }

    #[test]
    fn what_is_saturated_or_unknown_is_so_all_around() {
        let raw = frame(12, 10, |x, y| match (x, y) {
            (3, 3) => 4095.0,
            (8, 6) => f32::NAN,
            _ => 100.0,
        });
        let grey = smoothed(&raw, 4095.0);
        for (x, y) in (0..120_usize).map(|i| (i % 12, i / 12)) {
            let near = |px: usize, py: usize| x.abs_diff(px) <= 1 && y.abs_diff(py) <= 1;
            let value = grey.at(x, y);
            if near(8, 6) {
                assert!(value.is_nan());
            } else if near(3, 3) {
                assert_eq!(value, 4095.0);
            } else {
                assert_eq!(value, 100.0);
            }
        }
    }

    #[test]
    fn noise_and_width_are_as_stated() {
        use crate::frame::Mosaic;
        let raw = frame(9, 9, |x, y| if (x, y) == (4, 4) { 1.0 } else { 0.0 });
        let grey = smoothed(&raw, f32::INFINITY);
        let sum = |of: &dyn Fn(usize) -> f64| -> f64 { (0..81).map(of).sum() };
        let k = |i: usize| f64::from(grey.at(i % 9, i / 9));
        let noise2 = sum(&|i| k(i).powi(2));
        assert!((noise2.sqrt() - Mosaic::NOISE_RATIO).abs() < 1e-6);
        let variance_px2 = sum(&|i| k(i) * (i as f64 % 9.0 - 4.0).powi(2));
        assert!((variance_px2 - Mosaic::ADDED_VARIANCE_PX2).abs() < 1e-6);
    }
}
