//! Tables of Gaia's stars, which are held in memory.

use super::coverage::Coverage;
use crate::base::interrupt::Interrupt;
use crate::catalog::import::{ImportRows, LoadedCatalog, OpenedFile, combine};
use crate::catalog::parts::{CatalogFileKind, read_part, title};
use crate::catalog::table::CatalogTable;
use crate::catalog::{Band, CatalogError, Star};
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// A file with Gaia's columns.
#[derive(Debug)]
pub struct GaiaTable {
    path: PathBuf,
    band: Band,
}

/// Tables with Gaia's columns.
#[derive(Debug)]
pub struct TableStars {
    /// The bands of the magnitudes.
    pub band: Band,
    /// The files.
    pub files: Vec<PathBuf>,
    /// Their stars, and what became of each record.
    pub loaded: LoadedCatalog,
    /// Share of the sky that has stars.
    pub share_of_sky: f64,
}

impl GaiaTable {
    /// The table in a file; `None` where it is of another kind, by its first bytes and its headings.
    pub fn find(path: &Path) -> Result<Option<Self>, CatalogError> {
        let file = OpenedFile::open(path, &Interrupt::default())?;
        let kind = CatalogFileKind::of(&file.head);
        if !matches!(kind, CatalogFileKind::Table | CatalogFileKind::Votable) {
            return Ok(None);
        }
        match CatalogTable::open(&mut ImportRows::new(kind.text_of(file)), path) {
            Ok(table) => Ok(table.gaia_band().map(|band| Self {
                path: path.to_owned(),
                band,
            })),
            Err(error) if error.is_of_system() => Err(error),
            // Another file, or a table that is read as a whole: there it tells what is wrong.
            Err(_) => Ok(None),
        }
    }
}

impl TableStars {
    /// The stars of the tables in `path`.
    pub fn read(path: &Path, tables: Vec<GaiaTable>) -> Result<Self, CatalogError> {
        let bands = tables.iter().map(|table| table.band);
        // Of different ones the least certain counts.
        let band = bands.max_by(|a, b| a.v_sigma_mag().total_cmp(&b.v_sigma_mag()));
        let files: Vec<PathBuf> = tables.into_iter().map(|table| table.path).collect();
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
        let mut coverage = Coverage::default();
        let stars = loaded.catalog.stars();
        stars.iter().for_each(|star| coverage.add(&star.direction));
        Ok(Self {
            band: band.unwrap_or(Band::GaiaG),
            share_of_sky: coverage.share_of_sky().unwrap_or(1.0),
            files,
            loaded,
        })
    }

    /// Its stars.
    pub fn stars(&self) -> &[Star] {
        self.loaded.catalog.stars()
    }
}
