//! A frame without what the detector adds to it: pattern of the dark, unequal response, hot pixels.
//!
//! Master dark, master flat, list of hot pixels → [`Calibration`]; [`Frame`] → the same frame, calibrated.
//!
//! value = L + (value − dark) / flat, with L the median of the dark: its pattern goes, and the frame's level stays what it
//! was, bias and all. Without a dark the flat divides about the level that is given, else about 0.
//!
//! - Hot pixels, and those where the dark or the flat has no use, become pixels without a value (NaN).
//! - Saturated pixels stay saturated: where dividing lifts others above full scale, full scale is lifted, too.
//! - A flat is taken as relative: its mean is made 1.
//!
//! Caveats: the dark is not scaled to another exposure; its dark current is then too large or too small, and a note says so.

pub mod darks;
pub mod flats;
mod hot;

pub use hot::{HotPixelList, read_hot_pixels};

use crate::base::statistics::median;
use crate::frame::Frame;
use std::fmt;
use std::path::PathBuf;

/// With more than this part of its pixels of no use, a flat or a list of hot pixels is a mistake.
pub const MAX_BAD_SHARE: f64 = 0.1;
/// A response below this part of the mean says nothing of what falls on the pixel.
const LEAST_RESPONSE: f32 = 0.01;
/// Exposures that differ by more than this part are different.
const SAME_EXPOSURE: f64 = 1e-3;

/// Why a frame cannot be calibrated.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CalibrationError {
    /// A master has another size than the frame or the other master.
    #[error(
        "{what} {name} has {width} x {height} pixels: expected {expected_width} x {expected_height}, as {of}"
    )]
    SizesDiffer {
        /// `the dark`, `the flat`.
        what: &'static str,
        /// Its file.
        name: String,
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
    /// Too many pixels of a master are of no use.
    #[error("{what} {name}: found {bad} of {pixels} pixels {found}, expected at most {} %", MAX_BAD_SHARE * 100.0)]
    TooManyBad {
        /// `the dark`, `the flat`, `the hot pixels`.
        what: &'static str,
        /// The file.
        name: String,
        /// The pixels of no use.
        bad: usize,
        /// All pixels.
        pixels: usize,
        /// What is wrong with them.
        found: &'static str,
    },
    /// A hot pixel that is not on the frame.
    #[error("{}, line {line}: found the pixel ({x}, {y}), expected x below {width} and y below {height}", path.display())]
    Outside {
        /// The list.
        path: PathBuf,
        /// The line in it, from 1.
        line: u64,
        /// Column.
        x: usize,
        /// Row.
        y: usize,
        /// Columns of the frame.
        width: usize,
        /// Rows of the frame.
        height: usize,
    },
    /// The list of hot pixels cannot be read.
    #[error("{}: {source}", path.display())]
    List {
        /// The list.
        path: PathBuf,
        /// What is wrong.
        source: csv::Error,
    },
    /// The list of hot pixels has something that is no pixel.
    #[error("{}, line {line}: found {found}, expected {expected}", path.display())]
    Malformed {
        /// The list.
        path: PathBuf,
        /// The line in it, from 1.
        line: u64,
        /// What is there.
        found: String,
        /// What should be.
        expected: &'static str,
    },
    /// Nothing is left of a frame.
    #[error("no pixel of the frame is left with a value")]
    NothingLeft,
}

/// A master frame and what it is called.
#[derive(Debug, Clone, PartialEq)]
pub struct Master {
    /// Its file.
    pub name: String,
    /// Its pixels.
    pub frame: Frame,
}

/// What is taken out of frames.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Calibration {
    dark: Option<Master>,
    flat: Option<Master>,
    hot_pixels: Option<HotPixelList>,
    /// The level about which a flat divides.
    level_adu: f32,
}

/// What was taken out of a frame: the files.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Applied {
    /// The dark.
    pub dark: Option<String>,
    /// The flat.
    pub flat: Option<String>,
    /// The list of hot pixels.
    pub hot_pixels: Option<String>,
}

impl Calibration {
    /// What `dark`, `flat` and `hot_pixels` take out of frames. Without a dark, a flat divides about `bias_adu`.
    /// # Errors
    /// [`CalibrationError::SizesDiffer`], [`CalibrationError::TooManyBad`].
    pub fn new(
        dark: Option<Master>,
        flat: Option<Master>,
        hot_pixels: Option<HotPixelList>,
        bias_adu: f64,
    ) -> Result<Self, CalibrationError> {
        if let (Some(dark), Some(flat)) = (&dark, &flat) {
            check_size(
                "the flat",
                flat,
                &dark.frame,
                &format!("the dark {}", dark.name),
            )?;
        }
        let mut level_adu = bias_adu as f32;
        if let Some(dark) = &dark {
            let valid = dark.frame.pixels.iter().filter(|p| !p.is_nan());
            let mut levels: Vec<f64> = valid.map(|&p| f64::from(p)).collect();
            let bad = dark.frame.pixels.len() - levels.len();
            check_bad("the dark", &dark.name, bad, &dark.frame, "without a value")?;
            level_adu = median(&mut levels) as f32;
        }
        let flat = flat.map(relative).transpose()?;
        Ok(Self {
            dark,
            flat,
            hot_pixels,
            level_adu,
        })
    }

