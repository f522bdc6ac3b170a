//! Which stars of a large catalogue are in a part of the sky?
//!
//! A file or directory → [`DeepCatalog`]; a [`Region`] → its brightest stars. Only that part of the files is
//! read, and no more stars are kept than are wanted: the files may be larger than the memory.
//!
//! # Kinds
//! - Index files of astrometry.net: the series 4100, 4200 and 5200, and others of the same form.
//! - Tables of stars in the form of Parquet, as of Gaia: files with the same columns are one catalogue; and HATS
//!   directories of such files. For these the feature `archive` is needed.
//! - Databases of ASTAP and HNSKY, in files that end in `.1476`, `.290` and `.001`.
//! - Tables of Gaia's stars, from its archive or from VizieR, which are held in memory.
//! - The compact form, which is loaded whole when its stars are first needed.

mod astap;
mod astrometry;
mod contents;
mod coverage;
mod error;
mod finding;
mod healpix;
mod installed;
#[cfg(feature = "archive")]
mod parquet;
mod region;
mod stock;
mod stored;
mod tables;

pub use contents::{DeepContents, narrowest_fov_deg};
pub use error::Damage;
pub(crate) use healpix::SkyZone;
pub use installed::{installed_paths, installed_paths_below};
pub use region::Region;

use super::import::LoadedCatalog;
use super::{CatalogError, SourceFile, Star};
use crate::base::interrupt::Interrupt;
use region::BrightestStars;
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;
use stock::Stock;
use xxhash_rust::xxh3::Xxh3;

/// A large catalogue, of which the stars of a part of the sky are read.
#[derive(Debug)]
pub struct DeepCatalog {
    path: PathBuf,
    stock: Stock,
}

impl DeepCatalog {
    /// The catalogues in a file or a directory that are read region by region; none where it is of another kind.
    ///
    /// # Errors
    /// [`CatalogError`] where it cannot be read, or is damaged.
    pub fn find(path: &Path) -> Result<Vec<Self>, CatalogError> {
        let mut found = Self::find_installed(path)?;
        found.retain(|catalog| !matches!(catalog.stock, Stock::Stored(_)));
        Ok(found)
    }

    /// The same, and those in the compact form.
    ///
    /// # Errors
    /// As [`find`](Self::find).
    pub fn find_installed(path: &Path) -> Result<Vec<Self>, CatalogError> {
        let found = finding::stocks_in(path)?;
        let of = |stock| Self {
            path: path.to_owned(),
            stock,
        };
        Ok(found.into_iter().map(of).collect())
    }

    /// The file or directory that it was found in.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// What it has.
    pub fn contents(&self) -> DeepContents {
        self.stock.contents()
    }

    /// Its files that are held in memory, with what became of their records; none for other kinds.
    pub fn files(&self) -> &[SourceFile] {
        match &self.stock {
            Stock::Tables(tables) => &tables.loaded.files,
            _ => &[],
        }
    }

    /// All of it, where it is held in memory.
    pub(super) fn loaded(&self) -> Option<&LoadedCatalog> {
        match &self.stock {
            Stock::Tables(tables) => Some(&tables.loaded),
            _ => None,
        }
    }

    /// Changes when one of its files does: with its place, its length or the time at which it was written.
    pub fn fingerprint(&self) -> u64 {
        let mut state = Xxh3::new();
        for file in self.stock.files(&self.path) {
            let found = file.metadata().ok();
            let modified = found.as_ref().and_then(|found| found.modified().ok());
            let since = modified.and_then(|time| time.duration_since(UNIX_EPOCH).ok());
            state.update(file.as_os_str().as_encoded_bytes());
            state.update(&found.map_or(0, |found| found.len()).to_le_bytes());
            state.update(&since.map_or(0, |since| since.as_nanos()).to_le_bytes());
        }
        state.digest()
    }

    /// The brightest stars of a region, as many as it wants, brightest first.
    ///
    /// # Errors
    /// [`CatalogError::Deep`] where a file is damaged, or `interrupt` is due.
    pub fn stars_in(
        &self,
        region: Region,
        interrupt: &Interrupt,
    ) -> Result<Vec<Star>, CatalogError> {
        let mut brightest = BrightestStars::new(region);
        let mut add = |star| brightest.add(star);
        self.stock.stars_in(&region, interrupt, &mut add)?;
        Ok(brightest.into_stars())
    }
}
