//! Splits a text file into rows, many at once, so that they can be parsed on all threads.

use memchr::memchr;
use std::io::{self, BufRead, ErrorKind, Read};
use std::ops::Range;

/// The part of a file that is in memory at a time.
const BUFFER_BYTES: usize = 1 << 23;

/// Rows that are parsed at a time.
const BATCH_ROWS: usize = 1 << 17;

/// The longest row. A record of SKY2000 has 520 bytes, the widest tables of VizieR some thousand.
const MAX_ROW_BYTES: usize = 1 << 16;

/// Most records of a file: twice those of Tycho-2.
pub(in crate::catalog) const MAX_RECORDS: u64 = 5_000_000;
/// Most lines of a file, whatever is in them: twice as many as there may be records.
const MAX_LINES: u64 = 2 * MAX_RECORDS;

/// Quotes that are looked for in vain. A file with more does not quote its cells.
const MAX_UNCLOSED: usize = 1000;

/// A row without its line end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::catalog) struct Row<'a> {
    /// The line of its beginning, from 1.
    pub(in crate::catalog) line: u64,
    /// Its bytes.
    pub(in crate::catalog) bytes: &'a [u8],
}

impl Row<'_> {
    /// Whether the row is empty or a comment.
    pub(in crate::catalog) fn is_blank_or_comment(&self) -> bool {
        self.bytes.starts_with(b"#") || self.bytes.trim_ascii().is_empty()
    }
}

/// The range of a row in the buffer, with its line end.
struct RowRange {
    line: u64,
    range: Range<usize>,
}

/// Splits what it reads into rows. Lines end with LF or CR LF; a last byte 0x1A (the end-of-file
/// mark of DOS) is ignored.
pub(in crate::catalog) struct ImportRows<R> {
    reader: R,
    buffer: Vec<u8>,
    /// Where the next row begins: its byte in the buffer, and its line.
    next_byte: usize,
    next_line: u64,
    /// The reader is at its end.
    ended: bool,
    /// An error in reading after the rows in the buffer.
    error: Option<io::Error>,
    /// The separator of cells, where quoted cells may contain line ends.
    quoting: Option<u8>,
    /// Quoted cells so far that have no end.
    unclosed: usize,
}

impl<R: BufRead> ImportRows<R> {
    pub(in crate::catalog) fn new(reader: R) -> Self {
        Self {
            reader,
            buffer: Vec::new(),
            next_byte: 0,
            next_line: 1,
            ended: false,
            error: None,
            quoting: None,
            unclosed: 0,
        }
    }

    /// From here on, quoted cells between separators may contain line ends.
    pub(in crate::catalog) fn quote_between(&mut self, separator: u8) {
        self.quoting = Some(separator);
    }

    /// The number of lines returned so far.
    pub(in crate::catalog) fn lines_read(&self) -> u64 {
        self.next_line - 1
    }

