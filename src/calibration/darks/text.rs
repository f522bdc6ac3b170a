//! The report on dark frames as text.

use super::report::{
    DarkCurrentReport, DarksReport, ExposureReport, HotPixelsReport, PatternReport,
};
use crate::base::format::counted;
use std::fmt::Write as _;

impl DarksReport {
    /// The report as text.
    pub fn to_text(&self) -> String {
        let mut text = format!(
            "{}, {} × {} px\n",
            counted(self.frames, "dark frame"),
            self.width,
            self.height
        );
        for (label, value) in self.lines() {
            let _ = writeln!(text, "  {label:<15}{value}");
        }
        for missing in self.missing_texts() {
            let _ = writeln!(text, "  {:<15}{missing}", "not known");
        }
        text
    }

    /// What is not known, and why.
    pub fn missing_texts(&self) -> impl Iterator<Item = String> {
        let missing = self.missing.iter();
        missing.map(|(what, reason)| format!("{}: {reason}", what.replace('_', " ")))
    }

    /// What was measured, each with its name.
    pub fn lines(&self) -> Vec<(String, String)> {
        let mut lines = Vec::new();
        let mut line = |label: &str, value: String| lines.push((label.to_owned(), value));
        line(
            "mean",
            with(self.mean_adu, "ADU", self.relative_mean.map(relative)),
        );
        line(
            "deviation",
            with(self.sigma_adu, "ADU", self.relative_sigma.map(relative)),
        );
        if let (Some(full), Some(source)) = (self.full_scale_adu, &self.full_scale_source) {
            line(
                "full scale",
                format!("{full} levels, from {}", source_text(source)),
            );
        }
        if let Some(noise) = self.read_noise_adu {
            line(
                "read noise",
                with(noise, "ADU", self.read_noise_e.map(electrons)),
            );
        }
        for exposure in &self.exposures {
            let label = exposure
                .exposure_s
                .map_or("exposure ?".to_owned(), |s| format!("at {s} s"));
            line(&label, exposure_text(exposure));
        }
        if let Some(pattern) = &self.pattern {
            line("pattern", pattern_text(pattern));
        }
        if let Some(current) = &self.dark_current {
            line("dark current", current_text(current));
            line(
                "bias",
                plus_minus(current.bias_adu, current.bias_sigma_adu, "ADU"),
            );
        }
        line("hot pixels", hot_pixels_text(&self.hot_pixels));
        lines
    }
}

fn source_text(source: &str) -> &str {
    match source {
        "option" => "the given bit depth",
        "camera" => "the camera description",
        _ => "the file format, which may have more bits than the detector",
    }
}

fn relative(part: f64) -> String {
    format!("{part:.4e} of full scale")
}

fn electrons(value: f64) -> String {
    format!("{value:.3} e")
}

/// A value with its unit, and the same in another unit in parentheses.
fn with(value: f64, unit: &str, other: Option<String>) -> String {
    let other = other.map_or(String::new(), |text| format!(" ({text})"));
    format!("{value:.3} {unit}{other}")
}

fn plus_minus(value: f64, sigma: Option<f64>, unit: &str) -> String {
    let sigma = sigma.map_or(String::new(), |sigma| format!(" ± {sigma:.3}"));
    format!("{value:.3}{sigma} {unit}")
}

fn exposure_text(exposure: &ExposureReport) -> String {
    let mut text = format!(
        "{}, level {:.3} ADU",
        counted(exposure.frames, "frame"),
        exposure.level_adu
    );
    if let Some(noise) = exposure.temporal_noise_adu {
        let noise = with(noise, "ADU", exposure.temporal_noise_e.map(electrons));
        text += &format!(", noise {noise}");
    }
    if let Some(drift) = exposure.frame_to_frame_adu {
        text += &format!(", frame-to-frame drift {drift:.3} ADU");
    }
    text
}

fn pattern_text(pattern: &PatternReport) -> String {
    let fixed = match pattern.fixed_pattern_adu {
        Some(fixed) => with(fixed, "ADU", pattern.fixed_pattern_e.map(electrons)),
        None => format!("{:.3} ADU (includes noise)", pattern.spatial_adu),
    };
    format!(
        "{fixed}; columns {:.3} ADU, rows {:.3} ADU",
        pattern.column_adu, pattern.row_adu
    )
}

fn hot_pixels_text(hot: &HotPixelsReport) -> String {
    format!(
        "{} ({:.4} %) beyond {} standard deviations: {} in level, {} in dark current, {} in noise",
        hot.count,
        hot.share * 100.0,
        hot.hot_sigma,
        hot.by_level,
        hot.by_dark_current,
        hot.by_noise
    )
}

fn current_text(current: &DarkCurrentReport) -> String {
    let in_electrons = current.median_e_s.map_or(String::new(), |value| {
        format!(" ({})", plus_minus(value, current.median_sigma_e_s, "e/s"))
    });
    format!(
        "{}{in_electrons} median, {} mean",
        plus_minus(current.median_adu_s, current.median_sigma_adu_s, "ADU/s"),
        plus_minus(current.mean_adu_s, current.mean_sigma_adu_s, "ADU/s")
    )
}
