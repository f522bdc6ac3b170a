//! The identity of a run: all that its results depend on.

use super::configuration::Configuration;
use super::error::StoreError;
use super::plan::Plan;
use crate::base::differences::differences;
use crate::base::sealed::{is_intact, sealed};
use serde::Serialize;
use serde_json::Value;
use std::num::NonZeroUsize;

/// Version of the tables of frames.
const SCHEMA: u32 = 1;

/// Whose checksum it has.
const SEAL: &str = "identity";

/// All that the results of a run depend on, as a file beside them has it.
#[derive(Debug, Clone, PartialEq)]
pub struct Identity {
    /// As they are read, so that numbers have the same digits as those of a file.
    values: Value,
    text: String,
    is_sealed: bool,
}

#[derive(Serialize)]
struct RunOfFrames {
    schema: u32,
    version: &'static str,
    frames_per_part: NonZeroUsize,
    frames: usize,
    /// Hash of the frames' names.
    names: String,
    configuration: Value,
}

impl Identity {
    /// That of these frames and this configuration.
    ///
    /// # Errors
    /// [`StoreError::Json`], which does not occur with these types.
    pub fn new(plan: &Plan, configuration: &Configuration) -> Result<Self, StoreError> {
        let run = RunOfFrames {
            schema: SCHEMA,
            version: env!("CARGO_PKG_VERSION"),
            frames_per_part: plan.frames_per_part(),
            frames: plan.names().len(),
            names: plan.names_hash(),
            configuration: serde_json::to_value(configuration)?,
        };
        let text = sealed(&serde_json::to_string_pretty(&run)?, SEAL) + "\n";
        let values = values_in(&text)?;
        Ok(Self {
            values,
            text,
            is_sealed: true,
        })
    }

    /// That of a run which depends on `values`, without a checksum.
    ///
    /// # Errors
    /// [`StoreError::Json`].
    pub(crate) fn unsealed(values: &impl Serialize) -> Result<Self, StoreError> {
        let values = values_in(&serde_json::to_string(values)?)?;
        Ok(Self {
            text: format!("{values:#}\n"),
            values,
            is_sealed: false,
        })
    }

    /// Reads the content of `archive.json`; `None` if it is not what was written.
    pub fn read(text: &str) -> Option<Self> {
        Self::parse(text, true)
    }

    /// Reads the content of a file for another identity of the same kind.
    pub(super) fn read_other(&self, content: &[u8]) -> Option<Self> {
        Self::parse(std::str::from_utf8(content).ok()?, self.is_sealed)
    }

    fn parse(text: &str, is_sealed: bool) -> Option<Self> {
        if is_sealed && !is_intact(text.strip_suffix('\n')?, SEAL) {
            return None;
        }
        Some(Self {
            values: values_in(text).ok()?,
            text: text.to_owned(),
            is_sealed,
        })
    }

    /// The content of its file.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The frames with these names in the parts that they were cut into, if they are its frames.
    pub fn plan(&self, names: Vec<String>) -> Option<Plan> {
        let per_part = usize::try_from(self.values["frames_per_part"].as_u64()?).ok()?;
        let plan = Plan::new(names, NonZeroUsize::new(per_part)?).ok()?;
        (self.values["names"] == plan.names_hash()).then_some(plan)
    }

    /// Where it differs from `wanted`: a text for each value.
    pub fn differences(&self, wanted: &Self) -> Vec<String> {
        differences(&self.values, &wanted.values)
    }
}

/// The values in a text, without their checksum.
fn values_in(text: &str) -> serde_json::Result<Value> {
    let mut values: Value = serde_json::from_str(text)?;
    if let Some(object) = values.as_object_mut() {
        object.remove("checksum");
    }
    Ok(values)
}
