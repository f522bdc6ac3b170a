//! Opens a catalogue file and finds out from its content what it is.

use super::compact;
use super::error::quoted;
use super::import::Importer;
use super::{Catalog, CatalogError, ImportSummary, sky2000, table};
use flate2::bufread::MultiGzDecoder;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Cursor, Read};
use std::path::Path;

/// What can be imported, for messages.
pub(super) const KINDS_IMPORTED: &str = "SKY2000 records of 520 bytes, or a table with SKY2000's \
     column labels (ID, RAh, RAm, RAs, DE-, DEd, DEm, DEs, Vmag) as headings, plain or gzip";
/// What can be read, for messages.
pub(super) const KINDS_READ: &str = "a compact catalog of starpipe, SKY2000 records of 520 bytes, \
     or a table with SKY2000's column labels (ID, RAh, RAm, RAs, DE-, DEd, DEm, DEs, Vmag) as \
     headings, plain or gzip";

const GZIP_MARK: [u8; 2] = [0x1f, 0x8b];
/// No line is read beyond so many bytes, whatever the file is.
const LINE_BYTES_MAX: u64 = 4096;
const END_OF_FILE_MARK: u8 = 0x1a;
/// As many bytes as tell the kinds apart.
const HEAD_BYTES: u64 = 16;

/// A file, decompressed if need be, and how it begins.
pub(super) struct Source {
    /// The first bytes, which `reader` gives once more.
    pub(super) head: Vec<u8>,
    /// The content from its beginning.
    pub(super) reader: Box<dyn BufRead>,
}

impl Source {
    /// Opens the file `path`.
    pub(super) fn open(path: &Path) -> Result<Self, CatalogError> {
        let file = File::open(path).map_err(|source| CatalogError::Open {
            path: path.to_owned(),
            source,
        })?;
        Self::from_reader(Box::new(BufReader::with_capacity(1 << 16, file))).map_err(|source| {
            CatalogError::Read {
                path: path.to_owned(),
                lines_read: 0,
                source,
            }
        })
    }

    fn from_reader(reader: Box<dyn BufRead>) -> io::Result<Self> {
        let plain = Self::peek(reader)?;
        if !plain.head.starts_with(&GZIP_MARK) {
            return Ok(plain);
        }
        let unpacked = MultiGzDecoder::new(plain.reader);
        Self::peek(Box::new(BufReader::with_capacity(1 << 16, unpacked)))
    }

    fn peek(mut reader: Box<dyn BufRead>) -> io::Result<Self> {
        let mut head = Vec::new();
        reader.by_ref().take(HEAD_BYTES).read_to_end(&mut head)?;
        let reader = Box::new(Cursor::new(head.clone()).chain(reader));
        Ok(Self { head, reader })
    }

    /// The error for content that is of no known kind.
    pub(super) fn unknown_kind(path: &Path, head: &[u8]) -> CatalogError {
        CatalogError::UnknownKind {
            path: path.to_owned(),
            found: if head.is_empty() {
                "nothing: it is empty".to_owned()
            } else {
                quoted(head)
            },
            expected: KINDS_READ,
        }
    }
}

/// The catalogue in a file of any kind, and what became of its records, if it has any.
pub(super) fn read(path: &Path) -> Result<(Catalog, Option<ImportSummary>), CatalogError> {
    let source = Source::open(path)?;
    if source.head.starts_with(&compact::MAGIC) {
        return Ok((read_compact(path, source)?, None));
    }
    let mut importer = Importer::new(path);
    if sky2000::is_fixed_width(&source.head) {
        sky2000::read_records(source.reader, &mut importer, |_, _| Ok(()))?;
    } else {
        table::read_rows(source.reader, &mut importer)?;
    }
    let (catalog, summary) = importer.finish()?;
    Ok((catalog, Some(summary)))
}

fn read_compact(path: &Path, mut source: Source) -> Result<Catalog, CatalogError> {
    let mut bytes = Vec::new();
    let read = source.reader.read_to_end(&mut bytes);
    read.map_err(|source| CatalogError::Read {
        path: path.to_owned(),
        lines_read: 0,
        source,
    })?;
    Catalog::from_compact(&bytes).map_err(|fault| CatalogError::Compact {
        path: path.to_owned(),
        fault,
    })
}

/// The lines of a file, one at a time, without their ends.
pub(super) struct Lines<R> {
    reader: R,
    buffer: Vec<u8>,
    /// The number of the line last read, from 1.
    number: u64,
}

impl<R: BufRead> Lines<R> {
    pub(super) fn new(reader: R) -> Self {
        Self {
            reader,
            buffer: Vec::new(),
            number: 0,
        }
    }

    /// How many lines were read so far.
    pub(super) fn read(&self) -> u64 {
        self.number
    }

    /// The next line and its number; `None` at the end.
    pub(super) fn next(&mut self) -> io::Result<Option<(u64, &[u8])>> {
        let found = self.advance()?;
        Ok(found.then(|| (self.number, self.current())))
    }

    /// The line last read, cut after [`LINE_BYTES_MAX`].
    pub(super) fn current(&self) -> &[u8] {
        let line = self.buffer.strip_suffix(b"\n").unwrap_or(&self.buffer);
        line.strip_suffix(b"\r").unwrap_or(line)
    }

    /// Reads the next line; false at the end, or at a mark of it that is the last byte.
    pub(super) fn advance(&mut self) -> io::Result<bool> {
        self.buffer.clear();
        let mut limited = self.reader.by_ref().take(LINE_BYTES_MAX);
        limited.read_until(b'\n', &mut self.buffer)?;
        let ended = self.buffer.last() == Some(&b'\n');
        if !ended && self.buffer.len() as u64 == LINE_BYTES_MAX {
            self.reader.skip_until(b'\n')?;
        }
        if self.buffer.is_empty() || (!ended && self.buffer == [END_OF_FILE_MARK]) {
            return Ok(false);
        }
        self.number += 1;
        Ok(true)
    }
}
