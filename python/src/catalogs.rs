//! Catalogues, each read and indexed once in a process.

use crate::errors::{exception, message, warn};
use pyo3::prelude::*;
use starpipe::Interrupt;
use starpipe::catalog::deep::{DeepCatalog, installed_paths_below};
use starpipe::catalog::{self, Catalog};
use starpipe::identify::{IndexedCatalog, cache_directory};
use starpipe::solve::DeepSky;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// The file of a catalogue, `None` for the built-in one, and the directory of its index.
type Key = (Option<PathBuf>, Option<PathBuf>);
/// The files and folders of deep catalogues, and the directory of their indexes.
type DeepKey = (Vec<PathBuf>, Option<PathBuf>);

static CATALOGS: Mutex<Option<HashMap<Key, &'static IndexedCatalog<'static>>>> = Mutex::new(None);
static DEEP: Mutex<Option<HashMap<DeepKey, &'static DeepSky>>> = Mutex::new(None);

/// The catalogue with its index. It is kept to the end of the process: pipelines, copies and
/// threads share it.
pub fn open(key: Key, interrupt: &Interrupt) -> PyResult<&'static IndexedCatalog<'static>> {
    let mut catalogs = CATALOGS.lock().unwrap_or_else(PoisonError::into_inner);
    let catalogs = catalogs.get_or_insert_default();
    if let Some(known) = catalogs.get(&key) {
        return Ok(known);
    }
    let catalog: &'static Catalog = match &key.0 {
        None => Catalog::built_in(),
        Some(path) => {
            let reading = catalog::read_until(path, interrupt).map_err(exception)?;
            for file in &reading.files {
                if let Some(reasons) = file.summary.left_out() {
                    let (path, records) = (file.path.display(), file.summary.records);
                    warn(&format!(
                        "{path}: some of its {records} records are skipped: {reasons}"
                    ));
                }
            }
            Box::leak(Box::new(reading.catalog))
        }
    };
    let directory = key.1.clone().or_else(cache_directory);
    let indexed = IndexedCatalog::open_until(catalog, directory.as_deref(), &|_| (), interrupt);
    let indexed = indexed.map_err(exception)?;
    for error in indexed.take_cache_errors() {
        warn(&format!(
            "{}; results are unaffected, but take longer",
            message(&error)
        ));
    }
    let indexed: &'static IndexedCatalog = Box::leak(Box::new(indexed));
    catalogs.insert(key, indexed);
    Ok(indexed)
}

/// The deep catalogues for narrow fields: those in the stated file or folder, none if it has another catalogue; if none
/// is stated, those that are installed, by packages of Python below `prefix`, too.
pub fn deep(key: &Key, prefix: &Path) -> PyResult<Option<&'static DeepSky>> {
    let cache = key.1.clone().or_else(cache_directory);
    let paths = match &key.0 {
        Some(path) => vec![path.clone()],
        None => installed_paths_below(prefix),
    };
    if paths.is_empty() {
        return Ok(None);
    }
    let mut known = DEEP.lock().unwrap_or_else(PoisonError::into_inner);
    let known = known.get_or_insert_default();
    let deep_key = (paths, cache);
    if let Some(kept) = known.get(&deep_key) {
        return Ok(Some(kept));
    }
    let (paths, cache) = deep_key.clone();
    let made = match &key.0 {
        Some(path) => match DeepCatalog::find(path).map_err(exception)? {
            found if found.is_empty() => return Ok(None),
            found => DeepSky::new(found, cache),
        },
        None => DeepSky::installed(paths, cache),
    };
    let made: &'static DeepSky = Box::leak(Box::new(made));
    known.insert(deep_key, made);
    Ok(Some(made))
}

/// The catalogue in a file, or the built-in one.
pub fn read(path: Option<PathBuf>, interrupt: &Interrupt) -> PyResult<&'static Catalog> {
    match path {
        None => Ok(Catalog::built_in()),
        path => Ok(open((path, None), interrupt)?.catalog()),
    }
}
