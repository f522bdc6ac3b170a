//! Evenly lit frames, and what they tell of the detector: response of each pixel, gain, noise.
//!
//! [`Frame`]s, a dark → [`FlatStack`] → [`Flats`]
//!
//! 1. Of each frame the dark is subtracted, and it is divided by its own mean: the light may change from frame to frame.
//! 2. Mean and variance of every pixel over the frames; the mean, made 1 over the frame, is the master flat.
//! 3. The gain by photon transfer: of two frames of the same light the variance of the difference is twice that of a pixel,
//!    V = R² + S / g, with the read noise R and the signal S in ADU. The first and the second frame are a pair, the third
//!    and the fourth, and so on. Pairs of different light give a line, from whose slope g follows and from whose
//!    beginning R; of one light, R has to be known.
//! 4. The unevenness of the response: of all of it, lens and lamp included, and from pixel to pixel.
//!
//! Caveats: the light has to be that of the sky or of a screen, even over the field; what it is not goes into the flat. A
//! response that is not linear shows in the line as a wrong gain.
//!
//! # Reference
//! Janesick 2007, Photon Transfer, doi 10.1117/3.725073, ch. 5; EMVA Standard 1288, release 4.0 (2021), sect. 6.6 and 8.

mod report;
mod transfer;

pub use report::{FlatRow, FlatsReport, PairReport};
pub use transfer::{Gain, GainMethod, PairPoint};

use crate::calibration::darks::robust::{Typical, mean_and_sigma, typical_variance};
use crate::calibration::darks::{DarksError, PixelStack, pooled_variances};
use crate::frame::Frame;

/// With more than this part of its pixels saturated, a frame is no flat.
pub const MAX_SATURATED_SHARE: f64 = 0.01;
/// Two frames whose levels differ by more than this part are no pair.
const PAIR_LEVELS: f64 = 0.05;

/// Why frames are no flats.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FlatsError {
    /// A frame of another size.
    #[error(
        "{frame} has {width} x {height} pixels: expected {expected_width} x {expected_height}, as {of}"
    )]
    SizesDiffer {
        /// The frame.
        frame: String,
        /// Its columns.
        width: usize,
        /// Its rows.
        height: usize,
        /// The columns that are needed.
        expected_width: usize,
        /// The rows that are needed.
        expected_height: usize,
        /// What has that size.
        of: String,
    },
    /// A frame that is overexposed.
    #[error("{frame} is overexposed: found {:.1} % of its pixels saturated, expected at most {} %", share * 100.0, MAX_SATURATED_SHARE * 100.0)]
    Overexposed {
        /// The frame.
        frame: String,
        /// The part of its pixels.
        share: f64,
    },
    /// A frame no brighter than the dark.
    #[error(
        "{frame} has no light in it: found a mean of {level_adu} ADU above the dark, expected more than 0"
    )]
    NoLight {
        /// The frame.
        frame: String,
        /// Its mean level above the dark.
        level_adu: f64,
    },
    /// No frame, or no memory.
    #[error(transparent)]
    Stack(#[from] DarksError),
}

/// What is known of the detector.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FlatConfig {
    /// The dark, and what it is called.
    pub dark: Option<(String, Frame)>,
    /// The level without light where there is no dark, in ADU.
    pub bias_adu: f64,
    /// Noise of reading a pixel, in electrons.
    pub read_noise_e: Option<f64>,
}

/// One flat.
#[derive(Debug, Clone, PartialEq)]
pub struct FlatFrame {
    /// What it is called.
    pub frame: String,
    /// Its exposure, in seconds, where the file has it.
    pub exposure_s: Option<f64>,
    /// The mean of its pixels above the dark, in ADU.
    pub level_adu: f64,
    /// Pixels at full scale.
    pub saturated: usize,
}

/// Flats as they come in.
#[derive(Debug)]
pub struct FlatStack {
    config: FlatConfig,
    frames: Vec<FlatFrame>,
    size: (usize, usize),
    stack: Option<PixelStack>,
    /// The first of a pair, above the dark.
    first: Option<(f64, Vec<f32>)>,
    pairs: Vec<PairPoint>,
}

