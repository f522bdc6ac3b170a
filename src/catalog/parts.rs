//! Reads one file of a catalogue, whose kind is detected from its content.

use super::import::{CatalogPart, ImportRows, ImportTally, OpenedFile, RowParser};
use super::sky2000::FixedWidth;
use super::table::{CatalogTable, VotableText, is_votable};
use super::tycho2::Tycho2;
use super::{CatalogError, compact};
use std::io::{BufRead, BufReader};
use std::path::Path;

/// The kind of a file, as far as its first bytes tell.
pub(super) enum CatalogFileKind {
    Compact,
    Sky2000,
    Tycho2(Tycho2),
    Votable,
    /// Or none of them.
    Table,
}

impl CatalogFileKind {
    pub(super) fn of(head: &[u8]) -> Self {
        if head.starts_with(&compact::MAGIC) {
            Self::Compact
        } else if FixedWidth::is_in(head) {
            Self::Sky2000
        } else if is_votable(head) {
            Self::Votable
        } else {
            Tycho2::detect(head).map_or(Self::Table, Self::Tycho2)
        }
    }

    /// The rows of `file`, which is of this kind, as text.
    pub(super) fn text_of(&self, file: OpenedFile) -> Box<dyn BufRead> {
        match self {
            Self::Votable => Box::new(BufReader::new(VotableText::new(file.reader))),
            _ => file.reader,
        }
    }
}

/// Reads the records of a file that is not compact.
pub(super) fn read_part(path: &Path, file: OpenedFile) -> Result<CatalogPart, CatalogError> {
    let kind = CatalogFileKind::of(&file.head);
    let mut rows = ImportRows::new(kind.text_of(file));
    let format: Box<dyn RowParser + Send> = match kind {
        CatalogFileKind::Sky2000 => Box::new(FixedWidth),
        CatalogFileKind::Tycho2(file) => Box::new(file),
        CatalogFileKind::Votable => Box::new(CatalogTable::open(&mut rows, path)?.of_votable()),
        CatalogFileKind::Compact | CatalogFileKind::Table => {
            Box::new(CatalogTable::open(&mut rows, path)?)
        }
    };
    let tally = ImportTally::read(&mut rows, &*format, path)?;
    Ok(CatalogPart {
        path: path.to_owned(),
        format,
        tally,
    })
}

/// The title of a catalogue, with the file name, which alone tells the version.
pub(super) fn title(path: &Path, format: &dyn RowParser) -> String {
    // `.` has no name of its own.
    let full = path.canonicalize().unwrap_or_default();
    let name = path.file_name().or(full.file_name()).unwrap_or_default();
    let name = name.to_string_lossy();
    let name = name.strip_suffix(".gz").unwrap_or(&name);
    match format.catalog() {
        Some(catalog) => format!("{catalog} ({name})"),
        None => name.to_owned(),
    }
}
