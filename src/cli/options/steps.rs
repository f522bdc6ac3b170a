//! Values of a sweep, typed as FROM:TO:COUNT[:log].

use super::values::{finite, not_of_form, whole};
use starpipe::predict::Spacing;
use std::str::FromStr;

/// First and last value, their number, and how they are spaced.
pub(crate) struct Steps {
    pub(crate) ends: [f64; 2],
    pub(crate) count: usize,
    pub(crate) spacing: Spacing,
}

impl Steps {
    /// Parses `range`, the whole or the end of `text`; `form` is the expected form of `text`.
    fn parse(range: &str, text: &str, form: &str) -> Result<Self, String> {
        let parts: Vec<&str> = range.split(':').collect();
        let (from, to, count, spacing) = match parts[..] {
            [from, to, count] => (from, to, count, Spacing::Linear),
            [from, to, count, "log"] => (from, to, count, Spacing::Log),
            _ => return Err(not_of_form(text, form)),
        };
        Ok(Self {
            ends: [finite(from)?, finite(to)?],
            count: whole(count)?,
            spacing,
        })
    }

    /// The values, which must rise.
    pub(crate) fn values(&self) -> Result<Vec<f64>, String> {
        let values = self.spacing.checked_values(self.ends, self.count);
        values.map_err(|error| error.to_string())
    }
}

impl FromStr for Steps {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Self::parse(text, text, "FROM:TO:COUNT or FROM:TO:COUNT:log")
    }
}

/// Parses NAME=FROM:TO:COUNT[:log]; the name is returned with _ for -.
pub(crate) fn named_steps(text: &str) -> Result<(String, Steps), String> {
    const FORM: &str = "NAME=FROM:TO:COUNT or NAME=FROM:TO:COUNT:log";
    let (name, range) = text
        .split_once('=')
        .ok_or_else(|| not_of_form(text, FORM))?;
    Ok((name.replace('-', "_"), Steps::parse(range, text, FORM)?))
}