/// What flats tell.
#[derive(Debug, Clone, PartialEq)]
pub struct Flats {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Each frame.
    pub frames: Vec<FlatFrame>,
    /// The response of each pixel, with a mean of 1; NaN where it is not known.
    pub master: Vec<f32>,
    /// The standard deviation of the response over the whole frame, of its mean, lens and light included.
    pub nonuniformity: f64,
    /// That from one pixel to the next, without the noise left in the master; none of one frame alone.
    pub pixel_nonuniformity: Option<f64>,
    /// Electrons for a step of the grey level.
    pub gain: Option<Gain>,
    /// What the gain is from.
    pub pairs: Vec<PairPoint>,
}

impl FlatStack {
    /// A stack without frames.
    pub fn new(config: FlatConfig) -> Self {
        Self {
            config,
            frames: Vec::new(),
            size: (0, 0),
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
        let full_adu = frame.saturation_adu.unwrap_or(f32::INFINITY);
        let saturated = frame.pixels.iter().filter(|p| **p >= full_adu).count();
        let share = saturated as f64 / frame.pixels.len() as f64;
        if share > MAX_SATURATED_SHARE {
            return Err(FlatsError::Overexposed {
                frame: name.to_owned(),
                share,
            });
        }
        let bias_adu = self.config.bias_adu as f32;
        let dark = self.config.dark.as_ref().map(|(_, dark)| &dark.pixels);
        let above = |(i, &pixel): (usize, &f32)| {
            if pixel >= full_adu {
                f32::NAN
            } else {
                pixel - dark.map_or(bias_adu, |dark| dark[i])
            }
        };
        let above: Vec<f32> = frame.pixels.iter().enumerate().map(above).collect();
        let valid = above.iter().filter(|p| !p.is_nan());
        let level_adu = mean_and_sigma(valid.map(|&p| f64::from(p))).level;
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

    fn check_size(&mut self, name: &str, frame: &Frame) -> Result<(), FlatsError> {
        let found = (frame.width, frame.height);
        let (expected, of) = match (self.frames.first(), &self.config.dark) {
            (Some(first), _) => (self.size, first.frame.clone()),
            (None, Some((dark, pixels))) => {
                ((pixels.width, pixels.height), format!("the dark {dark}"))
            }
            (None, None) => (found, String::new()),
        };
        self.size = expected;
        if found == expected {
            return Ok(());
        }
        Err(FlatsError::SizesDiffer {
            frame: name.to_owned(),
            width: found.0,
            height: found.1,
            expected_width: expected.0,
            expected_height: expected.1,
            of,
        })
    }

    /// Keeps the first of a pair, or compares the second with it.
    fn pair(&mut self, level_adu: f64, above: Vec<f32>, step_adu: f64) {
        let Some((first_level, first)) = self.first.take() else {
            self.first = Some((level_adu, above));
            return;
        };
        if (first_level - level_adu).abs() <= PAIR_LEVELS * level_adu {
            let pair = [
                (first_level, first.as_slice()),
                (level_adu, above.as_slice()),
            ];
            self.pairs.extend(PairPoint::of(pair, step_adu));
        }
    }

    /// What the frames tell.
    /// # Errors
    /// [`DarksError::NoFrames`].
    pub fn measure(self) -> Result<Flats, FlatsError> {
        let Some(stack) = &self.stack else {
            return Err(DarksError::NoFrames.into());
        };
        let (width, height) = self.size;
        let mut master = stack.means();
        let valid = master.iter().filter(|p| !p.is_nan());
        let mean = mean_and_sigma(valid.map(|&p| f64::from(p))).level;
        master.iter_mut().for_each(|p| *p /= mean as f32);
        let typical = Typical::of(&master, 0.0).ok_or(DarksError::NoFrames)?;
        let count = stack.frames();
        let noise = (count > 1)
            .then(|| {
                typical_variance(
                    &pooled_variances([stack].into_iter(), master.len()),
                    (count - 1) as f64,
                )
            })
            .flatten();
        let pixel_nonuniformity = noise.and_then(|noise| {
            let steps = master
                .chunks(width)
                .flat_map(|row| row.windows(2).map(|pair| pair[1] - pair[0]));
            let steps = Typical::of(&steps.collect::<Vec<_>>(), 0.0)?;
            // Two pixels differ by twice the variance of one.
            Some(
                (steps.spread * steps.spread / 2.0 - noise / count as f64)
                    .max(0.0)
                    .sqrt(),
            )
        });
        Ok(Flats {
            width,
            height,
            nonuniformity: typical.spread,
            pixel_nonuniformity,
            gain: Gain::of(&self.pairs, self.config.read_noise_e),
            pairs: self.pairs,
            frames: self.frames,
            master,
        })
    }
}

#[cfg(test)]
mod tests;
