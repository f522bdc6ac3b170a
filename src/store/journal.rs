//! Rows of frames, written as they are made: a run that was stopped goes on with them.
//!
//! Each row has a checksum. A row that was changed since is not taken, and its frame is done again.

use super::claim::lock;
use super::error::StoreError;
use crate::base::files;
use crate::base::format::{counted, json_escaped, ranges};
use crate::base::sealed::{is_intact, sealed};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::collections::HashMap;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// The file of rows, locked as long as it is open.
pub struct Journal<Row> {
    path: PathBuf,
    file: File,
    /// What this file was written anew for: its lock keeps other runs away that have opened it.
    replaced: Option<File>,
    rows: RowsOf<Row>,
    is_in_order: bool,
    left_out: Vec<String>,
}

/// Which rows are those of a run.
struct RowsOf<Row> {
    /// All that they depend on.
    owner: String,
    /// Names of the frames.
    frames: Vec<String>,
    /// Name of a row's frame.
    name: fn(&Row) -> String,
}

impl<Row: Serialize + DeserializeOwned> Journal<Row> {
    /// Opens the file of the run `owner` over `frames`, and returns it with the rows that are in it, in the order
    /// of the frames; `name` is the frame of a row. What is no such row is left out. A file that another run writes is
    /// refused.
    ///
    /// # Errors
    /// [`StoreError::Locked`], [`StoreError::File`].
    pub fn open(
        path: &Path,
        owner: &str,
        frames: &[String],
        name: fn(&Row) -> String,
    ) -> Result<(Self, Vec<Option<Row>>), StoreError> {
        let mut options = File::options();
        let open = options.create(true).read(true).append(true).open(path);
        let file = open.map_err(StoreError::file("writing", path))?;
        lock(&file, path)?;
        let mut journal = Self {
            path: path.to_owned(),
            file,
            replaced: None,
            rows: RowsOf {
                owner: owner.to_owned(),
                frames: frames.to_vec(),
                name,
            },
            is_in_order: true,
            left_out: Vec::new(),
        };
        let text = journal.text()?;
        let found = journal.rows.lines(&text);
        journal.left_out = found.left_out(path);
        let kept = found.kept_text();
        if kept != text {
            journal.rewrite(&kept)?;
        }
        journal.is_in_order = found.are_first();
        Ok((journal, found.rows))
    }

    /// What the file had that is no row of the run, in words.
    pub fn left_out(&self) -> &[String] {
        &self.left_out
    }

    /// Adds rows.
    ///
    /// # Errors
    /// [`StoreError::Json`], [`StoreError::File`].
    pub fn add<'r>(&mut self, rows: impl IntoIterator<Item = &'r Row>) -> Result<(), StoreError>
    where
        Row: 'r,
    {
        let line = |row| {
            let text = json_escaped(serde_json::to_string(row)?);
            Ok(sealed(&text, &self.rows.owner) + "\n")
        };
        let lines: Result<String, StoreError> = rows.into_iter().map(line).collect();
        let text = lines?;
        if text.is_empty() {
            return Ok(());
        }
        let written = self.file.write_all(text.as_bytes());
        let written = written.and_then(|()| self.file.sync_data());
        written.map_err(StoreError::file("writing", &self.path))
    }

    /// Puts the rows in the order of the frames, where they are not.
    ///
    /// # Errors
    /// [`StoreError::File`].
    pub fn finish(mut self) -> Result<(), StoreError> {
        if self.is_in_order {
            return Ok(());
        }
        let text = self.text()?;
        let kept = self.rows.lines(&text).kept_text();
        self.rewrite(&kept)
    }

    fn text(&mut self) -> Result<Vec<u8>, StoreError> {
        let mut text = Vec::new();
        let read = self.file.seek(SeekFrom::Start(0));
        let read = read.and_then(|_| self.file.read_to_end(&mut text));
        read.map_err(StoreError::file("reading", &self.path))?;
        Ok(text)
    }

    /// Writes the file anew: it has this text, or the old one.
    fn rewrite(&mut self, text: &[u8]) -> Result<(), StoreError> {
        let write = || {
            let mut file = files::beside(&self.path)?;
            file.write_all(text)?;
            file.as_file().sync_all()?;
            file.persist(&self.path).map_err(|refused| refused.error)
        };
        let written = write().map_err(StoreError::file("writing", &self.path))?;
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

impl<Row: DeserializeOwned> RowsOf<Row> {
    fn lines<'t>(&self, text: &'t [u8]) -> Lines<'t, Row> {
        let names = self.frames.iter().enumerate();
        let places: HashMap<&str, usize> = names.map(|(at, name)| (name.as_str(), at)).collect();
        let mut found = Lines {
            kept: vec![None; self.frames.len()],
            rows: self.frames.iter().map(|_| None).collect(),
            damaged: Vec::new(),
            surplus: Vec::new(),
        };
        for (number, line) in (1..).zip(text.split(|byte| *byte == b'\n')) {
            let line = line.trim_ascii();
            if line.is_empty() {
                continue;
            }
            let Some(row) = row_of::<Row>(line, &self.owner) else {
                found.damaged.push(number);
                continue;
            };
            match places.get((self.name)(&row).as_str()) {
                Some(&at) if found.rows[at].is_none() => {
                    found.kept[at] = Some(line);
                    found.rows[at] = Some(row);
                }
                _ => found.surplus.push(number),
            }
        }
        found
    }
}

