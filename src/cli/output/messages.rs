//! Errors and warnings on standard error, each in one line.

use starpipe::base::format::printable;
use starpipe::base::remedy::OptionNames;
use starpipe::solve::remedies_of;
use std::fmt::Display;
use std::io::{self, Write};
use std::path::PathBuf;

/// Reports an error with its causes.
pub(crate) fn report_error(error: &(dyn std::error::Error + 'static)) {
    let see = OptionNames::Flags.see(&remedies_of(error));
    report(one_line(error) + &see);
}

/// Reports something unexpected that leaves the results valid.
pub(crate) fn report_warning(message: impl Display) {
    report(format_args!("warning: {message}"));
}

/// Tells of files that say whose a directory is, and that were damaged.
pub(crate) fn report_mended(files: &[PathBuf]) {
    for path in files {
        report_warning(format_args!(
            "{} was damaged and is rewritten",
            path.display()
        ));
    }
}

/// Writes one line to standard error.
pub(crate) fn report(message: impl Display) {
    let line = line(&format!("starpipe: {message}"));
    // If standard error cannot be written, the exit status still tells of the failure.
    let _ = writeln!(io::stderr(), "{line}");
}

/// What a message says, on one line that people can read: of a long one the ends.
pub(crate) fn line(message: &str) -> String {
    /// Longer than any that quotes paths.
    const MAX: usize = 12_000;
    const END: usize = 2000;
    let count = message.chars().count();
    if count <= MAX {
        return printable(message);
    }
    let start: String = message.chars().take(MAX - END).collect();
    let end: String = message.chars().skip(count - END).collect();
    let left_out = count - MAX;
    printable(&format!("{start}… ({left_out} characters) …{end}"))
}

/// An error and its causes in one line, without causes that the text before them already ends with.
pub(crate) fn one_line(error: &(dyn std::error::Error + 'static)) -> String {
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

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::{Context, anyhow};

    #[test]
    fn causes_are_joined_in_one_line_without_repetition() {
        let cause = anyhow!("no such file");
        let error = Err::<(), _>(cause)
            .context("a.tif: no such file")
            .context("reading a.tif: no such file\nat all")
            .unwrap_err();
        assert_eq!(
            one_line(error.as_ref()),
            "reading a.tif: no such file at all: a.tif: no such file"
        );
    }
}
