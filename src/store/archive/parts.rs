//! The directory of an archive, and its parts.

use super::frame_row::FrameRow;
use super::read::is_readable;
use super::write::TableWriter;
use crate::base::files;
use crate::report::StarRow;
use crate::store::claim::{RunFiles, claim, make_directory};
use crate::store::configuration::{Configuration, FileHash};
use crate::store::error::StoreError;
use crate::store::identity::Identity;
use crate::store::plan::{Part, Plan};
use parquet::errors::Result as ParquetResult;
use std::fs;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

const FILES: RunFiles = RunFiles {
    identity: "archive.json",
    results: &[FRAMES, STARS],
};
/// The names of all frames, one a line.
const INPUTS: &str = "inputs.txt";
/// Directories of the parts of each table.
const FRAMES: &str = "frames.parquet";
const STARS: &str = "stars.parquet";
/// Directory of the checksums of each part's tables.
const CHECKSUMS: &str = "checksums";

/// The directory of an archive.
#[derive(Debug)]
pub struct Archive {
    directory: PathBuf,
    plan: Plan,
    identity: Identity,
    mended: Vec<PathBuf>,
}

/// Whether a part is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PartState {
    /// It is not.
    Missing,
    /// It is, and was changed since.
    Damaged,
    /// It is as it was written.
    Whole,
}

impl Archive {
    /// Takes `directory` for these frames and this configuration, or goes on in it.
    ///
    /// # Errors
    /// As [`claim()`].
    pub fn claim(
        directory: &Path,
        plan: Plan,
        configuration: &Configuration,
    ) -> Result<Self, StoreError> {
        let mut archive = Self {
            directory: directory.to_owned(),
            identity: Identity::new(&plan, configuration)?,
            plan,
            mended: Vec::new(),
        };
        let mended = claim(directory, FILES, &archive.identity, || archive.is_own())?;
        archive.mended.extend(mended);
        for part_of in [FRAMES, STARS, CHECKSUMS] {
            make_directory(&directory.join(part_of))?;
        }
        archive.write_inputs()?;
        Ok(archive)
    }

    /// Whether the parts that are there are of this run, by their names.
    fn is_own(&self) -> bool {
        let files = fs::read_dir(self.directory.join(FRAMES));
        let mut names = files.into_iter().flatten().flatten();
        let has_others = names.any(|file| file.file_name().to_string_lossy().starts_with("part-"));
        let own = || self.plan.parts().any(|part| self.frames_of(&part).exists());
        !has_others || own()
    }

    /// Files that say whose the directory is and that were damaged: they were written anew.
    pub fn mended(&self) -> &[PathBuf] {
        &self.mended
    }

    /// The archive in `directory`.
    ///
    /// # Errors
    /// [`StoreError::NoArchive`], [`StoreError::Damaged`], [`StoreError::File`].
    pub fn open(directory: &Path) -> Result<Self, StoreError> {
        let (path, inputs) = (directory.join(FILES.identity), directory.join(INPUTS));
        let text = match fs::read(&path) {
            Err(error) if error.kind() == ErrorKind::NotFound => {
                return Err(StoreError::NoArchive(directory.to_owned()));
            }
            read => read.map_err(StoreError::file("reading", &path))?,
        };
        let identity = std::str::from_utf8(&text).ok().and_then(Identity::read);
        let identity = identity.ok_or(StoreError::Damaged(path))?;
        let names = fs::read(&inputs).map_err(StoreError::file("reading", &inputs))?;
        let names = String::from_utf8(names).ok();
        let names = names.map(|names| names.lines().map(str::to_owned).collect());
        let plan = names.and_then(|names| identity.plan(names));
        Ok(Self {
            directory: directory.to_owned(),
            plan: plan.ok_or(StoreError::Damaged(inputs))?,
            identity,
            mended: Vec::new(),
        })
    }

    /// The directory.
    pub fn directory(&self) -> &Path {
        &self.directory
    }

    /// What its tables depend on.
    pub fn identity(&self) -> &Identity {
        &self.identity
    }

    /// Its frames and parts.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// The file of a part of the table of frames.
    pub fn frames_of(&self, part: &Part<'_>) -> PathBuf {
        self.file_of(FRAMES, part)
    }

    /// The file of a part of the table of stars.
    pub fn stars_of(&self, part: &Part<'_>) -> PathBuf {
        self.file_of(STARS, part)
    }

    fn checksums_of(&self, part: &Part<'_>) -> PathBuf {
        self.file_of(CHECKSUMS, part).with_extension("txt")
    }

    fn file_of(&self, kind: &str, part: &Part<'_>) -> PathBuf {
        let name = part.file_name(self.identity.text());
        self.directory.join(kind).join(name)
    }

    /// Whether a part is written, and both of its tables are as they were.
    pub fn state(&self, part: &Part<'_>) -> PartState {
        self.state_of(part, &[FRAMES, STARS])
    }

    fn state_of(&self, part: &Part<'_>, tables: &[&str]) -> PartState {
        // The table of frames is written last.
        if !self.frames_of(part).exists() {
            return PartState::Missing;
        }
        let checksums = fs::read_to_string(self.checksums_of(part));
        let is_whole = |table: &&str| {
            let path = self.file_of(table, part);
            match &checksums {
                Ok(known) => FileHash::of_file(&path)
                    .is_ok_and(|hash| known.contains(&checksum_line(table, hash))),
                // Another program may have written it.
                Err(_) => is_readable(&path),
            }
        };
        if tables.iter().all(is_whole) {
            PartState::Whole
        } else {
            PartState::Damaged
        }
    }

