//! `robustness`: rows of trials, their table, and their figure.

mod args;
mod figure;
mod sweep;
mod table;

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
use figure::RateTable;
use starpipe::identify::Photometry;
use starpipe::study::robustness::{
    Case, CaseResult, Mirrored, Parameter, Protocol, run, standard_cases,
};
use table::SweptRow;

/// `starpipe robustness`
pub(crate) fn robustness(arguments: &RobustnessArgs) -> Result<Exit, CommandError> {
    let rows = rows(arguments)?;
    if let Some(plot) = &arguments.plot {
        let file = match figure::sweeps(&rows) {
            Some(sheet) => plot.with(&sheet),
            None => plot.with(&RateTable(&rows)),
        };
        write_whole(&[file.context("drawing the figure")?])?;
    }
    let table = rows.iter().map(|swept| &swept.row);
    let text = match arguments.format {
        Format::Text => table::text(arguments, &rows),
        Format::Json => json_lines(table)?,
        Format::Csv => csv_table(table)?,
    };
    // Nobody left to read it: nothing is lost.
    let _ = print(&text)?;
    Ok(Exit::Success)
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

/// The cases that the options ask for, with the value of the parameter that is swept.
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
    let (trials, seed) = (arguments.trials, arguments.seed);
    let done = || progress.inc(1);
    let row = |(case, swept): (Case, Option<(Parameter, f64)>)| {
        let tally = pool.install(|| run(&indexed, &case.protocol, trials, seed, &done));
        let row = CaseResult::new(&case, &tally, arguments.least_true_stars);
        SweptRow { row, swept }
    };
    let rows = cases.into_iter().map(row).collect();
    progress.finish_and_clear();
    warn_of_cache(&indexed);
    Ok(rows)
}
