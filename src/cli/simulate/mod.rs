//! `simulate`: frames with known truth, as files.

mod args;
mod files;
mod generator;
mod header;
mod record;
mod subject;

pub(crate) use args::SimulateArgs;

use super::batch::for_each_ordered;
use super::exit::{CommandError, Outcome};
use super::options::format::PageFormat;
use super::output::files::write_whole;
use super::output::rows::{csv_table, json_lines};
use super::progress::frames_bar_with_speed;
use anyhow::Context;
use files::FrameFiles;
use generator::Generator;
use header::Description;
use record::FrameRecord;
use starpipe::model::sensitivity::{Budget, Detector, Rule};
use starpipe::model::simulate::{Simulator, truth_table};
use starpipe::sky::places::StarPlaces;
use std::ops::ControlFlow;
use subject::Subject;

/// `starpipe simulate`
pub(crate) fn simulate(arguments: &SimulateArgs) -> Result<Outcome, CommandError> {
    let setup = arguments.setup.setup()?;
    let subject = Subject::of(arguments, &setup)?;
    let files = FrameFiles::of(arguments, &subject, &setup.scenario.camera)?;
    let pool = arguments.catalog.threads.pool()?;
    let catalog = pool.install(|| arguments.catalog.read())?;
    let simulator = Simulator::new(&setup.scenario, &setup.scene, catalog.stars())
        .context("simulating a frame")?;
    let uniform = simulator.uniform_scenario();
    let detector = Detector::new(Rule::MatchedFilter, &uniform, &Budget::new(&uniform));
    let site = arguments.observer.site();
    let velocity_km_s = arguments.observer.velocity_km_s();
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
    let records = write_all(&generator, &files, &pool)?;
    Ok(Outcome::success(match arguments.format {
        PageFormat::Text => records.iter().map(FrameRecord::to_text).collect(),
        PageFormat::Json => json_lines(records.iter())?,
    }))
}

/// Simulates and writes all frames. Returns their records in order.
fn write_all(
    generator: &Generator,
    files: &FrameFiles,
    pool: &rayon::ThreadPool,
) -> anyhow::Result<Vec<FrameRecord>> {
    let numbers: Vec<u64> = files.numbers().collect();
    let progress = frames_bar_with_speed(numbers.len() as u64);
    let mut records = Vec::with_capacity(numbers.len());
    let mut failed = None;
    let write = |number: &u64, (): &mut ()| write(generator, files, *number);
    for_each_ordered(
        pool,
        &numbers,
        || (),
        write,
        |_, record| {
            progress.inc(1);
            match record {
                Ok(record) => {
                    records.push(record);
                    ControlFlow::Continue(())
                }
                Err(error) => {
                    failed = Some(error);
                    ControlFlow::Break(())
                }
            }
        },
    );
    progress.finish_and_clear();
    failed.map_or(Ok(records), Err)
}

/// Simulates the frame with this number and writes it with its table.
fn write(generator: &Generator, files: &FrameFiles, number: u64) -> anyhow::Result<FrameRecord> {
    let simulated = generator.frame(number).context("simulating a frame")?;
    let description = Description {
        generator,
        simulated: &simulated,
    };
    let path = files.image(number);
    let truth_path = simulated.truth.as_ref().map(|_| path.with_extension("csv"));
    let image = files.encoded(&simulated.frame, &description)?;
    let record = FrameRecord::new(generator, &simulated, &path, truth_path.as_deref());
    let mut contents = vec![(path, image)];
    if let (Some(truth), Some(path)) = (&simulated.truth, truth_path) {
        let (camera, pointing) = (generator.simulator.camera(), simulated.pointing.as_ref());
        let rows = truth_table(truth, camera, generator.catalog, pointing);
        contents.push((path, csv_table(rows.into_iter())?.into_bytes()));
    }
    write_whole(&contents)?;
    Ok(record)
}
