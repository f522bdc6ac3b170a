//! What became of the records of the source files? Rows of text → stars, counts, a catalogue.
//!
//! 1. [`OpenedFile`] decompresses a file and shows its first bytes, which tell its kind.
//! 2. [`ImportRows`] splits its content into rows, many at once.
//! 3. A [`RowParser`] parses each row; [`ImportTally`] collects the stars and counts the other records.
//! 4. [`combine`](fn@combine) makes the catalogue of all files, without repeated identifiers.

mod combine;
mod opened;
mod rows;
mod summary;
mod tally;

pub(super) use combine::{CatalogPart, combine};
pub use combine::{LoadedCatalog, SourceFile};
pub(super) use opened::OpenedFile;
pub(super) use rows::{ImportRows, MAX_RECORDS, Row};
pub use summary::ImportSummary;
pub(super) use tally::{ImportTally, NamedStar, Parsed, Rejection, RowParser, both_or_neither};