    /// The files of the table of frames that are in this state.
    pub fn tables_of_frames(&self, state: PartState) -> impl Iterator<Item = PathBuf> {
        let parts = self.plan.parts();
        let found = parts.filter(move |part| self.state_of(part, &[FRAMES]) == state);
        found.map(|part| self.frames_of(&part))
    }

    /// Begins to write a part, into a directory that [`claim`](Self::claim) has made.
    ///
    /// # Errors
    /// [`StoreError::File`], [`StoreError::Table`].
    pub fn write(&self, part: &Part<'_>) -> Result<PartWriter, StoreError> {
        let files = [self.frames_of(part), self.stars_of(part)];
        let beside =
            |path: &PathBuf| files::beside(path).map_err(StoreError::file("writing", path));
        let targets = [beside(&files[0])?, beside(&files[1])?];
        let tables = PartTables::new(targets);
        Ok(PartWriter {
            tables: tables.map_err(StoreError::table("writing", &files[0]))?,
            files,
            checksums: self.checksums_of(part),
        })
    }

    fn write_inputs(&mut self) -> Result<(), StoreError> {
        let path = self.directory.join(INPUTS);
        let names = self.plan.names().join("\n") + "\n";
        let found = fs::read(&path);
        if found.as_ref().is_ok_and(|found| found == names.as_bytes()) {
            return Ok(());
        }
        files::write(&path, names.as_bytes()).map_err(StoreError::file("writing", &path))?;
        self.mended.extend(found.is_ok().then_some(path));
        Ok(())
    }
}

/// The tables of a part: of frames, and of their stars.
pub struct PartTables<W: Write + Send> {
    frames: TableWriter<FrameRow, W>,
    stars: TableWriter<StarRow, W>,
}

impl<W: Write + Send> PartTables<W> {
    /// Begins the tables of frames and of stars.
    ///
    /// # Errors
    /// [`ParquetError`](parquet::errors::ParquetError).
    pub fn new([frames, stars]: [W; 2]) -> ParquetResult<Self> {
        Ok(Self {
            frames: TableWriter::new(frames)?,
            stars: TableWriter::new(stars)?,
        })
    }

    /// Adds a frame and its stars.
    ///
    /// # Errors
    /// [`ParquetError`](parquet::errors::ParquetError).
    pub fn add(
        &mut self,
        frame: FrameRow,
        stars: impl IntoIterator<Item = StarRow>,
    ) -> ParquetResult<()> {
        self.frames.add(frame)?;
        stars.into_iter().try_for_each(|star| self.stars.add(star))
    }

    /// Writes what is left, and returns the targets.
    ///
    /// # Errors
    /// [`ParquetError`](parquet::errors::ParquetError).
    pub fn finish(self) -> ParquetResult<[W; 2]> {
        let stars = self.stars.finish()?;
        Ok([self.frames.finish()?, stars])
    }
}

/// Writes the rows of a part. It is there when it is finished, and not before.
pub struct PartWriter {
    tables: PartTables<NamedTempFile>,
    /// Those of the tables of frames and of stars.
    files: [PathBuf; 2],
    checksums: PathBuf,
}

impl PartWriter {
    /// Adds a frame and its stars.
    ///
    /// # Errors
    /// [`StoreError::Table`].
    pub fn add(
        &mut self,
        frame: FrameRow,
        stars: impl IntoIterator<Item = StarRow>,
    ) -> Result<(), StoreError> {
        let added = self.tables.add(frame, stars);
        added.map_err(StoreError::table("writing", &self.files[0]))
    }

    /// Finishes the part.
    ///
    /// # Errors
    /// [`StoreError::File`], [`StoreError::Table`].
    pub fn finish(self) -> Result<(), StoreError> {
        let Self {
            tables,
            files: [frames_path, stars_path],
            checksums,
        } = self;
        let written = tables.finish();
        let [frames, stars] = written.map_err(StoreError::table("writing", &frames_path))?;
        let hash = |table: &NamedTempFile| FileHash::of_file(table.path());
        let lines = || Ok(checksum_lines(hash(&frames)?, hash(&stars)?));
        let write = |lines: String| files::write(&checksums, lines.as_bytes());
        let written = lines().and_then(write);
        written.map_err(StoreError::file("writing", &checksums))?;
        for (table, path) in [(stars, stars_path), (frames, frames_path)] {
            files::finish(table, &path).map_err(StoreError::file("writing", &path))?;
        }
        Ok(())
    }
}

/// The line of a table among the checksums of a part.
fn checksum_line(table: &str, hash: FileHash) -> String {
    format!("{table} {hash}\n")
}

/// The file of the checksums of a part.
fn checksum_lines(frames: FileHash, stars: FileHash) -> String {
    checksum_line(FRAMES, frames) + &checksum_line(STARS, stars)
}

/// The file of the checksums of a part, by the contents of its tables.
pub fn checksums(frames: &[u8], stars: &[u8]) -> String {
    checksum_lines(FileHash::of(frames), FileHash::of(stars))
}
