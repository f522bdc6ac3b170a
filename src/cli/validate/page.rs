//! The pages of a run, of a study and of a suite.

use super::figures;
use super::frames::{FailedFrames, MOST_ROWS, RunFrameRow};
use super::run::ValidationRun;
use crate::cli::output::rows::csv_table;
use crate::cli::page::{catalog, codes_note, figure, options, table};
use serde::Serialize;
use starpipe::base::format::{counted, five_digits};
use starpipe::catalog::Catalog;
use starpipe::lab::night_sky::SkySummary;
use starpipe::lab::validation::{HardRow, Pull, StudyRow, ValidationSummary};
use starpipe::report::figure::Sheet;
use starpipe::report::page::{Fact, PageContent, PageTable};
use std::collections::BTreeMap;

const FAILED: &str = "Frames that failed";
/// A mean is off if it differs from what is true by more than so many standard errors.
const OFF_SIGMA: f64 = 3.0;
/// Mean of the squared error of three angles in units of its covariance, where that is true.
const NEES: f64 = 3.0;

/// The page of a run.
pub(super) fn of_run(run: ValidationRun) -> anyhow::Result<PageContent> {
    let ValidationRun { summary, frames } = run;
    let mut page = PageContent {
        title: format!("Validation of {}", summary.facts.camera),
        question: format!(
            "How often is a frame of {} identified, and are the stated errors correct? {} at random attitudes, scale {}.",
            summary.facts.camera,
            counted(summary.frames, "simulated frame"),
            if summary.facts.scale_known {
                "known"
            } else {
                "unknown"
            }
        ),
        answer: answer(&summary),
        facts: facts(&summary),
        notes: notes(&summary, &frames.rows),
        text: summary.to_text(),
        thumbnails_title: FAILED.to_owned(),
        thumbnails: frames.pictures,
        tables: tables(&summary, &frames.rows)?,
        ..PageContent::default()
    };
    for (name, sheet) in figures::of_run(&summary) {
        page.figures.push(figure(&sheet, caption(name)));
    }
    Ok(page)
}

/// The page of a suite.
pub(super) fn of_suite(
    camera: &str,
    rows: &[HardRow],
    failed: FailedFrames,
) -> anyhow::Result<PageContent> {
    let case = |row: &HardRow| TrialGroup {
        name: row.case.to_string(),
        counts: [row.frames, row.right, row.wrong],
        nees: row.nees_mean.zip(row.nees_sigma),
    };
    let runs: Vec<TrialGroup> = rows.iter().map(case).collect();
    let page = PageContent {
        title: format!("Hard cases for {camera}"),
        question: format!(
            "How often is a frame identified if lens, spot or detector differ from the model of the \
             pipeline? {}.",
            counted(rows.len(), "case")
        ),
        text: HardRow::to_text(rows),
        tables: vec![table("Cases", &csv_table(rows.iter())?)?],
        ..PageContent::default()
    };
    with_runs(page, &runs, failed)
}

/// The page of the sky suite.
pub(super) fn of_sky(
    camera: &str,
    summary: &SkySummary,
    sheet: &Sheet,
) -> anyhow::Result<PageContent> {
    let all = summary.groups.first();
    Ok(PageContent {
        title: format!("Skies over {camera}"),
        question: format!(
            "How accurate are brightness, extinction, clouds and limits of the sky? {}.",
            counted(all.map_or(0, |all| all.frames), "simulated frame")
        ),
        answer: all.map_or_else(String::new, |all| rates([all.frames, all.right, all.wrong])),
        text: summary.to_text(),
        figures: vec![figure(
            sheet,
            "Errors of the sky measurement, and calibration of its probabilities",
        )],
        tables: vec![
            table("Groups", &csv_table(summary.groups.iter())?)?,
            table(
                "Probability of a clear sky",
                &csv_table(summary.clear.iter())?,
            )?,
        ],
        ..PageContent::default()
    })
}

/// The page of a study.
pub(super) fn of_study(
    camera: &str,
    rows: &[StudyRow],
    failed: FailedFrames,
) -> anyhow::Result<PageContent> {
    let value = |row: &StudyRow| TrialGroup {
        name: format!("{} {}", row.parameter, five_digits(row.value)),
        counts: [row.frames, row.right, row.wrong],
        nees: row.nees_mean.zip(row.nees_sigma),
    };
    let runs: Vec<TrialGroup> = rows.iter().map(value).collect();
    let mut page = PageContent {
        title: format!("Study of {camera}"),
        question: format!(
            "How do identification, limit and errors depend on a parameter? {}.",
            counted(rows.len(), "value")
        ),
        text: StudyRow::to_text(rows),
        tables: vec![table("Values", &csv_table(rows.iter())?)?],
        ..PageContent::default()
    };
    for (name, sheet) in figures::of_study(rows) {
        let caption = format!("Identification, limit and errors versus {name}");
        page.figures.push(figure(&sheet, &caption));
    }
    with_runs(page, &runs, failed)
}

