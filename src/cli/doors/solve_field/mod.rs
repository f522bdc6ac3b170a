//! `solve-field`, the command line of astrometry.net: its options → its lines on standard output, and its files.
//!
//! Hints that are wrong do no harm: they are tried first. An input that is not identified is no failure, as there:
//! the exit status is 0.

mod answers;
mod args;
mod job;
mod without_effect;

pub(crate) use args::SolveFieldArgs;

use super::Question;
use crate::cli::exit::{CommandError, CommandOutput, Exit};
use crate::cli::output::files::make_directory;
use crate::cli::output::messages::{report, report_error};
use crate::cli::output::stdout::print;
use crate::cli::solving::{Inputs, SolvedImage};
use answers::Answer;
use args::OutputOptions;
use job::Job;
use starpipe::catalog::Catalog;
use starpipe::frame::{ImageName, PageChoice};
use std::ops::ControlFlow;

/// The version of astrometry.net whose options and files these are.
const VERSION: &str = "0.93";

/// `starpipe solve-field`
pub(crate) fn solve_field(arguments: &SolveFieldArgs) -> Result<CommandOutput, CommandError> {
    if arguments.version {
        let own = env!("CARGO_PKG_VERSION");
        let text = format!("{VERSION} (starpipe {own})\n");
        return Ok(CommandOutput::success(text));
    }
    if let Some(named) = arguments.without_effect.named() {
        report(format_args!("solve-field: without effect: {named}"));
    }
    if let Some(directory) = &arguments.outputs.names.dir {
        make_directory(directory)?;
    }
    let (jobs, mut has_failed) = jobs(arguments)?;
    // In the order in which they are given.
    for alike in jobs.chunk_by(|a, b| a.is_list == b.is_list) {
        has_failed |= solve(arguments, alike)?;
    }
    Ok(Exit::failure_if(has_failed).into())
}

/// What is to be solved, and whether an old file could not be removed. Inputs that are passed over are told at
/// once.
fn jobs(arguments: &SolveFieldArgs) -> Result<(Vec<Job>, bool), CommandError> {
    let inputs = arguments.inputs()?;
    let count = inputs.len();
    let OutputOptions { names, existing } = &arguments.outputs;
    let mut jobs = Vec::new();
    let mut has_failed = false;
    for (number, input) in (1..).zip(inputs) {
        let is_list = arguments.list.options().is_list(&input);
        let name = input.display();
        let title = format!("Reading input file {number} of {count}: \"{name}\"...\n");
        let job = Job::new(input, is_list, names).titled(title);
        if let Some(refusal) = job.refusal(existing) {
            let _ = print(&format!("{}{refusal}\n", job.title))?;
            continue;
        }
        if existing.overwrite
            && let Err(error) = job.remove_old()
        {
            has_failed = true;
            report_error(error.as_ref());
            continue;
        }
        jobs.push(job);
    }
    Ok((jobs, has_failed))
}

/// Solves inputs that are all lists, or all images. Returns whether something could not be read or written.
fn solve(arguments: &SolveFieldArgs, jobs: &[Job]) -> Result<bool, CommandError> {
    let question = Question {
        inputs: match jobs.first() {
            Some(Job { is_list: true, .. }) => Inputs::Xylists(arguments.list.options()),
            _ => Inputs::Frames(PageChoice::Main),
        },
        plan: arguments.plan(),
        scale: arguments.scale(),
    };
    let mut has_failed = false;
    let mut fail = |error: &anyhow::Error| {
        has_failed = true;
        report_error(error.as_ref());
    };
    let max_order = arguments.tweak.max_order();
    let make = |image: &ImageName, solved: &SolvedImage, catalog: &Catalog| {
        let job = jobs.iter().find(|job| job.input == image.path);
        Answer::new(image, solved, job, max_order, catalog)
    };
    let mut titles = jobs.iter().map(|job| &job.title);
    question.answer(&arguments.catalog, jobs, make, |images| {
        let mut text = titles.next().cloned().unwrap_or_default();
        for (_, answer) in images {
            match answer {
                Ok(Answer { lines, failures }) => {
                    text += &lines;
                    failures.iter().for_each(&mut fail);
                }
                Err(error) => fail(&error),
            }
        }
        // If nobody reads the lines, somebody may still read the files.
        if let Err(error) = print(&(text + "\n")) {
            fail(&error);
        }
        ControlFlow::Continue(())
    })?;
    Ok(has_failed)
}
