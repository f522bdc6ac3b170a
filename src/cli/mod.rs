//! From arguments to exit status: raw arguments, settings, work, printing.

mod batch;
mod camera;
mod catalog;
mod command;
mod darks;
mod defocus;
mod exit;
mod experiment;
mod flats;
mod identify;
mod input;
mod limit;
mod options;
mod output;
mod plot;
mod process;
mod progress;
mod robustness;
mod simulate;
mod solving;
mod validate;

use clap::{ArgMatches, CommandFactory, FromArgMatches, error::ErrorKind};
use command::{Arguments, Command};
use exit::{CommandError, Exit};
use output::messages::{one_line, report_error};
use starpipe::base::format::printable;
use std::process::ExitCode;

/// Does what the command line asks for.
pub(crate) fn run() -> ExitCode {
    let matches = Arguments::command().get_matches();
    let arguments = Arguments::from_arg_matches(&matches).unwrap_or_else(|error| error.exit());
    let done = match arguments.command {
        Command::Process(arguments) => process::process(arguments),
        Command::Identify(arguments) => identify::identify(arguments),
        Command::Catalog(arguments) => catalog::catalog(arguments),
        Command::Robustness(arguments) => robustness::robustness(&arguments),
        Command::Limit(arguments) => limit::limit(&arguments),
        Command::Camera(arguments) => camera::camera(&arguments),
        Command::Defocus(arguments) => defocus::defocus(&arguments),
        Command::Darks(arguments) => darks::darks(arguments),
        Command::Flats(arguments) => flats::flats(arguments),
        Command::Experiment(arguments) => experiment::experiment(&arguments),
        Command::Simulate(arguments) => simulate::simulate(&arguments),
        Command::Validate(arguments) => validate::validate(&arguments),
    };
    match done {
        Ok(exit) => exit.into(),
        Err(CommandError::Usage(message)) => command_of(&matches)
            .error(ErrorKind::ValueValidation, printable(&message))
            .exit(),
        Err(CommandError::Failed(error)) => {
            report_error(one_line(error.as_ref()));
            Exit::Failure.into()
        }
    }
}

/// The command that was typed, for its usage to be shown.
fn command_of(mut matches: &ArgMatches) -> clap::Command {
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