impl<Row> Lines<'_, Row> {
    /// What is left out, in words.
    fn left_out(&self, path: &Path) -> Vec<String> {
        let parts = [
            (&self.damaged, "damaged; their frames are processed again"),
            (&self.surplus, "for other frames or repeated, ignored"),
        ];
        let parts = parts.into_iter().filter(|(lines, _)| !lines.is_empty());
        let text = |(lines, what): (&Vec<usize>, _)| {
            let (path, count) = (path.display(), counted(lines.len(), "line"));
            format!("{path}: {count} {what}: {}", ranges(lines))
        };
        parts.map(text).collect()
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
pub fn has_row_of(text: &[u8], owner: &str) -> bool {
    let mut lines = text.split(|byte| *byte == b'\n').map(<[u8]>::trim_ascii);
    lines.any(|line| std::str::from_utf8(line).is_ok_and(|line| is_intact(line, owner)))
}

/// The row in a line, if it is what was written.
fn row_of<Row: DeserializeOwned>(line: &[u8], owner: &str) -> Option<Row> {
    let line = std::str::from_utf8(line).ok()?;
    if !is_intact(line, owner) {
        return None;
    }
    serde_json::from_str(line).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::night::NightRow;
    use std::fs;

    const OWNER: &str = "a run";

    type Opened = (Journal<NightRow>, Vec<Option<NightRow>>);

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
            journal.finish().unwrap();
            night.whole = fs::read(night.path()).unwrap();
            night
        }

        fn path(&self) -> PathBuf {
            self.directory.path().join("night.jsonl")
        }

        fn open(&self) -> Opened {
            self.try_open(OWNER, &self.names).unwrap()
        }

        fn try_open(&self, owner: &str, names: &[String]) -> Result<Opened, StoreError> {
            Journal::open(&self.path(), owner, names, |row| row.frame.clone())
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
            journal.finish().unwrap();
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
        let other = night.try_open("another", &night.names);
        assert!(other.unwrap().1.iter().all(Option::is_none));
        let text = String::from_utf8(night.lines().concat()).unwrap();
        let renamed = text.replace("é2.fits", "é3.fits");
        night.repair(renamed.as_bytes(), &[2]);
        let changed = text.replacen("\"trails\":null", "\"trails\":1e300", 2);
        night.repair(changed.as_bytes(), &[0, 1]);
        fs::write(night.path(), &night.whole).unwrap();
        let fewer = night.try_open(OWNER, &night.names[1..]);
        assert_eq!(fewer.unwrap().1.iter().flatten().count(), 6);
    }

    #[test]
    fn a_file_that_another_run_writes_is_refused() {
        let night = Night::new();
        let held = night.open();
        let second = night.try_open(OWNER, &night.names);
        let second = second.err().unwrap().to_string();
        assert!(second.contains("another run"), "{second}");
        drop(held);
        night.open();
    }
}
