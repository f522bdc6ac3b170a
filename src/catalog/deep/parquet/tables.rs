//! Files of one catalogue.

use super::file::ParquetFile;
use super::table::OpenTable;
use crate::base::coords::UnitVector;
use crate::base::interrupt::Interrupt;
use crate::base::units::RAD_PER_DEG;
use crate::catalog::deep::coverage::Coverage;
use crate::catalog::deep::error::Damage;
use crate::catalog::deep::region::Region;
use crate::catalog::{Band, Star};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// Files with the same columns.
#[derive(Debug)]
pub struct Tables {
    first: ParquetFile,
    others: Vec<ParquetFile>,
    share: OnceLock<f64>,
}

impl Tables {
    /// One file.
    pub const fn of(file: ParquetFile) -> Self {
        Self {
            first: file,
            others: Vec::new(),
            share: OnceLock::new(),
        }
    }

    /// Adds other files, if they have the same columns; else they are given back.
    pub fn join(&mut self, other: Self) -> Option<Self> {
        if self.first.names != other.first.names {
            return Some(other);
        }
        self.others.push(other.first);
        self.others.extend(other.others);
        None
    }

    fn all(&self) -> impl Iterator<Item = &ParquetFile> {
        std::iter::once(&self.first).chain(&self.others)
    }

    /// Where they are.
    pub fn files(&self) -> impl Iterator<Item = &Path> {
        self.all().map(|file| &*file.path)
    }

    /// Number of rows.
    pub fn rows(&self) -> u64 {
        self.all().map(|file| file.rows).sum()
    }

    /// The bands of the magnitudes.
    pub const fn band(&self) -> Band {
        self.first.band
    }

    /// The epoch of positions without proper motion, where it is known.
    pub const fn epoch_year(&self) -> Option<f64> {
        self.first.epoch_year
    }

    /// The share of the sky that the stars cover: a table may be the answer to a query. Large ones count as whole.
    pub fn share_of_sky(&self) -> f64 {
        const ROWS_MAX: u64 = 2_000_000;
        let measure = || {
            let mut coverage = Coverage::default();
            for file in self.all() {
                // What cannot be read is told when its stars are.
                let table = OpenTable::open(&file.path).ok()?;
                let mut add = |ra_deg, dec_deg| {
                    let [ra_rad, dec_rad] = [ra_deg, dec_deg].map(|deg: f64| deg * RAD_PER_DEG);
                    coverage.add(&UnitVector::from_ra_dec(ra_rad, dec_rad));
                };
                table.for_each_position(&mut add).ok()?;
            }
            coverage.share_of_sky()
        };
        *self.share.get_or_init(|| match self.rows() <= ROWS_MAX {
            true => measure().unwrap_or(1.0),
            false => 1.0,
        })
    }

    /// Calls `add` with every star that may lie in a region, and some around it.
    pub fn stars_in(
        &self,
        region: &Region,
        interrupt: &Interrupt,
        add: &mut dyn FnMut(Star),
    ) -> Result<(), (PathBuf, Damage)> {
        for file in self.all() {
            let read = file.stars_in(region, interrupt, add);
            read.map_err(|error| (file.path.clone(), error))?;
        }
        Ok(())
    }
}
