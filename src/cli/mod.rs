//! The command line: arguments → settings → the library's work → output and exit status.
//!
//! - Each command is one file or folder: its arguments, and a function that returns an
//!   [`exit::Outcome`].
//! - `options`, `input`, `output`, `batch`, `progress`, `plot` and `page` hold what several commands share.
//! - Only `run` and the reports of `solving` and `track`, which appear frame by frame, write to
//!   standard output.

mod archive;
mod batch;
mod calibrate;
mod camera;
mod catalog;
mod command;
mod darks;
mod defocus;
mod doors;
mod exit;
mod experiment;
mod first_word;
mod flats;
mod identify;
mod input;
mod limit;
mod night;
mod options;
mod output;
mod page;
mod plot;
mod process;
mod progress;
#[cfg(feature = "shell")]
mod shell;
mod short_help;
mod simulate;
mod solving;
mod track;
mod validate;

use clap::error::ErrorKind;
use clap::{ArgMatches, CommandFactory, FromArgMatches};
use command::{Arguments, Command};
use exit::{CommandError, CommandOutput, Exit};
use output::messages::{line, report_error};
use output::stdout::print;
use starpipe::base::panics::{caught, silence};
use std::process::ExitCode;

/// Runs the command that the command line names.
pub(crate) fn run() -> ExitCode {
    let mut program = short_help::apply(Arguments::command());
    let words = first_word::completed(std::env::args_os(), &mut program);
    let matches = program.get_matches_from(words.unwrap_or_else(|error| error.exit()));
    let arguments = Arguments::from_arg_matches(&matches).unwrap_or_else(|error| error.exit());
    silence();
    let done = caught(|| run_command(arguments.command));
    let exit = done.unwrap_or_else(|panicked| Err(panicked.into()));
    let exit = exit.and_then(|outcome| {
        // If the reader closed the pipe, nobody waits for the rest.
        let _ = print(&outcome.text)?;
        Ok(outcome.exit)
    });
    match exit {
        Ok(exit) => exit.into(),
        Err(CommandError::Usage(message)) => typed_command(&matches)
            .error(ErrorKind::ValueValidation, line(&message))
            .exit(),
        Err(CommandError::Failed(error)) => {
            report_error(error.as_ref());
            Exit::Failure.into()
        }
    }
}

fn run_command(command: Command) -> Result<CommandOutput, CommandError> {
    match command {
        Command::Process(arguments) => process::process(*arguments),
        Command::Sky(mut arguments) => {
            arguments.sky = true;
            process::process(*arguments)
        }
        Command::Identify(arguments) => identify::identify(*arguments),
        Command::Archive(arguments) => archive::archive(&arguments),
        #[cfg(feature = "serve")]
        Command::Serve(arguments) => doors::serve::serve(&arguments),
        Command::Track(arguments) => track::track(&arguments),
        Command::Calibrate(arguments) => calibrate::calibrate(*arguments),
        Command::Catalog(arguments) => catalog::catalog(arguments),
        Command::Night(arguments) => night::night(&arguments),
        Command::Limit(arguments) => limit::limit(&arguments),
        Command::Camera(arguments) => camera::camera(&arguments),
        Command::Defocus(arguments) => defocus::defocus(&arguments),
        Command::Darks(arguments) => darks::darks(arguments),
        Command::Flats(arguments) => flats::flats(arguments),
        Command::Experiment(arguments) => experiment::experiment(&arguments),
        Command::Simulate(arguments) => simulate::simulate(&arguments),
        Command::Validate(arguments) => validate::validate(&arguments),
        Command::ValidateHard(arguments) => validate::hard(&arguments),
        Command::ValidateSky(arguments) => validate::sky(&arguments),
        Command::ValidateRobustness(arguments) => validate::robustness(&arguments),
        Command::ValidateClutter(arguments) => validate::clutter(&arguments),
        Command::SolveField(arguments) => doors::solve_field::solve_field(&arguments),
        Command::Astap(arguments) => doors::astap::astap(*arguments),
        #[cfg(feature = "shell")]
        Command::Completions(arguments) => shell::completions(&arguments, Arguments::command()),
        #[cfg(feature = "shell")]
        Command::Man(arguments) => shell::man(&arguments, Arguments::command()),
    }
}

/// The subcommand that was typed: its usage is shown with the error.
fn typed_command(mut matches: &ArgMatches) -> clap::Command {
    let mut command = Arguments::command();
    command.build();
    while let Some((name, below)) = matches.subcommand() {
        if let Some(found) = command.find_subcommand(name) {
            command = found.clone();
        }
        matches = below;
    }
    command
}
