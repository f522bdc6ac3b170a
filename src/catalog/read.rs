//! Reads a catalogue, a file or a directory, whose kind is detected from its content.

use super::deep::{DeepCatalog, Region};
use super::folder::files_in;
use super::import::{
    CatalogPart, ImportRows, ImportSummary, LoadedCatalog, MAX_RECORDS, OpenedFile, RowParser,
    SourceFile, combine,
};
use super::parts::{CatalogFileKind, read_part, title};
use super::table::CatalogTable;
use super::tycho2::Tycho2;
use super::{Catalog, CatalogError};
use crate::base::interrupt::Interrupt;
use rayon::prelude::*;
use std::path::{Path, PathBuf};

impl Catalog {
    /// Reads the catalogue in the file or directory `path`, whose [kind](super#kinds) is detected
    /// from the content.
    ///
    /// # Errors
    /// [`CatalogError`] if it cannot be read, is of another kind, or is damaged. Up to 1 % of the
    /// records may be unreadable; [`read`] reports them.
    ///
    /// # Example
    /// ```
    /// use starpipe::Catalog;
    ///
    /// let file = tempfile::NamedTempFile::new()?;
    /// let table = "hip,ra,dec,vmag,pmra,pmdec\n\
    ///              32349,101.287155,-16.716116,-1.44,-546.01,-1223.07\n\
    ///              91262,279.234735,38.783689,0.03,200.94,286.23\n";
    /// std::fs::write(&file, table)?;
    /// let catalog = Catalog::read(file.path())?;
    /// // The brightest is the first.
    /// assert_eq!(catalog.stars()[0].id.to_string(), "HIP 32349");
    /// assert_eq!(catalog.stars().len(), 2);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn read(path: impl AsRef<Path>) -> Result<Self, CatalogError> {
        let path = path.as_ref();
        read(path).map(|reading| reading.catalog)
    }
}

/// Reads a catalogue like [`Catalog::read`], and reports what became of the records of each file.
///
/// # Errors
/// As for [`Catalog::read`].
pub fn read(path: &Path) -> Result<LoadedCatalog, CatalogError> {
    read_until(path, &Interrupt::default())
}

/// [`read`], which ends with an error when `interrupt` is due.
///
/// # Errors
/// As for [`Catalog::read`]; [`CatalogError::Read`].
pub fn read_until(path: &Path, interrupt: &Interrupt) -> Result<LoadedCatalog, CatalogError> {
    if path.is_dir() {
        return read_directory(path, interrupt);
    }
    let file = OpenedFile::open(path, interrupt)?;
    if let CatalogFileKind::Compact = CatalogFileKind::of(&file.head) {
        let catalog = read_compact(path, file)?;
        let files = Vec::new();
        return Ok(LoadedCatalog { catalog, files });
    }
    let part = read_part(path, file)?;
    combine(path, title(path, &*part.format), vec![part])
}

/// Reads a catalogue that is not compact, and reports what became of each record.
///
/// # Errors
/// As for [`Catalog::read`]; [`CatalogError::UnknownKind`] also for a compact catalogue, which has
/// no records.
pub fn import(path: &Path) -> Result<LoadedCatalog, CatalogError> {
    let deep = DeepCatalog::find(path)?;
    if let Some(deep) = deep.first() {
        return import_deep(deep);
    }
    let reading = read(path)?;
    if reading.files.is_empty() {
        return Err(CatalogError::already_compact(path));
    }
    Ok(reading)
}

/// Reads all stars of a catalogue that is otherwise read region by region.
fn import_deep(deep: &DeepCatalog) -> Result<LoadedCatalog, CatalogError> {
    if let Some(loaded) = deep.loaded() {
        return Ok(loaded.clone());
    }
    let contents = deep.contents();
    if contents.stars > MAX_RECORDS {
        let (path, limit) = (deep.path().to_owned(), MAX_RECORDS);
        return Err(CatalogError::TooManyRecords { path, limit });
    }
    let stars = deep.stars_in(Region::WHOLE_SKY, &Interrupt::default())?;
    let summary = ImportSummary {
        records: contents.stars,
        stars: stars.len() as u64,
        ..ImportSummary::default()
    };
    let files = vec![SourceFile {
        path: deep.path().to_owned(),
        kind: format!("{}, magnitudes: {}", contents.kind, contents.band),
        summary,
    }];
    let catalog = Catalog::new(contents.kind, stars, Vec::new())?;
    Ok(LoadedCatalog { catalog, files })
}

