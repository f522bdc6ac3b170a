//! A directory is of one run: a file in it says of which.

use super::error::StoreError;
use super::identity::Identity;
use crate::base::files;
use std::fs::{self, File, TryLockError};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

/// The files of a run.
#[derive(Debug, Clone, Copy)]
pub struct RunFiles {
    /// Name of the file that says whose the others are.
    pub identity: &'static str,
    /// Names of results, which are of an unknown run without that file.
    pub results: &'static [&'static str],
}

/// Takes `directory`, which is made if necessary, for the run `identity`, or goes on in it. A damaged file of the
/// identity is written anew if `is_own` says that the results in the directory are of this run. Returns this file
/// if it was.
///
/// # Errors
/// [`StoreError::OtherRun`] if it belongs to another run, [`StoreError::UnknownRun`] and [`StoreError::Damaged`]
/// if nothing tells whose it is, [`StoreError::File`].
pub fn claim(
    directory: &Path,
    run: RunFiles,
    identity: &Identity,
    is_own: impl Fn() -> bool,
) -> Result<Option<PathBuf>, StoreError> {
    make_directory(directory)?;
    let path = directory.join(run.identity);
    // In this order: another worker may write its first results meanwhile.
    let is_unknown = |name: &&&str| directory.join(name).exists() && !path.exists();
    if let Some(name) = run.results.iter().find(is_unknown) {
        return Err(StoreError::UnknownRun {
            directory: directory.to_owned(),
            name,
            file: run.identity,
        });
    }
    let is_new = write_new(&path, identity.text()).map_err(StoreError::file("writing", &path))?;
    if is_new {
        return Ok(None);
    }
    let content = fs::read(&path).map_err(StoreError::file("reading", &path))?;
    let Some(found) = identity.read_other(&content) else {
        if !is_own() {
            return Err(StoreError::Damaged(path));
        }
        let written = files::write(&path, identity.text().as_bytes());
        written.map_err(StoreError::file("writing", &path))?;
        return Ok(Some(path));
    };
    let differences = found.differences(identity);
    if differences.is_empty() {
        return Ok(None);
    }
    Err(StoreError::OtherRun {
        directory: directory.to_owned(),
        differences: differences.join(", "),
    })
}

/// Writes a file unless there is one; says whether it was written.
fn write_new(path: &Path, text: &str) -> io::Result<bool> {
    if path.exists() {
        return Ok(false);
    }
    let mut file = files::beside(path)?;
    file.write_all(text.as_bytes())?;
    file.as_file().sync_all()?;
    match file.persist_noclobber(path) {
        Ok(_) => Ok(true),
        // Another worker was faster.
        Err(refused) if refused.error.kind() == ErrorKind::AlreadyExists => Ok(false),
        Err(refused) => Err(refused.error),
    }
}

/// Makes a directory for results.
pub(super) fn make_directory(directory: &Path) -> Result<(), StoreError> {
    files::make_directory(directory).map_err(StoreError::file("making the directory", directory))
}

/// Locks `file`, as long as it is open, for the one process that writes `path`.
pub(crate) fn lock(file: &File, path: &Path) -> Result<(), StoreError> {
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => Err(StoreError::Locked(path.to_owned())),
        // Where the file system has no locks, nothing is known of other runs.
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RUN: RunFiles = RunFiles {
        identity: "run.json",
        results: &["stars.csv"],
    };

    #[test]
    fn results_of_an_unknown_run_are_left_alone() {
        let directory = tempfile::tempdir().unwrap();
        let identity = Identity::unsealed(&[("seed", 1)]).unwrap();
        let claim = || claim(directory.path(), RUN, &identity, || false);
        fs::write(directory.path().join("stars.csv"), "").unwrap();
        let error = claim().unwrap_err().to_string();
        assert!(error.contains("stars.csv but no run.json"), "{error}");
        fs::write(directory.path().join("run.json"), "{").unwrap();
        assert!(matches!(claim(), Err(StoreError::Damaged(_))));
    }
}
