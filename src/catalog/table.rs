//! A table with SKY2000's labels as headings: starpipe's bright CSV, or an export from VizieR.
//!
//! Columns are found by their labels, in any order; others are passed over. The separator (comma,
//! semicolon, bar or tab) is the one that occurs in the headings. Lines that begin with `#` and
//! empty lines are comments; a line of dashes under the headings, and the units between, are skipped.

use super::CatalogError;
use super::error::{FaultPlace, RecordFault, quoted};
use super::import::Importer;
use super::record::{COLUMN_COUNT, COLUMNS, Cell, Cells, REQUIRED};
use super::source::{Lines, Source};
use std::borrow::Cow;
use std::io::BufRead;

const SEPARATORS: [u8; 4] = *b"\t;|,";
/// So many of the labels make a table one that is meant to be a catalogue.
const LABELS_RECOGNIZED: usize = 3;
/// Under the headings: a line of units, then a line of dashes.
const LINES_UNDER_HEADINGS: usize = 2;

/// Gives every row to `importer`.
pub(super) fn read_rows(reader: impl BufRead, importer: &mut Importer) -> Result<(), CatalogError> {
    let mut lines = Lines::new(reader);
    let Some((line, text)) = next_content(&mut lines, importer)? else {
        return Err(Source::unknown_kind(importer.path(), b""));
    };
    let headings = Headings::parse(text, line, importer)?;

    // The lines that may turn out to be units and dashes are kept until that is known.
    let mut kept: Vec<(u64, Vec<u8>)> = Vec::new();
    while kept.len() < LINES_UNDER_HEADINGS {
        let Some((line, text)) = next_content(&mut lines, importer)? else {
            break;
        };
        if headings.is_rule(text) {
            kept.clear();
            break;
        }
        kept.push((line, text.to_owned()));
    }
    for (line, text) in &kept {
        headings.take(*line, text, importer)?;
    }
    while let Some((line, text)) = next_content(&mut lines, importer)? {
        headings.take(line, text, importer)?;
    }
    Ok(())
}

/// The next line that is neither empty nor a comment, with its number.
fn next_content<'a, R: BufRead>(
    lines: &'a mut Lines<R>,
    importer: &Importer,
) -> Result<Option<(u64, &'a [u8])>, CatalogError> {
    loop {
        let lines_read = lines.read();
        let found = lines.advance();
        let found = found.map_err(|error| importer.read_error(lines_read, error))?;
        if !found {
            return Ok(None);
        }
        let text = lines.current();
        if !(text.starts_with(b"#") || text.trim_ascii().is_empty()) {
            break;
        }
    }
    Ok(Some((lines.read(), lines.current())))
}

/// What the headings tell of the table.
struct Headings {
    separator: u8,
    /// How many cells a row has.
    width: usize,
    /// Where each of [`COLUMNS`] stands.
    cell_of: [Option<usize>; COLUMN_COUNT],
}

impl Headings {
    /// The headings in `text`, the first line that is no comment.
    fn parse(text: &[u8], line: u64, importer: &Importer) -> Result<Self, CatalogError> {
        let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
        let unknown = || Source::unknown_kind(importer.path(), text);
        let separator = SEPARATORS
            .into_iter()
            .find(|separator| text.contains(separator));
        let separator = separator.ok_or_else(unknown)?;
        let labels: Vec<&[u8]> = text
            .split(|&byte| byte == separator)
            .map(|label| label.trim_ascii())
            .map(|label| match label {
                [b'"', inner @ .., b'"'] => inner,
                _ => label,
            })
            .collect();
        let cell_of = COLUMNS.map(|column| {
            labels
                .iter()
                .position(|&label| label == column.label.as_bytes())
        });
        if cell_of.iter().flatten().count() < LABELS_RECOGNIZED {
            return Err(unknown());
        }
        let missing: Vec<&str> = REQUIRED
            .into_iter()
            .filter(|&cell| cell_of[cell as usize].is_none())
            .map(|cell| COLUMNS[cell as usize].label)
            .collect();
        if !missing.is_empty() {
            return Err(CatalogError::MissingColumns {
                path: importer.path().to_owned(),
                line,
                missing,
                found: String::from_utf8_lossy(text).into_owned(),
            });
        }
        Ok(Self {
            separator,
            width: labels.len(),
            cell_of,
        })
    }

    /// Whether the line is the one of dashes that ends what stands above the rows.
    fn is_rule(&self, text: &[u8]) -> bool {
        let dashes = text
            .iter()
            .all(|&byte| byte == b'-' || byte == self.separator || byte == b' ');
        dashes && text.windows(2).any(|pair| pair == b"--")
    }

    fn take(&self, line: u64, text: &[u8], importer: &mut Importer) -> Result<(), CatalogError> {
        let row = self.split(text);
        if row.len() != self.width {
            return importer.refuse(RecordFault {
                line,
                place: FaultPlace::Cell(row.len().min(self.width) + 1),
                label: "",
                found: format!("{} columns, {}", row.len(), quoted(text)),
                expected: "as many columns as headings",
            });
        }
        let mut cells: Cells = [&[]; COLUMN_COUNT];
        for (cell, place) in cells.iter_mut().zip(self.cell_of) {
            *cell = place.map_or(&[][..], |place| &row[place]);
        }
        let place_of =
            |cell: Cell| FaultPlace::Cell(self.cell_of[cell as usize].map_or(0, |place| place + 1));
        importer.take(line, &cells, place_of).map(|_| ())
    }

    fn split<'a>(&self, text: &'a [u8]) -> Vec<Cow<'a, [u8]>> {
        // Only CSV quotes: in the others, a quote is an inch sign or part of a name.
        if self.separator == b',' && text.contains(&b'"') {
            let mut reader = csv::ReaderBuilder::new()
                .has_headers(false)
                .from_reader(text);
            let row = reader.byte_records().next().and_then(Result::ok);
            return row
                .unwrap_or_default()
                .iter()
                .map(|cell| Cow::Owned(cell.to_owned()))
                .collect();
        }
        text.split(|&byte| byte == self.separator)
            .map(Cow::Borrowed)
            .collect()
    }
}