fn read_compact(path: &Path, file: OpenedFile) -> Result<Catalog, CatalogError> {
    let bytes = file.read_to_end(path)?;
    let catalog = Catalog::from_compact(&bytes).map_err(|error| CatalogError::Compact {
        path: path.to_owned(),
        error,
    })?;
    if catalog.stars().is_empty() {
        let (path, records) = (path.to_owned(), 0);
        return Err(CatalogError::NoStars { path, records });
    }
    Ok(catalog)
}

/// The files of a directory by kind.
#[derive(Default)]
struct CatalogDirectory {
    tycho2: Vec<PathBuf>,
    /// Files of Tycho-2 whose entries are probably not stars.
    left_out: Vec<PathBuf>,
    /// Catalogues of other kinds.
    others: Vec<PathBuf>,
}

impl CatalogDirectory {
    fn list(path: &Path, interrupt: &Interrupt) -> Result<Self, CatalogError> {
        let mut found = Self::default();
        let mut has_supplement_1 = false;
        for path in files_in(path)? {
            let file = OpenedFile::open(&path, interrupt)?;
            let kind = CatalogFileKind::of(&file.head);
            match kind {
                CatalogFileKind::Tycho2(Tycho2::Supplement2) => found.left_out.push(path),
                CatalogFileKind::Tycho2(part) => {
                    has_supplement_1 |= part == Tycho2::Supplement1;
                    found.tycho2.push(path);
                }
                CatalogFileKind::Compact | CatalogFileKind::Sky2000 => found.others.push(path),
                CatalogFileKind::Votable | CatalogFileKind::Table => {
                    let mut rows = ImportRows::new(kind.text_of(file));
                    match CatalogTable::open(&mut rows, &path) {
                        Ok(_) => found.others.push(path),
                        Err(error) if error.is_of_system() => return Err(error),
                        Err(_) => {}
                    }
                }
            }
        }
        if !has_supplement_1 {
            // Without trailing blanks, supplement 1 is as wide as supplement 2.
            found.tycho2.append(&mut found.left_out);
        }
        Ok(found)
    }
}

/// Reads the catalogue in a directory: all files of Tycho-2, or the one file of another kind.
fn read_directory(path: &Path, interrupt: &Interrupt) -> Result<LoadedCatalog, CatalogError> {
    let found = CatalogDirectory::list(path, interrupt)?;
    if let ([], [only]) = (&*found.tycho2, &*found.others) {
        return read_until(only, interrupt);
    }
    if found.tycho2.is_empty() || !found.others.is_empty() {
        return Err(CatalogError::Directory {
            path: path.to_owned(),
            found: contents_of(&found.tycho2, &found.others),
        });
    }
    // Collected before the first error is returned, so that it is the same on any number of
    // threads.
    let files = found.tycho2.par_iter();
    let parts: Vec<Result<CatalogPart, CatalogError>> = files
        .map(|file| read_part(file, OpenedFile::open(file, interrupt)?))
        .collect();
    let parts: Vec<CatalogPart> = parts.into_iter().collect::<Result<_, _>>()?;
    let mut reading = combine(path, title(path, &*parts[0].format), parts)?;
    let left_out = found.left_out.into_iter().map(|path| SourceFile {
        path,
        kind: format!(
            "{}, left out: its entries are probably not stars",
            Tycho2::Supplement2.kind()
        ),
        summary: ImportSummary::default(),
    });
    reading.files.extend(left_out);
    Ok(reading)
}

/// Describes a directory without exactly one catalogue.
fn contents_of(tycho2: &[PathBuf], others: &[PathBuf]) -> String {
    if others.is_empty() {
        return "found no catalog in it".to_owned();
    }
    let names: Vec<String> = tycho2
        .iter()
        .take(1)
        .chain(others.iter().take(3))
        .filter_map(|file| Some(file.file_name()?.to_string_lossy().into_owned()))
        .collect();
    format!(
        "found more than one catalog in it ({}, ...)",
        names.join(", ")
    )
}
