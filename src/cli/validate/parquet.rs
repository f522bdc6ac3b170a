//! The tables as Parquet: for each table a directory of parts, each of a part of the frames.

use crate::cli::output::files::remove_outdated;
use anyhow::Context;
use starpipe::base::files::{beside, finish, make_directory};
use starpipe::base::table::TableRow;
use starpipe::lab::validation::{FrameRecord, RunTables, StarRecord};
use starpipe::store::{StoreError, TableWriter};
use std::path::{Path, PathBuf};

/// Removes the part that does not have all its frames yet, and any after it.
pub(super) fn remove_unfinished(directory: &Path, tables: &RunTables) -> anyhow::Result<()> {
    let first = tables.whole_parts();
    remove_parts::<FrameRecord>(directory, first)?;
    remove_parts::<StarRecord>(directory, first)
}

/// Writes all parts that are missing, the last one with the frames that there are.
pub(super) fn write_parts(directory: &Path, tables: &RunTables) -> anyhow::Result<()> {
    for part in 0..tables.parts() {
        let (frames, stars) = tables.part(part)?;
        write_part(directory, part, frames)?;
        write_part(directory, part, stars)?;
    }
    Ok(())
}

fn part_path<R: TableRow>(directory: &Path, part: u64) -> PathBuf {
    let parts = directory.join(format!("{}.parquet", R::TABLE));
    parts.join(format!("part-{part:05}.parquet"))
}

/// Writes a part unless it is there. It takes its name when it is complete.
fn write_part<R: TableRow>(
    directory: &Path,
    part: u64,
    rows: impl Iterator<Item = Result<R, StoreError>>,
) -> anyhow::Result<()> {
    let path = part_path::<R>(directory, part);
    if path.exists() {
        return Ok(());
    }
    let write = || -> anyhow::Result<()> {
        path.parent().map_or(Ok(()), make_directory)?;
        let mut table = TableWriter::new(beside(&path)?)?;
        for row in rows {
            table.add(row?)?;
        }
        Ok(finish(table.finish()?, &path)?)
    };
    write().with_context(|| format!("writing {}", path.display()))
}

/// Removes the parts from this number on.
fn remove_parts<R: TableRow>(directory: &Path, from: u64) -> anyhow::Result<()> {
    for part in from.. {
        let path = part_path::<R>(directory, part);
        if !remove_outdated(&path)? {
            break;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::RowAccessor;
    use std::fs::File;

    /// A frame of which only what is required is known.
    fn frame_row(frame: u64) -> FrameRecord {
        let json = serde_json::json!({
            "frame": frame, "seed": u64::MAX - frame, "ra_deg": 12.5, "dec_deg": -3.25, "up_pa_deg": 170.0,
            "status": "right", "stars_above_limit": 40, "detected": 41, "rejected": 0, "named": 39, "misnamed": 0,
            "misnamed_companions": 0, "false_detections": 1, "blends": 0, "star_rows": 1,
            "predicted_limit_vmag": 7.0, "true_background_adu": 100.0, "true_noise_adu": 5.0, "split": 0,
        });
        serde_json::from_value(json).unwrap()
    }

    /// A false detection.
    fn star_row(frame: u64) -> StarRecord {
        let json =
            serde_json::json!({"frame": frame, "kind": "false", "detected": false, "named": "no"});
        serde_json::from_value(json).unwrap()
    }

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
