//! Files that are written whole or not at all, each for itself: what fails does not cost the others.

use super::messages::report_error;
use anyhow::Context;
use starpipe::base::files;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// A file to write: its path and its content.
pub(crate) type NewFile = (PathBuf, Vec<u8>);

/// Writes a file whole or not at all: into a temporary file beside it, which is renamed once it is written.
pub(crate) fn write_whole(path: &Path, content: &[u8]) -> anyhow::Result<()> {
    let write = || {
        let mut file = files::beside(path)?;
        file.write_all(content)?;
        // The error itself owns the temporary file and would keep it.
        file.persist(path).map_err(|refused| refused.error)?;
        io::Result::Ok(())
    };
    write().with_context(|| format!("writing {}", path.display()))
}

/// Writes each of `files` whole. Returns why some could not be made or written.
pub(crate) fn failures(
    files: impl IntoIterator<Item = anyhow::Result<NewFile>>,
) -> Vec<anyhow::Error> {
    let write = |file: anyhow::Result<NewFile>| {
        let (path, content) = file?;
        write_whole(&path, &content)
    };
    let written = files.into_iter().map(write);
    written.filter_map(Result::err).collect()
}

/// Writes each of `files` whole, and tells which could not be made or written. Returns whether all are.
#[must_use]
pub(crate) fn write_each(files: impl IntoIterator<Item = anyhow::Result<NewFile>>) -> bool {
    let failures = failures(files);
    for error in &failures {
        report_error(error.as_ref());
    }
    failures.is_empty()
}

/// [`write_each`] into `directory`, which is made if necessary; `files` are names and contents.
#[must_use]
pub(crate) fn write_into(
    directory: &Path,
    files: impl IntoIterator<Item = anyhow::Result<(String, Vec<u8>)>>,
) -> bool {
    if let Err(error) = make_directory(directory) {
        report_error(error.as_ref());
        return false;
    }
    let placed = |(name, content)| (directory.join::<String>(name), content);
    write_each(files.into_iter().map(|file| file.map(placed)))
}

/// The files that were made together, or why none was.
pub(crate) fn generated<F>(files: anyhow::Result<Vec<F>>) -> Vec<anyhow::Result<F>> {
    match files {
        Ok(files) => files.into_iter().map(Ok).collect(),
        Err(error) => vec![Err(error)],
    }
}

/// Makes `directory` and those above it, if necessary.
pub(crate) fn make_directory(directory: &Path) -> anyhow::Result<()> {
    files::make_directory(directory)
        .with_context(|| format!("making the directory {}", directory.display()))
}

/// Removes a file of an earlier run. Returns whether it existed.
pub(crate) fn remove_outdated(path: &Path) -> anyhow::Result<bool> {
    match std::fs::remove_file(path) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
        Err(error) => {
            Err(error).with_context(|| format!("removing {}, which is out of date", path.display()))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_and_no_temporary_file_remains() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.json");
        for content in [&b"one, and long"[..], b"two"] {
            write_whole(&path, content).unwrap();
            assert_eq!(std::fs::read(&path).unwrap(), content);
        }
        assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 1);
    }

    #[test]
    fn what_fails_does_not_cost_the_other_files() {
        let directory = tempfile::tempdir().unwrap();
        let path = |name: &str| directory.path().join(name);
        std::fs::create_dir(path("taken")).unwrap();
        let files = [
            Ok((path("not/there/a.csv"), b"one".to_vec())),
            Ok((path("taken"), b"two".to_vec())),
            Err(anyhow::anyhow!("drawing b.svg")),
            Ok((path("a.json"), b"three".to_vec())),
        ];
        let failures = failures(files);
        let named = ["not/there/a.csv", "taken", "drawing b.svg"];
        assert_eq!(failures.len(), named.len());
        for (error, name) in failures.iter().zip(named) {
            assert!(format!("{error:#}").contains(name), "{error:#}");
        }
        assert_eq!(std::fs::read(path("a.json")).unwrap(), b"three");
        assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 2);
    }
}
