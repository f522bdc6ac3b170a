//! One table as a CSV file that grows.

use super::csv_rows::RowReader;
use super::error::StoreError;
use crate::base::table::TableRow;
use serde::de::DeserializeOwned;
use std::fs::{File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::marker::PhantomData;
use std::path::{Path, PathBuf};

/// A table, open for writing at its end.
pub(crate) struct CsvTable<R> {
    path: PathBuf,
    file: File,
    /// Bytes up to the end of the last whole row.
    length: u64,
    rows: PhantomData<R>,
}

impl<R: TableRow + DeserializeOwned> CsvTable<R> {
    /// Opens the table in `directory`, or makes an empty one.
    pub(crate) fn open(directory: &Path) -> Result<Self, StoreError> {
        let path = directory.join(format!("{}.csv", R::TABLE));
        let (file, length) =
            open_file(&path, &heading::<R>()).map_err(StoreError::file("opening", &path))?;
        Ok(Self {
            path,
            file,
            length,
            rows: PhantomData,
        })
    }

    /// Bytes up to the end of the last whole row.
    pub(crate) fn length(&self) -> u64 {
        self.length
    }

    /// All whole rows.
    pub(crate) fn rows(&self) -> Result<RowReader<R>, StoreError> {
        let heading = heading::<R>();
        let mut first = vec![0; heading.len()];
        let mut file = File::open(&self.path).map_err(StoreError::file("reading", &self.path))?;
        let read = file.read_exact(&mut first);
        if read.is_err() || first != heading.as_bytes() {
            let expected = heading.trim_end();
            return Err(StoreError::Changed {
                path: self.path.clone(),
                line: 1,
                problem: format!("not the heading of a table of {}, {expected:?}", R::TABLE),
            });
        }
        RowReader::open(&self.path, [first.len() as u64, self.length], 2)
    }

    /// The rows between two byte offsets.
    pub(crate) fn rows_between(&self, bounds: [u64; 2]) -> Result<RowReader<R>, StoreError> {
        RowReader::open(&self.path, bounds, 1)
    }

    /// Removes all after `length` bytes.
    pub(crate) fn cut(&mut self, length: u64) -> Result<(), StoreError> {
        self.length = length;
        self.file
            .set_len(length)
            .and_then(|()| self.file.seek(SeekFrom::Start(length)))
            .map_err(StoreError::file("cutting back", &self.path))?;
        Ok(())
    }

    /// Adds whole lines.
    pub(crate) fn add(&mut self, lines: &[u8]) -> Result<(), StoreError> {
        self.length += lines.len() as u64;
        let written = self.file.write_all(lines);
        written.map_err(StoreError::file("writing", &self.path))
    }
}

/// The file, with a heading if it is new, and the length of its whole lines in bytes.
fn open_file(path: &Path, heading: &str) -> io::Result<(File, u64)> {
    let mut file = OpenOptions::new()
        .read(true)
        .write(true)
        .create(true)
        .truncate(false)
        .open(path)?;
    let length = length_of_whole_lines(&mut file)?;
    if length > 0 {
        return Ok((file, length.max(heading.len() as u64)));
    }
    file.set_len(0)?;
    file.seek(SeekFrom::Start(0))?;
    file.write_all(heading.as_bytes())?;
    Ok((file, heading.len() as u64))
}

fn heading<R: TableRow>() -> String {
    let names: Vec<_> = R::columns().iter().map(|column| column.name).collect();
    names.join(",") + "\n"
}

/// Bytes up to the end of the last line that has one.
fn length_of_whole_lines(file: &mut File) -> io::Result<u64> {
    const STEP_BYTES: u64 = 1 << 16;
    let mut end = file.seek(SeekFrom::End(0))?;
    let mut bytes = Vec::new();
    while end > 0 {
        let start = end.saturating_sub(STEP_BYTES);
        bytes.resize((end - start) as usize, 0);
        file.seek(SeekFrom::Start(start))?;
        file.read_exact(&mut bytes)?;
        if let Some(last) = memchr::memrchr(b'\n', &bytes) {
            return Ok(start + last as u64 + 1);
        }
        end = start;
    }
    Ok(0)
}
