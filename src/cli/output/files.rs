//! Files that are written whole or not at all.

use anyhow::Context;
use starpipe::base::files;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// A file to write: its path and its content.
pub(crate) type NewFile = (PathBuf, Vec<u8>);

/// Writes all files or none: into temporary files beside them, which are renamed once all are
/// written.
pub(crate) fn write_whole(files: &[NewFile]) -> anyhow::Result<()> {
    let writing = |path: &Path| format!("writing {}", path.display());
    let write = |path: &Path, content: &[u8]| {
        let mut file = files::beside(path)?;
        file.write_all(content)?;
        io::Result::Ok(file)
    };
    let mut written = Vec::new();
    for (path, content) in files {
        let file = write(path, content).with_context(|| writing(path))?;
        written.push((path, file));
    }
    for (path, file) in written {
        // The error itself owns the temporary file and would keep it.
        let persisted = file.persist(path).map_err(|refused| refused.error);
        persisted.with_context(|| writing(path))?;
    }
    Ok(())
}

/// Writes all files or none into `directory`, which is made if necessary; `files` are names and
/// contents.
pub(crate) fn write_into(
    directory: &Path,
    files: impl IntoIterator<Item = (String, Vec<u8>)>,
) -> anyhow::Result<Vec<PathBuf>> {
    make_directory(directory)?;
    let placed = |(name, content)| (directory.join::<String>(name), content);
    let files: Vec<NewFile> = files.into_iter().map(placed).collect();
    write_whole(&files)?;
    Ok(files.into_iter().map(|(path, _)| path).collect())
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
            write_whole(&[(path.clone(), content.to_vec())]).unwrap();
            assert_eq!(std::fs::read(&path).unwrap(), content);
        }
        assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 1);
    }

    #[test]
    fn if_one_file_cannot_be_written_none_is() {
        let directory = tempfile::tempdir().unwrap();
        let there = directory.path().join("a.json");
        let elsewhere = directory.path().join("not/there/a.csv");
        let files = [(there, b"one".to_vec()), (elsewhere, b"two".to_vec())];
        let error = write_whole(&files).unwrap_err();
        assert!(
            format!("{error:#}").contains("not/there/a.csv"),
            "{error:#}"
        );
        assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 0);
    }

    #[test]
    fn a_directory_is_not_replaced_by_a_file() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("taken");
        std::fs::create_dir(&path).unwrap();
        let error = write_whole(&[(path, b"one".to_vec())]).unwrap_err();
        assert!(format!("{error:#}").contains("taken"), "{error:#}");
        assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 1);
    }
}
