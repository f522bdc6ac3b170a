//! Errors as Python's exceptions: `OSError` for files, `ValueError` for what is in them.

use pyo3::exceptions::{PyOSError, PyValueError};
use pyo3::prelude::*;
use serde::Serialize;
use std::error::Error;
use std::io;

/// `error` and its causes.
fn causes<'a>(error: &'a (dyn Error + 'static)) -> impl Iterator<Item = &'a (dyn Error + 'static)> {
    std::iter::successors(Some(error), |&error| error.source())
}

/// The message of `error` with those of its causes.
fn message(error: &(dyn Error + 'static)) -> String {
    let mut text = String::new();
    for cause in causes(error).map(ToString::to_string) {
        if text.is_empty() {
            text = cause;
        } else if !text.contains(&cause) {
            text = format!("{text}: {cause}");
        }
    }
    text
}

/// The exception for `error`.
pub fn exception(error: impl Error + 'static) -> PyErr {
    let is_of_system = causes(&error).any(|cause| cause.is::<io::Error>());
    if is_of_system {
        PyOSError::new_err(message(&error))
    } else {
        PyValueError::new_err(message(&error))
    }
}

/// A report as JSON.
pub fn json(report: &impl Serialize) -> PyResult<String> {
    serde_json::to_string(report).map_err(exception)
}
