//! Report on dark frames: values with the units in their names, for JSON and CSV.

use super::current::FittedValue;
use super::hot::HotPixel;
use super::measure::{Darks, MissingQuantity};
use super::noise::ExposureGroup;
use super::not_dark::NotDark;
use crate::base::format::to_significant;
use serde::Serialize;
use std::collections::BTreeMap;

/// Report on dark frames, see [`Darks`]. Unknown values are null; `missing` gives the reasons.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DarksReport {
    /// Version of the format.
    pub schema: u32,
    /// Number of frames.
    pub frames: usize,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Mean of the frames' means (E).
    pub mean_adu: f64,
    /// Root of the mean of the frames' variances (σ_g).
    pub sigma_adu: f64,
    /// Full scale.
    pub full_scale_adu: Option<f64>,
    /// `option`, `camera` or `file format`.
    pub full_scale_source: Option<String>,
    /// Mean relative to full scale (γ_eg).
    pub relative_mean: Option<f64>,
    /// Standard deviation relative to full scale (γ_σg).
    pub relative_sigma: Option<f64>,
    /// Gain, in electrons per grey level.
    pub gain_e_per_adu: Option<f64>,
    /// Read noise of a pixel.
    pub read_noise_adu: Option<f64>,
    /// The same in electrons.
    pub read_noise_e: Option<f64>,
    /// Each exposure.
    pub exposures: Vec<ExposureReport>,
    /// Fixed pattern.
    pub pattern: Option<PatternReport>,
    /// Dark current and bias.
    pub dark_current: Option<DarkCurrentReport>,
    /// Hot pixels.
    pub hot_pixels: HotPixelsReport,
    /// Each frame.
    pub per_frame: Vec<DarkFrameRow>,
    /// Unknown quantities and the reasons.
    pub missing: BTreeMap<&'static str, String>,
    /// Frames that do not look dark.
    pub warnings: Vec<String>,
}

/// The frames of one exposure.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ExposureReport {
    /// Exposure.
    pub exposure_s: Option<f64>,
    /// Number of frames.
    pub frames: usize,
    /// Mean level.
    pub level_adu: f64,
    /// Standard deviation of a pixel from frame to frame.
    pub temporal_noise_adu: Option<f64>,
    /// The same in electrons.
    pub temporal_noise_e: Option<f64>,
    /// Standard deviation of the level of the whole frame from frame to frame.
    pub frame_to_frame_adu: Option<f64>,
}

/// Fixed pattern, as standard deviations over the pixels.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PatternReport {
    /// Exposure at which it was measured.
    pub exposure_s: Option<f64>,
    /// Of the pixels' means, including the noise left in them.
    pub spatial_adu: f64,
    /// Of the pattern alone.
    pub fixed_pattern_adu: Option<f64>,
    /// The same in electrons.
    pub fixed_pattern_e: Option<f64>,
    /// Of the columns.
    pub column_adu: f64,
    /// The same in electrons.
    pub column_e: Option<f64>,
    /// Of the rows.
    pub row_adu: f64,
    /// The same in electrons.
    pub row_e: Option<f64>,
}

/// Dark current and bias; each `_sigma` is a standard error.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DarkCurrentReport {
    /// Median over the pixels.
    pub median_adu_s: f64,
    /// Its standard error.
    pub median_sigma_adu_s: Option<f64>,
    /// Mean over the pixels, hot ones included.
    pub mean_adu_s: f64,
    /// Its standard error.
    pub mean_sigma_adu_s: Option<f64>,
    /// The median in electrons.
    pub median_e_s: Option<f64>,
    /// Its standard error.
    pub median_sigma_e_s: Option<f64>,
    /// The mean in electrons.
    pub mean_e_s: Option<f64>,
    /// Its standard error.
    pub mean_sigma_e_s: Option<f64>,
    /// Bias: the level at exposure 0.
    pub bias_adu: f64,
    /// Its standard error.
    pub bias_sigma_adu: Option<f64>,
}

