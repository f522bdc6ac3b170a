//! Rows of frames, written as they are made: a run that was stopped goes on with them.
//!
//! Each row has a checksum. A row that was changed since is not taken, and its frame is done again.

use super::messages::report_warning;
use super::rows::json_line;
use anyhow::{Context, bail};
use serde::Serialize;
use serde::de::DeserializeOwned;
use starpipe::base::files;
use starpipe::base::format::{counted, ranges};
use starpipe::base::sealed::{is_intact, sealed};
use std::collections::HashMap;
use std::fs::{File, TryLockError};
use std::io::{self, Read, Seek, SeekFrom, Write};
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
    /// What this file was written anew for: its lock keeps other runs away that have opened it.
    replaced: Option<File>,
    /// Whose rows they are: all that they depend on.
    owner: String,
    frames: Vec<String>,
    is_in_order: bool,
}

impl Journal {
    /// Opens the file of the run `owner` over `frames`, and returns it with the rows that are in it, in the order
    /// of the frames. What is no such row is told and left out. A file that another run writes is refused.
    pub(crate) fn open<Row: JournalRow>(
        path: &Path,
        owner: &str,
        frames: &[String],
    ) -> anyhow::Result<(Self, Vec<Option<Row>>)> {
        let open = File::options()
            .create(true)
            .read(true)
            .append(true)
            .open(path);
        let file = open.with_context(|| format!("writing {}", path.display()))?;
        // Where the file system has no locks, nothing is known of other runs.
        if let Err(TryLockError::WouldBlock) = file.try_lock() {
            bail!("{}: another run is writing it", path.display());
        }
        let mut journal = Self {
            path: path.to_owned(),
            file,
            replaced: None,
            owner: owner.to_owned(),
            frames: frames.to_vec(),
            is_in_order: true,
        };
        let text = journal.text()?;
        let found = Lines::<Row>::parse(&text, owner, frames);
        found.tell(path);
        let kept = found.kept_text();
        if kept != text {
            journal.rewrite(&kept)?;
        }
        journal.is_in_order = found.are_first();
        Ok((journal, found.rows))
    }

    /// Adds rows.
    pub(crate) fn add<'r, Row: JournalRow + 'r>(
        &mut self,
        rows: impl IntoIterator<Item = &'r Row>,
    ) -> anyhow::Result<()> {
        let line = |row| Ok(sealed(&json_line(row)?, &self.owner) + "\n");
        let text: String = rows.into_iter().map(line).collect::<anyhow::Result<_>>()?;
        if text.is_empty() {
            return Ok(());
        }
        let written = self.file.write_all(text.as_bytes());
        let written = written.and_then(|()| self.file.sync_data());
        written.with_context(|| format!("writing {}", self.path.display()))
    }

    /// Puts the rows in the order of the frames, where they are not.
    pub(crate) fn finish<Row: JournalRow>(mut self) -> anyhow::Result<()> {
        if self.is_in_order {
            return Ok(());
        }
        let text = self.text()?;
        let kept = Lines::<Row>::parse(&text, &self.owner, &self.frames).kept_text();
        self.rewrite(&kept)
    }

    fn text(&mut self) -> anyhow::Result<Vec<u8>> {
        let mut text = Vec::new();
        let read = self.file.seek(SeekFrom::Start(0));
        let read = read.and_then(|_| self.file.read_to_end(&mut text));
        read.with_context(|| format!("reading {}", self.path.display()))?;
        Ok(text)
    }

    /// Writes the file anew: it has this text, or the old one.
    fn rewrite(&mut self, text: &[u8]) -> anyhow::Result<()> {
        let write = || {
            let mut file = files::beside(&self.path)?;
            file.write_all(text)?;
            file.as_file().sync_all()?;
            file.persist(&self.path).map_err(|refused| refused.error)
        };
        let written: io::Result<File> = write();
        let written = written.with_context(|| format!("writing {}", self.path.display()))?;
        let before = std::mem::replace(&mut self.file, written);
        self.replaced.get_or_insert(before);
        Ok(())
    }
}

