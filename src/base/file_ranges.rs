//! A file of which only some ranges of bytes are read.
//!
//! Ranges are read, not mapped: the length of a mapped file may change under the program, which ends it.

use super::files;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

/// A file of which only some ranges of bytes are read, by any number of threads.
#[derive(Debug)]
pub struct FileRanges {
    source: Source,
    length: u64,
}

#[derive(Debug)]
enum Source {
    File(Mutex<File>),
    Bytes(Vec<u8>),
}

impl FileRanges {
    /// Opens a file.
    ///
    /// # Errors
    /// I/O errors.
    pub fn open(path: &Path) -> io::Result<Self> {
        let file = files::open(path)?;
        let length = file.metadata()?.len();
        let source = Source::File(Mutex::new(file));
        Ok(Self { source, length })
    }

    /// A file whose bytes these are.
    pub fn of_bytes(bytes: Vec<u8>) -> Self {
        let length = bytes.len() as u64;
        let source = Source::Bytes(bytes);
        Self { source, length }
    }

    /// Its length in bytes when it was opened.
    pub const fn length(&self) -> u64 {
        self.length
    }

    /// The bytes of a range.
    ///
    /// # Errors
    /// I/O errors; [`io::ErrorKind::UnexpectedEof`] where the file ends before.
    pub fn read(&self, range: Range<u64>) -> io::Result<Vec<u8>> {
        if range.end > self.length {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        let count = range.end.saturating_sub(range.start);
        let count = usize::try_from(count).map_err(io::Error::other)?;
        let file = match &self.source {
            Source::File(file) => file,
            Source::Bytes(bytes) => {
                // The range ends within the bytes, so their number is that of a slice.
                let start = range.end - count as u64;
                return Ok(bytes[start as usize..range.end as usize].to_vec());
            }
        };
        let mut bytes = vec![0; count];
        let mut file = file.lock().unwrap_or_else(PoisonError::into_inner);
        file.seek(SeekFrom::Start(range.start))?;
        file.read_exact(&mut bytes)?;
        Ok(bytes)
    }

    /// The first bytes, at most `most`.
    ///
    /// # Errors
    /// I/O errors.
    pub fn head(&self, most: u64) -> io::Result<Vec<u8>> {
        self.read(0..most.min(self.length))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_read_and_none_beyond_the_end() {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(&file, b"0123456789").unwrap();
        let opened = FileRanges::open(file.path()).unwrap();
        for ranges in [opened, FileRanges::of_bytes(b"0123456789".to_vec())] {
            assert_eq!(ranges.length(), 10);
            assert_eq!(ranges.read(3..6).unwrap(), b"345");
            assert_eq!(ranges.read(10..10).unwrap(), b"");
            assert_eq!(ranges.head(4).unwrap(), b"0123");
            assert_eq!(ranges.head(40).unwrap(), b"0123456789");
            let error = ranges.read(8..11).unwrap_err();
            assert_eq!(error.kind(), io::ErrorKind::UnexpectedEof);
        }
    }
}
