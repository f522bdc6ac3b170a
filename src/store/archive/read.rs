//! Reads columns of tables.

use crate::base::files;
use crate::base::panics::caught;
use crate::store::error::StoreError;
use parquet::basic::{ConvertedType, LogicalType};
use parquet::errors::{ParquetError, Result};
use parquet::file::reader::{ChunkReader, FileReader, SerializedFileReader};
use parquet::record::{Field, Row};
use parquet::schema::types::Type;
use std::fs::File;
use std::path::Path;
use std::sync::Arc;

/// Calls `read`. The decoder panics on some damaged files (`parquet` 60.1): this makes errors of it.
/// What `read` uses must not be used again after an error.
fn guarded<T>(read: impl FnOnce() -> Result<T>) -> Result<T> {
    let damaged = |_| Err(ParquetError::General("the file is damaged".to_owned()));
    caught(read).unwrap_or_else(damaged)
}

/// A reader of a table.
pub(super) fn reader<T: ChunkReader + 'static>(table: T) -> Result<SerializedFileReader<T>> {
    guarded(|| SerializedFileReader::new(table))
}

/// Calls `each` with every row of a table, of which only these columns are read, all if there are none; columns come
/// in the order of the table.
pub(super) fn for_each_row(
    table: impl ChunkReader + 'static,
    columns: Option<&[&str]>,
    mut each: impl FnMut(&Row),
) -> Result<()> {
    let reader = reader(table)?;
    let schema = columns.map(|columns| projected(&reader, columns));
    let schema = schema.transpose()?;
    let mut rows = guarded(|| reader.get_row_iter(schema))?;
    while let Some(row) = guarded(|| rows.next().transpose())? {
        each(&row);
    }
    Ok(())
}

/// Whether all values of a table can be read.
pub(super) fn is_readable(path: &Path) -> bool {
    open(path).is_ok_and(|file| for_each_row(file, None, |_| {}).is_ok())
}

/// Opens the file of a table.
pub(super) fn open(path: &Path) -> std::result::Result<File, StoreError> {
    files::open(path).map_err(StoreError::file("reading", path))
}

/// The schema of the columns with these names.
fn projected(reader: &impl FileReader, columns: &[&str]) -> Result<Type> {
    let schema = reader.metadata().file_metadata().schema();
    let wanted = schema.get_fields().iter();
    let wanted = wanted.filter(|field| columns.contains(&field.name()));
    Type::group_type_builder(schema.name())
        .with_fields(wanted.cloned().collect())
        .build()
}

/// A value of a row.
pub(super) trait Cell {
    /// The value of a field, if it has this type.
    fn of(field: Option<&Field>) -> Self;
}

impl Cell for Option<f64> {
    fn of(field: Option<&Field>) -> Self {
        match field? {
            Field::Double(value) => Some(*value),
            _ => None,
        }
    }
}

impl Cell for Option<u64> {
    fn of(field: Option<&Field>) -> Self {
        match field? {
            Field::ULong(value) => Some(*value),
            Field::Long(value) => u64::try_from(*value).ok(),
            _ => None,
        }
    }
}

/// Empty where there is no text.
impl Cell for String {
    fn of(field: Option<&Field>) -> Self {
        match field {
            Some(Field::Str(value)) => value.clone(),
            _ => Self::new(),
        }
    }
}

/// The value of a column.
pub(super) fn cell<C: Cell>(row: &Row, column: &str) -> C {
    let found = row.get_column_iter().find(|(name, _)| *name == column);
    C::of(found.map(|(_, field)| field))
}

/// The names in a table: its column `frame`, or its only column of text.
///
/// # Errors
/// [`StoreError::NoNames`] if there is no such column, [`StoreError::File`],
/// [`StoreError::Table`].
pub fn names_in(path: &Path) -> std::result::Result<Vec<String>, StoreError> {
    let error = StoreError::table("reading", path);
    let table = reader(open(path)?).map_err(&error)?;
    let schema = table.metadata().file_metadata().schema();
    let is_text = |field: &&Arc<Type>| {
        let info = field.get_basic_info();
        info.converted_type() == ConvertedType::UTF8
            || info.logical_type_ref() == Some(&LogicalType::String)
    };
    let texts = schema.get_fields().iter().filter(is_text);
    let texts: Vec<&str> = texts.map(|field| field.name()).collect();
    let column = match texts[..] {
        [only] => only,
        _ if texts.contains(&"frame") => "frame",
        _ => return Err(StoreError::NoNames(path.to_owned())),
    };
    let mut names: Vec<String> = Vec::new();
    let read = for_each_row(open(path)?, Some(&[column]), |row| {
        names.push(cell(row, column));
    });
    read.map_err(&error)?;
    names.retain(|name| !name.is_empty());
    Ok(names)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_tells_of_a_damaged_file() {
        assert_eq!(guarded(|| Ok(7)).unwrap(), 7);
        let refused = guarded(|| -> Result<()> { panic!("slice out of range") }).unwrap_err();
        assert!(refused.to_string().contains("damaged"), "{refused}");
    }
}
