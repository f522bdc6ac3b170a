//! Report on flats: values with the units in their names, and as text.

use super::stack::Flats;
use super::transfer::PairPoint;
use crate::base::format::{counted, to_significant};
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// Report on flats, see [`Flats`]. Unknown values are null; `missing` gives the reasons.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FlatsReport {
    /// Version of the format.
    pub schema: u32,
    /// Number of frames.
    pub frames: usize,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Standard deviation of the response over the frame, relative to its mean.
    pub nonuniformity_percent: f64,
    /// The same from pixel to pixel.
    pub pixel_nonuniformity_percent: Option<f64>,
    /// Number of pixels without a known response.
    pub without_response: usize,
    /// Gain, in electrons per grey level.
    pub gain_e_per_adu: Option<f64>,
    /// Its standard error.
    pub gain_sigma_e_per_adu: Option<f64>,
    /// How it was measured.
    pub gain_method: Option<&'static str>,
    /// Read noise, from the same fit.
    pub read_noise_adu: Option<f64>,
    /// The pairs from which the gain was measured.
    pub pairs: Vec<PairReport>,
    /// Each frame.
    pub per_frame: Vec<FlatRow>,
    /// Unknown quantities and the reasons.
    pub missing: BTreeMap<&'static str, &'static str>,
}

/// Two frames of the same light.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PairReport {
    /// Level above the dark.
    pub signal_adu: f64,
    /// Variance of a pixel, without rounding.
    pub variance_adu2: f64,
    /// Its standard error.
    pub variance_sigma_adu2: f64,
}

/// One frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FlatRow {
    /// Name of the frame.
    pub frame: String,
    /// Exposure.
    pub exposure_s: Option<f64>,
    /// Level above the dark.
    pub level_adu: f64,
    /// Number of pixels at full scale.
    pub saturated: usize,
}

/// Rounds to the significant digits of the report.
fn rounded(value: f64) -> f64 {
    const DIGITS: i32 = 6;
    to_significant(value, DIGITS)
}

impl Flats {
    /// The report.
    pub fn report(&self) -> FlatsReport {
        let mut missing = BTreeMap::new();
        if self.pixel_nonuniformity.is_none() {
            missing.insert(
                "pixel_nonuniformity",
                "with one frame, the fixed pattern cannot be separated from the noise",
            );
        }
        if self.gain.is_none() {
            let reason = match self.pairs[..] {
                [] => "no two consecutive frames have the same level",
                _ => "the noise does not increase with the signal",
            };
            missing.insert("gain", reason);
        }
        FlatsReport {
            schema: 1,
            frames: self.frames.len(),
            width: self.width,
            height: self.height,
            nonuniformity_percent: rounded(self.nonuniformity * 100.0),
            pixel_nonuniformity_percent: self.pixel_nonuniformity.map(|part| rounded(part * 100.0)),
            without_response: self.master.iter().filter(|p| p.is_nan()).count(),
            gain_e_per_adu: self.gain.map(|gain| rounded(gain.e_per_adu)),
            gain_sigma_e_per_adu: self.gain.map(|gain| rounded(gain.sigma)),
            gain_method: self.gain.map(|gain| gain.method.name()),
            read_noise_adu: self.gain.and_then(|gain| gain.read_noise_adu).map(rounded),
            pairs: self.pairs.iter().map(PairReport::from).collect(),
            per_frame: self.frame_rows().collect(),
            missing,
        }
    }

    /// One row per frame.
    pub fn frame_rows(&self) -> impl Iterator<Item = FlatRow> {
        self.frames.iter().map(|frame| FlatRow {
            frame: frame.frame.clone(),
            exposure_s: frame.exposure_s,
            level_adu: rounded(frame.level_adu),
            saturated: frame.saturated,
        })
    }
}

impl From<&PairPoint> for PairReport {
    fn from(pair: &PairPoint) -> Self {
        Self {
            signal_adu: rounded(pair.signal_adu),
            variance_adu2: rounded(pair.variance_adu2),
            variance_sigma_adu2: rounded(pair.sigma_adu2),
        }
    }
}

impl FlatsReport {
    /// The report as text.
    pub fn to_text(&self) -> String {
        let mut text = format!(
            "{}, {} × {} px\n",
            counted(self.frames, "flat"),
            self.width,
            self.height
        );
        let mut line = |label: &str, value: String| {
            let _ = writeln!(text, "  {label:<15}{value}");
        };
        line(
            "response",
            format!(
                "varies by {:.3} % over the frame",
                self.nonuniformity_percent
            ),
        );
        if let Some(percent) = self.pixel_nonuniformity_percent {
            line("", format!("varies by {percent:.3} % from pixel to pixel"));
        }
        if let (Some(gain), Some(sigma), Some(method)) = (
            self.gain_e_per_adu,
            self.gain_sigma_e_per_adu,
            self.gain_method,
        ) {
            line("gain", format!("{gain:.4} ± {sigma:.4} e/ADU ({method})"));
        }
        if let Some(noise) = self.read_noise_adu {
            line("read noise", format!("{noise:.3} ADU"));
        }
        for pair in &self.pairs {
            let PairReport {
                signal_adu,
                variance_adu2,
                variance_sigma_adu2,
            } = pair;
            line(
                "pair",
                format!(
                    "signal {signal_adu:.2} ADU, variance {variance_adu2:.3} ± {variance_sigma_adu2:.3} ADU²"
                ),
            );
        }
        for (what, reason) in &self.missing {
            line("not known", format!("{}: {reason}", what.replace('_', " ")));
        }
        text
    }
}
