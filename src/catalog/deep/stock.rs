//! What the stars of a deep catalogue are read from.

use super::astap::{AreaDatabase, WideDatabase};
use super::astrometry::IndexFile;
use super::contents::DeepContents;
#[cfg(feature = "archive")]
use super::parquet::{Hats, Tables};
use super::region::Region;
use super::stored::StoredCatalog;
use super::tables::TableStars;
use crate::base::interrupt::Interrupt;
use crate::catalog::{Band, CatalogError, Star};
use std::path::Path;

/// What the stars are read from.
#[derive(Debug)]
pub enum Stock {
    /// Index files of astrometry.net, densest first.
    Indexes(Vec<IndexFile>),
    /// A database of ASTAP.
    Areas(AreaDatabase),
    /// Its database of bright stars.
    Wide(WideDatabase),
    /// Tables of Gaia.
    Tables(TableStars),
    /// Files of Parquet with the same columns.
    #[cfg(feature = "archive")]
    Parquet(Tables),
    /// A HATS directory.
    #[cfg(feature = "archive")]
    Hats(Hats),
    /// A catalogue in the compact form.
    Stored(StoredCatalog),
}

impl Stock {
    /// What it has.
    pub fn contents(&self) -> DeepContents {
        match self {
            Self::Indexes(indexes) => contents_of_indexes(indexes),
            Self::Areas(database) => DeepContents {
                kind: format!("ASTAP database {}", database.name.to_ascii_uppercase()),
                band: database.band(),
                stars: database.records(),
                share_of_sky: database.share_of_sky(),
                epoch_year: database.epoch_year(),
            },
            Self::Wide(wide) => DeepContents {
                kind: "ASTAP database of bright stars".to_owned(),
                band: Band::JohnsonV,
                stars: wide.stars.len() as u64,
                share_of_sky: 1.0,
                epoch_year: None,
            },
            Self::Tables(tables) => DeepContents {
                kind: tables.loaded.catalog.title().to_owned(),
                band: tables.band,
                stars: tables.stars().len() as u64,
                share_of_sky: tables.share_of_sky,
                epoch_year: Some(tables.loaded.catalog.epoch_year()),
            },
            #[cfg(feature = "archive")]
            Self::Parquet(tables) => DeepContents {
                kind: "table in Parquet".to_owned(),
                band: tables.band(),
                stars: tables.rows(),
                share_of_sky: tables.share_of_sky(),
                epoch_year: tables.epoch_year(),
            },
            #[cfg(feature = "archive")]
            Self::Hats(hats) => DeepContents {
                kind: format!("HATS catalog {}", hats.name),
                band: hats.band(),
                stars: hats.rows(),
                share_of_sky: hats.share_of_sky(),
                epoch_year: hats.epoch_year(),
            },
            Self::Stored(StoredCatalog { summary, .. }) => DeepContents {
                kind: summary.title.clone(),
                band: Band::JohnsonV,
                stars: summary.stars,
                share_of_sky: 1.0,
                epoch_year: Some(summary.epoch_year),
            },
        }
    }

    /// Its files; `path` is the only one of some kinds.
    pub fn files<'a>(&'a self, path: &'a Path) -> Vec<&'a Path> {
        match self {
            Self::Indexes(indexes) => indexes.iter().map(|index| &*index.path).collect(),
            Self::Areas(database) => database.files().collect(),
            Self::Tables(tables) => tables.files.iter().map(|file| &**file).collect(),
            #[cfg(feature = "archive")]
            Self::Parquet(tables) => tables.files().collect(),
            #[cfg(feature = "archive")]
            Self::Hats(hats) => hats.files().collect(),
            Self::Wide(_) | Self::Stored(_) => vec![path],
        }
    }

    /// Calls `add` with every star that may lie in a region, and some around it.
    pub fn stars_in(
        &self,
        region: &Region,
        interrupt: &Interrupt,
        add: &mut dyn FnMut(Star),
    ) -> Result<(), CatalogError> {
        match self {
            Self::Indexes(indexes) => {
                for index in densest(indexes, region) {
                    let read = index.stars_in(region, interrupt, add);
                    read.map_err(|error| CatalogError::Deep {
                        path: index.path.clone(),
                        error,
                    })?;
                }
            }
            Self::Areas(database) => database
                .stars_in(region, interrupt, add)
                .map_err(|(path, error)| CatalogError::Deep { path, error })?,
            Self::Wide(wide) => wide.stars.iter().copied().for_each(add),
            Self::Tables(tables) => tables.stars().iter().copied().for_each(add),
            #[cfg(feature = "archive")]
            Self::Parquet(tables) => tables
                .stars_in(region, interrupt, add)
                .map_err(|(path, error)| CatalogError::Deep { path, error })?,
            #[cfg(feature = "archive")]
            Self::Hats(hats) => hats
                .stars_in(region, interrupt, add)
                .map_err(|(path, error)| CatalogError::Deep { path, error })?,
            Self::Stored(stored) => stored.catalog()?.stars().iter().copied().for_each(add),
        }
        Ok(())
    }
}

/// Of the files that may reach a region those with the smallest quads, which have most stars.
fn densest<'a>(indexes: &'a [IndexFile], region: &Region) -> impl Iterator<Item = &'a IndexFile> {
    let reaching: Vec<_> = indexes.iter().filter(|i| i.may_reach(region)).collect();
    let smallest = reaching.first().map(|index| index.widest_quad_rad);
    let is_of_it = move |index: &&IndexFile| Some(index.widest_quad_rad) == smallest;
    reaching.into_iter().filter(is_of_it)
}

fn contents_of_indexes(indexes: &[IndexFile]) -> DeepContents {
    let smallest = indexes.first().map(|index| index.widest_quad_rad);
    let densest = indexes.iter();
    let densest = densest.filter(|index| Some(index.widest_quad_rad) == smallest);
    let (mut stars, mut share, mut band) = (0, 0.0, Band::Unknown);
    for index in densest {
        let (of_file, band_of_file) = index.contents();
        stars += of_file;
        band = band_of_file;
        share += index.share_of_sky();
    }
    DeepContents {
        kind: "index files of astrometry.net".to_owned(),
        band,
        stars,
        share_of_sky: f64::min(share, 1.0),
        epoch_year: None,
    }
}
