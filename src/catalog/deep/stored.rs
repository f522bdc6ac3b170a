//! A catalogue in the compact form, loaded when its stars are first needed.

use crate::base::files;
use crate::catalog::compact::CompactSummary;
use crate::catalog::{Catalog, CatalogError};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// A catalogue in the compact form.
#[derive(Debug)]
pub struct StoredCatalog {
    path: PathBuf,
    /// What its header says.
    pub summary: CompactSummary,
    loaded: OnceLock<Catalog>,
}

impl StoredCatalog {
    /// The catalogue in a file that begins with `head`; `None` where it is of another kind.
    pub fn of_head(path: &Path, head: &[u8]) -> Option<Self> {
        Some(Self {
            path: path.to_owned(),
            summary: CompactSummary::of_head(head)?,
            loaded: OnceLock::new(),
        })
    }

    /// The catalogue.
    pub fn catalog(&self) -> Result<&Catalog, CatalogError> {
        /// Twice as many bytes as the largest number of stars fill.
        const MAX_BYTES: u64 = 1 << 32;
        if let Some(loaded) = self.loaded.get() {
            return Ok(loaded);
        }
        let path = &self.path;
        let bytes = files::read(path, MAX_BYTES).map_err(CatalogError::open(path))?;
        let catalog = Catalog::from_compact(&bytes).map_err(|error| CatalogError::Compact {
            path: path.clone(),
            error,
        })?;
        Ok(self.loaded.get_or_init(|| catalog))
    }
}
