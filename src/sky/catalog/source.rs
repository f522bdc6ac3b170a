//! Opens a catalogue, a file or a directory, and finds out from its content what it is.

use super::compact;
use super::error::quoted;
use super::import::{Format, ImportSummary, Part, Reading, SourceFile, Tally, combine};
use super::rows::Rows;
use super::sky2000::FixedWidth;
use super::table::Table;
use super::tycho2::Tycho2;
use super::{Catalog, CatalogError, sky2000};
use flate2::bufread::MultiGzDecoder;
use rayon::prelude::*;
use std::fs::{self, File};
use std::io::{self, BufRead, BufReader, Cursor, Read};
use std::path::{Path, PathBuf};

/// What can be imported, for messages.
pub(super) const KINDS_IMPORTED: &str = "SKY2000 records of 520 bytes, the files of Tycho-2, or a table with headings \
     for identifiers, right ascension, declination and magnitude, plain or gzip";
/// What can be read, for messages.
const KINDS_READ: &str = "a compact catalog of starpipe, SKY2000 records of 520 bytes, the files of Tycho-2, or a \
     table with headings for identifiers, right ascension, declination and magnitude, plain or gzip";

const GZIP_MARK: [u8; 2] = [0x1f, 0x8b];
/// As many bytes as tell the kinds apart: more than a record of Tycho-2 has.
const HEAD_BYTES: u64 = 256;
const BUFFER_BYTES: usize = 1 << 16;
/// As much of a content of no known kind is shown.
const SHOWN_BYTES: usize = 16;

/// A file, decompressed if need be, and how it begins.
pub(super) struct Source {
    /// The first bytes, which `reader` gives once more.
    pub(super) head: Vec<u8>,
    /// The content from its beginning.
    pub(super) reader: Box<dyn BufRead>,
}

/// What a file is, as far as its first bytes tell.
enum Kind {
    Compact,
    Sky2000,
    Tycho2(Tycho2),
    /// Or nothing at all.
    Table,
}

impl Source {
    /// Opens the file `path`.
    pub(super) fn open(path: &Path) -> Result<Self, CatalogError> {
        let file = File::open(path).map_err(|source| CatalogError::Open {
            path: path.to_owned(),
            source,
        })?;
        let reader = Box::new(BufReader::with_capacity(BUFFER_BYTES, file));
        Self::from_reader(reader).map_err(|source| read_error(path, source))
    }

    fn from_reader(reader: Box<dyn BufRead>) -> io::Result<Self> {
        let plain = Self::peek(reader)?;
        if !plain.head.starts_with(&GZIP_MARK) {
            return Ok(plain);
        }
        let unpacked = MultiGzDecoder::new(plain.reader);
        Self::peek(Box::new(BufReader::with_capacity(BUFFER_BYTES, unpacked)))
    }

    fn peek(mut reader: Box<dyn BufRead>) -> io::Result<Self> {
        let mut head = Vec::new();
        reader.by_ref().take(HEAD_BYTES).read_to_end(&mut head)?;
        let reader = Box::new(Cursor::new(head.clone()).chain(reader));
        Ok(Self { head, reader })
    }

    fn kind(&self) -> Kind {
        if self.head.starts_with(&compact::MAGIC) {
            Kind::Compact
        } else if sky2000::is_fixed_width(&self.head) {
            Kind::Sky2000
        } else {
            Tycho2::of(&self.head).map_or(Kind::Table, Kind::Tycho2)
        }
    }
}

fn read_error(path: &Path, source: io::Error) -> CatalogError {
    CatalogError::Read {
        path: path.to_owned(),
        lines_read: 0,
        source,
    }
}

/// The error for content that is of no known kind.
pub(super) fn unknown_kind(path: &Path, head: &[u8]) -> CatalogError {
    CatalogError::UnknownKind {
        path: path.to_owned(),
        found: if head.is_empty() {
            "nothing: it is empty".to_owned()
        } else {
            quoted(&head[..head.len().min(SHOWN_BYTES)])
        },
        expected: KINDS_READ,
    }
}

/// The catalogue in a file of any kind, or in a directory.
pub(super) fn read(path: &Path) -> Result<Reading, CatalogError> {
    if path.is_dir() {
        return read_directory(path);
    }
    let source = Source::open(path)?;
    if let Kind::Compact = source.kind() {
        let catalog = read_compact(path, source)?;
        let files = Vec::new();
        return Ok(Reading { catalog, files });
    }
    let part = read_part(path, source)?;
    combine(path, title(path, &*part.format), vec![part])
}

