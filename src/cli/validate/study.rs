//! Studies: a run for each value of a parameter, and a row for each run.

use super::figures;
use super::sweep::{Studied, StudySweep};
use super::{Shared, run};
use crate::cli::exit::CommandError;
use crate::cli::output::files::write_whole;
use crate::cli::output::rows::csv_table;
use anyhow::Context;
use serde::Serialize;
use starpipe::base::format::five_digits as number;
use starpipe::model::sensitivity::Spacing;
use starpipe::study::validation::{Protocol, Summary};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// One value of one parameter.
pub(super) struct Study {
    studied: Studied,
    spacing: Spacing,
    value: f64,
    protocol: Protocol,
}

/// What came of it.
#[derive(Debug, Clone, Serialize)]
pub(super) struct StudyRow {
    pub(super) parameter: &'static str,
    pub(super) value: f64,
    frames: usize,
    right: usize,
    none: usize,
    wrong: usize,
    pub(super) right_percent: f64,
    pub(super) right_low_percent: f64,
    pub(super) right_high_percent: f64,
    wrong_high_percent: f64,
    detected: u64,
    named: u64,
    misnamed: u64,
    misnamed_companions: u64,
    pub(super) false_per_mpx: f64,
    pub(super) false_low_per_mpx: f64,
    pub(super) false_high_per_mpx: f64,
    pub(super) predicted_limit_vmag: f64,
    pub(super) measured_limit_vmag: Option<f64>,
    pub(super) measured_limit_sigma_mag: Option<f64>,
    limit_difference_mag: Option<f64>,
    pub(super) centroid_ratio: Option<f64>,
    pub(super) centroid_ratio_sigma: Option<f64>,
    pub(super) boresight_p50_arcsec: Option<f64>,
    pub(super) boresight_p95_arcsec: Option<f64>,
    pub(super) roll_p50_arcsec: Option<f64>,
    pub(super) roll_p95_arcsec: Option<f64>,
    pub(super) nees_mean: Option<f64>,
    pub(super) nees_sigma: Option<f64>,
    pull_x_sd: f64,
    pull_y_sd: f64,
    pull_flux_sd: f64,
    faintest_difference_mag: f64,
    faintest_difference_sigma_mag: f64,
    #[serde(skip)]
    pub(super) title: String,
    #[serde(skip)]
    pub(super) is_log: bool,
}

/// The runs that the sweeps ask for, each of which makes sense.
pub(super) fn protocols(
    sweeps: &[StudySweep],
    base: &Protocol,
) -> Result<Vec<Study>, CommandError> {
    let mut studies: Vec<Study> = Vec::new();
    for sweep in sweeps {
        let name = sweep.studied.name();
        if studies.iter().any(|study| study.studied.name() == name) {
            return Err(CommandError::Usage(format!(
                "--sweep is given twice for {name}"
            )));
        }
        for &value in &sweep.values {
            let mut protocol = base.clone();
            sweep.studied.set(&mut protocol.setup, value);
            let check = protocol.setup.scenario.check();
            check.map_err(|error| CommandError::Usage(format!("{name} of {value}: {error}")))?;
            studies.push(Study {
                studied: sweep.studied,
                spacing: sweep.spacing,
                value,
                protocol,
            });
        }
    }
    Ok(studies)
}

/// Does them all, one after the other, and writes what came of each.
pub(super) fn run(
    directory: &Path,
    studies: &[Study],
    shared: &Shared,
) -> Result<Vec<StudyRow>, CommandError> {
    let mut rows = Vec::new();
    for study in studies {
        let place = directory.join(format!("{}={}", study.studied.name(), study.value));
        let summary = run::run(&place, &study.protocol, shared)?;
        rows.push(StudyRow::new(study, &summary));
    }
    let json = serde_json::to_string_pretty(&rows).context("writing JSON")? + "\n";
    let mut files: Vec<(PathBuf, Vec<u8>)> = figures::of_study(&rows, shared.figures)?
        .into_iter()
        .map(|(name, content)| (directory.join(name), content))
        .collect();
    files.push((directory.join("study.json"), json.into_bytes()));
    files.push((
        directory.join("study.csv"),
        csv_table(rows.iter())?.into_bytes(),
    ));
    write_whole(&files)?;
    Ok(rows)
}

