//! Reading the rows of a table.

use super::error::StoreError;
use crate::base::table::TableRow;
use serde::de::DeserializeOwned;
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom, Take};
use std::marker::PhantomData;
use std::path::{Path, PathBuf};

/// The rows of a table or of a part of it, read one by one.
pub struct RowReader<R> {
    path: PathBuf,
    reader: csv::Reader<Take<BufReader<File>>>,
    names: csv::StringRecord,
    record: csv::StringRecord,
    /// Offset of the first row in the file, in bytes.
    start: u64,
    /// Number of the line of the last row read.
    line: u64,
    rows: PhantomData<R>,
}

impl<R: TableRow + DeserializeOwned> RowReader<R> {
    /// The rows of the table at `path` between two byte offsets, the first on `first_line`.
    pub(super) fn open(
        path: &Path,
        [start, end]: [u64; 2],
        first_line: u64,
    ) -> Result<Self, StoreError> {
        let open = || {
            let mut file = File::open(path)?;
            file.seek(SeekFrom::Start(start))?;
            Ok(file)
        };
        let file = open().map_err(StoreError::file("reading", path))?;
        let reader = csv::ReaderBuilder::new()
            .has_headers(false)
            // The number of fields is checked below, and an error reported with its line.
            .flexible(true)
            .from_reader(BufReader::new(file).take(end - start));
        Ok(Self {
            path: path.to_owned(),
            reader,
            names: R::columns().iter().map(|column| column.name).collect(),
            record: csv::StringRecord::new(),
            start,
            line: first_line - 1,
            rows: PhantomData,
        })
    }

    /// Offset of the end of the last row read, in bytes.
    pub(crate) fn end(&self) -> u64 {
        self.start + self.reader.position().byte()
    }

    /// An error of the last row read.
    pub(crate) fn changed(&self, problem: String) -> StoreError {
        StoreError::Changed {
            path: self.path.clone(),
            line: self.line,
            problem,
        }
    }

    /// The record that was read, as a row.
    fn row(&self) -> Result<R, String> {
        let (found, expected) = (self.record.len(), self.names.len());
        if found != expected {
            return Err(format!("{found} fields, expected {expected}"));
        }
        let row = self.record.deserialize(Some(&self.names));
        row.map_err(|error| self.field_error(&error))
    }

    fn field_error(&self, error: &csv::Error) -> String {
        let csv::ErrorKind::Deserialize { err, .. } = error.kind() else {
            return error.to_string();
        };
        let field = err.field().and_then(|field| {
            let field = field as usize;
            Some((self.names.get(field)?, self.record.get(field)?))
        });
        match field {
            Some((name, found)) => format!("{name} is {found:?}: {}", err.kind()),
            // An unknown word has no field, but its message has the word.
            None => err.kind().to_string(),
        }
    }
}

impl<R: TableRow + DeserializeOwned> Iterator for RowReader<R> {
    type Item = Result<R, StoreError>;

    fn next(&mut self) -> Option<Self::Item> {
        let read = self.reader.read_record(&mut self.record);
        self.line += 1;
        let row = match read {
            Ok(false) => return None,
            Ok(true) => self.row(),
            Err(error) => Err(error.to_string()),
        };
        Some(row.map_err(|problem| self.changed(problem)))
    }
}