fn read_compact(path: &Path, mut source: Source) -> Result<Catalog, CatalogError> {
    let mut bytes = Vec::new();
    let read = source.reader.read_to_end(&mut bytes);
    read.map_err(|source| read_error(path, source))?;
    let catalog = Catalog::from_compact(&bytes).map_err(|fault| CatalogError::Compact {
        path: path.to_owned(),
        fault,
    })?;
    if catalog.stars().is_empty() {
        let (path, records) = (path.to_owned(), 0);
        return Err(CatalogError::NoStars { path, records });
    }
    Ok(catalog)
}

/// Reads the records of a file that is not compact.
fn read_part(path: &Path, source: Source) -> Result<Part, CatalogError> {
    let kind = source.kind();
    let mut rows = Rows::new(source.reader);
    let format: Box<dyn Format + Send> = match kind {
        Kind::Sky2000 => Box::new(FixedWidth),
        Kind::Tycho2(file) => Box::new(file),
        Kind::Compact | Kind::Table => Box::new(Table::open(&mut rows, path)?),
    };
    let tally = Tally::of(&mut rows, &*format, path)?;
    Ok(Part {
        path: path.to_owned(),
        format,
        tally,
    })
}

/// The catalogue in a directory: all files of Tycho-2, or the one file of another kind.
fn read_directory(path: &Path) -> Result<Reading, CatalogError> {
    let (mut tycho2, mut others, mut left_out) = (Vec::new(), Vec::new(), Vec::new());
    let mut has_supplement_1 = false;
    for file in files_in(path)? {
        let source = Source::open(&file)?;
        match source.kind() {
            Kind::Tycho2(Tycho2::Supplement2) => left_out.push(file),
            Kind::Tycho2(part) => {
                has_supplement_1 |= part == Tycho2::Supplement1;
                tycho2.push(file);
            }
            Kind::Compact | Kind::Sky2000 => others.push(file),
            Kind::Table => match Table::open(&mut Rows::new(source.reader), &file) {
                Ok(_) => others.push(file),
                Err(error @ CatalogError::Read { .. }) => return Err(error),
                Err(_) => {}
            },
        }
    }
    if !has_supplement_1 {
        // Without the blanks at its line ends the first supplement is as wide as the second.
        tycho2.append(&mut left_out);
    }
    if let ([], [only]) = (&*tycho2, &*others) {
        return read(only);
    }
    if tycho2.is_empty() || !others.is_empty() {
        return Err(CatalogError::Directory {
            path: path.to_owned(),
            found: mixture(&tycho2, &others),
        });
    }
    // Collected before the first error is looked for, so that it is the same on any number of threads.
    let parts: Vec<Result<Part, CatalogError>> = tycho2
        .par_iter()
        .map(|file| read_part(file, Source::open(file)?))
        .collect();
    let parts: Vec<Part> = parts.into_iter().collect::<Result<_, _>>()?;
    let mut reading = combine(path, title(path, &*parts[0].format), parts)?;
    let left_out = left_out.into_iter().map(|path| SourceFile {
        path,
        kind: format!(
            "{}, left out: its stars are probably none",
            Tycho2::Supplement2.kind()
        ),
        summary: ImportSummary::default(),
    });
    reading.files.extend(left_out);
    Ok(reading)
}

/// The files in a directory that are not hidden, by name.
fn files_in(path: &Path) -> Result<Vec<PathBuf>, CatalogError> {
    let list = || -> io::Result<Vec<PathBuf>> {
        let paths = fs::read_dir(path)?.map(|entry| Ok(entry?.path()));
        let mut files = paths.collect::<io::Result<Vec<PathBuf>>>()?;
        let is_hidden = |file: &Path| {
            let name = file.file_name();
            name.is_some_and(|name| name.as_encoded_bytes().starts_with(b"."))
        };
        files.retain(|file| file.is_file() && !is_hidden(file));
        files.sort();
        Ok(files)
    };
    list().map_err(|source| CatalogError::Open {
        path: path.to_owned(),
        source,
    })
}

/// What is wrong with a directory of these files of Tycho-2 and these catalogues of other kinds.
fn mixture(tycho2: &[PathBuf], others: &[PathBuf]) -> String {
    if others.is_empty() {
        return "no catalog is in it".to_owned();
    }
    let names: Vec<String> = tycho2
        .iter()
        .take(1)
        .chain(others.iter().take(3))
        .filter_map(|file| Some(file.file_name()?.to_string_lossy().into_owned()))
        .collect();
    format!("more than one catalog is in it ({}, ...)", names.join(", "))
}

/// The file's name tells which version of the catalogue it is; nothing inside it does.
fn title(path: &Path, format: &dyn Format) -> String {
    // `.` has a name only in full.
    let full = path.canonicalize().unwrap_or_default();
    let name = path.file_name().or(full.file_name()).unwrap_or_default();
    let name = name.to_string_lossy();
    let name = name.strip_suffix(".gz").unwrap_or(&name);
    match format.catalog() {
        Some(catalog) => format!("{catalog} ({name})"),
        None => name.to_owned(),
    }
}
