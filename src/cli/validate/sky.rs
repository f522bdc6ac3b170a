//! The sky suite: simulated skies, compared with the truth in each cell.

use super::shared::Shared;
use crate::cli::batch::try_for_each_ordered;
use crate::cli::exit::CommandError;
use crate::cli::output::messages::report_warning;
use crate::cli::output::rows::{csv_table, json_indented};
use starpipe::ephemeris::observer::Site;
use starpipe::lab::night_sky::{SkyStudy, SkySummary, SkyTrial, TrialFrameRow};
use starpipe::lab::validation::{ValidationProtocol, claim_directory};
use starpipe::report::figure::{Axis, Dot, Marks, Panel, PlotLayer, Rgb, Sheet};
use starpipe::solve::Workspace;
use starpipe::store::Journal;
use std::path::Path;

/// Where the frames are taken.
const SITE_DEG_M: [f64; 3] = [50.0, 10.0, 300.0];
/// The rows of all frames, as they are made.
const ROWS: &str = "frames.jsonl";

/// Measures the frames that `directory` lacks, and writes tables of all.
pub(super) fn run(
    directory: &Path,
    base: &ValidationProtocol,
    shared: &Shared,
) -> Result<(SkySummary, Vec<SkyTrial>), CommandError> {
    let [lat_deg, lon_deg, height_m] = SITE_DEG_M;
    let site = Site::new(lat_deg, lon_deg, height_m).map_err(CommandError::usage)?;
    let protocol = ValidationProtocol {
        site: Some(site),
        ..base.clone()
    };
    claim_directory(directory, &protocol, shared.indexed.catalog())
        .map_err(|error| CommandError::of_store(error, "--out"))?;
    let study = SkyStudy {
        indexed: shared.indexed,
        setup: protocol.setup,
        site,
        seed: protocol.seed,
    };
    let numbers: Vec<String> = (0..shared.frames)
        .map(|number| number.to_string())
        .collect();
    let name = |trial: &SkyTrial| trial.frame.frame.to_string();
    let (mut journal, mut trials) = Journal::open(&directory.join(ROWS), ROWS, &numbers, name)?;
    journal.left_out().iter().for_each(report_warning);
    let left: Vec<u64> = (0..shared.frames)
        .zip(&trials)
        .filter_map(|(number, made)| made.is_none().then_some(number))
        .collect();
    shared.progress.inc(shared.frames - left.len() as u64);
    shared.progress.reset_eta();
    let work = |number: &u64, workspace: &mut Workspace| study.run_one(*number, workspace);
    try_for_each_ordered(shared.pool, &left, Workspace::new, work, |number, made| {
        shared.progress.inc(1);
        let trial = made?;
        journal.add([&trial])?;
        trials[*number as usize] = Some(trial);
        Ok(())
    })?;
    journal.finish()?;
    let trials: Vec<SkyTrial> = trials.into_iter().flatten().collect();
    let summary = SkySummary::of(&trials);
    save(directory, &trials, &summary, shared)?;
    Ok((summary, trials))
}

fn save(
    directory: &Path,
    trials: &[SkyTrial],
    summary: &SkySummary,
    shared: &Shared,
) -> anyhow::Result<()> {
    let tables = [
        (
            "frames.csv",
            csv_table(trials.iter().map(|trial| &trial.frame))?,
        ),
        (
            "cells.csv",
            csv_table(trials.iter().flat_map(|trial| &trial.cells))?,
        ),
        ("suite.json", json_indented(summary)?),
        ("suite.csv", csv_table(summary.groups.iter())?),
        ("suite.txt", summary.to_text()),
    ];
    shared.write(directory, tables, vec![("sky", sheet(trials, summary))]);
    Ok(())
}

/// Errors of the frames over what they depend on.
pub(super) fn sheet(trials: &[SkyTrial], summary: &SkySummary) -> Sheet {
    let dots = |value: fn(&TrialFrameRow) -> Option<(f64, f64, f64)>| {
        let dots = trials.iter().filter_map(|trial| value(&trial.frame));
        Marks::Dots(
            dots.map(|(x, y, sigma)| Dot::from((x, y, [y - sigma, y + sigma])))
                .collect(),
        )
    };
    let errors = |title: &str, x: &str, y: &str, marks: Marks| Panel {
        title: title.to_owned(),
        x: Axis::new(x),
        y: Axis::new(y),
        layers: vec![
            PlotLayer::guide(Marks::Levels(vec![0.0])),
            PlotLayer::new("frames", Rgb::BLUE, marks),
        ],
        ..Panel::default()
    };
    let zenith = dots(|row| {
        let error = row.zenith_mag_arcsec2? - row.true_zenith_mag_arcsec2;
        Some((row.true_zenith_mag_arcsec2, error, row.zenith_sigma_mag?))
    });
    let extinction = dots(|row| {
        let error = row.extinction_mag? - row.true_extinction_mag;
        Some((row.true_extinction_mag, error, row.extinction_sigma_mag?))
    });
    let limit = dots(|row| Some((row.true_zenith_mag_arcsec2, row.limit_difference_mag?, 0.0)));
    let found = summary
        .clear
        .iter()
        .map(|tenth| (tenth.mean_clear, tenth.share_clear));
    Sheet::new(
        vec![
            errors(
                "Brightness of the zenith",
                "V mag/arcsec²",
                "measured − true (mag)",
                zenith,
            ),
            errors(
                "Extinction",
                "magnitudes per airmass",
                "measured − true (mag)",
                extinction,
            ),
            errors(
                "Limit in clear cells",
                "V mag/arcsec² at the zenith",
                "measured − expected (mag)",
                limit,
            ),
            Panel {
                title: "Probability of a clear sky".to_owned(),
                x: Axis::new("stated").within(0.0, 1.0),
                y: Axis::new("share of cells below 0.2 mag").within(0.0, 1.0),
                layers: vec![
                    PlotLayer::new(
                        "ideal",
                        Rgb::ORANGE,
                        Marks::Line(vec![(0.0, 0.0), (1.0, 1.0)]),
                    ),
                    PlotLayer::new("found", Rgb::BLUE, Marks::Line(found.collect())),
                ],
                ..Panel::default()
            },
        ],
        2,
    )
}
