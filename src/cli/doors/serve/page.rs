//! What a browser is shown: the built-in form, or the files of a page.

use super::http::{HTML, JSON, TEXT};
use anyhow::{Context, bail};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// The description of the routes.
pub(super) const OPENAPI: &str = include_str!("../../../../docs/doors/openapi.json");

const FORM: &str = "<!doctype html><html lang=en><meta charset=utf-8><title>starpipe</title>\
    <h1>starpipe</h1><form action=/solve method=post enctype=multipart/form-data>\
    <p><input type=file name=file required>\
    <p><label>Field of view, degrees wide: <input name=fov size=6></label>\
    <p><label>Right ascension,declination: <input name=near size=12></label>\
    <p><button>Identify the stars</button></form>\
    <p><a href=/openapi.json>The routes</a></html>\n";

const INDEX: &str = "index.html";

/// The files of a page by name.
#[derive(Debug, Default)]
pub(super) struct Page(BTreeMap<String, PathBuf>);

impl Page {
    /// The files in a directory; what comes later is not shown.
    pub(super) fn read(directory: &Path) -> anyhow::Result<Self> {
        let entries = fs::read_dir(directory)
            .with_context(|| format!("reading {}", directory.display()))?
            .flatten();
        let files = entries.filter(|entry| entry.path().is_file());
        let named = files
            .filter_map(|entry| Some((entry.file_name().into_string().ok()?, entry.path())))
            .collect();
        let page = Self(named);
        if !page.0.contains_key(INDEX) {
            bail!("{}: found no {INDEX}", directory.display());
        }
        Ok(page)
    }

    /// The kind and the content of a file: `None` if there is none of this name.
    pub(super) fn file(&self, name: &str) -> Option<(&'static str, anyhow::Result<Vec<u8>>)> {
        if self.0.is_empty() && name.is_empty() {
            return Some((HTML, Ok(FORM.into())));
        }
        let name = if name.is_empty() { INDEX } else { name };
        let path = self.0.get(name)?;
        let content = fs::read(path).with_context(|| format!("reading {}", path.display()));
        Some((kind_of(path), content))
    }
}

fn kind_of(path: &Path) -> &'static str {
    let extension = path.extension().and_then(|extension| extension.to_str());
    match extension.unwrap_or_default() {
        "html" => HTML,
        "js" => "text/javascript; charset=utf-8",
        "css" => "text/css; charset=utf-8",
        "json" => JSON,
        "webmanifest" => "application/manifest+json",
        "wasm" => "application/wasm",
        "png" => "image/png",
        "jpg" => "image/jpeg",
        "svg" => "image/svg+xml",
        "txt" => TEXT,
        _ => "application/octet-stream",
    }
}