impl StudyRow {
    fn new(study: &Study, summary: &Summary) -> Self {
        let identification = &summary.identification.all;
        let (detection, completeness) = (&summary.detection, &summary.completeness);
        let attitude = summary.attitude.as_ref();
        let pulls = &summary.pulls;
        Self {
            parameter: study.studied.name(),
            value: study.value,
            frames: summary.frames,
            right: identification.right,
            none: identification.none,
            wrong: identification.wrong,
            right_percent: identification.right_percent,
            right_low_percent: identification.right_low_percent,
            right_high_percent: identification.right_high_percent,
            wrong_high_percent: identification.wrong_high_percent,
            detected: detection.detected,
            named: detection.named,
            misnamed: detection.misnamed,
            misnamed_companions: detection.misnamed_companions,
            false_per_mpx: detection.false_per_mpx,
            false_low_per_mpx: detection.false_low_per_mpx,
            false_high_per_mpx: detection.false_high_per_mpx,
            predicted_limit_vmag: completeness
                .predicted_fit_vmag
                .unwrap_or(completeness.predicted_limit_vmag),
            measured_limit_vmag: completeness.measured_limit_vmag,
            measured_limit_sigma_mag: completeness.measured_limit_sigma_mag,
            limit_difference_mag: completeness.difference_mag,
            centroid_ratio: summary.centroids.ratio,
            centroid_ratio_sigma: summary.centroids.ratio_sigma,
            boresight_p50_arcsec: attitude.map(|a| a.boresight_arcsec.p50),
            boresight_p95_arcsec: attitude.map(|a| a.boresight_arcsec.p95),
            roll_p50_arcsec: attitude.map(|a| a.roll_arcsec.p50),
            roll_p95_arcsec: attitude.map(|a| a.roll_arcsec.p95),
            nees_mean: attitude.map(|a| a.nees_mean),
            nees_sigma: attitude.map(|a| a.nees_sigma),
            pull_x_sd: pulls.x.sd,
            pull_y_sd: pulls.y.sd,
            pull_flux_sd: pulls.flux.sd,
            faintest_difference_mag: summary.faintest.mean,
            faintest_difference_sigma_mag: summary.faintest.mean_sigma,
            title: study.studied.title(),
            is_log: study.spacing == Spacing::Log,
        }
    }
}

/// The rows for people.
pub(super) fn text(rows: &[StudyRow]) -> String {
    let mut text = String::new();
    for rows in rows.chunk_by(|a, b| a.parameter == b.parameter) {
        let _ = writeln!(
            text,
            "{:>26} {:>7} {:>7} {:>6} {:>6} {:>8} {:>19} {:>8} {:>8} {:>9} {:>9} {:>7} {:>7}",
            rows[0].parameter,
            "frames",
            "right",
            "none",
            "wrong",
            "right %",
            "95 %",
            "limit",
            "minus",
            "ratio to",
            "boresight",
            "95 %",
            "NEES"
        );
        let _ = writeln!(
            text,
            "{:>26} {:>7} {:>7} {:>6} {:>6} {:>8} {:>19} {:>8} {:>8} {:>9} {:>9} {:>7} {:>7}",
            "", "", "", "", "", "", "", "V", "expected", "bound", "off ″, 50", "", "of 3"
        );
        for row in rows {
            let or_dash = |value: Option<f64>, decimals: usize| {
                value.map_or("–".to_owned(), |value| format!("{value:.decimals$}"))
            };
            let interval = format!(
                "{:.2} to {:.2}",
                row.right_low_percent, row.right_high_percent
            );
            let _ = writeln!(
                text,
                "{:>26} {:>7} {:>7} {:>6} {:>6} {:>8.2} {interval:>19} {:>8} {:>8} {:>9} {:>9} {:>7} {:>7}",
                number(row.value),
                row.frames,
                row.right,
                row.none,
                row.wrong,
                row.right_percent,
                or_dash(row.measured_limit_vmag, 3),
                or_dash(row.limit_difference_mag, 3),
                or_dash(row.centroid_ratio, 3),
                or_dash(row.boresight_p50_arcsec, 2),
                or_dash(row.boresight_p95_arcsec, 2),
                or_dash(row.nees_mean, 2),
            );
        }
    }
    text
}