/// The lines of a file: which are rows of the run, and which are none.
struct Lines<'t, Row> {
    /// The lines of the rows, in the order of the frames.
    kept: Vec<Option<&'t [u8]>>,
    rows: Vec<Option<Row>>,
    /// Numbers of lines that are not what was written, from 1,
    damaged: Vec<usize>,
    /// and of those whose frame is not of the run or has a row already.
    surplus: Vec<usize>,
}

impl<'t, Row: JournalRow> Lines<'t, Row> {
    fn parse(text: &'t [u8], owner: &str, frames: &[String]) -> Self {
        let places: HashMap<&str, usize> = frames
            .iter()
            .enumerate()
            .map(|(at, name)| (name.as_str(), at))
            .collect();
        let mut found = Self {
            kept: vec![None; frames.len()],
            rows: frames.iter().map(|_| None).collect(),
            damaged: Vec::new(),
            surplus: Vec::new(),
        };
        for (number, line) in (1..).zip(text.split(|byte| *byte == b'\n')) {
            let line = line.trim_ascii();
            if line.is_empty() {
                continue;
            }
            let Some(row) = row_of::<Row>(line, owner) else {
                found.damaged.push(number);
                continue;
            };
            match places.get(row.name().as_str()) {
                Some(&at) if found.rows[at].is_none() => {
                    found.kept[at] = Some(line);
                    found.rows[at] = Some(row);
                }
                _ => found.surplus.push(number),
            }
        }
        found
    }

    /// Says what is left out.
    fn tell(&self, path: &Path) {
        let warn = |lines: &[usize], what: &str| {
            if !lines.is_empty() {
                let (path, count) = (path.display(), counted(lines.len(), "line"));
                report_warning(format_args!("{path}: {count} {what}: {}", ranges(lines)));
            }
        };
        warn(&self.damaged, "damaged, whose frames are done again");
        warn(&self.surplus, "of other frames, or repeated, left out");
    }

    /// The rows as they are written.
    fn kept_text(&self) -> Vec<u8> {
        let lines = self.kept.iter().flatten();
        lines
            .flat_map(|line| [line, &b"\n"[..]])
            .flatten()
            .copied()
            .collect()
    }

    /// Whether the rows are those of the first frames.
    fn are_first(&self) -> bool {
        self.rows.is_sorted_by_key(Option::is_none)
    }
}

/// Whether a row of the run `owner` is in a file of this text.
pub(crate) fn has_row_of(text: &[u8], owner: &str) -> bool {
    let mut lines = text.split(|byte| *byte == b'\n').map(<[u8]>::trim_ascii);
    lines.any(|line| std::str::from_utf8(line).is_ok_and(|line| is_intact(line, owner)))
}

