//! The page of an archive.

use super::nights::{NightLine, nights_text};
use crate::cli::output::rows::csv_table;
use crate::cli::page::{codes_note, figure, options, table, thumbnails};
use serde::Serialize;
use serde_json::Value;
use starpipe::base::format::counted;
use starpipe::base::statistics::{median, quantile};
use starpipe::report::figure::{Axis, Dot, Marks, Panel, PlotLayer, Rgb, Sheet, Spacing};
use starpipe::report::page::{Fact, PageContent, PageFigure};
use starpipe::store::{Archive, CameraNight, FrameSummary, frames, status};
use std::collections::BTreeMap;

/// Points of a figure; with more frames, each is the median of several.
const MAX_POINTS: usize = 400;

const NO_PICTURES: &str =
    "There are no pictures of failed frames: no file can be read at its original path.";

/// The page of the frames and nights of an archive.
pub(super) fn build(archive: &Archive, nights: &[CameraNight]) -> anyhow::Result<PageContent> {
    let mut frames = frames(archive)?;
    let failed = |frame: &FrameSummary| !frame.is_identified();
    let reasons = reasons(frames.iter().filter(|frame| failed(frame)));
    let mut notes = notes(archive, &frames, &reasons)?;
    let figures = limits(&frames);
    let mut tables = Vec::new();
    if !reasons.is_empty() {
        let csv = csv_table(reasons.iter())?;
        tables.push(table("Why frames are not identified", &csv)?);
    }
    // Failures first, otherwise by name.
    frames.sort_by_key(|frame| frame.is_identified());
    let pictures = frames.iter().filter(|frame| failed(frame));
    let thumbnails = thumbnails(pictures.map(|frame| (frame.frame.clone(), frame.reason.clone())));
    if thumbnails.is_empty() && frames.iter().any(failed) {
        notes.push(NO_PICTURES.to_owned());
    }
    tables.push(table(
        "Nights",
        &csv_table(nights.iter().map(NightLine::from_night))?,
    )?);
    tables.push(table("Frames", &csv_table(frames.iter())?)?);
    Ok(PageContent {
        title: format!("Archive {}", archive.directory().display()),
        question: format!("What do {} show?", counted(frames.len(), "frame")),
        answer: answer(&frames),
        facts: facts(&frames, nights),
        notes,
        text: nights_text(nights),
        figures,
        thumbnails_title: "Frames that are not identified".to_owned(),
        thumbnails,
        tables,
        provenance: provenance(archive)?,
    })
}

/// Frames that are not identified for one reason.
#[derive(Serialize)]
struct ReasonRow<'a> {
    reason_code: &'a str,
    frames: usize,
    first_frame: &'a str,
    /// Of the first frame.
    reason: &'a str,
}

/// The reasons, the most frequent first.
fn reasons<'a>(failed: impl Iterator<Item = &'a FrameSummary>) -> Vec<ReasonRow<'a>> {
    let mut by_code: BTreeMap<&str, (usize, &FrameSummary)> = BTreeMap::new();
    for frame in failed {
        by_code.entry(&frame.reason_code).or_insert((0, frame)).0 += 1;
    }
    let row = |(code, (frames, first)): (&'a str, (usize, &'a FrameSummary))| ReasonRow {
        reason_code: code,
        frames,
        first_frame: &first.frame,
        reason: &first.reason,
    };
    let mut rows: Vec<_> = by_code.into_iter().map(row).collect();
    rows.sort_by_key(|row| std::cmp::Reverse(row.frames));
    rows
}

fn answer(frames: &[FrameSummary]) -> String {
    let identified = frames.iter().filter(|frame| frame.is_identified()).count();
    let unread = frames
        .iter()
        .filter(|frame| frame.status == "unread")
        .count();
    let all = frames.len();
    let mut text = format!(
        "{identified} of {} identified ({:.1} %)",
        counted(all, "frame"),
        100.0 * identified as f64 / all.max(1) as f64
    );
    let not_identified = all - identified - unread;
    if not_identified > 0 {
        text += &format!(", {not_identified} not identified");
    }
    if unread > 0 {
        text += &format!(", {unread} could not be read");
    }
    text + "."
}

