//! Standard output.

use anyhow::Context;
use std::io::{self, Write};
use std::ops::ControlFlow;

/// Writes `text` to standard output and flushes it. Breaks if the reader has closed the pipe.
pub(crate) fn print(text: &str) -> anyhow::Result<ControlFlow<()>> {
    let mut stdout = io::stdout().lock();
    let written = stdout
        .write_all(text.as_bytes())
        .and_then(|()| stdout.flush());
    match written {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(ControlFlow::Break(())),
        Err(error) => Err(error).context("writing to standard output"),
        Ok(()) => Ok(ControlFlow::Continue(())),
    }
}