    /// The files that it is made of.
    pub fn applied(&self) -> Applied {
        let name = |master: &Option<Master>| master.as_ref().map(|master| master.name.clone());
        let list = self.hot_pixels.as_ref();
        Applied {
            dark: name(&self.dark),
            flat: name(&self.flat),
            hot_pixels: list.map(|list| list.path().display().to_string()),
        }
    }

    /// Calibrates `frame`.
    /// # Errors
    /// [`CalibrationError::SizesDiffer`], [`CalibrationError::Outside`], [`CalibrationError::TooManyBad`],
    /// [`CalibrationError::NothingLeft`]; the frame is then as it was, except for the last.
    pub fn apply(&self, frame: &mut Frame) -> Result<(), CalibrationError> {
        for (what, master) in [("the dark", &self.dark), ("the flat", &self.flat)] {
            if let Some(master) = master {
                check_size(what, master, frame, "the frame")?;
            }
        }
        if let Some(list) = &self.hot_pixels {
            list.check(frame)?;
        }
        let full_adu = frame.saturation_adu.unwrap_or(f32::INFINITY);
        let mut highest = full_adu;
        let saturated = |pixel: f32| pixel >= full_adu;
        let was_full: Vec<usize> = (0..frame.pixels.len())
            .filter(|&i| saturated(frame.pixels[i]))
            .collect();
        for (i, pixel) in frame.pixels.iter_mut().enumerate() {
            let dark = self
                .dark
                .as_ref()
                .map_or(self.level_adu, |dark| dark.frame.pixels[i]);
            let response = self.flat.as_ref().map_or(1.0, |flat| flat.frame.pixels[i]);
            let is_full = saturated(*pixel);
            *pixel = self.level_adu + (*pixel - dark) / response;
            if !is_full && *pixel >= highest {
                highest = pixel.next_up();
            }
        }
        // Whatever was saturated stays so, unless the dark or the flat has no use there.
        for i in was_full {
            if !frame.pixels[i].is_nan() {
                frame.pixels[i] = highest;
            }
        }
        frame.saturation_adu = frame.saturation_adu.map(|_| highest);
        if let Some(list) = &self.hot_pixels {
            for (x, y) in list.pixels() {
                frame.pixels[y * frame.width + x] = f32::NAN;
            }
        }
        if frame.pixels.iter().all(|pixel| pixel.is_nan()) {
            return Err(CalibrationError::NothingLeft);
        }
        Ok(())
    }

    /// The dark's exposure, where it differs from the frame's.
    pub fn exposure_mismatch(&self, frame_exposure_s: Option<f64>) -> Option<ExposureMismatch> {
        let dark = self.dark.as_ref()?;
        let (dark_s, frame_s) = (dark.frame.metadata.exposure_s?, frame_exposure_s?);
        let differs = (dark_s - frame_s).abs() > SAME_EXPOSURE * dark_s.max(frame_s);
        differs.then(|| ExposureMismatch {
            dark: dark.name.clone(),
            dark_exposure_s: dark_s,
            frame_exposure_s: frame_s,
        })
    }
}

/// A dark whose exposure is not the frame's: its dark current is wrong for the frame.
#[derive(Debug, Clone, PartialEq)]
pub struct ExposureMismatch {
    /// Name of the dark.
    pub dark: String,
    /// Exposure of the dark, in seconds.
    pub dark_exposure_s: f64,
    /// Exposure of the frame, in seconds.
    pub frame_exposure_s: f64,
}

impl fmt::Display for ExposureMismatch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "the dark {} was exposed for {} s and the frame for {} s: its dark current is not the frame's",
            self.dark, self.dark_exposure_s, self.frame_exposure_s
        )
    }
}

/// The flat with a mean of 1, and without what is of no use in it.
fn relative(mut flat: Master) -> Result<Master, CalibrationError> {
    let pixels = &mut flat.frame.pixels;
    let positive = pixels.iter().filter(|p| **p > 0.0);
    let (count, sum) = positive.fold((0_u64, 0.0), |(n, sum), &p| (n + 1, sum + f64::from(p)));
    let mean = (sum / count.max(1) as f64) as f32;
    let mut bad = 0;
    for pixel in pixels.iter_mut() {
        *pixel /= mean;
        // NaN is no response either.
        if pixel.is_nan() || *pixel < LEAST_RESPONSE {
            bad += 1;
            *pixel = f32::NAN;
        }
    }
    check_bad(
        "the flat",
        &flat.name,
        bad,
        &flat.frame,
        "without a response (0, negative or no value)",
    )?;
    Ok(flat)
}

fn check_size(
    what: &'static str,
    master: &Master,
    frame: &Frame,
    of: &str,
) -> Result<(), CalibrationError> {
    let Frame { width, height, .. } = master.frame;
    if (width, height) == (frame.width, frame.height) {
        return Ok(());
    }
    Err(CalibrationError::SizesDiffer {
        what,
        name: master.name.clone(),
        width,
        height,
        expected_width: frame.width,
        expected_height: frame.height,
        of: of.to_owned(),
    })
}

fn check_bad(
    what: &'static str,
    name: &str,
    bad: usize,
    frame: &Frame,
    found: &'static str,
) -> Result<(), CalibrationError> {
    let pixels = frame.width * frame.height;
    if bad as f64 <= MAX_BAD_SHARE * pixels as f64 {
        return Ok(());
    }
    Err(CalibrationError::TooManyBad {
        what,
        name: name.to_owned(),
        bad,
        pixels,
        found,
    })
}

#[cfg(test)]
mod tests;
