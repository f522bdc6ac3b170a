//! Errors as Python's exceptions: `OSError` for files, `ValueError` for what is in them.

use pyo3::exceptions::{PyOSError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use serde::Serialize;
use std::error::Error;
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// `error` and its causes.
fn causes<'a>(error: &'a (dyn Error + 'static)) -> impl Iterator<Item = &'a (dyn Error + 'static)> {
    std::iter::successors(Some(error), |&error| error.source())
}

/// The message of `error` with those of its causes.
pub fn message(error: &(dyn Error + 'static)) -> String {
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

/// Works while Python's other threads run. A panic, which is a fault of starpipe, becomes a
/// `RuntimeError`.
pub fn detached<R: Send>(py: Python<'_>, work: impl FnOnce() -> PyResult<R> + Send) -> PyResult<R> {
    let done = py.detach(|| catch_unwind(AssertUnwindSafe(work)));
    done.unwrap_or_else(|panic| {
        let text = panic.downcast_ref::<String>().map(String::as_str);
        let text = text.or(panic.downcast_ref::<&str>().copied());
        let text = text.unwrap_or("no message");
        let message = format!("starpipe has a fault, please report it: {text}");
        Err(PyRuntimeError::new_err(message))
    })
}

/// Tells Python's logger `starpipe` of something that does not end the work.
pub fn warn(message: &str) {
    let told = Python::attach(|py| {
        let logger = py
            .import("logging")?
            .call_method1("getLogger", ("starpipe",))?;
        logger.call_method1("warning", (message,)).map(drop)
    });
    if let Err(error) = told {
        eprintln!("starpipe: {message} ({error})");
    }
}

/// A report as JSON.
pub fn json(report: &impl Serialize) -> PyResult<String> {
    serde_json::to_string(report).map_err(exception)
}
