//! What a HATS directory says of itself.

use crate::base::files;
use crate::catalog::deep::error::Damage;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Lengths of such files are bounded.
const BYTES_MAX: u64 = 1 << 20;

/// Texts by their names.
pub(super) struct Properties {
    /// The file that has them.
    pub(super) path: PathBuf,
    texts: BTreeMap<String, String>,
}

impl Properties {
    /// Those of a collection of catalogues.
    pub(super) fn of_collection(directory: &Path) -> Result<Option<Self>, (PathBuf, Damage)> {
        Self::read(directory.join("collection.properties"), java_properties)
    }

    /// Those of a catalogue, new or old.
    pub(super) fn of_catalog(directory: &Path) -> Result<Option<Self>, (PathBuf, Damage)> {
        for name in ["hats.properties", "properties"] {
            let found = Self::read(directory.join(name), java_properties)?;
            // Other programs have files with the second name.
            if let Some(found) = found.filter(|found| found.is_of_catalog()) {
                return Ok(Some(found));
            }
        }
        Self::read(directory.join("catalog_info.json"), json_properties)
    }

    fn read(
        path: PathBuf,
        parse: fn(&str) -> BTreeMap<String, String>,
    ) -> Result<Option<Self>, (PathBuf, Damage)> {
        if !path.is_file() {
            return Ok(None);
        }
        match files::read_text(&path, BYTES_MAX) {
            Ok(text) => {
                let texts = parse(&text);
                Ok(Some(Self { path, texts }))
            }
            Err(error) => Err((path, error.into())),
        }
    }

    /// The text of the first of these names that has one.
    pub(super) fn text(&self, names: &[&str]) -> Option<&str> {
        let mut texts = names.iter().filter_map(|name| self.texts.get(*name));
        texts.find(|text| !text.is_empty()).map(String::as_str)
    }

    fn is_of_catalog(&self) -> bool {
        let mut names = self.texts.keys();
        names.any(|name| name == "dataproduct_type" || name.starts_with("hats_"))
    }

    /// Whether the rows are stars, each once: margins repeat those of other cells.
    pub(super) fn has_stars(&self) -> bool {
        let kind = self.text(&["dataproduct_type", "catalog_type"]);
        kind.is_none_or(|kind| kind == "object" || kind == "source")
    }
}

/// Lines like `name = text`.
fn java_properties(text: &str) -> BTreeMap<String, String> {
    let lines = text.lines().map(str::trim);
    let lines = lines.filter(|line| !line.starts_with(['#', '!']));
    let pairs = lines.filter_map(|line| line.split_once(['=', ':']));
    pairs
        .map(|(name, text)| {
            // Colons may be escaped, as in `https\://`.
            let text = text.trim().replace("\\:", ":").replace("\\=", "=");
            (name.trim().to_owned(), text)
        })
        .collect()
}

/// The members of an object that are text or numbers.
fn json_properties(text: &str) -> BTreeMap<String, String> {
    let object: serde_json::Map<String, serde_json::Value> =
        serde_json::from_str(text).unwrap_or_default();
    object
        .into_iter()
        .filter_map(|(name, value)| match value {
            serde_json::Value::String(text) => Some((name, text)),
            serde_json::Value::Number(number) => Some((name, number.to_string())),
            _ => None,
        })
        .collect()
}
