//! Which catalogues are in a file or a directory?

use super::astap::{AreaDatabase, WideDatabase};
use super::astrometry::IndexFile;
use super::error::Damage;
#[cfg(feature = "archive")]
use super::parquet::{Hats, ParquetFile, Tables};
use super::stock::Stock;
use super::stored::StoredCatalog;
use super::tables::{GaiaTable, TableStars};
use crate::base::file_ranges::FileRanges;
use crate::catalog::CatalogError;
#[cfg(feature = "archive")]
use crate::catalog::folder::directories_in;
use crate::catalog::folder::files_in;
use std::path::{Path, PathBuf};

/// Bytes of a file by which its kind is told: header cards of some generators come after a long history.
const HEAD_BYTES: u64 = 2880;
/// The beginning of a file of Parquet.
const PARQUET_MAGIC: &[u8] = b"PAR1";

/// The catalogues in a file or a directory; none where it is of another kind.
///
/// # Errors
/// [`CatalogError`] where it cannot be read, or is damaged.
pub fn stocks_in(path: &Path) -> Result<Vec<Stock>, CatalogError> {
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
        match of_file(file) {
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
    let databases =
        AreaDatabase::find(&beside).map_err(|(path, error)| CatalogError::Deep { path, error })?;
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
    Ok(found)
}

/// What one file alone has; `None` where it is of another kind.
fn of_file(path: &Path) -> Result<Option<Stock>, CatalogError> {
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
        return Ok(Some(Stock::Indexes(vec![index])));
    }
    if head.starts_with(PARQUET_MAGIC) {
        return of_table(path).map_err(damaged);
    }
    if path.extension().is_some_and(|ending| ending == "001") {
        let wide = WideDatabase::read(&file).map_err(damaged)?;
        return Ok(wide.map(Stock::Wide));
    }
    Ok(StoredCatalog::of_head(path, &head).map(Stock::Stored))
}

#[cfg(feature = "archive")]
fn of_table(path: &Path) -> Result<Option<Stock>, Damage> {
    let tables = Tables::of(ParquetFile::open(path)?);
    Ok(Some(Stock::Parquet(tables)))
}

#[cfg(not(feature = "archive"))]
fn of_table(_: &Path) -> Result<Option<Stock>, Damage> {
    let found =
        "the form of Parquet (this starpipe was built without Parquet: its feature `archive`)";
    Err(Damage::Unsupported(found.to_owned()))
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
