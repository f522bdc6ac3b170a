//! Whose the results are: frames, configuration and version.

use super::configuration::Configuration;
use super::plan::Plan;
use crate::base::differences::differences;
use crate::base::sealed::{is_intact, sealed};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::num::NonZeroUsize;

/// Version of the tables.
pub const SCHEMA: u32 = 1;

/// Whose checksum it has.
const SEAL: &str = "identity";

/// All that the tables depend on, as `archive.json` has it.
#[derive(Debug, Clone, PartialEq)]
pub struct Identity {
    known: IdentityFields,
    text: String,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct IdentityFields {
    schema: u32,
    version: String,
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
    /// [`serde_json::Error`], which does not occur with these types.
    pub fn new(plan: &Plan, configuration: &Configuration) -> serde_json::Result<Self> {
        let known = IdentityFields {
            schema: SCHEMA,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            frames_per_part: plan.frames_per_part(),
            frames: plan.names().len(),
            names: names_hash(plan),
            configuration: serde_json::to_value(configuration)?,
        };
        let text = sealed(&serde_json::to_string_pretty(&known)?, SEAL) + "\n";
        Ok(Self { known, text })
    }

    /// Reads the content of `archive.json`; `None` if it is not what was written.
    pub fn read(text: &str) -> Option<Self> {
        if !is_intact(text.strip_suffix('\n')?, SEAL) {
            return None;
        }
        Some(Self {
            known: serde_json::from_str(text).ok()?,
            text: text.to_owned(),
        })
    }

    /// The content of `archive.json`.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Whether it is of the frames of `plan`.
    pub(super) fn is_of(&self, plan: &Plan) -> bool {
        self.known.names == names_hash(plan)
    }

    /// Frames of a part, but for the last one.
    pub fn frames_per_part(&self) -> NonZeroUsize {
        self.known.frames_per_part
    }

    /// Where it differs from `wanted`: a text for each value.
    pub fn differences(&self, wanted: &Self) -> Vec<String> {
        let value = |identity: &Self| serde_json::to_value(&identity.known).unwrap_or_default();
        differences(&value(self), &value(wanted))
    }
}

fn names_hash(plan: &Plan) -> String {
    format!("{:016x}", plan.hash())
}
