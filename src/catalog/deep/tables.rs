//! Tables of Gaia's stars, which are held in memory.

use super::coverage;
use crate::base::interrupt::Interrupt;
use crate::catalog::import::{ImportRows, LoadedCatalog, OpenedFile, combine};
use crate::catalog::parts::{CatalogFileKind, read_part, title};
use crate::catalog::table::CatalogTable;
use crate::catalog::{CatalogError, Star};
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// Tables with Gaia's columns.
#[derive(Debug)]
pub struct TableStars {
    /// The files.
    pub files: Vec<PathBuf>,
    /// Their stars, and what became of each record.
    pub loaded: LoadedCatalog,
    /// Share of the sky that has stars.
    pub share_of_sky: f64,
}

impl TableStars {
    /// Whether a file is one, by its first bytes and its headings.
    pub fn is_one(path: &Path) -> Result<bool, CatalogError> {
        let file = OpenedFile::open(path, &Interrupt::default())?;
        let kind = CatalogFileKind::of(&file.head);
        if !matches!(kind, CatalogFileKind::Table | CatalogFileKind::Votable) {
            return Ok(false);
        }
        match CatalogTable::open(&mut ImportRows::new(kind.text_of(file)), path) {
            Ok(table) => Ok(table.is_of_gaia()),
            Err(error) if error.is_of_system() => Err(error),
            // Another file, or a table that is read as a whole: there it tells what is wrong.
            Err(_) => Ok(false),
        }
    }

    /// The stars of all files.
    pub fn read(path: &Path, files: Vec<PathBuf>) -> Result<Self, CatalogError> {
        // Collected before the first error is returned, so that it is the same on any number of threads.
        let parts: Vec<_> = files
            .par_iter()
            .map(|file| read_part(file, OpenedFile::open(file, &Interrupt::default())?))
            .collect();
        let parts: Vec<_> = parts.into_iter().collect::<Result<_, _>>()?;
        let title = match &parts[..] {
            [part] => title(path, &*part.format),
            _ => "tables of Gaia".to_owned(),
        };
        let loaded = combine(path, title, parts)?;
        Ok(Self {
            share_of_sky: coverage::share_of_sky(loaded.catalog.stars()),
            files,
            loaded,
        })
    }

    /// Its stars.
    pub fn stars(&self) -> &[Star] {
        self.loaded.catalog.stars()
    }
}
