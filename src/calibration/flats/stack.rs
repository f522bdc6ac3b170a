//! Accumulates flats and measures the detector from them.

use super::error::{FlatsError, MAX_SATURATED_FRACTION};
use super::transfer::{Gain, PairPoint};
use crate::base::size::Size;
use crate::calibration::pixel_stack::{PixelStack, pooled_variances};
use crate::calibration::robust::{RobustMoments, typical_variance};
use crate::frame::Frame;

/// What is known of the detector.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FlatConfig {
    /// Name and frame of the dark.
    pub dark: Option<(String, Frame<'static>)>,
    /// Bias, in ADU, if there is no dark.
    pub bias_adu: f64,
    /// Read noise of a pixel, in electrons.
    pub read_noise_e: Option<f64>,
}

/// One flat.
#[derive(Debug, Clone, PartialEq)]
pub struct FlatFrame {
    /// Name of the frame.
    pub frame: String,
    /// Exposure in seconds, if known.
    pub exposure_s: Option<f64>,
    /// Mean of the pixels above the dark, in ADU.
    pub level_adu: f64,
    /// Number of pixels at full scale.
    pub saturated: usize,
}

/// Accumulates flats.
#[derive(Debug)]
pub struct FlatStack {
    config: FlatConfig,
    frames: Vec<FlatFrame>,
    size: Size,
    stack: Option<PixelStack>,
    /// Level and pixels above the dark of the first frame of a pair.
    first: Option<(f64, Vec<f32>)>,
    pairs: Vec<PairPoint>,
}

/// Properties of a detector, measured from flats.
#[derive(Debug, Clone, PartialEq)]
pub struct Flats {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Each frame.
    pub frames: Vec<FlatFrame>,
    /// Response of each pixel, with a mean of 1; NaN if it is unknown.
    pub master: Vec<f32>,
    /// Standard deviation of the response over the frame, relative to its mean, lens and light
    /// included.
    pub nonuniformity: f64,
    /// Standard deviation from pixel to pixel, without the noise left in the master; `None` from
    /// one frame.
    pub pixel_nonuniformity: Option<f64>,
    /// Gain.
    pub gain: Option<Gain>,
    /// The pairs from which the gain was measured.
    pub pairs: Vec<PairPoint>,
}

impl FlatStack {
    /// An empty stack.
    pub fn new(config: FlatConfig) -> Self {
        Self {
            config,
            frames: Vec::new(),
            size: Size::default(),
            stack: None,
            first: None,
            pairs: Vec::new(),
        }
    }

    /// Adds the frame called `name`.
    /// # Errors
    /// [`FlatsError`].
    pub fn add(&mut self, name: &str, frame: &Frame) -> Result<(), FlatsError> {
        self.check_size(name, frame)?;
        let saturated = saturated_pixels(name, frame)?;
        let above = self.above_dark(frame);
        let valid = above.iter().filter(|p| !p.is_nan());
        let level_adu = RobustMoments::of(valid.map(|&p| f64::from(p))).mean;
        if level_adu <= 0.0 {
            return Err(FlatsError::NoLight {
                frame: name.to_owned(),
                level_adu,
            });
        }
        let stack = match &mut self.stack {
            Some(stack) => stack,
            none => none.insert(PixelStack::new(above.len())?),
        };
        stack.add(above.iter().map(|p| p / level_adu as f32));
        self.frames.push(FlatFrame {
            frame: name.to_owned(),
            exposure_s: frame.metadata.exposure_s,
            level_adu,
            saturated,
        });
        self.pair(level_adu, above, f64::from(frame.step_adu));
        Ok(())
    }

    /// The pixels of `frame` minus the dark or the bias; NaN if saturated.
    fn above_dark(&self, frame: &Frame) -> Vec<f32> {
        let full_adu = frame.saturation_adu.unwrap_or(f32::INFINITY);
        let bias_adu = self.config.bias_adu as f32;
        let dark = self.config.dark.as_ref().map(|(_, dark)| dark.values());
        let above = |(i, &pixel): (usize, &f32)| {
            if pixel >= full_adu {
                f32::NAN
            } else {
                pixel - dark.as_ref().map_or(bias_adu, |dark| dark[i])
            }
        };
        frame.values().iter().enumerate().map(above).collect()
    }

