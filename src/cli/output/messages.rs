//! Errors and warnings on standard error.

use starpipe::base::format::printable;
use std::fmt::Display;
use std::io::{self, Write};

/// An error and its causes in one line. A cause that the message before it ends with is not said again.
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

/// Tells of trouble, on standard error.
pub(crate) fn report_error(message: impl Display) {
    let line = printable(&format!("starpipe: {message}"));
    // Where standard error cannot be written nobody can be told; the exit status still does.
    let _ = writeln!(io::stderr(), "{line}");
}

/// Tells of something odd that does no harm, on standard error.
pub(crate) fn report_warning(message: impl Display) {
    report_error(format_args!("warning: {message}"));
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
            one_line(error.as_ref()),
            "reading a.tif: no such file at all: a.tif: no such file"
        );
    }
}
