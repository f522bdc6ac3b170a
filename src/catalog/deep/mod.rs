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
mod coverage;
mod error;
mod fits_tables;
mod healpix;
mod installed;
#[cfg(feature = "archive")]
mod parquet;
mod region;
mod stored;
mod tables;

pub use error::Damage;
pub(crate) use healpix::SkyZone;
pub use installed::{installed_paths, installed_paths_below};
pub use region::Region;

#[cfg(feature = "archive")]
use super::folder::directories_in;
use super::folder::files_in;
use super::import::LoadedCatalog;
use super::{Band, Catalog, CatalogError, SourceFile, Star};
use crate::base::file_ranges::FileRanges;
use crate::base::interrupt::Interrupt;
use crate::base::units::WHOLE_SKY_SQ_DEG;
use astap::{AreaDatabase, WideDatabase};
use astrometry::IndexFile;
#[cfg(feature = "archive")]
use parquet::{Hats, ParquetFile, Tables};
use region::BrightestStars;
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;
use stored::StoredCatalog;
use tables::{GaiaTable, TableStars};
use xxhash_rust::xxh3::Xxh3;

/// Bytes of a file by which its kind is told: header cards of some generators come after a long history.
const HEAD_BYTES: u64 = 2880;
/// The beginning of a file of Parquet.
const PARQUET_MAGIC: &[u8] = b"PAR1";

/// A large catalogue, of which the stars of a part of the sky are read.
#[derive(Debug)]
pub struct DeepCatalog {
    path: PathBuf,
    stock: Stock,
}

/// What the stars are read from.
#[derive(Debug)]
enum Stock {
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

/// What a catalogue has.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct DeepContents {
    /// Its kind, for people.
    pub kind: String,
    /// The band of its magnitudes.
    pub band: Band,
    /// Number of stars.
    pub stars: u64,
    /// Share of the sky that it covers.
    pub share_of_sky: f64,
    /// Epoch of the positions, where it is known.
    pub epoch_year: Option<f64>,
}

impl DeepContents {
    /// Those of a catalogue in memory.
    pub fn of(catalog: &Catalog) -> Self {
        Self {
            kind: catalog.title().to_owned(),
            band: Band::JohnsonV,
            stars: catalog.stars().len() as u64,
            share_of_sky: 1.0,
            epoch_year: Some(catalog.epoch_year()),
        }
    }

    /// Mean density of the stars where it covers the sky.
    pub fn per_sq_deg(&self) -> f64 {
        self.stars as f64 / (WHOLE_SKY_SQ_DEG * self.share_of_sky.max(1e-9))
    }

    /// Width of the narrowest field, with sides as 3 to 2, that has on average as many stars as identification needs.
    pub fn narrowest_fov_deg(&self) -> f64 {
        narrowest_fov_deg(self.per_sq_deg())
    }
}

