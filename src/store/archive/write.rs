//! Writes a table as Parquet, group after group of rows.

use super::votable::{CONTENT_KEY, VERSION, VERSION_KEY, votable};
use crate::base::table::{Column, FieldValue, TableRow};
use parquet::basic::Compression;
use parquet::column::writer::ColumnWriter;
use parquet::data_type::ByteArray;
use parquet::errors::{ParquetError, Result};
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;
use std::fmt::Write as _;
use std::io::Write;
use std::sync::Arc;

/// Rows in memory at once.
const ROWS_PER_GROUP: usize = 1 << 16;

/// Writes rows to a file. The same rows make the same bytes.
pub struct TableWriter<R, W: Write + Send> {
    columns: Vec<Column<R>>,
    /// Characters of the longest text of each column.
    widths: Vec<usize>,
    writer: SerializedFileWriter<W>,
    /// Rows that are not written yet.
    rows: Vec<R>,
}

impl<R: TableRow, W: Write + Send> TableWriter<R, W> {
    /// Begins a table.
    ///
    /// # Errors
    /// [`ParquetError`] if the beginning cannot be written.
    pub fn new(target: W) -> Result<Self> {
        let columns = R::columns();
        let schema = Arc::new(parse_message_type(&schema(R::TABLE, &columns))?);
        let properties = WriterProperties::builder()
            .set_compression(Compression::SNAPPY)
            .build();
        Ok(Self {
            writer: SerializedFileWriter::new(target, schema, Arc::new(properties))?,
            widths: vec![0; columns.len()],
            columns,
            rows: Vec::new(),
        })
    }

    /// Adds a row.
    ///
    /// # Errors
    /// [`ParquetError`] if a group of rows cannot be written.
    pub fn add(&mut self, row: R) -> Result<()> {
        self.rows.push(row);
        if self.rows.len() < ROWS_PER_GROUP {
            return Ok(());
        }
        self.write_group()
    }

    /// Writes what is left, and returns the target.
    ///
    /// # Errors
    /// [`ParquetError`] if it cannot be written.
    pub fn finish(mut self) -> Result<W> {
        if !self.rows.is_empty() {
            self.write_group()?;
        }
        let content = votable(R::TABLE, &self.columns, &self.widths);
        describe(&mut self.writer, content);
        self.writer.into_inner()
    }

    fn write_group(&mut self) -> Result<()> {
        let mut group = self.writer.next_row_group()?;
        for (column, width) in self.columns.iter().zip(&mut self.widths) {
            let missing = || ParquetError::General(format!("{} has no writer", column.name));
            let mut writer = group.next_column()?.ok_or_else(missing)?;
            let fields = self.rows.iter().map(column.value).collect();
            let longest = write_column(writer.untyped(), column.name, column.is_optional, fields)?;
            *width = longest.max(*width);
            writer.close()?;
        }
        group.close()?;
        self.rows.clear();
        Ok(())
    }
}

/// Adds a VOTable to the metadata of a file.
pub(super) fn describe<W: Write + Send>(writer: &mut SerializedFileWriter<W>, votable: String) {
    for (key, value) in [(VERSION_KEY, VERSION.to_owned()), (CONTENT_KEY, votable)] {
        writer.append_key_value_metadata(KeyValue::new(key.to_owned(), value));
    }
}

/// The schema in Parquet's own notation.
fn schema<R>(table: &str, columns: &[Column<R>]) -> String {
    let mut text = format!("message {table} {{\n");
    for column in columns {
        let presence = if column.is_optional {
            "optional"
        } else {
            "required"
        };
        let (kind, logical) = match (&column.empty, column.name) {
            (FieldValue::Integer(_), "seed") => ("int64", " (INTEGER(64, false))"),
            (FieldValue::Integer(_), _) => ("int64", ""),
            (FieldValue::Number(_), _) => ("double", ""),
            (FieldValue::Bool(_), _) => ("boolean", ""),
            (FieldValue::Text(_), _) => ("binary", " (UTF8)"),
        };
        let _ = writeln!(text, "  {presence} {kind} {}{logical};", column.name);
    }
    text + "}\n"
}

/// Writes the fields of a column, and returns the characters of its longest text. It knows nothing of rows, so that
/// Parquet's writers are compiled once and not for each table.
fn write_column(
    writer: &mut ColumnWriter<'_>,
    name: &str,
    is_optional: bool,
    fields: Vec<FieldValue>,
) -> Result<usize> {
    // Definition levels: 1 for a value, 0 for an empty field.
    let level = |field: &FieldValue| i16::from(!field.is_empty());
    let levels: Option<Vec<i16>> = is_optional.then(|| fields.iter().map(level).collect());
    let levels = levels.as_deref();
    /// The values of a column of this kind.
    macro_rules! values {
        ($kind:ident) => {{
            let value = |field| match field {
                FieldValue::$kind(value) => value,
                _ => None,
            };
            fields.into_iter().filter_map(value)
        }};
    }
    match writer {
        ColumnWriter::Int64ColumnWriter(typed) => {
            typed.write_batch(&values!(Integer).collect::<Vec<_>>(), levels, None)?;
        }
        ColumnWriter::DoubleColumnWriter(typed) => {
            typed.write_batch(&values!(Number).collect::<Vec<_>>(), levels, None)?;
        }
        ColumnWriter::BoolColumnWriter(typed) => {
            typed.write_batch(&values!(Bool).collect::<Vec<_>>(), levels, None)?;
        }
        ColumnWriter::ByteArrayColumnWriter(typed) => {
            let texts: Vec<String> = values!(Text).collect();
            let longest = texts.iter().map(|text| text.chars().count()).max();
            let bytes = texts.into_iter().map(String::into_bytes);
            let values: Vec<ByteArray> = bytes.map(ByteArray::from).collect();
            typed.write_batch(&values, levels, None)?;
            return Ok(longest.unwrap_or(0));
        }
        _ => {
            let message = format!("column {name} has a type that is not supported");
            return Err(ParquetError::General(message));
        }
    }
    Ok(0)
}
