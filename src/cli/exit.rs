//! How a command ends: what it prints, its exit status, its errors.

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
pub(crate) enum CommandError {
    /// The command line is wrong, in a way that only shows when it is read as a whole.
    Usage(String),
    /// Anything else.
    Failed(anyhow::Error),
}

impl From<anyhow::Error> for CommandError {
    fn from(error: anyhow::Error) -> Self {
        Self::Failed(error)
    }
}