/// Numbers of hot pixels.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HotPixelsReport {
    /// Threshold, in standard deviations.
    pub hot_sigma: f64,
    /// All hot pixels.
    pub count: usize,
    /// Their share of all pixels.
    pub share: f64,
    /// Hot by level.
    pub by_level: usize,
    /// Hot by dark current.
    pub by_dark_current: usize,
    /// Hot by noise.
    pub by_noise: usize,
}

/// One frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DarkFrameRow {
    /// Name of the frame.
    pub frame: String,
    /// Exposure.
    pub exposure_s: Option<f64>,
    /// Mean (Eᵢ).
    pub mean_adu: f64,
    /// Standard deviation (σ_gi).
    pub sigma_adu: f64,
    /// Mean relative to full scale.
    pub relative_mean: Option<f64>,
    /// Standard deviation relative to full scale.
    pub relative_sigma: Option<f64>,
    /// Number of pixels without a value.
    pub without_value: usize,
    /// Number of pixels at full scale.
    pub saturated: usize,
    /// Number of spots that look like stars.
    pub star_like: usize,
}

/// One line of hot-pixels.csv.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HotPixelRow {
    /// Column.
    pub x: usize,
    /// Row.
    pub y: usize,
    /// Mean level at the longest exposure.
    pub level_adu: f64,
    /// Mean level minus that of ordinary pixels.
    pub excess_adu: f64,
    /// Standard deviation from frame to frame.
    pub noise_adu: Option<f64>,
    /// Dark current.
    pub dark_current_adu_s: Option<f64>,
    /// Why it is hot: `level`, `dark current`, `noise`, joined by +.
    pub reason: String,
}

impl HotPixelRow {
    /// Names of the columns.
    pub const COLUMNS: [&str; 7] = [
        "x",
        "y",
        "level_adu",
        "excess_adu",
        "noise_adu",
        "dark_current_adu_s",
        "reason",
    ];
}

impl From<&HotPixel> for HotPixelRow {
    fn from(hot: &HotPixel) -> Self {
        let reasons = [
            (hot.reasons.level, "level"),
            (hot.reasons.dark_current, "dark current"),
            (hot.reasons.noise, "noise"),
        ];
        let reasons: Vec<_> = reasons.iter().filter(|r| r.0).map(|r| r.1).collect();
        Self {
            x: hot.x,
            y: hot.y,
            level_adu: rounded(hot.level_adu),
            excess_adu: rounded(hot.excess_adu),
            noise_adu: known(hot.noise_adu),
            dark_current_adu_s: known(hot.dark_current_adu_s),
            reason: reasons.join("+"),
        }
    }
}

/// Rounds to the significant digits of the report.
fn rounded(value: f64) -> f64 {
    const DIGITS: i32 = 6;
    to_significant(value, DIGITS)
}

fn known(value: Option<f64>) -> Option<f64> {
    value.filter(|v| v.is_finite()).map(rounded)
}

impl Darks {
    /// The report.
    pub fn report(&self) -> DarksReport {
        let full = self.full_scale.map(|full| full.levels_adu);
        let electrons =
            |adu: Option<f64>| known(adu.zip(self.gain_e_per_adu).map(|(adu, gain)| adu * gain));
        let of_scale = |adu: f64| known(full.map(|full| adu / full));
        DarksReport {
            schema: 1,
            frames: self.frames.len(),
            width: self.width,
            height: self.height,
            mean_adu: rounded(self.mean_adu),
            sigma_adu: rounded(self.sigma_adu),
            full_scale_adu: full,
            full_scale_source: self.full_scale.map(|full| full.source.to_string()),
            relative_mean: of_scale(self.mean_adu),
            relative_sigma: of_scale(self.sigma_adu),
            gain_e_per_adu: self.gain_e_per_adu,
            read_noise_adu: known(self.read_noise_adu),
            read_noise_e: electrons(self.read_noise_adu),
            exposures: self.exposures(&electrons),
            pattern: self.pattern_report(&electrons),
            dark_current: self.dark_current_report(&electrons),
            hot_pixels: self.hot_pixels_report(),
            per_frame: self.frame_rows().collect(),
            missing: self
                .missing
                .iter()
                .map(|MissingQuantity { what, reason }| (*what, reason.clone()))
                .collect(),
            warnings: self.warnings.iter().map(NotDark::to_string).collect(),
        }
    }

