//! `robustness`: rows of trials, their table, and their figure.

mod args;
mod figure;
mod sweep;

pub(crate) use args::RobustnessArgs;

use super::exit::{CommandError, Exit};
use super::options::catalog::{index_catalog, read_catalog, thread_pool, warn_of_cache};
use super::options::format::Format;
use super::output::files::write_whole;
use super::output::rows::{csv_table, json_lines};
use super::output::stdout::print;
use super::progress::bar;
use anyhow::Context;
use args::{MirroredArg, ProtocolOptions};
use figure::Rates;
use starpipe::identify::Photometry;
use starpipe::study::robustness::{Case, Mirrored, Parameter, Protocol, Row, run, standard_cases};
use std::fmt::Write as _;

/// `starpipe robustness`
pub(crate) fn robustness(arguments: &RobustnessArgs) -> Result<Exit, CommandError> {
    let rows = rows(arguments)?;
    if let Some(plot) = &arguments.plot {
        let file = plot.with(&Rates(&rows)).context("drawing the figure")?;
        write_whole(&[file])?;
    }
    // Nobody left to read it: nothing is lost.
    let _ = print(&rendered(arguments, &rows)?)?;
    Ok(Exit::Success)
}

/// A row of the table, and the value of the parameter that is swept in it.
struct SweptRow {
    row: Row,
    swept: Option<(Parameter, f64)>,
}

impl ProtocolOptions {
    fn resolve(&self) -> Protocol {
        Protocol {
            fov_deg: self.fov,
            width_px: self.width as usize,
            height_px: self.height as usize,
            mean_stars: self.stars,
            centroid_sigma_px: self.centroid_error,
            mag_sigma: self.mag_error,
            missing: self.missing / 100.0,
            false_stars: self.false_stars / 100.0,
            scale_error: (!self.scale_unknown).then_some(self.scale_error / 100.0),
            mirrored: match self.mirrored {
                MirroredArg::Never => Mirrored::Never,
                MirroredArg::Half => Mirrored::Half,
                MirroredArg::Always => Mirrored::Always,
            },
            photometry: if self.vmag {
                Photometry::JohnsonV
            } else {
                Photometry::Instrumental
            },
        }
    }
}

/// The cases that are asked for.
fn cases(arguments: &RobustnessArgs) -> Vec<(Case, Option<(Parameter, f64)>)> {
    let base = arguments.protocol.resolve();
    if arguments.sweep.is_empty() {
        let standard = standard_cases(&base).into_iter();
        return standard.map(|case| (case, None)).collect();
    }
    let mut cases = Vec::new();
    for sweep in &arguments.sweep {
        for &value in &sweep.values {
            let case = Case {
                label: format!("{} {value}", sweep.parameter.name()),
                protocol: sweep.parameter.set(&base, value),
            };
            cases.push((case, Some((sweep.parameter, value))));
        }
    }
    cases
}

fn rows(arguments: &RobustnessArgs) -> Result<Vec<SweptRow>, CommandError> {
    let cases = cases(arguments);
    let pool = thread_pool(arguments.resources.threads)?;
    let catalog = pool.install(|| read_catalog(arguments.resources.catalog.as_deref()))?;
    let indexed = pool.install(|| index_catalog(&catalog, &arguments.resources));
    let progress = bar(
        arguments.trials * cases.len() as u64,
        "trials {wide_bar} {pos}/{len} {eta}",
    );
    let row = |(case, swept): (Case, Option<(Parameter, f64)>)| {
        let done = || progress.inc(1);
        let tally = pool.install(|| {
            run(
                &indexed,
                &case.protocol,
                arguments.trials,
                arguments.seed,
                &done,
            )
        });
        let row = Row::new(&case, &tally, arguments.least_true_stars);
        SweptRow { row, swept }
    };
    let rows = cases.into_iter().map(row).collect();
    progress.finish_and_clear();
    warn_of_cache(&indexed);
    Ok(rows)
}

fn rendered(arguments: &RobustnessArgs, rows: &[SweptRow]) -> anyhow::Result<String> {
    match arguments.format {
        Format::Text => Ok(text(arguments, rows)),
        Format::Json => json_lines(rows.iter().map(|swept| &swept.row)),
        Format::Csv => csv_table(rows.iter().map(|swept| &swept.row)),
    }
}

fn text(arguments: &RobustnessArgs, rows: &[SweptRow]) -> String {
    let protocol = &arguments.protocol;
    let scale = if protocol.scale_unknown {
        "unknown".to_owned()
    } else {
        format!("known to {} %", protocol.scale_error)
    };
    let mut text = format!(
        "{} trials a row, seed {}; {} × {} px, {} stars on average; unless the row says otherwise centroids {} px and \
         magnitudes {} off, {} % of the stars missing, {} % false, field of view {scale}.\n\
         Rates are of the trials with {} true stars or more, with 95 % intervals; wrong answers and times are of all trials.\n\n",
        arguments.trials,
        arguments.seed,
        protocol.width,
        protocol.height,
        protocol.stars,
        protocol.centroid_error,
        protocol.mag_error,
        protocol.missing,
        protocol.false_stars,
        arguments.least_true_stars,
    );
    let _ = writeln!(
        text,
        "{:<28} {:>8} {:>8} {:>6} {:>6} {:>9} {:>17} {:>7} {:>9} {:>9}",
        "", "counted", "right", "none", "wrong", "right", "95 %", "wrong", "median", "99 %"
    );
    for SweptRow { row, .. } in rows {
        let interval = format!(
            "{:.2} to {:.2} %",
            row.right_low_percent, row.right_high_percent
        );
        let rate = match row.counted {
            0 => "–".to_owned(),
            _ => format!("{:.2} %", row.right_percent),
        };
        let interval = if row.counted == 0 {
            "–".to_owned()
        } else {
            interval
        };
        let _ = writeln!(
            text,
            "{:<28} {:>8} {:>8} {:>6} {:>6} {rate:>9} {interval:>17} {:>7} {:>6.2} ms {:>6.1} ms",
            row.case,
            row.counted,
            row.right,
            row.no_answer,
            row.wrong_of_all,
            format!("<{:.2} %", row.wrong_high_percent + 0.005),
            row.median_ms,
            row.p99_ms,
        );
    }
    text
}
