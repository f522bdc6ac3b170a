//! From arguments to exit status: raw arguments, settings, work, printing.

mod args;
mod batch;
mod cache;
mod camera;
mod centroids;
mod darks;
mod defocus;
mod experiment;
mod flats;
mod import;
mod input;
mod limit;
mod output;
mod overwrite;
mod plot;
mod resources;
mod robustness;
mod settings;
mod setup;
mod simulate;
mod solve;
mod validate;
mod values;

use args::{Arguments, Command};
use clap::{ArgMatches, CommandFactory, FromArgMatches, error::ErrorKind};
use starpipe::base::format::printable;
use std::fmt::Display;
use std::io::{self, Write};
use std::process::ExitCode;

/// How a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Exit {
    /// All went well, and every frame was identified.
    Success,
    /// Something could not be read, written or understood.
    Failure,
    /// Everything was read, but some frame was not identified.
    NotIdentified,
    /// All was done, but there is nothing that meets what is required.
    Unmet,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(match exit {
            Exit::Success => 0,
            Exit::Failure => 1,
            // clap leaves with 2 where the command line is wrong.
            Exit::NotIdentified | Exit::Unmet => 3,
        })
    }
}

/// Why a command could not do its work.
pub(crate) enum Fault {
    /// The command line is wrong, in a way that only shows when it is read as a whole.
    Usage(String),
    /// Anything else.
    Failed(anyhow::Error),
}

impl From<anyhow::Error> for Fault {
    fn from(error: anyhow::Error) -> Self {
        Self::Failed(error)
    }
}

/// Does what the command line asks for.
pub(crate) fn run() -> ExitCode {
    let matches = Arguments::command().get_matches();
    let arguments = Arguments::from_arg_matches(&matches).unwrap_or_else(|error| error.exit());
    let done = match arguments.command {
        Command::Process(arguments) => solve::process(arguments),
        Command::Identify(arguments) => solve::identify(arguments),
        Command::Catalog(arguments) => import::catalog(arguments),
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
        Err(Fault::Usage(message)) => command_of(&matches)
            .error(ErrorKind::ValueValidation, printable(&message))
            .exit(),
        Err(Fault::Failed(error)) => {
            complain(chained(error.as_ref()));
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

/// An error and its causes in one line. A cause that the message before it ends with is not said again.
pub(crate) fn chained(error: &(dyn std::error::Error + 'static)) -> String {
    let mut line = String::new();
    for cause in std::iter::successors(Some(error), |error| error.source()) {
        let text = cause.to_string();
        let text = text.trim();
        if !line.ends_with(text) {
            line += if line.is_empty() { "" } else { ": " };
            line += text;
        }
    }
    line.replace('\n', " ")
}

/// Tells of trouble, on standard error.
pub(crate) fn complain(message: impl Display) {
    let line = printable(&format!("starpipe: {message}"));
    // Where standard error cannot be written nobody can be told; the exit status still does.
    let _ = writeln!(io::stderr(), "{line}");
}

/// Tells of something odd that does no harm, on standard error.
pub(crate) fn warn(message: impl Display) {
    complain(format_args!("warning: {message}"));
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::{Context, anyhow};

    #[test]
    fn causes_are_chained_in_one_line_and_said_once() {
        let cause = anyhow!("no such file");
        let error = Err::<(), _>(cause)
            .context("a.tif: no such file")
            .context("reading a.tif: no such file\nat all")
            .unwrap_err();
        assert_eq!(
            chained(error.as_ref()),
            "reading a.tif: no such file at all: a.tif: no such file"
        );
    }
}
