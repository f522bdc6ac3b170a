//! What the page states of a frame.

use crate::told;
use serde::Deserialize;
use starpipe::SolveOptions;
use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use wasm_bindgen::JsError;

/// The form's fields that are filled in.
#[derive(Debug, Deserialize)]
struct Stated {
    /// Of a file with several.
    image: Option<NonZeroUsize>,
    /// Options by name.
    #[serde(flatten)]
    options: BTreeMap<String, String>,
}

/// The options of the library, and the number of the image that is meant.
///
/// # Errors
/// JSON that is none, and values outside their limits.
pub(crate) fn resolve(text: &str) -> Result<(SolveOptions, Option<NonZeroUsize>), JsError> {
    let stated: Stated = serde_json::from_str(text).map_err(told)?;
    // Who waits may end it.
    let options = SolveOptions::unlimited().with(&stated.options);
    Ok((options.map_err(told)?, stated.image))
}