    /// The next row; `None` at the end.
    pub(in crate::catalog) fn next(&mut self) -> io::Result<Option<Row<'_>>> {
        let span = self.next_span()?;
        Ok(span.map(|span| self.row(span)))
    }

    /// The next row, without consuming it; `None` at the end.
    pub(in crate::catalog) fn peek(&mut self) -> io::Result<Option<Row<'_>>> {
        let Some(span) = self.next_span()? else {
            return Ok(None);
        };
        (self.next_byte, self.next_line) = (span.range.start, span.line);
        Ok(Some(self.row(span)))
    }

    /// The rows that are in memory, at least one; none at the end.
    pub(in crate::catalog) fn batch(&mut self) -> io::Result<Vec<Row<'_>>> {
        let mut spans: Vec<RowRange> = self.next_span()?.into_iter().collect();
        while (1..BATCH_ROWS).contains(&spans.len())
            && let Some(span) = self.take_span()
        {
            spans.push(span);
        }
        Ok(spans.into_iter().map(|span| self.row(span)).collect())
    }

    fn row(&self, span: RowRange) -> Row<'_> {
        let bytes = &self.buffer[span.range];
        let bytes = bytes.strip_suffix(b"\n").unwrap_or(bytes);
        Row {
            line: span.line,
            bytes: bytes.strip_suffix(b"\r").unwrap_or(bytes),
        }
    }

    fn next_span(&mut self) -> io::Result<Option<RowRange>> {
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
        let wanted = (BUFFER_BYTES - self.buffer.len()) as u64;
        let mut reader = self.reader.by_ref().take(wanted);
        match reader.read_to_end(&mut self.buffer) {
            Ok(read) => self.ended = (read as u64) < wanted,
            Err(error) => self.error = Some(error),
        }
    }

    /// The next row that is complete in the buffer.
    fn take_span(&mut self) -> Option<RowRange> {
        const END_OF_FILE_MARK: u8 = 0x1a;
        let start = self.next_byte;
        let found = self.row_length(start);
        let rest = &self.buffer[start..];
        let (length, lines) = match found {
            Some(found) => found,
            // A last row without a line end.
            None if self.ended && !rest.is_empty() && rest != [END_OF_FILE_MARK] => (rest.len(), 1),
            None if rest.len() > MAX_ROW_BYTES => (rest.len(), 1),
            None => return None,
        };
        if length > MAX_ROW_BYTES {
            let what = format!("a line of more than {MAX_ROW_BYTES} bytes");
            return self.refuse(&what);
        }
        if self.next_line > MAX_LINES {
            return self.refuse(&format!("more than {MAX_LINES} lines"));
        }
        let span = RowRange {
            line: self.next_line,
            range: start..start + length,
        };
        self.next_byte += length;
        self.next_line += lines;
        Some(span)
    }

    /// Ends reading with an error.
    fn refuse(&mut self, found: &str) -> Option<RowRange> {
        let message = format!("found {found}, more than any catalog has");
        self.error = Some(io::Error::new(ErrorKind::InvalidData, message));
        self.ended = true;
        self.next_byte = self.buffer.len();
        None
    }

    /// The number of bytes and lines of the row that begins at `start`, if it is complete.
    fn row_length(&mut self, start: usize) -> Option<(usize, u64)> {
        /// A quote that is not closed within this many bytes is an ordinary character.
        const QUOTED_BYTES_MAX: usize = 1 << 14;
        let rest = &self.buffer[start..];
        let first_end = memchr(b'\n', rest)? + 1;
        let Some(separator) = self.quoting.filter(|_| self.unclosed < MAX_UNCLOSED) else {
            return Some((first_end, 1));
        };
        let (mut end, mut lines) = (first_end, 1);
        let mut cells = CellScanner::new(separator);
        while cells.end_in_quotes(&rest[..end]) {
            let searched = &rest[end..rest.len().min(QUOTED_BYTES_MAX.max(end))];
            match memchr(b'\n', searched) {
                Some(more) => (end, lines) = (end + more + 1, lines + 1),
                // The rest may follow with the next filling of the buffer.
                None if rest.len() < QUOTED_BYTES_MAX && !self.ended => return None,
                None => {
                    self.unclosed += 1;
                    return Some((first_end, 1));
                }
            }
        }
        Some((end, lines))
    }
}

/// Cells of a row that is looked through as it grows.
struct CellScanner {
    separator: u8,
    seen_bytes: usize,
    is_quoted: bool,
    is_at_start: bool,
}

impl CellScanner {
    fn new(separator: u8) -> Self {
        Self {
            separator,
            seen_bytes: 0,
            is_quoted: false,
            is_at_start: true,
        }
    }

    /// Whether `text`, which begins with what was seen before, ends inside a quoted cell.
    fn end_in_quotes(&mut self, text: &[u8]) -> bool {
        if self.seen_bytes == 0 && memchr(b'"', text).is_none() {
            return false;
        }
        for &byte in &text[self.seen_bytes..] {
            // A doubled quote inside a quoted cell closes and reopens it.
            if byte == b'"' && (self.is_quoted || self.is_at_start) {
                self.is_quoted = !self.is_quoted;
                self.is_at_start = !self.is_quoted;
            } else {
                self.is_at_start = !self.is_quoted && byte == self.separator;
            }
        }
        self.seen_bytes = text.len();
        self.is_quoted
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn rows_of(content: &[u8], quoting: Option<u8>) -> Vec<(u64, Vec<u8>)> {
        let mut rows = ImportRows::new(content);
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
    fn a_line_that_no_catalogue_has_ends_reading() {
        let longest = MAX_ROW_BYTES - 1;
        for (length, is_read) in [(longest, true), (longest + 1, false), (20 * longest, false)] {
            let content = [b"first\n", &vec![b'x'; length][..], b"\nafter\n"].concat();
            let mut rows = ImportRows::new(&content[..]);
            assert_eq!(rows.next().unwrap().unwrap().bytes, b"first");
            assert_eq!(rows.next().is_ok(), is_read, "{length} bytes");
            assert_eq!(rows.next().unwrap().is_some(), is_read);
        }
    }

    #[test]
    fn lines_without_records_are_not_read_without_end() {
        let lines = io::repeat(b'\n').take(MAX_LINES + 1);
        let mut rows = ImportRows::new(io::BufReader::new(lines));
        let error = loop {
            match rows.batch() {
                Ok(batch) => assert!(!batch.is_empty() && batch.len() <= BATCH_ROWS),
                Err(error) => break error.to_string(),
            }
        };
        assert!(error.contains("more than 10000000 lines"), "{error}");
    }

    #[test]
    fn quotes_that_are_never_closed_cost_little() {
        let content = ",\"\n".repeat(MAX_UNCLOSED) + &"\"\n".repeat(3) + &",x\n".repeat(10_000);
        assert!(rows_of(content.as_bytes(), Some(b',')).len() > 10_000);
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
