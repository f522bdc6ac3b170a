//! `simulate`: frames with known truth, as files.

mod args;
mod files;
mod generator;
mod header;
mod record;
mod subject;

pub(crate) use args::SimulateArgs;

use super::batch::for_each_ordered;
use super::exit::{CommandError, CommandOutput};
use super::options::format::PageFormat;
use super::options::stated::with_stated;
use super::output::files::{failures, write_whole};
use super::output::messages::report_error;
use super::output::rows::{csv_table, json_lines};
use super::progress::frames_bar_with_speed;
use anyhow::Context;
use files::FrameFiles;
use generator::Generator;
use header::Description;
use record::SimulationRecord;
use starpipe::ephemeris::places::StarPlaces;
use starpipe::lab::simulate::{Simulator, truth_table};
use starpipe::predict::{Budget, Detector, Rule};
use starpipe::solve::SolveOptions;
use std::ops::ControlFlow;
use subject::FrameSubject;

/// `starpipe simulate`
pub(crate) fn simulate(arguments: &SimulateArgs) -> Result<CommandOutput, CommandError> {
    let observer = with_stated(SolveOptions::default(), &arguments.observer)?;
    let setup = arguments.setup.setup()?;
    let subject = FrameSubject::of(arguments, &setup)?;
    let files = FrameFiles::from_arguments(arguments, &subject, &setup.scenario.camera)?;
    let pool = arguments.catalog.threads.pool()?;
    let catalog = pool.install(|| arguments.catalog.read())?;
    let simulator = Simulator::new(&setup.scenario, &setup.scene, catalog.stars())
        .context("simulating a frame")?;
    let uniform = simulator.uniform_scenario();
    let detector = Detector::new(Rule::MatchedFilter, &uniform, &Budget::new(&uniform));
    let site = observer.site_with_air();
    let velocity_km_s = observer.velocity_km_s;
    let generator = Generator {
        setup: &setup,
        simulator: &simulator,
        subject: &subject,
        catalog: &catalog,
        date: arguments.date,
        site,
        places: arguments.date.map_or_else(StarPlaces::default, |date| {
            StarPlaces::at(&date, site, velocity_km_s.map(Into::into))
        }),
        seed: arguments.seed,
        limit_vmag: detector.vmag_at(0.5),
    };
    files.prepare()?;
    let (records, all_written) = write_all(&generator, &files, &pool);
    let outcome = CommandOutput::success(match arguments.format {
        PageFormat::Text => records.iter().map(SimulationRecord::to_text).collect(),
        PageFormat::Json => json_lines(records.iter())?,
    });
    Ok(outcome.if_written(all_written))
}

/// Simulates and writes all frames; what fails is told. Returns the records of those that are written, in order,
/// and whether all files are.
fn write_all(
    generator: &Generator,
    files: &FrameFiles,
    pool: &rayon::ThreadPool,
) -> (Vec<SimulationRecord>, bool) {
    let numbers: Vec<u64> = files.numbers().collect();
    let progress = frames_bar_with_speed(numbers.len() as u64);
    let mut records = Vec::with_capacity(numbers.len());
    let mut all_written = true;
    let write = |number: &u64, (): &mut ()| write(generator, files, *number);
    for_each_ordered(
        pool,
        &numbers,
        || (),
        write,
        |_, record| {
            progress.inc(1);
            let (record, failures) = record.unwrap_or_else(|error| (None, vec![error]));
            records.extend(record);
            all_written &= failures.is_empty();
            for error in &failures {
                progress.suspend(|| report_error(error.as_ref()));
            }
            ControlFlow::Continue(())
        },
    );
    progress.finish_and_clear();
    (records, all_written)
}

/// Simulates the frame with this number and writes it with its table. Returns its record, if its image is
/// written, and why files of it are not.
fn write(
    generator: &Generator,
    files: &FrameFiles,
    number: u64,
) -> anyhow::Result<(Option<SimulationRecord>, Vec<anyhow::Error>)> {
    let simulated = generator.frame(number).context("simulating a frame")?;
    let description = Description {
        generator,
        simulated: &simulated,
    };
    let path = files.image(number);
    let truth_path = simulated.truth.as_ref().map(|_| path.with_extension("csv"));
    let image = files.encoded(&simulated.frame, &description)?;
    let record = SimulationRecord::new(generator, &simulated, &path, truth_path.as_deref());
    let written = write_whole(&path, &image);
    let record = written.is_ok().then_some(record);
    let table = simulated.truth.as_ref().zip(truth_path);
    let table = table.map(|(truth, path)| {
        let (camera, pointing) = (generator.simulator.camera(), simulated.pointing.as_ref());
        let rows = truth_table(truth, camera, generator.catalog, pointing);
        Ok((path, csv_table(rows.into_iter())?.into_bytes()))
    });
    let failures = failures(table).into_iter().chain(written.err());
    Ok((record, failures.collect()))
}
