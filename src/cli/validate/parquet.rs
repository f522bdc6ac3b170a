//! The tables as Parquet: a directory of parts, each of so many frames, written whole.

use super::columns::{Cell, Column, Row};
use anyhow::Context;
use parquet::basic::Compression;
use parquet::column::writer::ColumnWriter;
use parquet::data_type::ByteArray;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;
use std::fmt::Write as _;
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Frames in a part.
pub(super) const FRAMES_PER_PART: u64 = 1000;
/// Rows that are kept in memory at once.
const ROWS_PER_GROUP: usize = 1 << 16;

/// Where the parts of the table of `R` are.
pub(super) fn parts_directory<R: Row>(directory: &Path) -> PathBuf {
    directory.join(format!("{}.parquet", R::TABLE))
}

/// Where the part with this number is.
pub(super) fn part_path<R: Row>(directory: &Path, part: u64) -> PathBuf {
    parts_directory::<R>(directory).join(format!("part-{part:05}.parquet"))
}

/// Writes a part whole: beside its place, which it takes when it is done.
pub(super) fn write_part<R: Row>(
    directory: &Path,
    part: u64,
    rows: impl Iterator<Item = anyhow::Result<R>>,
) -> anyhow::Result<()> {
    let parts = parts_directory::<R>(directory);
    std::fs::create_dir_all(&parts)
        .with_context(|| format!("making the directory {}", parts.display()))?;
    let path = part_path::<R>(directory, part);
    // Always of the same name: what a run that was killed leaves is written over.
    let beside = path.with_extension("tmp");
    let write = || -> anyhow::Result<()> {
        let file = File::create(&beside)?;
        write_table(file, rows)?;
        Ok(std::fs::rename(&beside, &path)?)
    };
    write().with_context(|| format!("writing {}", path.display()))
}

/// Takes away the parts from this number on, which are out of date.
pub(super) fn remove_parts<R: Row>(directory: &Path, from: u64) -> anyhow::Result<()> {
    let mut part = from;
    loop {
        let path = part_path::<R>(directory, part);
        match std::fs::remove_file(&path) {
            Ok(()) => part += 1,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(()),
            Err(error) => {
                return Err(error)
                    .with_context(|| format!("removing {}, which is out of date", path.display()));
            }
        }
    }
}

fn write_table<R: Row, W: Write + Send>(
    target: W,
    rows: impl Iterator<Item = anyhow::Result<R>>,
) -> anyhow::Result<()> {
    let columns = R::columns();
    let schema = Arc::new(parse_message_type(&schema(&columns))?);
    let properties = WriterProperties::builder()
        .set_compression(Compression::SNAPPY)
        .build();
    let mut writer = SerializedFileWriter::new(target, schema, Arc::new(properties))?;
    let mut rows = rows.peekable();
    while rows.peek().is_some() {
        let group: Vec<R> = rows
            .by_ref()
            .take(ROWS_PER_GROUP)
            .collect::<Result<_, _>>()?;
        let mut group_writer = writer.next_row_group()?;
        for column in &columns {
            let mut column_writer = group_writer
                .next_column()?
                .context("a column of the schema has no writer")?;
            write_column(column_writer.untyped(), column, &group)?;
            column_writer.close()?;
        }
        group_writer.close()?;
    }
    writer.close()?;
    Ok(())
}

/// The schema in Parquet's own notation.
fn schema<R: Row>(columns: &[Column<R>]) -> String {
    let mut text = format!("message {} {{\n", R::TABLE);
    for column in columns {
        let presence = if column.is_optional {
            "optional"
        } else {
            "required"
        };
        let (kind, means) = match (&column.empty, column.name) {
            (Cell::Whole(_), "seed") => ("int64", " (INTEGER(64, false))"),
            (Cell::Whole(_), _) => ("int64", ""),
            (Cell::Number(_), _) => ("double", ""),
            (Cell::Yes(_), _) => ("boolean", ""),
            (Cell::Text(_), _) => ("binary", " (UTF8)"),
        };
        let _ = writeln!(text, "  {presence} {kind} {}{means};", column.name);
    }
    text + "}\n"
}

