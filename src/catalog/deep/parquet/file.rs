//! One file of stars.

use super::table::OpenTable;
use crate::base::interrupt::Interrupt;
use crate::catalog::deep::error::Damage;
use crate::catalog::deep::region::Region;
use crate::catalog::{Band, Star};
use std::path::{Path, PathBuf};

/// A file of stars.
#[derive(Debug)]
pub struct ParquetFile {
    /// Where it is.
    pub path: PathBuf,
    /// Number of its rows.
    pub rows: u64,
    /// The bands of its magnitudes.
    pub band: Band,
    /// The epoch of positions without proper motion, where it is known.
    pub epoch_year: Option<f64>,
    /// The names of its columns: files of one catalogue have the same.
    pub names: Vec<String>,
}

impl ParquetFile {
    /// Finds the columns of a file.
    ///
    /// # Errors
    /// [`Damage::NoColumns`] where it is no table of stars; others where it is damaged.
    pub fn open(path: &Path) -> Result<Self, Damage> {
        let table = OpenTable::open(path)?;
        let columns = &table.layout.columns;
        Ok(Self {
            path: path.to_owned(),
            rows: table.rows(),
            band: columns.band(),
            epoch_year: table.epoch_year(),
            names: table.layout.names().to_owned(),
        })
    }

    /// Calls `add` with every star that may lie in a region, and some around it.
    pub fn stars_in(
        &self,
        region: &Region,
        interrupt: &Interrupt,
        add: &mut dyn FnMut(Star),
    ) -> Result<(), Damage> {
        OpenTable::open(&self.path)?.stars_in(region, interrupt, add)
    }
}
