//! `-` as an input: standard input.

use crate::cli::exit::CommandError;
use std::path::{Path, PathBuf};

/// Whether `input` stands for standard input.
pub(crate) fn is_stdin(input: &Path) -> bool {
    input.as_os_str() == "-"
}

/// Refuses inputs that name standard input twice: it can be read only once.
pub(crate) fn check_once(inputs: &[PathBuf]) -> Result<(), CommandError> {
    if inputs.iter().filter(|input| is_stdin(input)).count() > 1 {
        return Err(CommandError::usage(
            "- is standard input, which can be read only once; it is given twice",
        ));
    }
    Ok(())
}
