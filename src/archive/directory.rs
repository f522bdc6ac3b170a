//! The directory of an archive: whose it is, and its parts.

use super::configuration::Configuration;
use super::error::ArchiveError;
use super::frame_row::FrameRow;
use super::identity::Identity;
use super::plan::{Part, Plan};
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

/// The directory of an archive.
#[derive(Debug)]
pub struct Archive {
    directory: PathBuf,
    plan: Plan,
    identity: Identity,
}

impl Archive {
    /// Takes `directory` for these frames and this configuration, or goes on in it.
    ///
    /// # Errors
    /// [`ArchiveError::OtherRun`] if it belongs to another run, [`ArchiveError::Foreign`] if it has
    /// tables of another kind, [`ArchiveError::File`], [`ArchiveError::Json`].
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
        claim_file(directory, IDENTITY, &identity)?;
        make_directory(&directory.join(FRAMES))?;
        make_directory(&directory.join(STARS))?;
        let archive = Self {
            directory: directory.to_owned(),
            plan,
            identity,
        };
        archive.write_inputs()?;
        Ok(archive)
    }

    /// The archive in `directory`.
    ///
    /// # Errors
    /// [`ArchiveError::NoArchive`], [`ArchiveError::File`], [`ArchiveError::Json`].
    pub fn open(directory: &Path) -> Result<Self, ArchiveError> {
        let (path, inputs) = (directory.join(IDENTITY), directory.join(INPUTS));
        let text = match fs::read_to_string(&path) {
            Err(error) if error.kind() == ErrorKind::NotFound => {
                return Err(ArchiveError::NoArchive(directory.to_owned()));
            }
            read => read.map_err(ArchiveError::file("reading", &path))?,
        };
        let identity = Identity::read(&text).map_err(ArchiveError::json(&path))?;
        let names = fs::read_to_string(&inputs).map_err(ArchiveError::file("reading", &inputs))?;
        let names = names.lines().map(str::to_owned).collect();
        Ok(Self {
            directory: directory.to_owned(),
            plan: Plan::new(names, identity.frames_per_part())?,
            identity,
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

    /// Whether a part is written.
    pub fn has(&self, part: &Part<'_>) -> bool {
        // The table of frames is written last.
        self.frames_of(part).exists()
    }

    /// Begins to write a part, into a directory that [`claim`](Self::claim) has made.
    ///
    /// # Errors
    /// [`ArchiveError::File`], [`ArchiveError::Table`].
    pub fn write(&self, part: &Part<'_>) -> Result<PartWriter, ArchiveError> {
        Ok(PartWriter {
            frames: open_table(self.frames_of(part), "frames", FrameRow::columns())?,
            stars: open_table(self.stars_of(part), "stars", StarRow::columns())?,
        })
    }

    fn write_inputs(&self) -> Result<(), ArchiveError> {
        let path = self.directory.join(INPUTS);
        if path.exists() {
            return Ok(());
        }
        let names = self.plan.names().join("\n") + "\n";
        files::write(&path, names.as_bytes()).map_err(ArchiveError::file("writing", &path))
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
        self.stars.finish()?;
        self.frames.finish()
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

    fn finish(self) -> Result<(), ArchiveError> {
        let Self { path, writer } = self;
        let written = writer
            .finish()
            .map_err(ArchiveError::table("writing", &path))?;
        files::finish(written, &path).map_err(ArchiveError::file("writing", &path))
    }
}

/// Takes `directory` for a run by a file of this name in it.
///
/// # Errors
/// [`ArchiveError::OtherRun`] if it belongs to another run, [`ArchiveError::File`],
/// [`ArchiveError::Json`].
pub fn claim_file(directory: &Path, name: &str, identity: &Identity) -> Result<(), ArchiveError> {
    let path = directory.join(name);
    if !is_claimed(&path, identity.text())? {
        // Another worker may have been faster.
        check_same(directory, &path, identity)?;
    }
    Ok(())
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
fn check_same(directory: &Path, path: &Path, wanted: &Identity) -> Result<(), ArchiveError> {
    let text = fs::read_to_string(path).map_err(ArchiveError::file("reading", path))?;
    let found = Identity::read(&text).map_err(ArchiveError::json(path))?;
    let differences = found.differences(wanted);
    if differences.is_empty() {
        return Ok(());
    }
    Err(ArchiveError::OtherRun {
        directory: directory.to_owned(),
        differences: differences.join(", "),
    })
}
