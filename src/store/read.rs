//! Reads columns of tables.

use super::error::ArchiveError;
use super::guard::guarded;
use crate::base::files;
use parquet::basic::{ConvertedType, LogicalType};
use parquet::errors::ParquetError;
use parquet::file::reader::{ChunkReader, FileReader, SerializedFileReader};
use parquet::record::{Field, Row};
use parquet::schema::types::Type;
use std::fs::File;
use std::path::Path;
use std::sync::Arc;

/// Calls `each` with every row of a table, of which only these columns are read; columns come in the
/// order of the table.
pub(super) fn for_each_row(
    table: impl ChunkReader + 'static,
    columns: &[&str],
    mut each: impl FnMut(&Row),
) -> Result<(), ParquetError> {
    let reader = guarded(|| SerializedFileReader::new(table))?;
    let schema = projected(&reader, columns)?;
    let mut rows = guarded(|| reader.get_row_iter(Some(schema)))?;
    while let Some(row) = guarded(|| rows.next().transpose())? {
        each(&row);
    }
    Ok(())
}

/// Whether all values of a table can be read.
pub(super) fn is_readable(path: &Path) -> bool {
    let read = |file: File| {
        let reader = guarded(|| SerializedFileReader::new(file))?;
        let mut rows = guarded(|| reader.get_row_iter(None))?;
        while guarded(|| rows.next().transpose())?.is_some() {}
        Ok::<(), ParquetError>(())
    };
    open(path).is_ok_and(|file| read(file).is_ok())
}

/// Opens the file of a table.
pub(super) fn open(path: &Path) -> Result<File, ArchiveError> {
    files::open(path).map_err(ArchiveError::file("reading", path))
}

/// The schema of the columns with these names.
fn projected(reader: &impl FileReader, columns: &[&str]) -> Result<Type, ParquetError> {
    let schema = reader.metadata().file_metadata().schema();
    let wanted: Vec<Arc<Type>> = schema
        .get_fields()
        .iter()
        .filter(|field| columns.contains(&field.name()))
        .cloned()
        .collect();
    Type::group_type_builder(schema.name())
        .with_fields(wanted)
        .build()
}

/// The value of a column, if it is a number.
pub(super) fn number(row: &Row, column: &str) -> Option<f64> {
    match field(row, column)? {
        Field::Double(value) => Some(*value),
        _ => None,
    }
}

/// The value of a column, if it is a count.
pub(super) fn count(row: &Row, column: &str) -> Option<u64> {
    match field(row, column)? {
        Field::ULong(value) => Some(*value),
        Field::Long(value) => u64::try_from(*value).ok(),
        _ => None,
    }
}

/// The value of a column of text; empty where there is none.
pub(super) fn text<'r>(row: &'r Row, column: &str) -> &'r str {
    match field(row, column) {
        Some(Field::Str(value)) => value,
        _ => "",
    }
}

fn field<'r>(row: &'r Row, column: &str) -> Option<&'r Field> {
    let found = row.get_column_iter().find(|(name, _)| *name == column);
    found.map(|(_, field)| field)
}

/// The names in a table: its column `frame`, or its only column of text.
///
/// # Errors
/// [`ArchiveError::NoNames`] if there is no such column, [`ArchiveError::File`],
/// [`ArchiveError::Table`].
pub fn names_in(path: &Path) -> Result<Vec<String>, ArchiveError> {
    let error = ArchiveError::table("reading", path);
    let file = open(path)?;
    let reader = guarded(|| SerializedFileReader::new(file)).map_err(&error)?;
    let schema = reader.metadata().file_metadata().schema();
    let is_text = |field: &&Arc<Type>| {
        let info = field.get_basic_info();
        info.converted_type() == ConvertedType::UTF8
            || info.logical_type_ref() == Some(&LogicalType::String)
    };
    let texts: Vec<&str> = schema
        .get_fields()
        .iter()
        .filter(is_text)
        .map(|field| field.name())
        .collect();
    let column = match texts[..] {
        [only] => only,
        _ if texts.contains(&"frame") => "frame",
        _ => return Err(ArchiveError::NoNames(path.to_owned())),
    };
    let mut names = Vec::new();
    let read = for_each_row(open(path)?, &[column], |row| {
        names.push(text(row, column).to_owned());
    });
    read.map_err(&error)?;
    names.retain(|name| !name.is_empty());
    Ok(names)
}
