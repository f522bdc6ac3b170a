//! Errors as Python's exceptions: `OSError` for files, `ValueError` for what is in them, `TimeoutError`
//! where the time is over.

use pyo3::exceptions::{PyOSError, PyRuntimeError, PyTimeoutError, PyValueError};
use pyo3::prelude::*;
use serde::Serialize;
use starpipe::Interrupted;
use starpipe::base::panics::{Panicked, caught};
use starpipe::base::remedy::{OptionNames, Remedy};
use starpipe::solve::remedies_of;
use std::error::Error;
use std::io;

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
    let has = |is_it: fn(&(dyn Error + 'static)) -> bool| causes(&error).any(is_it);
    let text = message(&error) + &see(&remedies_of(&error));
    if has(|cause| cause.is::<Panicked>()) {
        PyRuntimeError::new_err(text)
    } else if has(|cause| cause.is::<Interrupted>()) {
        PyTimeoutError::new_err(text)
    } else if has(|cause| cause.is::<io::Error>()) {
        PyOSError::new_err(text)
    } else {
        PyValueError::new_err(text)
    }
}

/// The keywords that may help, after a message. Not all options are keywords of Python's.
pub fn see(remedies: &[Remedy]) -> String {
    let is_keyword =
        |remedy: &&Remedy| !matches!(remedy, Remedy::AllStars | Remedy::Frame | Remedy::MaxMemory);
    let keywords: Vec<Remedy> = remedies.iter().filter(is_keyword).copied().collect();
    OptionNames::Words.see(&keywords)
}

/// Works while Python's other threads run. A panic, which is a bug in starpipe, becomes a
/// `RuntimeError`.
pub fn detached<R: Send>(py: Python<'_>, work: impl FnOnce() -> PyResult<R> + Send) -> PyResult<R> {
    py.detach(|| guarded(work))
}

/// Makes a `RuntimeError` of a panic in `work`.
pub fn guarded<R>(work: impl FnOnce() -> PyResult<R>) -> PyResult<R> {
    caught(work).unwrap_or_else(|panicked| Err(exception(panicked)))
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
