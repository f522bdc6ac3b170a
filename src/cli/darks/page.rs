//! The page of dark frames.

use super::figure;
use super::files::hot_pixels_table;
use crate::cli::output::rows::csv_table;
use crate::cli::page;
use starpipe::base::format::counted;
use starpipe::calibration::darks::{Darks, DarksReport};
use starpipe::report::page::{Fact, PageContent};

/// Hot pixels in the table: a detector with more is better looked at in hot-pixels.csv.
const MAX_HOT: usize = 5000;

/// The page of what was measured. `unread` files could not be read.
pub(super) fn build(darks: &Darks, unread: usize) -> anyhow::Result<PageContent> {
    let report = darks.report();
    let hot: String = hot_pixels_table(darks)?
        .split_inclusive('\n')
        .take(MAX_HOT + 1)
        .collect();
    let drawing = figure::sheet(darks);
    let figures = if drawing.is_empty() {
        Vec::new()
    } else {
        vec![page::figure(
            &drawing,
            "Histograms of the pixels' mean level, and of their noise from frame to frame",
        )]
    };
    let mut tables = vec![page::table("Frames", &csv_table(darks.frame_rows())?)?];
    if !darks.hot_pixels.is_empty() {
        tables.push(page::table("Hot pixels", &hot)?);
    }
    let facts = report.lines().into_iter();
    let full_scale = report.full_scale_source.clone().unwrap_or_default();
    Ok(PageContent {
        title: "Dark frames".to_owned(),
        question: format!(
            "What does the detector of {} × {} px record without light?",
            report.width, report.height
        ),
        answer: answer(&report),
        facts: facts.map(|(name, value)| Fact::new(name, value)).collect(),
        notes: notes(&report, unread),
        text: report.to_text(),
        figures,
        tables,
        provenance: vec![page::options(), Fact::new("Full scale from", full_scale)],
        ..PageContent::default()
    })
}

fn answer(report: &DarksReport) -> String {
    let mut parts = Vec::new();
    match (report.read_noise_adu, report.read_noise_e) {
        (Some(adu), Some(e)) => parts.push(format!("a read noise of {adu:.3} ADU ({e:.3} e)")),
        (Some(adu), None) => parts.push(format!("a read noise of {adu:.3} ADU")),
        _ => parts.push(format!(
            "a standard deviation of {:.3} ADU within a frame",
            report.sigma_adu
        )),
    }
    if let Some(current) = &report.dark_current {
        let sigma = current.median_sigma_adu_s;
        let sigma = sigma.map_or(String::new(), |sigma| format!(" ± {sigma:.3}"));
        parts.push(format!(
            "a dark current of {:.3}{sigma} ADU/s",
            current.median_adu_s
        ));
    }
    let hot = &report.hot_pixels;
    parts.push(match hot.count {
        0 => "no hot pixels".to_owned(),
        count => format!(
            "{} ({:.4} % of all)",
            counted(count, "hot pixel"),
            100.0 * hot.share
        ),
    });
    format!(
        "{}: {}.",
        counted(report.frames, "dark frame"),
        parts.join(", ")
    )
}

fn notes(report: &DarksReport, unread: usize) -> Vec<String> {
    let mut notes = report.warnings.clone();
    let missing = report.missing_texts();
    notes.extend(missing.map(|missing| format!("Not measured: {missing}.")));
    if unread > 0 {
        notes.push(format!("{} could not be read.", counted(unread, "file")));
    }
    if report.hot_pixels.count > MAX_HOT {
        notes.push(format!(
            "The table has the first {MAX_HOT} hot pixels; --out writes all of them."
        ));
    }
    notes
}
