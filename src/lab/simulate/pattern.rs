//! Fixed pattern: differences between pixels that are the same in every frame of a camera.

use crate::camera::data_sheet::DataSheet;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// The fixed pattern of a detector, row-major; a part without variation is `None`.
#[derive(Debug, Clone, Default)]
pub(super) struct DetectorPattern {
    /// Response to light, relative to its mean.
    pub(super) response: Option<Vec<f32>>,
    /// Dark current, in electrons per second.
    pub(super) dark_current_e_s: Option<Vec<f32>>,
    /// Difference of the bias from its mean, in ADU.
    pub(super) offset_adu: Option<Vec<f32>>,
}

/// Streams of random numbers: each part of the pattern is independent of the others.
#[derive(Clone, Copy)]
enum PatternStream {
    Response,
    Dead,
    DarkCurrent,
    Hot,
    Offset,
    Column,
}

impl DetectorPattern {
    pub(super) fn generate(sheet: &DataSheet) -> Self {
        let made = &sheet.imperfections;
        let has_response = made.response_sigma > 0.0 || made.dead_pixels_per_mpx > 0.0;
        let has_dark = made.dark_current_sigma > 0.0 && sheet.dark_current_e_s > 0.0;
        let has_hot = made.hot_pixels_per_mpx > 0.0 && made.hot_pixel_e_s > 0.0;
        let has_offset = made.offset_sigma_adu > 0.0 || made.column_sigma_adu > 0.0;
        Self {
            response: has_response.then(|| response(sheet)),
            dark_current_e_s: (has_dark || has_hot).then(|| dark_current(sheet)),
            offset_adu: has_offset.then(|| offset(sheet)),
        }
    }
}

fn random(sheet: &DataSheet, stream: PatternStream) -> ChaCha8Rng {
    let mut random = ChaCha8Rng::seed_from_u64(sheet.imperfections.pattern_seed as u64);
    random.set_stream(stream as u64);
    random
}

fn normal(random: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(random)
}

fn pixels(sheet: &DataSheet) -> usize {
    sheet.width_px * sheet.height_px
}

/// Whether each pixel is chosen, at a rate per million pixels.
fn chosen(sheet: &DataSheet, per_mpx: f64, stream: PatternStream) -> impl Iterator<Item = bool> {
    let mut random = random(sheet, stream);
    std::iter::repeat_with(move || random.random::<f64>() * 1e6 < per_mpx)
}

fn response(sheet: &DataSheet) -> Vec<f32> {
    let made = &sheet.imperfections;
    let mut random = random(sheet, PatternStream::Response);
    let dead = chosen(sheet, made.dead_pixels_per_mpx, PatternStream::Dead);
    dead.take(pixels(sheet))
        .map(|is_dead| {
            let response = (1.0 + made.response_sigma * normal(&mut random)).max(0.0);
            if is_dead { 0.0 } else { response as f32 }
        })
        .collect()
}

fn dark_current(sheet: &DataSheet) -> Vec<f32> {
    let made = &sheet.imperfections;
    let mut random_current = random(sheet, PatternStream::DarkCurrent);
    let mut random_hot = random(sheet, PatternStream::Hot);
    // Variance of the logarithm of a log-normal distribution of mean 1 and this standard deviation.
    let log_variance = libm::log1p(made.dark_current_sigma.powi(2));
    (0..pixels(sheet))
        .map(|_| {
            let spread = log_variance.sqrt() * normal(&mut random_current) - 0.5 * log_variance;
            let current_e_s = sheet.dark_current_e_s * libm::exp(spread);
            let is_hot = random_hot.random::<f64>() * 1e6 < made.hot_pixels_per_mpx;
            let hot_e_s = if is_hot {
                -made.hot_pixel_e_s * libm::log1p(-random_hot.random::<f64>())
            } else {
                0.0
            };
            (current_e_s + hot_e_s) as f32
        })
        .collect()
}

fn offset(sheet: &DataSheet) -> Vec<f32> {
    let made = &sheet.imperfections;
    let mut random_column = random(sheet, PatternStream::Column);
    let mut column = || made.column_sigma_adu * normal(&mut random_column);
    let columns: Vec<f64> = (0..sheet.width_px).map(|_| column()).collect();
    let mut random_pixel = random(sheet, PatternStream::Offset);
    let mut offset = |i: usize| {
        let own = made.offset_sigma_adu * normal(&mut random_pixel);
        (columns[i % sheet.width_px] + own) as f32
    };
    (0..pixels(sheet)).map(&mut offset).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::data_sheet::Preset;

    fn data_sheet() -> DataSheet {
        let mut sheet = Preset::NanosatTracker.data_sheet();
        (sheet.width_px, sheet.height_px) = (500, 400);
        sheet.dark_current_e_s = 20.0;
        sheet
    }

    fn moments(values: &[f32]) -> (f64, f64) {
        let count = values.len() as f64;
        let mean = values.iter().map(|v| f64::from(*v)).sum::<f64>() / count;
        let squares = values.iter().map(|v| (f64::from(*v) - mean).powi(2));
        (mean, (squares.sum::<f64>() / count).sqrt())
    }

    #[test]
    fn a_perfect_detector_has_none() {
        let pattern = DetectorPattern::generate(&data_sheet());
        assert!(pattern.response.is_none() && pattern.dark_current_e_s.is_none());
        assert!(pattern.offset_adu.is_none());
    }

    #[test]
    fn each_part_has_the_spread_that_is_asked_for() {
        let mut sheet = data_sheet();
        sheet.imperfections.response_sigma = 0.02;
        sheet.imperfections.dark_current_sigma = 0.3;
        sheet.imperfections.offset_sigma_adu = 2.0;
        sheet.imperfections.column_sigma_adu = 1.0;
        let pattern = DetectorPattern::generate(&sheet);
        let (mean, sigma) = moments(&pattern.response.unwrap());
        assert!(
            (mean - 1.0).abs() < 3e-4 && (sigma - 0.02).abs() < 2e-4,
            "{mean} {sigma}"
        );
        let (mean, sigma) = moments(&pattern.dark_current_e_s.unwrap());
        assert!(
            (mean - 20.0).abs() < 0.08 && (sigma - 6.0).abs() < 0.1,
            "{mean} {sigma}"
        );
        let offset = pattern.offset_adu.unwrap();
        let (_, sigma) = moments(&offset);
        assert!((sigma - 5f64.sqrt()).abs() < 0.1, "{sigma}");
        // The offset of a column is common to its pixels.
        let column: Vec<f32> = offset.iter().step_by(500).copied().collect();
        assert!((moments(&column).1 - 2.0).abs() < 0.4);
    }

    #[test]
    fn hot_and_dead_pixels_are_as_many_as_they_should_be() {
        let mut sheet = data_sheet();
        sheet.imperfections.hot_pixels_per_mpx = 5000.0;
        sheet.imperfections.dead_pixels_per_mpx = 1000.0;
        let pattern = DetectorPattern::generate(&sheet);
        let dark = pattern.dark_current_e_s.unwrap();
        let hot: Vec<f32> = dark.iter().copied().filter(|e| *e > 20.001).collect();
        // 1000 and 200 in 0.2 million; five standard errors.
        assert!((hot.len() as f64 - 1000.0).abs() < 160.0, "{}", hot.len());
        assert!((moments(&hot).0 - 1020.0).abs() < 160.0);
        let dead = pattern
            .response
            .unwrap()
            .iter()
            .filter(|r| **r == 0.0)
            .count();
        assert!((dead as f64 - 200.0).abs() < 71.0, "{dead}");
    }
}