    fn check_size(&mut self, name: &str, frame: &Frame) -> Result<(), FlatsError> {
        let found = frame.size();
        let (expected, of) = match (self.frames.first(), &self.config.dark) {
            (Some(first), _) => (self.size, first.frame.clone()),
            (None, Some((dark, pixels))) => (pixels.size(), format!("the dark {dark}")),
            (None, None) => (found, String::new()),
        };
        self.size = expected;
        if found == expected {
            return Ok(());
        }
        Err(FlatsError::SizesDiffer {
            frame: name.to_owned(),
            width: found.width,
            height: found.height,
            expected_width: expected.width,
            expected_height: expected.height,
            of,
        })
    }

    /// Keeps the first frame of a pair, or compares the second with it.
    fn pair(&mut self, level_adu: f64, above: Vec<f32>, step_adu: f64) {
        /// Maximum relative difference of level within a pair.
        const MAX_DIFFERENCE: f64 = 0.05;
        let Some((first_level, first)) = self.first.take() else {
            self.first = Some((level_adu, above));
            return;
        };
        if (first_level - level_adu).abs() <= MAX_DIFFERENCE * level_adu {
            let pair = [
                (first_level, first.as_slice()),
                (level_adu, above.as_slice()),
            ];
            self.pairs.extend(PairPoint::measure(pair, step_adu));
        }
    }

    /// Measures the detector from the frames added.
    /// # Errors
    /// [`FlatsError::NoFrames`].
    pub fn measure(self) -> Result<Flats, FlatsError> {
        let Some(stack) = &self.stack else {
            return Err(FlatsError::NoFrames);
        };
        let Size { width, height } = self.size;
        let mut master = stack.means();
        let valid = master.iter().filter(|p| !p.is_nan());
        let mean = RobustMoments::of(valid.map(|&p| f64::from(p))).mean;
        master.iter_mut().for_each(|p| *p /= mean as f32);
        let moments = RobustMoments::clipped(&master, 0.0).ok_or(FlatsError::NoFrames)?;
        Ok(Flats {
            width,
            height,
            nonuniformity: moments.sigma,
            pixel_nonuniformity: pixel_nonuniformity(&master, width, stack),
            gain: Gain::measure(&self.pairs, self.config.read_noise_e),
            pairs: self.pairs,
            frames: self.frames,
            master,
        })
    }
}

/// The number of saturated pixels of `frame`, which must be at most [`MAX_SATURATED_FRACTION`].
fn saturated_pixels(name: &str, frame: &Frame) -> Result<usize, FlatsError> {
    let full_adu = frame.saturation_adu.unwrap_or(f32::INFINITY);
    let saturated = frame.values().iter().filter(|p| **p >= full_adu).count();
    let share = saturated as f64 / frame.pixels.len() as f64;
    if share > MAX_SATURATED_FRACTION {
        return Err(FlatsError::Overexposed {
            frame: name.to_owned(),
            share,
        });
    }
    Ok(saturated)
}

/// The standard deviation of the response from pixel to pixel, without the noise left in the
/// master.
fn pixel_nonuniformity(master: &[f32], width: usize, stack: &PixelStack) -> Option<f64> {
    let count = stack.frames();
    if count < 2 {
        return None;
    }
    let variances = pooled_variances([stack].into_iter(), master.len());
    let noise = typical_variance(&variances, (count - 1) as f64)?;
    let differences: Vec<f32> = master
        .chunks(width)
        .flat_map(|row| row.windows(2).map(|pair| pair[1] - pair[0]))
        .collect();
    let sigma = RobustMoments::clipped(&differences, 0.0)?.sigma;
    // The difference of two pixels has twice the variance of one.
    Some((sigma * sigma / 2.0 - noise / count as f64).max(0.0).sqrt())
}