/// The page with where it is from.
pub(super) fn with_provenance(page: PageContent, seed: u64, of_stars: &Catalog) -> PageContent {
    let provenance = vec![
        options(),
        Fact::new("Seed", seed.to_string()),
        catalog(of_stars),
    ];
    PageContent { provenance, ..page }
}

/// The page with the answer of several runs, their doubts, and the frames that failed.
fn with_runs(
    mut page: PageContent,
    runs: &[TrialGroup],
    failed: FailedFrames,
) -> anyhow::Result<PageContent> {
    if !failed.rows.is_empty() {
        let csv = csv_table(failed.rows.iter())?;
        page.tables.push(table(FAILED, &csv)?);
    }
    let counts = [0, 1, 2].map(|of| runs.iter().map(|run| run.counts[of]).sum());
    let notes = doubts(runs).into_iter().chain(cut_note(failed.rows.len()));
    Ok(PageContent {
        answer: rates(counts),
        notes: notes.collect(),
        thumbnails_title: FAILED.to_owned(),
        thumbnails: failed.pictures,
        ..page
    })
}

fn cut_note(rows: usize) -> Option<String> {
    (rows == MOST_ROWS)
        .then(|| format!("The table of frames has {MOST_ROWS} rows at most; frames.csv has all."))
}

/// Counts of all frames, of right and of wrong ones as a sentence.
fn rates([frames, right, wrong]: [usize; 3]) -> String {
    format!(
        "{right} of {} identified correctly ({:.2} %), {wrong} incorrectly, {} not identified.",
        counted(frames, "frame"),
        100.0 * right as f64 / frames.max(1) as f64,
        frames - right - wrong
    )
}

/// The frames of a hard case, or of a value of a parameter.
struct TrialGroup {
    name: String,
    /// Of all frames, of right and of wrong ones.
    counts: [usize; 3],
    /// Mean and its standard error.
    nees: Option<(f64, f64)>,
}

/// Notes on runs with wrong answers, on the one with the fewest right ones, and on errors that are stated
/// wrongly.
fn doubts(runs: &[TrialGroup]) -> Vec<String> {
    let mut notes = Vec::new();
    let mut least: Option<(f64, String)> = None;
    for TrialGroup { name, counts, .. } in runs {
        let [frames, right, wrong] = *counts;
        let share = right as f64 / frames.max(1) as f64;
        let said = format!("{name}: {}", rates(*counts));
        if wrong > 0 {
            notes.push(said);
        } else if share < 1.0 && least.as_ref().is_none_or(|(found, _)| share < *found) {
            least = Some((share, said));
        }
    }
    notes.extend(least.map(|(_, said)| format!("Lowest rate of correct identifications: {said}")));
    let nees = runs.iter().filter_map(|TrialGroup { name, nees, .. }| {
        let (mean, sigma) = (*nees)?;
        Some(format!("{name}: {}", nees_note(mean, sigma)?))
    });
    notes.extend(nees);
    notes
}

fn answer(summary: &ValidationSummary) -> String {
    let all = &summary.identification.all;
    format!(
        "{} 95 % interval of correct identifications: {:.2} to {:.2} %; of wrong ones: below {:.2} %.",
        rates([all.frames, all.right, all.wrong]),
        all.right_low_percent,
        all.right_high_percent,
        all.wrong_high_percent + 0.005
    )
}

