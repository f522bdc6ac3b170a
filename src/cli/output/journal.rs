//! Rows of frames, written as they are made: a run that was stopped goes on with them.

use super::rows::json_line;
use anyhow::{Context, bail};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fs::{File, TryLockError};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

/// A row of a frame.
pub(crate) trait JournalRow: Serialize + DeserializeOwned {
    /// Name of the frame.
    fn name(&self) -> String;
}

/// The file of rows, locked as long as it is open.
pub(crate) struct Journal {
    path: PathBuf,
    file: File,
}

impl Journal {
    /// Opens the file of a run over `frames`, and returns it with the rows of the batches of `batch` frames
    /// that are complete in it. The rest is cut off. A file that another run writes is refused.
    pub(crate) fn open<Row: JournalRow>(
        path: &Path,
        frames: &[String],
        batch: usize,
    ) -> anyhow::Result<(Self, Vec<Row>)> {
        let open = File::options()
            .create(true)
            .read(true)
            .append(true)
            .open(path);
        let mut file = open.with_context(|| format!("writing {}", path.display()))?;
        // Where the file system has no locks, nothing is known of other runs.
        if let Err(TryLockError::WouldBlock) = file.try_lock() {
            bail!("{}: another run is writing it", path.display());
        }
        let mut text = Vec::new();
        let read = file.read_to_end(&mut text);
        read.with_context(|| format!("reading {}", path.display()))?;
        let lines = text.split_inclusive(|byte| *byte == b'\n');
        let lines: Vec<&[u8]> = lines.filter(|line| line.ends_with(b"\n")).collect();
        let whole = if lines.len() < frames.len() {
            lines.len() / batch * batch
        } else {
            lines.len()
        };
        let mut rows = Vec::with_capacity(whole);
        for (number, line) in lines[..whole].iter().enumerate() {
            let row: Row = serde_json::from_slice(line)
                .with_context(|| format!("reading {}, line {}", path.display(), number + 1))?;
            if frames.get(number) != Some(&row.name()) {
                bail!(
                    "{}, line {}: found frame {:?}, expected {:?}",
                    path.display(),
                    number + 1,
                    row.name(),
                    frames.get(number).map_or("no more", String::as_str)
                );
            }
            rows.push(row);
        }
        let bytes: usize = lines[..whole].iter().map(|line| line.len()).sum();
        let cut = file.set_len(bytes as u64);
        cut.with_context(|| format!("writing {}", path.display()))?;
        let path = path.to_owned();
        Ok((Self { path, file }, rows))
    }

    /// Adds the rows of a batch.
    pub(crate) fn add(&mut self, rows: &[impl JournalRow]) -> anyhow::Result<()> {
        let text: String = rows.iter().map(json_line).collect::<anyhow::Result<_>>()?;
        let written = self.file.write_all(text.as_bytes());
        let written = written.and_then(|()| self.file.sync_data());
        written.with_context(|| format!("writing {}", self.path.display()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use starpipe::night::NightRow;
    use std::fs;

    #[test]
    fn complete_batches_are_kept_and_the_rest_is_cut_off() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("night.jsonl");
        let names: Vec<String> = (0..7).map(|n| format!("{n}.fits")).collect();
        let rows: Vec<NightRow> = names.iter().map(|name| NightRow::unread(name)).collect();
        let (mut journal, none) = Journal::open::<NightRow>(&path, &names, 2).unwrap();
        assert!(none.is_empty());
        journal.add(&rows[..5]).unwrap();
        fs::write(
            &path,
            [&fs::read(&path).unwrap()[..], b"{\"frame\":"].concat(),
        )
        .unwrap();
        let second = Journal::open::<NightRow>(&path, &names, 2).err().unwrap();
        assert!(second.to_string().contains("another run"), "{second}");
        drop(journal);
        let (mut journal, kept) = Journal::open::<NightRow>(&path, &names, 2).unwrap();
        assert_eq!(kept, rows[..4]);
        journal.add(&rows[4..]).unwrap();
        drop(journal);
        let (_, all) = Journal::open::<NightRow>(&path, &names, 2).unwrap();
        assert_eq!(all, rows);
        assert!(Journal::open::<NightRow>(&path, &names[1..], 2).is_err());
    }
}