/// Width of the narrowest field, with sides as 3 to 2, that has on average as many stars as identification needs, of
/// a catalogue with this density.
pub fn narrowest_fov_deg(per_sq_deg: f64) -> f64 {
    /// In a field with half as many, four stars can be expected with near certainty.
    const STARS: f64 = 10.0;
    (1.5 * STARS / per_sq_deg).sqrt()
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
        let (mut indexes, mut tables, mut found) = (Vec::new(), Vec::new(), Vec::new());
        #[cfg(feature = "archive")]
        if path.is_dir() {
            found.extend(hats_in(path)?.into_iter().map(Stock::Hats));
        }
        let (files, beside) = if path.is_dir() {
            let files = files_in(path)?;
            (files.clone(), files)
        } else {
            (vec![path.to_owned()], siblings(path)?)
        };
        for file in files
            .iter()
            .filter(|file| !path.is_dir() || may_be_one(file))
        {
            match Stock::of_file(file) {
                // A directory may have other tables, too.
                Err(CatalogError::Deep {
                    error: Damage::NoColumns(_),
                    ..
                }) if path.is_dir() => {}
                found_in_file => match found_in_file? {
                    Some(Stock::Indexes(index)) => indexes.extend(index),
                    #[cfg(feature = "archive")]
                    Some(Stock::Parquet(tables)) => join(&mut found, tables),
                    Some(stock) => found.push(stock),
                    None => tables.extend(GaiaTable::find(file)?),
                },
            }
        }
        let databases = AreaDatabase::find(&beside)
            .map_err(|(path, error)| CatalogError::Deep { path, error })?;
        found.extend(databases.into_iter().map(Stock::Areas));
        if !indexes.is_empty() {
            indexes.sort_by(|a, b| {
                let scale = a.widest_quad_rad.total_cmp(&b.widest_quad_rad);
                scale.then_with(|| a.path.cmp(&b.path))
            });
            found.push(Stock::Indexes(indexes));
        }
        if !tables.is_empty() {
            found.push(Stock::Tables(TableStars::read(path, tables)?));
        }
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
        match &self.stock {
            Stock::Indexes(indexes) => contents_of_indexes(indexes),
            Stock::Areas(database) => DeepContents {
                kind: format!("ASTAP database {}", database.name.to_ascii_uppercase()),
                band: database.band(),
                stars: database.records(),
                share_of_sky: database.share_of_sky(),
                epoch_year: database.epoch_year(),
            },
            Stock::Wide(wide) => DeepContents {
                kind: "ASTAP database of bright stars".to_owned(),
                band: Band::JohnsonV,
                stars: wide.stars.len() as u64,
                share_of_sky: 1.0,
                epoch_year: None,
            },
            Stock::Tables(tables) => DeepContents {
                kind: tables.loaded.catalog.title().to_owned(),
                band: tables.band,
                stars: tables.stars().len() as u64,
                share_of_sky: tables.share_of_sky,
                epoch_year: Some(tables.loaded.catalog.epoch_year()),
            },
            #[cfg(feature = "archive")]
            Stock::Parquet(tables) => DeepContents {
                kind: "table in Parquet".to_owned(),
                band: tables.band(),
                stars: tables.rows(),
                share_of_sky: tables.share_of_sky(),
                epoch_year: tables.epoch_year(),
            },
            #[cfg(feature = "archive")]
            Stock::Hats(hats) => DeepContents {
                kind: format!("HATS catalog {}", hats.name),
                band: hats.band(),
                stars: hats.rows(),
                share_of_sky: hats.share_of_sky(),
                epoch_year: hats.epoch_year(),
            },
            Stock::Stored(StoredCatalog { summary, .. }) => DeepContents {
                kind: summary.title.clone(),
                band: Band::JohnsonV,
                stars: summary.stars,
                share_of_sky: 1.0,
                epoch_year: Some(summary.epoch_year),
            },
        }
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
        let files: Vec<&Path> = match &self.stock {
            Stock::Indexes(indexes) => indexes.iter().map(|index| &*index.path).collect(),
            Stock::Areas(database) => database.files().collect(),
            Stock::Tables(tables) => tables.files.iter().map(|file| &**file).collect(),
            #[cfg(feature = "archive")]
            Stock::Parquet(tables) => tables.files().collect(),
            #[cfg(feature = "archive")]
            Stock::Hats(hats) => hats.files().collect(),
            Stock::Wide(_) | Stock::Stored(_) => vec![&self.path],
        };
        let mut state = Xxh3::new();
        for file in files {
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
        match &self.stock {
            Stock::Indexes(indexes) => {
                for index in densest(indexes, &region) {
                    let read = index.stars_in(&region, interrupt, &mut add);
                    read.map_err(|error| CatalogError::Deep {
                        path: index.path.clone(),
                        error,
                    })?;
                }
            }
            Stock::Areas(database) => database
                .stars_in(&region, interrupt, &mut add)
                .map_err(|(path, error)| CatalogError::Deep { path, error })?,
            Stock::Wide(wide) => wide.stars.iter().copied().for_each(add),
            Stock::Tables(tables) => tables.stars().iter().copied().for_each(add),
            #[cfg(feature = "archive")]
            Stock::Parquet(tables) => tables
                .stars_in(&region, interrupt, &mut add)
                .map_err(|(path, error)| CatalogError::Deep { path, error })?,
            #[cfg(feature = "archive")]
            Stock::Hats(hats) => hats
                .stars_in(&region, interrupt, &mut add)
                .map_err(|(path, error)| CatalogError::Deep { path, error })?,
            Stock::Stored(stored) => stored.catalog()?.stars().iter().copied().for_each(add),
        }
        Ok(brightest.into_stars())
    }
}

