//! Splits a text file into rows, many at once, so that they can be parsed on all threads.

use memchr::memchr;
use std::io::{self, BufRead, Read};
use std::ops::Range;

/// The part of a file that is in memory at a time; also the longest row.
const BUFFER_BYTES: usize = 1 << 23;

/// A row without its line end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::sky::catalog) struct Row<'a> {
    /// The line of its beginning, from 1.
    pub(in crate::sky::catalog) line: u64,
    /// Its bytes.
    pub(in crate::sky::catalog) bytes: &'a [u8],
}

impl Row<'_> {
    /// Whether the row is empty or a comment.
    pub(in crate::sky::catalog) fn is_blank_or_comment(&self) -> bool {
        self.bytes.starts_with(b"#") || self.bytes.trim_ascii().is_empty()
    }
}

/// The range of a row in the buffer, with its line end.
struct Span {
    line: u64,
    range: Range<usize>,
}

/// Splits what it reads into rows. Lines end with LF or CR LF; a last byte 0x1A (the end-of-file
/// mark of DOS) is ignored.
pub(in crate::sky::catalog) struct Rows<R> {
    reader: R,
    buffer: Vec<u8>,
    /// Where the next row begins: its byte in the buffer, and its line.
    next_byte: usize,
    next_line: u64,
    /// The reader is at its end.
    ended: bool,
    /// The rest of an overlong line is still to be skipped.
    in_long_line: bool,
    /// An error in reading after the rows in the buffer.
    error: Option<io::Error>,
    /// The separator of cells, where quoted cells may contain line ends.
    quoting: Option<u8>,
}

impl<R: BufRead> Rows<R> {
    pub(in crate::sky::catalog) fn new(reader: R) -> Self {
        Self {
            reader,
            buffer: Vec::new(),
            next_byte: 0,
            next_line: 1,
            ended: false,
            in_long_line: false,
            error: None,
            quoting: None,
        }
    }

    /// From here on, quoted cells between separators may contain line ends.
    pub(in crate::sky::catalog) fn quote_between(&mut self, separator: u8) {
        self.quoting = Some(separator);
    }

    /// The number of lines returned so far.
    pub(in crate::sky::catalog) fn lines_read(&self) -> u64 {
        self.next_line - 1
    }

    /// The next row; `None` at the end.
    pub(in crate::sky::catalog) fn next(&mut self) -> io::Result<Option<Row<'_>>> {
        let span = self.next_span()?;
        Ok(span.map(|span| self.row(span)))
    }

    /// The next row, without consuming it; `None` at the end.
    pub(in crate::sky::catalog) fn peek(&mut self) -> io::Result<Option<Row<'_>>> {
        let Some(span) = self.next_span()? else {
            return Ok(None);
        };
        (self.next_byte, self.next_line) = (span.range.start, span.line);
        Ok(Some(self.row(span)))
    }

    /// All rows that are in memory, at least one; none at the end.
    pub(in crate::sky::catalog) fn batch(&mut self) -> io::Result<Vec<Row<'_>>> {
        let mut spans: Vec<Span> = self.next_span()?.into_iter().collect();
        while !spans.is_empty()
            && let Some(span) = self.take_span()
        {
            spans.push(span);
        }
        Ok(spans.into_iter().map(|span| self.row(span)).collect())
    }

    fn row(&self, span: Span) -> Row<'_> {
        let bytes = &self.buffer[span.range];
        let bytes = bytes.strip_suffix(b"\n").unwrap_or(bytes);
        Row {
            line: span.line,
            bytes: bytes.strip_suffix(b"\r").unwrap_or(bytes),
        }
    }

    fn next_span(&mut self) -> io::Result<Option<Span>> {
        loop {
            if let Some(span) = self.take_span() {
                return Ok(Some(span));
            }
            if let Some(error) = self.error.take() {
                return Err(error);
            }
            if self.ended {
                return Ok(None);
            }
            self.fill();
        }
    }

    /// Moves the remaining bytes to the front of the buffer, and fills the rest.
    fn fill(&mut self) {
        self.buffer.drain(..self.next_byte);
        self.next_byte = 0;
        let reader = &mut self.reader;
        let read = if std::mem::take(&mut self.in_long_line) {
            reader.skip_until(b'\n')
        } else {
            Ok(0)
        };
        let wanted = (BUFFER_BYTES - self.buffer.len()) as u64;
        let read = read.and_then(|_| reader.take(wanted).read_to_end(&mut self.buffer));
        match read {
            Ok(read) => self.ended = (read as u64) < wanted,
            Err(error) => self.error = Some(error),
        }
    }

    /// The next row that is complete in the buffer.
    fn take_span(&mut self) -> Option<Span> {
        const END_OF_FILE_MARK: u8 = 0x1a;
        let start = self.next_byte;
        let rest = &self.buffer[start..];
        let (length, lines) = match self.row_length(rest) {
            Some(found) => found,
            // A last row without a line end, or one as long as the buffer.
            None if self.ended && !rest.is_empty() && rest != [END_OF_FILE_MARK] => (rest.len(), 1),
            None if rest.len() == BUFFER_BYTES => {
                self.in_long_line = true;
                (rest.len(), 1)
            }
            None => return None,
        };
        let span = Span {
            line: self.next_line,
            range: start..start + length,
        };
        self.next_byte += length;
        self.next_line += lines;
        Some(span)
    }

    /// The number of bytes and lines of the first row of `rest`, if it is complete.
    fn row_length(&self, rest: &[u8]) -> Option<(usize, u64)> {
        /// A quote that is not closed within this many bytes is an ordinary character.
        const QUOTED_BYTES_MAX: usize = 1 << 14;
        let first_end = memchr(b'\n', rest)? + 1;
        let Some(separator) = self.quoting else {
            return Some((first_end, 1));
        };
        let (mut end, mut lines) = (first_end, 1);
        while ends_in_quotes(&rest[..end], separator) {
            let searched = &rest[end..rest.len().min(QUOTED_BYTES_MAX.max(end))];
            match memchr(b'\n', searched) {
                Some(more) => (end, lines) = (end + more + 1, lines + 1),
                // The rest may follow with the next filling of the buffer.
                None if rest.len() < QUOTED_BYTES_MAX && !self.ended => return None,
                None => return Some((first_end, 1)),
            }
        }
        Some((end, lines))
    }
}

