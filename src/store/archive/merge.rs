//! One file of each table, of all parts.

use super::parts::{Archive, PartState};
use super::read::{open, reader};
use super::votable::{CONTENT_KEY, widened};
use super::write::describe;
use crate::base::files;
use crate::store::error::StoreError;
use crate::store::plan::Part;
use parquet::column::writer::ColumnCloseResult;
use parquet::errors::Result;
use parquet::file::metadata::RowGroupMetaData;
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::file::writer::SerializedFileWriter;
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Writes `frames.parquet` and `stars.parquet` with the rows of all parts into the directory `out`.
/// Rows are in the order of the frames' names; they are copied as they are.
///
/// # Errors
/// [`StoreError::Unfinished`] if parts are missing or damaged, [`StoreError::File`],
/// [`StoreError::Table`].
pub fn merge(archive: &Archive, out: &Path) -> std::result::Result<[PathBuf; 2], StoreError> {
    let parts: Vec<_> = archive.plan().parts().collect();
    let is_missing = |part: &&Part<'_>| archive.state(part) != PartState::Whole;
    let missing = parts.iter().filter(is_missing).count();
    if missing > 0 {
        return Err(StoreError::Unfinished {
            directory: archive.directory().to_owned(),
            missing,
            parts: parts.len(),
        });
    }
    let targets = ["frames.parquet", "stars.parquet"].map(|name| out.join(name));
    let frames = parts.iter().map(|part| archive.frames_of(part));
    concatenate(&frames.collect::<Vec<_>>(), &targets[0])?;
    let stars = parts.iter().map(|part| archive.stars_of(part));
    concatenate(&stars.collect::<Vec<_>>(), &targets[1])?;
    Ok(targets)
}

fn concatenate(parts: &[PathBuf], target: &Path) -> std::result::Result<(), StoreError> {
    let failed = StoreError::table("writing", target);
    let mut writer = None;
    let mut votable: Option<String> = None;
    for path in parts {
        let source = open(path)?;
        let reader = reader(open(path)?).map_err(StoreError::table("reading", path))?;
        if let Some(of_part) = votable_of(&reader) {
            votable = Some(match votable {
                Some(before) => widened(&before, of_part),
                None => of_part.to_owned(),
            });
        }
        let writer = match &mut writer {
            Some(writer) => writer,
            none => {
                let file = files::beside(target).map_err(StoreError::file("writing", target))?;
                none.insert(begin(file, &reader).map_err(&failed)?)
            }
        };
        for group in reader.metadata().row_groups() {
            copy(&source, group, writer).map_err(&failed)?;
        }
    }
    let Some(mut writer) = writer else {
        return Ok(());
    };
    if let Some(votable) = votable {
        describe(&mut writer, votable);
    }
    let written = writer.into_inner().map_err(&failed)?;
    files::finish(written, target).map_err(StoreError::file("writing", target))
}

/// The VOTable in the metadata of a part.
fn votable_of(part: &SerializedFileReader<File>) -> Option<&str> {
    let metadata = part.metadata().file_metadata().key_value_metadata()?;
    let found = metadata.iter().find(|entry| entry.key == CONTENT_KEY);
    found?.value.as_deref()
}

/// A table with the columns of `part`.
fn begin<W: Write + Send>(
    target: W,
    part: &SerializedFileReader<File>,
) -> Result<SerializedFileWriter<W>> {
    let schema = part.metadata().file_metadata().schema_descr();
    let properties = Arc::new(WriterProperties::default());
    SerializedFileWriter::new(target, schema.root_schema_ptr(), properties)
}

/// Copies a group of rows as it is.
fn copy<W: Write + Send>(
    source: &File,
    group: &RowGroupMetaData,
    writer: &mut SerializedFileWriter<W>,
) -> Result<()> {
    let mut copied = writer.next_row_group()?;
    for column in group.columns() {
        let result = ColumnCloseResult {
            bytes_written: column.compressed_size().cast_unsigned(),
            rows_written: group.num_rows().cast_unsigned(),
            metadata: column.clone(),
            bloom_filter: None,
            column_index: None,
            offset_index: None,
        };
        copied.append_column(source, result)?;
    }
    copied.close()?;
    Ok(())
}