    fn exposures(&self, electrons: &impl Fn(Option<f64>) -> Option<f64>) -> Vec<ExposureReport> {
        let report = |group: &ExposureGroup| ExposureReport {
            exposure_s: group.exposure_s,
            frames: group.frames,
            level_adu: rounded(group.level_adu),
            temporal_noise_adu: known(group.temporal_noise_adu),
            temporal_noise_e: electrons(group.temporal_noise_adu),
            frame_to_frame_adu: known(group.frame_to_frame_adu),
        };
        self.groups.iter().map(report).collect()
    }

    fn pattern_report(
        &self,
        electrons: &impl Fn(Option<f64>) -> Option<f64>,
    ) -> Option<PatternReport> {
        let pattern = self.pattern?;
        Some(PatternReport {
            exposure_s: self.pattern_exposure_s,
            spatial_adu: rounded(pattern.spatial_adu),
            fixed_pattern_adu: known(pattern.fixed_adu),
            fixed_pattern_e: electrons(pattern.fixed_adu),
            column_adu: rounded(pattern.column_adu),
            column_e: electrons(Some(pattern.column_adu)),
            row_adu: rounded(pattern.row_adu),
            row_e: electrons(Some(pattern.row_adu)),
        })
    }

    fn dark_current_report(
        &self,
        electrons: &impl Fn(Option<f64>) -> Option<f64>,
    ) -> Option<DarkCurrentReport> {
        let current = self.dark_current.as_ref()?;
        let median_sigma = current.median().map(|median| median.sigma);
        let FittedValue {
            value: mean,
            sigma: mean_sigma,
        } = current.mean_adu_s;
        Some(DarkCurrentReport {
            median_adu_s: rounded(current.median_adu_s),
            median_sigma_adu_s: known(median_sigma),
            mean_adu_s: rounded(mean),
            mean_sigma_adu_s: known(mean_sigma),
            median_e_s: electrons(Some(current.median_adu_s)),
            median_sigma_e_s: electrons(median_sigma),
            mean_e_s: electrons(Some(mean)),
            mean_sigma_e_s: electrons(mean_sigma),
            bias_adu: rounded(current.bias_adu.value),
            bias_sigma_adu: known(current.bias_adu.sigma),
        })
    }

    fn hot_pixels_report(&self) -> HotPixelsReport {
        let count =
            |of: fn(&HotPixel) -> bool| self.hot_pixels.iter().filter(|hot| of(hot)).count();
        HotPixelsReport {
            hot_sigma: self.hot_sigma,
            count: self.hot_pixels.len(),
            share: rounded(self.hot_pixels.len() as f64 / (self.width * self.height) as f64),
            by_level: count(|hot| hot.reasons.level),
            by_dark_current: count(|hot| hot.reasons.dark_current),
            by_noise: count(|hot| hot.reasons.noise),
        }
    }

    /// One row per frame.
    pub fn frame_rows(&self) -> impl Iterator<Item = DarkFrameRow> {
        let full = self.full_scale.map(|full| full.levels_adu);
        self.frames.iter().map(move |frame| DarkFrameRow {
            frame: frame.frame.clone(),
            exposure_s: frame.exposure_s,
            mean_adu: rounded(frame.mean_adu),
            sigma_adu: rounded(frame.sigma_adu),
            relative_mean: known(full.map(|full| frame.mean_adu / full)),
            relative_sigma: known(full.map(|full| frame.sigma_adu / full)),
            without_value: frame.without_value,
            saturated: frame.saturated,
            star_like: frame.star_like,
        })
    }
}