/// Whether `text` ends inside a quoted cell.
fn ends_in_quotes(text: &[u8], separator: u8) -> bool {
    if memchr(b'"', text).is_none() {
        return false;
    }
    let (mut quoted, mut at_start) = (false, true);
    for &byte in text {
        // A doubled quote inside a quoted cell closes and reopens it.
        if byte == b'"' && (quoted || at_start) {
            quoted = !quoted;
            at_start = !quoted;
        } else {
            at_start = !quoted && byte == separator;
        }
    }
    quoted
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn rows_of(content: &[u8], quoting: Option<u8>) -> Vec<(u64, Vec<u8>)> {
        let mut rows = Rows::new(content);
        rows.quoting = quoting;
        let mut found = Vec::new();
        loop {
            let batch = rows.batch().unwrap();
            if batch.is_empty() {
                return found;
            }
            found.extend(batch.iter().map(|row| (row.line, row.bytes.to_vec())));
        }
    }

    #[test]
    fn rows_end_at_line_ends_and_have_line_numbers() {
        let expected = vec![(1, b"a".to_vec()), (2, b"".to_vec()), (3, b"b".to_vec())];
        for content in ["a\n\nb", "a\r\n\r\nb\r\n", "a\n\nb\n\x1a"] {
            assert_eq!(rows_of(content.as_bytes(), None), expected);
        }
        assert!(rows_of(b"", None).is_empty());
    }

    #[test]
    fn quoted_cells_may_contain_line_ends_but_unclosed_quotes_do_not() {
        let content = b"a,\"x\ny \"\"z\"\" \",1\nb,5\",2\nc\n";
        let rows = rows_of(content, Some(b','));
        assert_eq!(rows[0], (1, b"a,\"x\ny \"\"z\"\" \",1".to_vec()));
        assert_eq!(rows[1], (3, b"b,5\",2".to_vec()));
        assert_eq!(rows[2], (4, b"c".to_vec()));
        let many = "d,1\n".repeat(10_000);
        let rows = rows_of(format!("a,\"x\n{many}").as_bytes(), Some(b','));
        assert_eq!((rows.len(), rows[0].1.len()), (10_001, 4));
        assert_eq!(rows_of(content, None).len(), 4);
    }

    #[test]
    fn a_line_longer_than_the_buffer_is_one_row_and_the_next_is_whole() {
        let content = [&vec![b'x'; BUFFER_BYTES + 5][..], b"\nafter\n"].concat();
        let rows = rows_of(&content, None);
        assert_eq!(rows.len(), 2);
        assert_eq!(rows[0].1.len(), BUFFER_BYTES);
        assert_eq!(rows[1], (2, b"after".to_vec()));
    }

    proptest! {
        #[test]
        fn rows_are_the_lines_where_there_are_no_quotes(text in "[a-c,\n]{0,60}") {
            let expected: Vec<&str> = text.lines().collect();
            let rows = rows_of(text.as_bytes(), Some(b','));
            prop_assert_eq!(rows.len(), expected.len());
            for ((line, row), (number, expected)) in rows.iter().zip((1..).zip(expected)) {
                prop_assert_eq!((*line, row.as_slice()), (number, expected.as_bytes()));
            }
        }

        #[test]
        fn nothing_is_lost_between_rows(text in "[a\",;\n]{0,60}") {
            let rows = rows_of(text.as_bytes(), Some(b','));
            let joined: Vec<&[u8]> = rows.iter().map(|row| row.1.as_slice()).collect();
            let joined = joined.join(&b'\n');
            prop_assert_eq!(joined.as_slice(), text.strip_suffix('\n').unwrap_or(&text).as_bytes());
        }
    }
}