fn facts(frames: &[FrameSummary], nights: &[CameraNight]) -> Vec<Fact> {
    let mut facts = Vec::new();
    let mut add = |name: &str, unit: &str, value: fn(&FrameSummary) -> Option<f64>| {
        let mut values: Vec<f64> = frames.iter().filter_map(value).collect();
        values.sort_unstable_by(f64::total_cmp);
        if let [Some(middle), Some(low), Some(high)] =
            [0.5, 0.05, 0.95].map(|share| quantile(&values, share))
        {
            let text = format!("{middle:.2}{unit} ({low:.2} to {high:.2})");
            facts.push(Fact::new(name, text));
        }
    };
    add("50 % detection limit (V)", "", |f| f.limit50_vmag);
    add("Predicted 50 % detection limit (V)", "", |f| {
        f.predicted_limit50_vmag
    });
    add("Measured minus predicted", " mag", |f| {
        f.limit_difference_mag
    });
    add("Sky", " mag/arcsec²", |f| f.sky_mag_arcsec2);
    add("Zero point", " mag", |f| f.zero_point_vmag);
    add("Residuals", " px", |f| f.rms_px);
    facts.push(Fact::new("Nights and cameras", nights.len().to_string()));
    facts
}

fn notes(
    archive: &Archive,
    frames: &[FrameSummary],
    reasons: &[ReasonRow<'_>],
) -> anyhow::Result<Vec<String>> {
    let status = status(archive)?;
    let mut notes = Vec::new();
    if !status.is_complete() {
        notes.push(format!(
            "{} of {} parts are missing: repeat the same `starpipe process` command to continue.",
            status.parts - status.parts_done,
            status.parts
        ));
    }
    for row in reasons {
        let code = row.reason_code.replace('_', " ");
        let (frames, reason) = (counted(row.frames, "frame"), row.reason);
        notes.push(format!("{frames}: {code}. {}: {reason}", row.first_frame));
    }
    let mut coded: BTreeMap<&str, u64> = BTreeMap::new();
    for code in frames.iter().flat_map(|frame| frame.notes.split(',')) {
        *coded.entry(code).or_default() += 1;
    }
    coded.remove("");
    notes.extend(codes_note(coded.into_iter()));
    Ok(notes)
}

/// The limits over time, if dates and limits are known.
fn limits(frames: &[FrameSummary]) -> Vec<PageFigure> {
    let mut dated: Vec<(f64, &FrameSummary)> = frames
        .iter()
        .filter(|frame| frame.limit50_vmag.is_some())
        .filter_map(|frame| Some((frame.t_min?, frame)))
        .collect();
    dated.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    if dated.is_empty() {
        return Vec::new();
    }
    let together = dated.len().div_ceil(MAX_POINTS);
    let points = |value: fn(&FrameSummary) -> Option<f64>| -> Vec<(f64, f64)> {
        let point = |chunk: &[(f64, &FrameSummary)]| {
            let known = chunk
                .iter()
                .filter_map(|(date, frame)| Some((date, value(frame)?)));
            let (mut times, mut values): (Vec<f64>, Vec<f64>) = known.unzip();
            (!values.is_empty()).then(|| (median(&mut times), median(&mut values)))
        };
        dated.chunks(together).filter_map(point).collect()
    };
    let measured = points(|frame| frame.limit50_vmag).into_iter();
    let mut layers = vec![PlotLayer::new(
        "measured",
        Rgb::BLUE,
        Marks::Dots(measured.map(Dot::from).collect()),
    )];
    let predicted = points(|frame| frame.predicted_limit50_vmag);
    if !predicted.is_empty() {
        layers.push(PlotLayer::new(
            "predicted",
            Rgb::ORANGE,
            Marks::Line(predicted),
        ));
    }
    let panel = Panel {
        title: "50 % detection limit".to_owned(),
        x: Axis {
            spacing: Spacing::Time,
            ..Axis::new("UTC")
        },
        y: Axis::new("V magnitude"),
        layers,
        ..Panel::default()
    };
    let caption = match together {
        1 => "Limiting magnitude of each frame over time".to_owned(),
        n => format!("Limiting magnitude over time; each point is the median of {n} frames"),
    };
    vec![figure(&Sheet::of_one(panel), &caption)]
}

/// What the tables depend on.
fn provenance(archive: &Archive) -> anyhow::Result<Vec<Fact>> {
    let identity: Value = serde_json::from_str(archive.identity().text())?;
    let text = |value: &Value| {
        value
            .as_str()
            .map_or_else(|| value.to_string(), str::to_owned)
    };
    let configuration = &identity["configuration"];
    let settings = configuration.as_object().into_iter().flatten();
    let settings = settings.filter(|(_, value)| !value.is_null() && !value.is_object());
    let settings: Vec<String> = settings
        .map(|(name, value)| format!("{name} {}", text(value)))
        .collect();
    Ok(vec![
        options(),
        Fact::new("Tables written by starpipe", text(&identity["version"])),
        Fact::new("Catalog", text(&configuration["catalog"]["title"])),
        Fact::new("Processing options", settings.join(", ")),
    ])
}
