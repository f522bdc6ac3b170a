//! What is stated for frames.

use crate::errors::exception;
use pyo3::prelude::*;
use starpipe::solve::SolveOptions;
use std::collections::BTreeMap;

/// Options by name, as texts; what is absent has its default.
#[derive(Debug, FromPyObject)]
#[pyo3(transparent)]
pub struct Options(BTreeMap<String, String>);

impl Options {
    /// The options of the library.
    pub fn resolve(&self) -> PyResult<SolveOptions> {
        SolveOptions::unlimited().with(&self.0).map_err(exception)
    }
}

/// Refuses options that are none, or outside their limits.
#[pyfunction]
pub fn check_options(options: Options) -> PyResult<()> {
    options.resolve().map(drop)
}