fn facts(summary: &ValidationSummary) -> Vec<Fact> {
    let completeness = &summary.completeness;
    let mut facts = vec![Fact::new(
        "Predicted 50 % detection limit",
        format!("V {:.3}", completeness.predicted_limit_vmag),
    )];
    if let (Some(limit), Some(sigma), Some(difference)) = (
        completeness.measured_limit_vmag,
        completeness.measured_limit_sigma_mag,
        completeness.difference_mag,
    ) {
        let value = format!("V {limit:.3} ± {sigma:.3}: {difference:+.3} mag from the prediction");
        facts.push(Fact::new("Measured 50 % detection limit", value));
    }
    if let Some(attitude) = &summary.attitude {
        let nees = format!("{:.3} ± {:.3}", attitude.nees_mean, attitude.nees_sigma);
        facts.push(Fact::new("NEES (3 expected)", nees));
        for (name, of) in [
            ("Error of the boresight", &attitude.boresight_arcsec),
            ("Error of the roll", &attitude.roll_arcsec),
        ] {
            let value = format!("{:.2}″ (median), {:.2}″ (95 %)", of.p50, of.p95);
            facts.push(Fact::new(name, value));
        }
    }
    let pulls = summary.pulls.named().into_iter();
    let pulls: Vec<String> = pulls
        .filter(|(_, pull)| pull.count > 0)
        .map(|(name, pull)| format!("{name} {:+.2}, {:.2}", pull.mean, pull.sd))
        .collect();
    facts.push(Fact::new(
        "Pulls: errors / stated errors (mean, standard deviation; 0, 1 expected)",
        pulls.join("; "),
    ));
    let detection = &summary.detection;
    facts.push(Fact::new(
        "False detections per million pixels",
        format!(
            "{} ({} to {})",
            detection.false_per_mpx, detection.false_low_per_mpx, detection.false_high_per_mpx
        ),
    ));
    facts.push(Fact::new(
        "Wrong names",
        format!("{} of {}", detection.misnamed, detection.named),
    ));
    facts
}

/// That stated errors of the attitude are too small or too large, if they are.
fn nees_note(mean: f64, sigma: f64) -> Option<String> {
    let too = if mean > NEES { "small" } else { "large" };
    let is_off = (mean - NEES).abs() > OFF_SIGMA * sigma;
    is_off.then(|| {
        format!("the stated errors of the attitude are too {too}: NEES {mean:.2} ± {sigma:.2}, 3 expected.")
    })
}

fn notes(summary: &ValidationSummary, rows: &[RunFrameRow]) -> Vec<String> {
    let mut notes = Vec::new();
    let wrong = summary.identification.all.wrong;
    if wrong > 0 {
        notes.push(format!(
            "{} identified incorrectly.",
            counted(wrong, "frame")
        ));
    }
    let mut reasons: BTreeMap<&str, usize> = BTreeMap::new();
    for reason in rows.iter().filter_map(|row| row.reason.as_deref()) {
        *reasons.entry(reason).or_default() += 1;
    }
    for (reason, frames) in reasons {
        let reason = reason.replace('_', " ");
        notes.push(format!(
            "{} not identified: {reason}.",
            counted(frames, "frame")
        ));
    }
    let attitude = summary.attitude.as_ref();
    notes.extend(attitude.and_then(|a| nees_note(a.nees_mean, a.nees_sigma)));
    let codes = summary.notes.iter();
    notes.extend(codes_note(codes.map(|(code, frames)| (&**code, *frames))));
    notes.extend(cut_note(rows.len()));
    notes
}

/// A pull as a row.
#[derive(Serialize)]
struct PullRow {
    pull: &'static str,
    values: usize,
    mean: f64,
    sd: f64,
    beyond_2_percent: f64,
    beyond_3_percent: f64,
    beyond_5_percent: f64,
}

impl PullRow {
    fn of((name, pull): (&'static str, &Pull)) -> Self {
        Self {
            pull: name,
            values: pull.count,
            mean: pull.mean,
            sd: pull.sd,
            beyond_2_percent: pull.beyond_2_percent,
            beyond_3_percent: pull.beyond_3_percent,
            beyond_5_percent: pull.beyond_5_percent,
        }
    }
}

fn tables(summary: &ValidationSummary, frames: &[RunFrameRow]) -> anyhow::Result<Vec<PageTable>> {
    let pulls = summary.pulls.named().into_iter().map(PullRow::of);
    let by_stars = summary.identification.by_stars.iter();
    [
        ("Frames, failures first", csv_table(frames.iter())?),
        ("Identification by number of stars", csv_table(by_stars)?),
        ("Completeness", csv_table(summary.completeness.bins.iter())?),
        (
            "Errors of centroids",
            csv_table(summary.centroids.bins.iter())?,
        ),
        ("Pulls", csv_table(pulls)?),
    ]
    .iter()
    .map(|(title, csv)| table(title, csv))
    .collect()
}

fn caption(name: &str) -> &'static str {
    match name {
        "identification" => "Identification rate by number of stars brighter than the limit",
        "completeness" => "Detected fraction of the stars, and the prediction",
        "centroids" => "Centroid errors, and the Cramér-Rao bound",
        "pulls" => {
            "Errors in units of their stated standard errors, with the standard normal distribution"
        }
        "faintest" => "Faintest named star minus the faintest expected",
        _ => "Errors of the attitude",
    }
}
