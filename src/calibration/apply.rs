//! Applies master dark, master flat and hot pixels to a frame.

use super::error::{CalibrationError, check_bad};
use super::hot_pixels::HotPixelList;
use crate::base::statistics::median;
use crate::frame::Frame;
use std::fmt;

/// A master frame with its name.
#[derive(Debug, Clone, PartialEq)]
pub struct Master {
    /// Name of the file.
    pub name: String,
    /// The frame.
    pub frame: Frame<'static>,
}

impl Master {
    fn into_stored(self) -> Self {
        Self {
            frame: self.frame.into_stored(),
            ..self
        }
    }
}

/// A calibration that can be applied to frames.
///
/// # Example
/// ```
/// use starpipe::calibration::Master;
/// use starpipe::{Calibration, Frame};
///
/// // The pixel in the middle has much dark current.
/// let mut levels = vec![100.0; 9];
/// levels[4] = 350.0;
/// let dark = Master {
///     name: "dark.fits".to_owned(),
///     frame: Frame::new(3, 3, levels.clone())?,
/// };
/// let calibration = Calibration::new(Some(dark), None, None, 0.0)?;
/// // Light of 20 on every pixel.
/// let lit = levels.iter().map(|level| level + 20.0).collect();
/// let mut frame = Frame::new(3, 3, lit)?;
/// calibration.apply(&mut frame)?;
/// assert!(frame.values().iter().all(|&pixel| pixel == 120.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Calibration {
    dark: Option<Master>,
    flat: Option<Master>,
    hot_pixels: Option<HotPixelList>,
    /// Black where the picture does not show the sky.
    mask: Option<Master>,
    /// The level L that is kept when a flat divides.
    level_adu: f32,
}

/// Names of the files with which a frame was calibrated.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct Applied {
    /// The dark.
    pub dark: Option<String>,
    /// The flat.
    pub flat: Option<String>,
    /// The list of hot pixels.
    pub hot_pixels: Option<String>,
    /// The mask.
    pub mask: Option<String>,
}

impl Calibration {
    /// Makes a calibration. Without a dark, the level L is `bias_adu`. The masters apply in the rows
    /// of their files, whatever their `Orientation`.
    /// # Errors
    /// [`CalibrationError::SizesDiffer`], [`CalibrationError::TooManyBad`].
    pub fn new(
        dark: Option<Master>,
        flat: Option<Master>,
        hot_pixels: Option<HotPixelList>,
        bias_adu: f64,
    ) -> Result<Self, CalibrationError> {
        let [dark, flat] = [dark, flat].map(|master| master.map(Master::into_stored));
        if let (Some(dark), Some(flat)) = (&dark, &flat) {
            check_size(
                "the flat",
                flat,
                &dark.frame,
                &format!("the dark {}", dark.name),
            )?;
        }
        let level_adu = match &dark {
            Some(dark) => median_level(dark)?,
            None => bias_adu as f32,
        };
        Ok(Self {
            dark,
            flat: flat.map(normalized).transpose()?,
            hot_pixels,
            mask: None,
            level_adu,
        })
    }

    /// The same with a mask: where it is black, the picture as drawn does not show the sky, and its
    /// pixels have no value.
    #[must_use]
    pub fn with_mask(self, mask: Option<Master>) -> Self {
        Self { mask, ..self }
    }

    /// Level of a calibrated pixel without light, in ADU, where a dark tells it.
    pub fn dark_level_adu(&self) -> Option<f64> {
        self.dark.as_ref().map(|_| self.level_adu.into())
    }

    /// Whether frames are divided by a flat.
    pub fn has_flat(&self) -> bool {
        self.flat.is_some()
    }

    /// Names of the files used.
    pub fn applied(&self) -> Applied {
        let name = |master: &Option<Master>| master.as_ref().map(|master| master.name.clone());
        let list = self.hot_pixels.as_ref();
        Applied {
            dark: name(&self.dark),
            flat: name(&self.flat),
            hot_pixels: list.map(|list| list.path().display().to_string()),
            mask: name(&self.mask),
        }
    }

    /// Calibrates `frame`.
    /// # Errors
    /// [`CalibrationError::SizesDiffer`], [`CalibrationError::Outside`],
    /// [`CalibrationError::TooManyBad`], which leave the frame unchanged;
    /// [`CalibrationError::NothingLeft`].
    pub fn apply(&self, frame: &mut Frame) -> Result<(), CalibrationError> {
        if let Some(mask) = &self.mask {
            check_size("the mask", mask, frame, "the frame")?;
        }
        frame.with_stored(|frame| self.apply_to_stored(frame))?;
        if let Some(mask) = &self.mask {
            for (pixel, mask) in frame
                .values_mut()
                .iter_mut()
                .zip(mask.frame.pixels.values())
            {
                if mask <= 0.0 {
                    *pixel = f32::NAN;
                }
            }
        }
        if frame.values().iter().all(|pixel| pixel.is_nan()) {
            return Err(CalibrationError::NothingLeft);
        }
        Ok(())
    }

