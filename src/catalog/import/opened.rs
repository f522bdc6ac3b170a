//! Opens plain and gzip files alike.

use crate::base::files;
use crate::base::interrupt::Interrupt;
use crate::catalog::CatalogError;
use flate2::bufread::MultiGzDecoder;
use std::io::{self, BufRead, BufReader, Cursor, Read};
use std::path::Path;

const BUFFER_BYTES: usize = 1 << 16;

/// Largest content that is read row by row: all lines that there may be, as long as SKY2000's.
const MAX_TEXT_BYTES: u64 = 10_000_000 * 521;

/// Largest content that is read as a whole: that of several million stars.
const MAX_CONTENT_BYTES: u64 = 1 << 28;

/// A file, decompressed if necessary, with its first bytes.
pub(in crate::catalog) struct OpenedFile {
    /// The first bytes, which `reader` returns again.
    pub(in crate::catalog) head: Vec<u8>,
    /// The content from its beginning.
    pub(in crate::catalog) reader: Box<dyn BufRead>,
}

impl OpenedFile {
    /// Opens the file `path`.
    ///
    /// Reading ends with an error when `interrupt` is due.
    pub(in crate::catalog) fn open(
        path: &Path,
        interrupt: &Interrupt,
    ) -> Result<Self, CatalogError> {
        let file = files::open(path).map_err(CatalogError::open(path))?;
        let reader = Box::new(BufReader::with_capacity(BUFFER_BYTES, file));
        Self::decompress(reader, interrupt).map_err(CatalogError::read(path, 0))
    }

    /// The whole content of the file, which is `path`.
    pub(in crate::catalog) fn read_to_end(self, path: &Path) -> Result<Vec<u8>, CatalogError> {
        let content = files::read_stream(self.reader, MAX_CONTENT_BYTES);
        content.map_err(CatalogError::read(path, 0))
    }

    fn decompress(reader: Box<dyn BufRead>, interrupt: &Interrupt) -> io::Result<Self> {
        const GZIP_MARK: [u8; 2] = [0x1f, 0x8b];
        let plain = Self::peek(reader)?;
        let content: Box<dyn Read> = if plain.head.starts_with(&GZIP_MARK) {
            Box::new(MultiGzDecoder::new(plain.reader))
        } else {
            Box::new(plain.reader)
        };
        let content = Bounded {
            content,
            left_bytes: MAX_TEXT_BYTES,
            interrupt: interrupt.clone(),
        };
        Self::peek(Box::new(BufReader::with_capacity(BUFFER_BYTES, content)))
    }

    fn peek(mut reader: Box<dyn BufRead>) -> io::Result<Self> {
        /// Enough to distinguish the kinds: more than a record of Tycho-2.
        const HEAD_BYTES: u64 = 256;
        let mut head = Vec::new();
        reader.by_ref().take(HEAD_BYTES).read_to_end(&mut head)?;
        let reader = Box::new(Cursor::new(head.clone()).chain(reader));
        Ok(Self { head, reader })
    }
}

/// Reads so much and no longer.
struct Bounded {
    content: Box<dyn Read>,
    left_bytes: u64,
    interrupt: Interrupt,
}

impl Read for Bounded {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.interrupt.check().map_err(io::Error::other)?;
        let read = self.content.read(buffer)?;
        let left = self.left_bytes.checked_sub(read as u64);
        self.left_bytes = left.ok_or_else(|| {
            io::Error::other(format!("too large: found more than {MAX_TEXT_BYTES} bytes"))
        })?;
        Ok(read)
    }
}
