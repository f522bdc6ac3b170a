//! What a browser shows: the built-in form, or the files of a page.

use super::Server;
use super::http::{HTML, JSON, TEXT, reply};
use super::refusal::Refusal;
use anyhow::{Context, bail};
use axum::extract::{Request, State};
use axum::response::Response;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

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
}

/// `/`
pub(super) async fn index(State(server): State<Arc<Server>>) -> Result<Response, Refusal> {
    match server.page.0.is_empty() {
        true => Ok(reply(HTML, FORM)),
        false => named(&server, INDEX).await,
    }
}

/// A file of the page.
pub(super) async fn file(
    State(server): State<Arc<Server>>,
    request: Request,
) -> Result<Response, Refusal> {
    let path = request.uri().path();
    named(&server, path.strip_prefix('/').unwrap_or(path)).await
}

async fn named(server: &Server, name: &str) -> Result<Response, Refusal> {
    let path = server.page.0.get(name);
    let path = path.ok_or_else(|| Refusal::unknown("such address"))?;
    let content = tokio::task::spawn_blocking({
        let path = path.clone();
        move || fs::read(path)
    });
    let content = content.await.map_err(anyhow::Error::from);
    let content = content.and_then(|content| Ok(content?));
    let content = content.map_err(|error| Refusal::internal(&error))?;
    Ok(reply(kind_of(path), content))
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
