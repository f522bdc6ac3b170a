//! starpipe in the browser: what the page's worker calls.
//!
//! Values that have fields come and go as JSON, as the program prints it. All of it runs on the thread that
//! calls; what takes long tells `starpipeProgress`, a function of that thread, how far it is.

mod catalogs;
mod defocus;
mod equipment;
mod limit;
mod options;
mod simulated;
mod solver;
mod stated;

pub use catalogs::{index_name, open_catalog, open_numbers};
pub use defocus::defocus;
pub use equipment::{Equipment, GivenFile};
pub use limit::{limit, limit_curve, parameters};
pub use simulated::{SimulatedFrame, simulate};
pub use solver::{Solved, Solver, image_count, preview};

use serde::Serialize;
use std::error::Error;
use wasm_bindgen::prelude::*;

#[wasm_bindgen]
extern "C" {
    /// Told what is done, and which share of it, from 0 to 1.
    #[wasm_bindgen(js_namespace = globalThis, js_name = starpipeProgress)]
    fn progress(stage: &str, share: f64);
}

/// Lets panics be remembered, and not printed.
#[wasm_bindgen(start)]
fn start() {
    starpipe::base::panics::silence();
}

/// What the latest panic said. A panic ends the module: nothing else may be called after it.
#[wasm_bindgen]
pub fn latest_panic() -> Option<String> {
    starpipe::base::panics::latest().map(|panicked| panicked.to_string())
}

/// The version of starpipe.
#[wasm_bindgen]
pub fn version() -> String {
    env!("CARGO_PKG_VERSION").to_owned()
}

/// An error as the page shows it: with its causes, on one line.
fn told(error: impl Error) -> JsError {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(error) = cause {
        let words = error.to_string();
        // Some errors name their cause themselves.
        if !text.contains(&words) {
            text = format!("{text}: {words}");
        }
        cause = error.source();
    }
    JsError::new(&text)
}

fn json(value: &impl Serialize) -> Result<String, JsError> {
    let text = serde_json::to_string(value).map_err(told)?;
    Ok(starpipe::base::format::json_escaped(text))
}
