//! Lists of centroids from files and standard input.

use super::stdin::is_stdin;
use anyhow::Context;
use starpipe::CentroidList;
use starpipe::base::files;
use starpipe::centroids::CentroidListOptions;
use std::io::{self, Read};
use std::path::Path;

/// Largest size of a list: some millions of centroids.
const MAX_BYTES: u64 = 1 << 28;

/// Reads the list in the file `path`, or in standard input if that is `-`.
pub(crate) fn read(path: &Path, options: &CentroidListOptions) -> anyhow::Result<CentroidList> {
    let reading = || format!("reading {}", path.display());
    let stream: Box<dyn Read> = if is_stdin(path) {
        Box::new(io::stdin().lock())
    } else {
        Box::new(files::open(path).with_context(reading)?)
    };
    let bytes = files::read_stream(stream, MAX_BYTES).with_context(reading)?;
    CentroidList::parse(&bytes, options).with_context(reading)
}