/// The row in a line, if it is what was written.
fn row_of<Row: JournalRow>(line: &[u8], owner: &str) -> Option<Row> {
    let line = std::str::from_utf8(line).ok()?;
    if !is_intact(line, owner) {
        return None;
    }
    serde_json::from_str(line).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use starpipe::night::NightRow;
    use std::fs;

    const OWNER: &str = "a run";

    struct Night {
        directory: tempfile::TempDir,
        names: Vec<String>,
        rows: Vec<NightRow>,
        whole: Vec<u8>,
    }

    impl Night {
        /// With all rows in its file.
        fn new() -> Self {
            let names: Vec<String> = (0..7).map(|n| format!("é{n}.fits")).collect();
            let mut night = Self {
                directory: tempfile::tempdir().unwrap(),
                rows: names.iter().map(|name| NightRow::unread(name)).collect(),
                names,
                whole: Vec::new(),
            };
            let (mut journal, none) = night.open();
            assert!(none.iter().all(Option::is_none));
            journal.add(&night.rows).unwrap();
            journal.finish::<NightRow>().unwrap();
            night.whole = fs::read(night.path()).unwrap();
            night
        }

        fn path(&self) -> PathBuf {
            self.directory.path().join("night.jsonl")
        }

        fn open(&self) -> (Journal, Vec<Option<NightRow>>) {
            Journal::open(&self.path(), OWNER, &self.names).unwrap()
        }

        /// Goes on with a file of this text, of which the frames `lost` are done again.
        fn repair(&self, text: &[u8], lost: &[usize]) {
            fs::write(self.path(), text).unwrap();
            let (mut journal, kept) = self.open();
            let found = (0..kept.len()).filter(|at| kept[*at].is_none());
            assert_eq!(found.collect::<Vec<_>>(), lost, "{}", text.escape_ascii());
            for (row, kept) in self.rows.iter().zip(&kept) {
                assert!(kept.as_ref().is_none_or(|kept| kept == row));
            }
            // A run that is stopped again loses nothing.
            let mut left = lost.iter();
            journal.add(left.next().map(|at| &self.rows[*at])).unwrap();
            drop(journal);
            let (mut journal, kept) = self.open();
            assert_eq!(kept.iter().flatten().count(), 7 - left.len());
            journal.add(left.map(|at| &self.rows[*at])).unwrap();
            journal.finish::<NightRow>().unwrap();
            assert!(fs::read(self.path()).unwrap() == self.whole);
        }

        fn lines(&self) -> Vec<Vec<u8>> {
            let lines = self.whole.split_inclusive(|byte| *byte == b'\n');
            lines.map(<[u8]>::to_vec).collect()
        }
    }

    #[test]
    fn a_changed_byte_costs_its_own_frame_and_no_other() {
        let night = Night::new();
        let starts: Vec<usize> = (0..7)
            .map(|at| night.lines()[..at].iter().map(Vec::len).sum())
            .collect();
        for at in (0..night.whole.len() - 1)
            .step_by(97)
            .chain([starts[3] - 1])
        {
            let line = starts.iter().filter(|start| **start <= at).count() - 1;
            for change in [1, 0x80, 0xff] {
                let mut text = night.whole.clone();
                text[at] ^= change;
                let is_joined = night.whole[at] == b'\n';
                let expected = if is_joined {
                    vec![line, line + 1]
                } else {
                    vec![line]
                };
                night.repair(&text, &expected);
            }
        }
    }

    #[test]
    fn whatever_became_of_the_lines_what_is_whole_is_kept() {
        let night = Night::new();
        let lines = night.lines();
        let all = || lines.concat();
        let mut cut = all();
        cut.truncate(night.whole.len() - 30);
        night.repair(&cut, &[6]);
        night.repair(&all()[..night.whole.len() - 1], &[]);
        night.repair(&lines[..4].concat(), &[4, 5, 6]);
        let reversed: Vec<u8> = lines.iter().rev().flatten().copied().collect();
        night.repair(&reversed, &[]);
        night.repair(&[all(), all()].concat(), &[]);
        let text = String::from_utf8(all()).unwrap();
        night.repair(text.replace('\n', "\r\n\r\n").as_bytes(), &[]);
        let gap = [&lines[..2].concat()[..], &[0; 4096], &lines[3..].concat()].concat();
        night.repair(&gap, &[2, 3]);
        for garbage in [&b""[..], b"\0\0\0", b"[1]\n{}\nnull\n", b"\xff\xfe\n"] {
            night.repair(garbage, &[0, 1, 2, 3, 4, 5, 6]);
        }
    }

    #[test]
    fn rows_of_another_run_or_of_other_values_are_not_taken() {
        let night = Night::new();
        let other = Journal::open::<NightRow>(&night.path(), "another", &night.names);
        assert!(other.unwrap().1.iter().all(Option::is_none));
        let text = String::from_utf8(night.lines().concat()).unwrap();
        let renamed = text.replace("é2.fits", "é3.fits");
        night.repair(renamed.as_bytes(), &[2]);
        let changed = text.replacen("\"trails\":null", "\"trails\":1e300", 2);
        night.repair(changed.as_bytes(), &[0, 1]);
        fs::write(night.path(), &night.whole).unwrap();
        let fewer = Journal::open::<NightRow>(&night.path(), OWNER, &night.names[1..]);
        assert_eq!(fewer.unwrap().1.iter().flatten().count(), 6);
    }

    #[test]
    fn a_file_that_another_run_writes_is_refused() {
        let night = Night::new();
        let held = night.open();
        let second = Journal::open::<NightRow>(&night.path(), OWNER, &night.names);
        let second = second.err().unwrap().to_string();
        assert!(second.contains("another run"), "{second}");
        drop(held);
        night.open();
    }
}
