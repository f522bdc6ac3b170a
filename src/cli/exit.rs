//! How a command ends: its output, its exit status, its errors.

use starpipe::store::StoreError;
use std::fmt::Display;
use std::process::ExitCode;

/// Result of a command: what is still to be printed on standard output, and the exit status.
pub(crate) struct CommandOutput {
    pub(crate) text: String,
    pub(crate) exit: Exit,
}

impl CommandOutput {
    /// The same, but [`Exit::Failure`] unless everything that was asked for besides is written.
    pub(crate) fn if_written(self, all: bool) -> Self {
        let exit = if all { self.exit } else { Exit::Failure };
        Self { exit, ..self }
    }

    /// Success, with `text` to print.
    pub(crate) fn success(text: String) -> Self {
        Self {
            text,
            exit: Exit::Success,
        }
    }
}

impl From<Exit> for CommandOutput {
    /// Nothing is left to print.
    fn from(exit: Exit) -> Self {
        Self {
            text: String::new(),
            exit,
        }
    }
}

/// Exit status of the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Exit {
    /// Everything succeeded, and every frame was identified.
    Success,
    /// Something could not be read, written or understood.
    Failure,
    /// Everything was read, but at least one frame was not identified.
    NotIdentified,
    /// The work is done, but no result meets the requirement.
    Unmet,
    /// That of another program, in whose place this one answers.
    Other(u8),
}

impl Exit {
    /// [`Exit::Failure`] if something failed, else [`Exit::Success`].
    pub(crate) fn failure_if(failed: bool) -> Self {
        if failed { Self::Failure } else { Self::Success }
    }
}

/// How the frames of a run ended.
#[derive(Debug, Default)]
pub(crate) struct OutcomeTally {
    pub(crate) identified: usize,
    pub(crate) not_identified: usize,
    /// What could not be read or written.
    pub(crate) failed: usize,
}

impl OutcomeTally {
    /// Counts a frame that could be read.
    pub(crate) fn count(&mut self, is_identified: bool) {
        let count = if is_identified {
            &mut self.identified
        } else {
            &mut self.not_identified
        };
        *count += 1;
    }

    /// The exit status of the run.
    pub(crate) fn exit(&self) -> Exit {
        match (self.failed, self.not_identified) {
            (0, 0) => Exit::Success,
            (0, _) => Exit::NotIdentified,
            _ => Exit::Failure,
        }
    }
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(match exit {
            Exit::Success => 0,
            Exit::Failure => 1,
            // clap exits with 2 if the command line is wrong.
            Exit::NotIdentified | Exit::Unmet => 3,
            Exit::Other(status) => status,
        })
    }
}

/// Why a command stopped.
pub(crate) enum CommandError {
    /// The command line is wrong: options contradict each other, or the files that they name.
    Usage(String),
    /// Anything else.
    Failed(anyhow::Error),
}

impl CommandError {
    /// The command line is wrong.
    pub(crate) fn usage(message: impl Display) -> Self {
        Self::Usage(message.to_string())
    }

    /// Why the results of a run cannot be used. A directory that holds something else is an error of the command
    /// line, of its option `option`.
    pub(crate) fn of_store(error: StoreError, option: &str) -> Self {
        if error.is_of_directory() {
            return Self::Usage(format!("{error}; choose another directory for {option}"));
        }
        Self::Failed(error.into())
    }
}

impl<E: Into<anyhow::Error>> From<E> for CommandError {
    fn from(error: E) -> Self {
        Self::Failed(error.into())
    }
}
