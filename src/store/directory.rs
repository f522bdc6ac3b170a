//! The directory of an archive: whose it is, and its parts.

use super::configuration::{Configuration, FileHash};
use super::error::ArchiveError;
use super::frame_row::FrameRow;
use super::identity::Identity;
use super::plan::{Part, Plan};
use super::read::is_readable;
use super::write::TableWriter;
use crate::base::files;
use crate::base::table::Column;
use crate::report::StarRow;
use std::fs;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// Says whose the directory is.
const IDENTITY: &str = "archive.json";
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
    /// [`ArchiveError::OtherRun`] if it belongs to another run, [`ArchiveError::Foreign`] if it has
    /// tables of another kind, [`ArchiveError::Damaged`] if nothing tells whose it is,
    /// [`ArchiveError::File`], [`ArchiveError::Json`].
    pub fn claim(
        directory: &Path,
        plan: Plan,
        configuration: &Configuration,
    ) -> Result<Self, ArchiveError> {
        make_directory(directory)?;
        let path = directory.join(IDENTITY);
        let is_foreign = |table: &&str| directory.join(table).exists() && !path.exists();
        if let Some(name) = [FRAMES, STARS].into_iter().find(is_foreign) {
            return Err(ArchiveError::Foreign {
                directory: directory.to_owned(),
                name,
            });
        }
        let identity = Identity::new(&plan, configuration).map_err(ArchiveError::json(&path))?;
        let mut archive = Self {
            directory: directory.to_owned(),
            plan,
            identity,
            mended: Vec::new(),
        };
        let is_mended = claim_file(directory, IDENTITY, &archive.identity, || archive.is_own())?;
        archive.mended.extend(is_mended.then_some(path));
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
    /// [`ArchiveError::NoArchive`], [`ArchiveError::Damaged`], [`ArchiveError::File`].
    pub fn open(directory: &Path) -> Result<Self, ArchiveError> {
        let (path, inputs) = (directory.join(IDENTITY), directory.join(INPUTS));
        let damaged = |path: &Path| ArchiveError::Damaged(path.to_owned());
        let text = match fs::read(&path) {
            Err(error) if error.kind() == ErrorKind::NotFound => {
                return Err(ArchiveError::NoArchive(directory.to_owned()));
            }
            read => read.map_err(ArchiveError::file("reading", &path))?,
        };
        let identity = std::str::from_utf8(&text).ok().and_then(Identity::read);
        let identity = identity.ok_or_else(|| damaged(&path))?;
        let names = fs::read(&inputs).map_err(ArchiveError::file("reading", &inputs))?;
        let names = String::from_utf8(names).map_err(|_| damaged(&inputs))?;
        let names = names.lines().map(str::to_owned).collect();
        let plan = Plan::new(names, identity.frames_per_part())?;
        if !identity.is_of(&plan) {
            return Err(damaged(&inputs));
        }
        Ok(Self {
            directory: directory.to_owned(),
            plan,
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
        self.table_of(FRAMES, part)
    }

    /// The file of a part of the table of stars.
    pub fn stars_of(&self, part: &Part<'_>) -> PathBuf {
        self.table_of(STARS, part)
    }

    fn table_of(&self, table: &str, part: &Part<'_>) -> PathBuf {
        self.directory
            .join(table)
            .join(part.file_name(self.identity.text()))
    }

    /// Whether a part is written, and both of its tables are as they were.
    pub fn state(&self, part: &Part<'_>) -> PartState {
        self.state_of(part, &[FRAMES, STARS])
    }

    /// The same by the table of frames alone.
    pub fn state_of_frames(&self, part: &Part<'_>) -> PartState {
        self.state_of(part, &[FRAMES])
    }

    fn state_of(&self, part: &Part<'_>, tables: &[&str]) -> PartState {
        // The table of frames is written last.
        if !self.frames_of(part).exists() {
            return PartState::Missing;
        }
        let checksums = fs::read_to_string(self.checksums_of(part));
        let is_whole = |table: &&str| {
            let path = self.table_of(table, part);
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

    fn checksums_of(&self, part: &Part<'_>) -> PathBuf {
        let name = part.file_name(self.identity.text());
        let path = self.directory.join(CHECKSUMS).join(name);
        path.with_extension("txt")
    }

    /// The parts whose tables of frames are whole.
    pub fn parts_with_frames(&self) -> impl Iterator<Item = Part<'_>> {
        let is_whole = |part: &Part<'_>| self.state_of_frames(part) == PartState::Whole;
        self.plan.parts().filter(is_whole)
    }

    /// The tables of frames that were changed since they were written.
    pub fn damaged_frames(&self) -> Vec<PathBuf> {
        let parts = self.plan.parts();
        let damaged = parts.filter(|part| self.state_of_frames(part) == PartState::Damaged);
        damaged.map(|part| self.frames_of(&part)).collect()
    }

    /// Begins to write a part, into a directory that [`claim`](Self::claim) has made.
    ///
    /// # Errors
    /// [`ArchiveError::File`], [`ArchiveError::Table`].
    pub fn write(&self, part: &Part<'_>) -> Result<PartWriter, ArchiveError> {
        Ok(PartWriter {
            frames: open_table(self.frames_of(part), "frames", FrameRow::columns())?,
            stars: open_table(self.stars_of(part), "stars", StarRow::columns())?,
            checksums: self.checksums_of(part),
        })
    }

    fn write_inputs(&mut self) -> Result<(), ArchiveError> {
        let path = self.directory.join(INPUTS);
        let names = self.plan.names().join("\n") + "\n";
        let found = fs::read(&path);
        if found.as_ref().is_ok_and(|found| found == names.as_bytes()) {
            return Ok(());
        }
        files::write(&path, names.as_bytes()).map_err(ArchiveError::file("writing", &path))?;
        self.mended.extend(found.is_ok().then_some(path));
        Ok(())
    }
}

/// A table that takes its name when it is finished.
struct OpenTable<R> {
    path: PathBuf,
    writer: TableWriter<R, NamedTempFile>,
}

/// Writes the rows of a part. It is there when it is finished, and not before.
pub struct PartWriter {
    frames: OpenTable<FrameRow>,
    stars: OpenTable<StarRow>,
    checksums: PathBuf,
}

impl PartWriter {
    /// Adds a frame and its stars.
    ///
    /// # Errors
    /// [`ArchiveError::Table`].
    pub fn add(
        &mut self,
        frame: FrameRow,
        stars: impl IntoIterator<Item = StarRow>,
    ) -> Result<(), ArchiveError> {
        self.frames.add(frame)?;
        stars.into_iter().try_for_each(|star| self.stars.add(star))
    }

    /// Finishes the part.
    ///
    /// # Errors
    /// [`ArchiveError::File`], [`ArchiveError::Table`].
    pub fn finish(self) -> Result<(), ArchiveError> {
        let stars = self.stars.written()?;
        let frames = self.frames.written()?;
        let path = &self.checksums;
        let lines = || {
            let hash = |table: &WrittenTable| FileHash::of_file(table.file.path());
            Ok(checksum_lines(hash(&frames)?, hash(&stars)?))
        };
        let write = |lines: String| files::write(path, lines.as_bytes());
        let written = lines().and_then(write);
        written.map_err(ArchiveError::file("writing", path))?;
        stars.finish()?;
        frames.finish()
    }
}

fn make_directory(directory: &Path) -> Result<(), ArchiveError> {
    files::make_directory(directory).map_err(ArchiveError::file("making the directory", directory))
}

fn open_table<R>(
    path: PathBuf,
    table: &str,
    columns: Vec<Column<R>>,
) -> Result<OpenTable<R>, ArchiveError> {
    let target = files::beside(&path).map_err(ArchiveError::file("writing", &path))?;
    let writer = TableWriter::new(target, table, columns);
    let writer = writer.map_err(ArchiveError::table("writing", &path))?;
    Ok(OpenTable { path, writer })
}

impl<R> OpenTable<R> {
    fn add(&mut self, row: R) -> Result<(), ArchiveError> {
        let added = self.writer.add(row);
        added.map_err(ArchiveError::table("writing", &self.path))
    }

    fn written(self) -> Result<WrittenTable, ArchiveError> {
        let Self { path, writer } = self;
        let file = writer
            .finish()
            .map_err(ArchiveError::table("writing", &path))?;
        Ok(WrittenTable { path, file })
    }
}

/// A table that is written, and has no name yet.
struct WrittenTable {
    path: PathBuf,
    file: NamedTempFile,
}

impl WrittenTable {
    fn finish(self) -> Result<(), ArchiveError> {
        let Self { path, file } = self;
        files::finish(file, &path).map_err(ArchiveError::file("writing", &path))
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

/// Takes `directory` for a run by a file of this name in it. A damaged one is written anew if `is_own` says that
/// the results in the directory are of this run. Returns whether it was.
///
/// # Errors
/// [`ArchiveError::OtherRun`] if it belongs to another run, [`ArchiveError::Damaged`] if nothing tells
/// whose it is, [`ArchiveError::File`].
pub fn claim_file(
    directory: &Path,
    name: &str,
    identity: &Identity,
    is_own: impl Fn() -> bool,
) -> Result<bool, ArchiveError> {
    let path = directory.join(name);
    if is_claimed(&path, identity.text())? {
        return Ok(false);
    }
    // Another worker may have been faster.
    let text = fs::read(&path).map_err(ArchiveError::file("reading", &path))?;
    let found = std::str::from_utf8(&text).ok().and_then(Identity::read);
    if let Some(found) = found {
        check_same(directory, &found, identity)?;
        return Ok(false);
    }
    if !is_own() {
        return Err(ArchiveError::Damaged(path));
    }
    let written = files::write(&path, identity.text().as_bytes());
    written.map_err(ArchiveError::file("writing", &path))?;
    Ok(true)
}

/// Writes the identity unless there is one; says whether it was written.
fn is_claimed(path: &Path, identity: &str) -> Result<bool, ArchiveError> {
    let error = ArchiveError::file("writing", path);
    if path.exists() {
        return Ok(false);
    }
    let claim = || {
        let mut file = files::beside(path)?;
        file.write_all(identity.as_bytes())?;
        file.as_file().sync_all()?;
        match file.persist_noclobber(path) {
            Ok(_) => Ok(true),
            Err(refused) if refused.error.kind() == ErrorKind::AlreadyExists => Ok(false),
            Err(refused) => Err(refused.error),
        }
    };
    claim().map_err(error)
}

/// Refuses a directory of another run.
fn check_same(directory: &Path, found: &Identity, wanted: &Identity) -> Result<(), ArchiveError> {
    let differences = found.differences(wanted);
    if differences.is_empty() {
        return Ok(());
    }
    Err(ArchiveError::OtherRun {
        directory: directory.to_owned(),
        differences: differences.join(", "),
    })
}
