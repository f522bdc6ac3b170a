//! The page of a calibration.

use super::figure::sheet;
use crate::cli::output::rows::csv_table;
use crate::cli::page::{figure, options, table, thumbnails};
use starpipe::base::format::counted;
use starpipe::identify::lens::LensCalibration;
use starpipe::report::LensReport;
use starpipe::report::page::{Fact, PageContent};

/// Frames that measure a lens well.
const ENOUGH_FRAMES: usize = 20;
/// The share of the frame that they should cover.
const ENOUGH_COVERAGE: f64 = 0.9;
/// Frames that do not fit whose reasons are among the notes.
const SHOWN: usize = 10;

/// The page of a lens. `unread` files could not be read.
pub(super) fn build(
    measured: &LensCalibration,
    report: &LensReport,
    unread: usize,
    catalog: Fact,
) -> anyhow::Result<PageContent> {
    let mut tables = vec![table("Frames", &csv_table(report.frames.iter())?)?];
    if !report.left_out.is_empty() {
        let csv = csv_table(report.left_out.iter())?;
        tables.insert(0, table("Frames that were not used", &csv)?);
    }
    let left_out = report.left_out.iter();
    let left_out = left_out.map(|frame| (frame.frame.clone(), frame.text.clone()));
    let facts = report.lines().into_iter();
    Ok(PageContent {
        title: "The lens of a camera".to_owned(),
        question: format!(
            "What are the properties of the lens in these {} of {} × {} px?",
            counted(report.frames.len() + report.left_out.len(), "frame"),
            report.width,
            report.height
        ),
        answer: answer(report),
        facts: facts.map(|(name, value)| Fact::new(name, value)).collect(),
        notes: notes(report, unread),
        text: report.to_text(),
        figures: vec![figure(
            &sheet(measured),
            "Positions of the stars in the frame, and their mean residuals",
        )],
        thumbnails_title: "Frames that were not used".to_owned(),
        thumbnails: thumbnails(left_out),
        tables,
        provenance: vec![options(), catalog],
    })
}

fn answer(report: &LensReport) -> String {
    let lens = &report.lens;
    format!(
        "{} with {}, focal length {:.3} ± {:.3} px, from {} in {}. Cross-validation: stars not used in the fit are predicted to {:.3} px on each axis.",
        lens.model,
        lens.distortion.unwrap_or("no distortion"),
        lens.focal_length_px,
        lens.focal_length_sigma_px,
        counted(report.stars, "star"),
        counted(report.frames.len(), "frame"),
        report.held_out_rms_px
    )
}

fn notes(report: &LensReport, unread: usize) -> Vec<String> {
    let mut notes = Vec::new();
    if unread > 0 {
        notes.push(format!("{} could not be read.", counted(unread, "file")));
    }
    for frame in report.left_out.iter().take(SHOWN) {
        notes.push(format!("{} was not used: {}", frame.frame, frame.text));
    }
    if report.left_out.len() > SHOWN {
        let more = report.left_out.len() - SHOWN;
        notes.push(format!("{more} more were not used: see the table."));
    }
    if report.frames.len() < ENOUGH_FRAMES {
        notes.push(format!(
            "Use {} or more frames, with stars all over the frame.",
            ENOUGH_FRAMES
        ));
    }
    if report.coverage < ENOUGH_COVERAGE {
        notes.push(format!(
            "Only {:.0} % of the frame has stars; elsewhere the lens model is less accurate. \
             Add frames with stars there.",
            100.0 * report.coverage
        ));
    }
    notes
}
