//! The compiled part of the Python package `starpipe`. Its Python part checks types and units, and
//! makes numpy's and astropy's objects of what this part returns.

#![allow(clippy::too_many_arguments, reason = "keywords of Python functions")]

mod catalogs;
mod errors;
mod hints;
mod image;
mod pipeline;
mod solved;

use pyo3::prelude::*;

/// The module `starpipe._starpipe`.
#[pymodule]
mod _starpipe {
    #[pymodule_export]
    use super::pipeline::Pipeline;
    #[pymodule_export]
    use super::solved::Solved;
}
