//! One row a frame, for people, and a summary of all.

use crate::cli::exit::OutcomeTally;
use starpipe::base::format::counted;
use starpipe::base::statistics::median_of;
use starpipe::report::FrameReport;
use std::collections::BTreeMap;
use std::io;
use std::time::Instant;

/// Width of the columns before the frame's name, without the space between.
const NUMBERS_WIDTH: usize = 47;
/// Columns of a name that are shown even where the terminal is narrower.
const MIN_NAME_WIDTH: usize = 12;

/// A table whose last column is the frame's name.
#[derive(Debug, Clone, Copy)]
pub(super) struct FrameTable {
    /// Columns for the name; `None` for all that it has.
    name_width: Option<usize>,
}

impl FrameTable {
    /// Names are shortened to the width of a terminal, if standard output is one.
    pub(super) fn for_stdout() -> Self {
        let width = terminal_size::terminal_size_of(io::stdout());
        let name_width = width.map(|(width, _)| {
            usize::from(width.0)
                .saturating_sub(NUMBERS_WIDTH + 1)
                .max(MIN_NAME_WIDTH)
        });
        Self { name_width }
    }

    /// The row of column names.
    pub(super) fn header(self) -> String {
        format!(
            "{:>7}{:>8}{:>7}{:>7}{:>6}{:>6}{:>6} frame\n",
            "RA (°)", "Dec (°)", "roll", "\u{2033}/px", "stars", "limit", "model"
        )
    }

    /// The row of a frame.
    pub(super) fn row(self, report: &FrameReport) -> String {
        let numbers = numbers(report);
        let name = &report.frame;
        let name = self
            .name_width
            .map_or_else(|| name.clone(), |width| ending(name, width));
        format!("{numbers:<NUMBERS_WIDTH$} {name}\n")
    }
}

/// What was measured of a frame, or why it was not.
fn numbers(report: &FrameReport) -> String {
    let (Some(attitude), Some(optics), Some(matched)) =
        (&report.attitude, &report.optics, &report.matched)
    else {
        let reason = report.reason_code.unwrap_or_default();
        return format!("not identified: {reason}");
    };
    let limit = limit_of(report);
    let predicted = report
        .prediction
        .as_ref()
        .and_then(|found| found.limit50_vmag);
    format!(
        "{:>7.3}{:>8.3}{:>7.1}{:>7.1}{:>6}{:>6}{:>6}",
        attitude.ra_deg,
        attitude.dec_deg,
        attitude.up_pa_deg,
        (1.0 / optics.focal_length_px).to_degrees() * 3600.0,
        matched.matched,
        or_dash(limit),
        or_dash(predicted),
    )
}

fn limit_of(report: &FrameReport) -> Option<f64> {
    report.photometry.as_ref()?.limit50_vmag
}

/// The end of a name, in which names of frames differ.
fn ending(name: &str, width: usize) -> String {
    let count = name.chars().count();
    if count <= width {
        return name.to_owned();
    }
    let end: String = name.chars().skip(count + 1 - width).collect();
    format!("…{end}")
}

fn or_dash(value: Option<f64>) -> String {
    value.map_or_else(|| "–".to_owned(), |value| format!("{value:.2}"))
}

/// What a run found, in a few lines.
pub(super) struct RunSummary {
    start: Instant,
    reasons: BTreeMap<&'static str, usize>,
    limits_vmag: Vec<f64>,
}

impl RunSummary {
    pub(super) fn new() -> Self {
        Self {
            start: Instant::now(),
            reasons: BTreeMap::new(),
            limits_vmag: Vec::new(),
        }
    }

    pub(super) fn add(&mut self, report: &FrameReport) {
        if let Some(code) = report.reason_code {
            *self.reasons.entry(code).or_default() += 1;
        }
        self.limits_vmag.extend(limit_of(report));
    }

    /// The summary; times are those of a clock.
    pub(super) fn text(&mut self, tally: &OutcomeTally) -> String {
        let all = tally.identified + tally.not_identified + tally.failed;
        let mut parts = vec![format!("{} identified", tally.identified)];
        let reasons = self.reasons.iter();
        parts.extend(reasons.map(|(code, count)| format!("{count} {code}")));
        if tally.failed > 0 {
            parts.push(format!("{} unreadable", tally.failed));
        }
        if let Some(median) = median_of(self.limits_vmag.iter().copied()) {
            parts.push(format!("median limit V {median:.2}"));
        }
        let rate = all as f64 / self.start.elapsed().as_secs_f64().max(1e-9);
        parts.push(format!("{rate:.3} a second"));
        format!("\n{}: {}\n", counted(all, "frame"), parts.join(", "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_names_keep_their_end() {
        assert_eq!(ending("night.tif", 9), "night.tif");
        let long = ending("/data/2026-11-26/camera-3/frame-00017.tif", 20);
        assert_eq!(long.chars().count(), 20);
        assert!(
            long.starts_with('…') && long.ends_with("frame-00017.tif"),
            "{long}"
        );
    }

    #[test]
    fn a_summary_counts_reasons() {
        let tally = OutcomeTally {
            identified: 7,
            not_identified: 2,
            failed: 1,
        };
        let mut summary = RunSummary::new();
        summary.reasons.insert("no_match", 2);
        summary.limits_vmag = vec![6.0, 8.0, 7.0];
        let text = summary.text(&tally);
        let expected = "\n10 frames: 7 identified, 2 no_match, 1 unreadable, median limit V 7.00, ";
        assert!(text.starts_with(expected), "{text}");
    }
}