    /// Calibrates a frame in the rows of its file, which are the detector's.
    fn apply_to_stored(&self, frame: &mut Frame) -> Result<(), CalibrationError> {
        for (what, master) in [("the dark", &self.dark), ("the flat", &self.flat)] {
            if let Some(master) = master {
                check_size(what, master, frame, "the frame")?;
            }
        }
        if let Some(list) = &self.hot_pixels {
            list.check(frame)?;
        }
        self.correct_pixels(frame);
        if let Some(list) = &self.hot_pixels {
            for (x, y) in list.pixels() {
                let index = y * frame.width + x;
                frame.values_mut()[index] = f32::NAN;
            }
        }
        Ok(())
    }

    /// Applies dark and flat, and raises the saturation level where necessary.
    fn correct_pixels(&self, frame: &mut Frame) {
        // Pixels that share a level do so no longer once they are calibrated.
        frame.saturation_adu = frame.saturation_level_adu();
        let full_adu = frame.saturation_adu.unwrap_or(f32::INFINITY);
        let mut highest = full_adu;
        let saturated = |pixel: f32| pixel >= full_adu;
        let pixels = frame.values_mut();
        let saturated_before: Vec<usize> = (0..pixels.len())
            .filter(|&i| saturated(pixels[i]))
            .collect();
        for (i, pixel) in pixels.iter_mut().enumerate() {
            let of = |master: &Option<Master>| {
                let master = master.as_ref();
                master.map(|master| master.frame.pixels.value(i))
            };
            let dark = of(&self.dark).unwrap_or(self.level_adu);
            let response = of(&self.flat).unwrap_or(1.0);
            let is_saturated = saturated(*pixel);
            *pixel = self.level_adu + (*pixel - dark) / response;
            if !is_saturated && *pixel >= highest {
                highest = pixel.next_up();
            }
        }
        // Saturated pixels stay saturated, unless the dark or the flat has no value there.
        for i in saturated_before {
            if !pixels[i].is_nan() {
                pixels[i] = highest;
            }
        }
        frame.saturation_adu = frame.saturation_adu.map(|_| highest);
    }

    /// The mismatch, if the exposures of the dark and the frame are known and differ.
    pub fn exposure_mismatch(&self, frame_exposure_s: Option<f64>) -> Option<ExposureMismatch> {
        let dark = self.dark.as_ref()?;
        /// Relative difference up to which exposures are the same.
        const TOLERANCE: f64 = 1e-3;
        let (dark_s, frame_s) = (dark.frame.metadata.exposure_s?, frame_exposure_s?);
        let differs = (dark_s - frame_s).abs() > TOLERANCE * dark_s.max(frame_s);
        differs.then(|| ExposureMismatch {
            dark: dark.name.clone(),
            dark_exposure_s: dark_s,
            frame_exposure_s: frame_s,
        })
    }
}

/// A dark whose exposure differs from the frame's, so that its dark current is wrong for the frame.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
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
            "the dark {} was exposed for {} s, but the frame for {} s: the dark current differs",
            self.dark, self.dark_exposure_s, self.frame_exposure_s
        )
    }
}

/// The median level of a dark, in ADU.
fn median_level(dark: &Master) -> Result<f32, CalibrationError> {
    let pixels = dark.frame.values();
    let valid = pixels.iter().filter(|p| !p.is_nan());
    let mut levels: Vec<f64> = valid.map(|&p| f64::from(p)).collect();
    let bad = pixels.len() - levels.len();
    check_bad("the dark", &dark.name, bad, &dark.frame, "without a value")?;
    Ok(median(&mut levels) as f32)
}

/// Normalizes a flat to a mean of 1. Pixels without a response become NaN.
fn normalized(mut flat: Master) -> Result<Master, CalibrationError> {
    /// Minimum response of a usable pixel, relative to the mean.
    const MIN_RESPONSE: f32 = 0.01;
    let pixels = flat.frame.values_mut();
    let positive = pixels.iter().filter(|p| **p > 0.0);
    let (count, sum) = positive.fold((0_u64, 0.0), |(n, sum), &p| (n + 1, sum + f64::from(p)));
    let mean = (sum / count.max(1) as f64) as f32;
    let mut bad = 0;
    for pixel in pixels.iter_mut() {
        *pixel /= mean;
        if pixel.is_nan() || *pixel < MIN_RESPONSE {
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
    if master.frame.size() == frame.size() {
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
