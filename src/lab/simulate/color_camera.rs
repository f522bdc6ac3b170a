//! A frame as color cameras and phones record it: a mosaic of colors, demosaiced, smoothed against
//! noise, a tone curve, eight bits, JPEG.

use crate::base::size::Size;
use crate::camera::data_sheet::Imperfections;
use crate::frame::{self, Frame, FrameError};
use image::ExtendedColorType;
use image::codecs::jpeg::JpegEncoder;

/// The largest level of eight bits.
const WHITE: f64 = 255.0;
/// Black is this many standard deviations of the noise below the sky.
const BLACK_SIGMAS: f64 = 4.0;

/// The processing of a color camera.
#[derive(Debug, Clone, Copy)]
pub(super) struct ColorCamera {
    jpeg_quality: u8,
    tone_gamma: f64,
    denoise_px: f64,
    /// The levels that become black and white.
    black_adu: f64,
    white_adu: f64,
}

impl ColorCamera {
    /// The camera's processing, if it has any, of frames whose background has this level and noise.
    pub fn new(
        made: &Imperfections,
        level_adu: f64,
        noise_adu: f64,
        white_adu: f64,
    ) -> Option<Self> {
        (made.jpeg_quality > 0.0).then_some(Self {
            jpeg_quality: made.jpeg_quality.round().clamp(1.0, 100.0) as u8,
            tone_gamma: made.tone_gamma,
            denoise_px: made.denoise_px,
            black_adu: level_adu - BLACK_SIGMAS * noise_adu,
            white_adu,
        })
    }

    /// `frame` as it is recorded.
    ///
    /// # Errors
    /// [`FrameError`] if no JPEG can have its size.
    pub fn record(&self, frame: &Frame) -> Result<Frame<'static>, FrameError> {
        let range_adu = self.white_adu - self.black_adu;
        let linear = |pixel: &f32| (f64::from(*pixel) - self.black_adu) / range_adu;
        let mosaic: Vec<f64> = frame.values().iter().map(linear).collect();
        let mut colors = demosaiced(&mosaic, frame.width, frame.height);
        if self.denoise_px > 0.0 {
            smooth(&mut colors, frame.width, self.denoise_px);
        }
        let exponent = 1.0 / self.tone_gamma;
        let tone = |linear: f64| (WHITE * libm::pow(linear.clamp(0.0, 1.0), exponent)).round();
        let samples: Vec<u8> = colors.iter().flatten().map(|c| tone(*c) as u8).collect();
        decoded_jpeg(
            &samples,
            frame.size(),
            ExtendedColorType::Rgb8,
            self.jpeg_quality,
        )
    }
}

/// The color of a pixel of the mosaic: RGGB.
pub const fn color(x: usize, y: usize) -> usize {
    match (x % 2, y % 2) {
        (0, 0) => 0,
        (1, 1) => 2,
        _ => 1,
    }
}

/// Bilinear interpolation: each color is the mean of the pixels with it among the 3 × 3 around.
pub fn demosaiced(mosaic: &[f64], width: usize, height: usize) -> Vec<[f64; 3]> {
    let mut colors = Vec::with_capacity(mosaic.len());
    for y in 0..height {
        for x in 0..width {
            let mut sums = [(0.0, 0.0); 3];
            for row in y.saturating_sub(1)..(y + 2).min(height) {
                for column in x.saturating_sub(1)..(x + 2).min(width) {
                    // Of four neighbors with one color all count alike; a pixel's own color is
                    // its own value.
                    let is_own = row == y && column == x;
                    let (sum, count) = &mut sums[color(column, row)];
                    if is_own || color(column, row) != color(x, y) {
                        *sum += mosaic[row * width + column];
                        *count += 1.0;
                    }
                }
            }
            colors.push(sums.map(|(sum, count): (f64, f64)| sum / count.max(1.0)));
        }
    }
    colors
}

/// Smooths `colors` with a Gaussian, along the rows and then along the columns.
fn smooth(colors: &mut [[f64; 3]], width: usize, sigma_px: f64) {
    let reach = (3.0 * sigma_px).ceil() as usize;
    let weight = |distance: usize| libm::exp(-0.5 * (distance as f64 / sigma_px).powi(2));
    let weights: Vec<f64> = (0..=reach).map(weight).collect();
    for (stride, length) in [(1, width), (width, colors.len() / width)] {
        let before = colors.to_vec();
        for (place, pixel) in colors.iter_mut().enumerate() {
            let at = place / stride % length;
            let first = place - at * stride;
            let (mut sums, mut total) = ([0.0; 3], 0.0);
            for other in at.saturating_sub(reach)..(at + reach + 1).min(length) {
                let weight = weights[other.abs_diff(at)];
                let color = before[first + other * stride];
                total += weight;
                for (sum, value) in sums.iter_mut().zip(color) {
                    *sum += weight * value;
                }
            }
            *pixel = sums.map(|sum| sum / total);
        }
    }
}

/// The frame that is read from the JPEG of these samples.
///
/// # Errors
/// [`FrameError`] if no JPEG can have its size.
pub fn decoded_jpeg(
    samples: &[u8],
    size: Size,
    form: ExtendedColorType,
    quality: u8,
) -> Result<Frame<'static>, FrameError> {
    let mut bytes = Vec::new();
    let mut encoder = JpegEncoder::new_with_quality(&mut bytes, quality);
    encoder
        .encode(samples, size.width as u32, size.height as u32, form)
        .map_err(std::io::Error::other)?;
    frame::decode(&bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_even_mosaic_has_even_colors() {
        let mut colors = demosaiced(&[0.25; 9 * 8], 9, 8);
        smooth(&mut colors, 9, 1.0);
        let is_even = |color: &[f64; 3]| color.iter().all(|c| (c - 0.25).abs() < 1e-12);
        assert!(colors.len() == 72 && colors.iter().all(is_even));
    }

    #[test]
    fn smoothing_spreads_a_point_by_its_standard_deviation() {
        let mut colors = vec![[0.0; 3]; 21 * 21];
        colors[10 * 21 + 10] = [1.0; 3];
        smooth(&mut colors, 21, 1.5);
        let sum: f64 = colors.iter().map(|c| c[0]).sum();
        let offset = |i: usize| i as f64 - 10.0;
        let moment = |of: &dyn Fn(usize) -> f64| {
            let terms = colors.iter().enumerate().map(|(i, c)| c[0] * of(i));
            terms.sum::<f64>() / sum
        };
        assert!((sum - 1.0).abs() < 1e-9);
        for variance in [
            moment(&|i| offset(i % 21).powi(2)),
            moment(&|i| offset(i / 21).powi(2)),
        ] {
            assert!((variance - 2.25).abs() < 0.1, "{variance}");
        }
    }

    #[test]
    fn a_tone_curve_brightens_the_shadows_and_the_levels_are_those_of_eight_bits() {
        let made = Imperfections {
            jpeg_quality: 95.0,
            tone_gamma: 2.2,
            ..Imperfections::default()
        };
        assert!(ColorCamera::new(&Imperfections::default(), 100.0, 5.0, 4095.0).is_none());
        let camera = ColorCamera::new(&made, 120.0, 5.0, 1100.0).unwrap();
        let frame = Frame::new(64, 48, vec![350.0; 64 * 48]).unwrap();
        let recorded = camera.record(&frame).unwrap();
        assert_eq!((recorded.width, recorded.height), (64, 48));
        // A quarter of the range.
        let expected = 255.0 * 0.25f32.powf(1.0 / 2.2);
        assert!(recorded.values().iter().all(|p| (p - expected).abs() < 1.5));
    }
}
