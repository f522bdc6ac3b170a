//! Reads typed columns from bytes.

use crate::catalog::error::{CompactError, quoted};

/// Bytes with a reading position. Callers check the length first: reading past the end panics.
pub(in crate::catalog) struct ByteReader<'a> {
    pub(in crate::catalog) bytes: &'a [u8],
    pub(in crate::catalog) at: usize,
}

impl<'a> ByteReader<'a> {
    pub(in crate::catalog) fn take<const N: usize>(&mut self) -> [u8; N] {
        self.column(1)[0]
    }

    pub(in crate::catalog) fn column<const N: usize>(&mut self, count: usize) -> &'a [[u8; N]] {
        let start = self.at;
        self.at += N * count;
        self.bytes[start..self.at].as_chunks().0
    }

    pub(super) fn text(&mut self, length: usize, expected: &str) -> Result<&'a str, CompactError> {
        let start = self.at;
        let text = &self.bytes[start..start + length];
        self.at += length;
        str::from_utf8(text).or_else(|_| invalid(start, quoted(text), expected))
    }
}

/// An error at `byte`.
pub(in crate::catalog) fn invalid<T>(
    byte: usize,
    found: impl Into<String>,
    expected: impl Into<String>,
) -> Result<T, CompactError> {
    Err(CompactError {
        byte,
        found: found.into(),
        expected: expected.into(),
    })
}