impl Stock {
    /// What one file alone has; `None` where it is of another kind.
    fn of_file(path: &Path) -> Result<Option<Self>, CatalogError> {
        let damaged = |error: Damage| CatalogError::Deep {
            path: path.to_owned(),
            error,
        };
        let file = FileRanges::open(path).map_err(CatalogError::open(path))?;
        let head = file
            .head(HEAD_BYTES)
            .map_err(|error| damaged(error.into()))?;
        if IndexFile::is_like(&head) {
            let index = IndexFile::open(path, file).map_err(damaged)?;
            return Ok(Some(Self::Indexes(vec![index])));
        }
        if head.starts_with(PARQUET_MAGIC) {
            return Self::of_table(path).map_err(damaged);
        }
        if path.extension().is_some_and(|ending| ending == "001") {
            let wide = WideDatabase::read(&file).map_err(damaged)?;
            return Ok(wide.map(Self::Wide));
        }
        Ok(StoredCatalog::of_head(path, &head).map(Self::Stored))
    }

    #[cfg(feature = "archive")]
    fn of_table(path: &Path) -> Result<Option<Self>, Damage> {
        let tables = Tables::of(ParquetFile::open(path)?);
        Ok(Some(Self::Parquet(tables)))
    }

    #[cfg(not(feature = "archive"))]
    fn of_table(_: &Path) -> Result<Option<Self>, Damage> {
        let found =
            "the form of Parquet (this starpipe was built without Parquet: its feature `archive`)";
        Err(Damage::Unsupported(found.to_owned()))
    }
}

/// The catalogue of a HATS directory; of another one those of the directories in it.
#[cfg(feature = "archive")]
fn hats_in(path: &Path) -> Result<Vec<Hats>, CatalogError> {
    let open =
        |path: &Path| Hats::open(path).map_err(|(path, error)| CatalogError::Deep { path, error });
    if let Some(hats) = open(path)? {
        return Ok(vec![hats]);
    }
    let found = directories_in(path)?.into_iter();
    found.filter_map(|path| open(&path).transpose()).collect()
}

/// Adds files to those with the same columns.
#[cfg(feature = "archive")]
fn join(found: &mut Vec<Stock>, tables: Tables) {
    let mut left = Some(tables);
    for stock in found.iter_mut() {
        if let Stock::Parquet(others) = stock {
            left = left.and_then(|tables| others.join(tables));
        }
    }
    found.extend(left.map(Stock::Parquet));
}

/// Whether a file of a directory may be one that has a catalogue alone, by its ending: others are not opened.
fn may_be_one(path: &Path) -> bool {
    const ENDINGS: [&str; 12] = [
        "fits", "fit", "fts", "001", "cat", "csv", "tsv", "ecsv", "vot", "votable", "xml",
        "parquet",
    ];
    let name = path.file_name().and_then(|name| name.to_str());
    let name = name.unwrap_or_default().to_ascii_lowercase();
    let name = name.strip_suffix(".gz").unwrap_or(&name);
    let ending = name.rsplit_once('.').map(|(_, ending)| ending);
    ending.is_some_and(|ending| ENDINGS.contains(&ending))
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

/// The files beside one of a database of areas; none of another file.
fn siblings(path: &Path) -> Result<Vec<PathBuf>, CatalogError> {
    let name = |path: &Path| {
        let stem = path.file_stem()?.to_str()?.to_ascii_lowercase();
        Some(stem.rsplit_once('_')?.0.to_owned())
    };
    let ending = path.extension();
    let is_of_areas = ending.is_some_and(|ending| ending == "290" || ending == "1476");
    let (Some(directory), true) = (path.parent(), is_of_areas) else {
        return Ok(Vec::new());
    };
    let directory = match directory.as_os_str().is_empty() {
        true => Path::new("."),
        false => directory,
    };
    let mut files = files_in(directory)?;
    files.retain(|file| file.extension() == ending && name(file) == name(path));
    Ok(files)
}
