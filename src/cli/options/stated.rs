//! Options of solving that several commands share, and how the library gets them: what they may be it knows.

use crate::cli::exit::CommandError;
use clap::Args;
use serde::Serialize;
use starpipe::solve::{DEFAULT_TIME_LIMIT_S, SolveOptions};

/// `options` with what is stated: a group of options whose fields have the library's names.
pub(crate) fn with_stated(
    options: SolveOptions,
    stated: &impl Serialize,
) -> Result<SolveOptions, CommandError> {
    options.with(stated).map_err(|error| {
        let option = error.name.replace('_', "-");
        CommandError::usage(format_args!("--{option} {}", error.reason))
    })
}

#[derive(Debug, Args, Serialize)]
#[command(next_help_heading = "Hints")]
pub(crate) struct ExposureOption {
    /// Exposure of the frames, in seconds [default: the exposure in the file's header]
    #[arg(long, value_name = "SECONDS", allow_hyphen_values = true)]
    exposure: Option<String>,
}

#[derive(Debug, Args, Serialize)]
#[command(next_help_heading = "Limits")]
pub(crate) struct TimeLimitOption {
    /// Time limit for a frame, in seconds; a frame that exceeds it is reported as not identified
    #[arg(long, value_name = "SECONDS", allow_hyphen_values = true, default_value_t = DEFAULT_TIME_LIMIT_S.to_string())]
    time_limit: String,
}