fn write_column<R>(
    writer: &mut ColumnWriter<'_>,
    column: &Column<R>,
    rows: &[R],
) -> anyhow::Result<()> {
    let cells = || rows.iter().map(column.of);
    let is_there = |cell: Cell| i16::from(!is_empty(&cell));
    // Which of the values are there, of a column in which some are not.
    let levels: Option<Vec<i16>> = column.is_optional.then(|| cells().map(is_there).collect());
    let levels = levels.as_deref();
    match writer {
        ColumnWriter::Int64ColumnWriter(typed) => {
            let values: Vec<i64> = cells().filter_map(whole).collect();
            typed.write_batch(&values, levels, None)?;
        }
        ColumnWriter::DoubleColumnWriter(typed) => {
            let values: Vec<f64> = cells().filter_map(number).collect();
            typed.write_batch(&values, levels, None)?;
        }
        ColumnWriter::BoolColumnWriter(typed) => {
            let values: Vec<bool> = cells().filter_map(yes).collect();
            typed.write_batch(&values, levels, None)?;
        }
        ColumnWriter::ByteArrayColumnWriter(typed) => {
            let values: Vec<ByteArray> = cells().filter_map(text).collect();
            typed.write_batch(&values, levels, None)?;
        }
        _ => anyhow::bail!("column {} is of no kind that is written", column.name),
    }
    Ok(())
}

fn is_empty(cell: &Cell) -> bool {
    matches!(
        cell,
        Cell::Whole(None) | Cell::Number(None) | Cell::Yes(None) | Cell::Text(None)
    )
}

fn whole(cell: Cell) -> Option<i64> {
    match cell {
        Cell::Whole(value) => value,
        _ => None,
    }
}

fn number(cell: Cell) -> Option<f64> {
    match cell {
        Cell::Number(value) => value,
        _ => None,
    }
}

fn yes(cell: Cell) -> Option<bool> {
    match cell {
        Cell::Yes(value) => value,
        _ => None,
    }
}

fn text(cell: Cell) -> Option<ByteArray> {
    match cell {
        Cell::Text(value) => value.map(|text| text.into_bytes().into()),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::super::columns::tests::{frame_row, star_row};
    use super::*;
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::RowAccessor;
    use starpipe::study::validation::{FrameRecord, StarRecord};

    #[test]
    fn what_is_written_is_read_again_and_nothing_is_left_beside_it() {
        let directory = tempfile::tempdir().unwrap();
        let frames = (0..3).map(|frame| Ok(frame_row(frame)));
        write_part(directory.path(), 7, frames).unwrap();
        write_part(directory.path(), 0, (0..2).map(|frame| Ok(star_row(frame)))).unwrap();
        let path = part_path::<FrameRecord>(directory.path(), 7);
        assert_eq!(
            std::fs::read_dir(path.parent().unwrap()).unwrap().count(),
            1
        );
        let reader = SerializedFileReader::new(File::open(path).unwrap()).unwrap();
        let rows: Vec<_> = reader
            .get_row_iter(None)
            .unwrap()
            .map(Result::unwrap)
            .collect();
        assert_eq!(rows.len(), 3);
        assert_eq!(rows[2].get_long(0).unwrap(), 2);
        assert_eq!(rows[2].get_ulong(1).unwrap(), u64::MAX - 2);
        assert_eq!(rows[2].get_double(2).unwrap(), 12.5);
        assert_eq!(rows[2].get_string(5).unwrap(), "right");
        let path = part_path::<StarRecord>(directory.path(), 0);
        let reader = SerializedFileReader::new(File::open(path).unwrap()).unwrap();
        assert_eq!(reader.metadata().file_metadata().num_rows(), 2);
        remove_parts::<StarRecord>(directory.path(), 0).unwrap();
        assert!(!part_path::<StarRecord>(directory.path(), 0).exists());
    }
}
