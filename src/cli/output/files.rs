//! Files that are written whole or not at all.

use anyhow::Context;
use starpipe::base::files;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Writes files whole or not at all: into temporary files beside them, which take their names once all are written.
pub(crate) fn write_whole(files: &[(PathBuf, Vec<u8>)]) -> anyhow::Result<()> {
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
        // The error would keep the temporary file as long as it lives.
        let persisted = file.persist(path).map_err(|refused| refused.error);
        persisted.with_context(|| writing(path))?;
    }
    Ok(())
}

/// Writes `files` into `directory`, all or none.
pub(crate) fn save(directory: &Path, files: &[(PathBuf, Vec<u8>)]) -> anyhow::Result<()> {
    std::fs::create_dir_all(directory)
        .with_context(|| format!("making the directory {}", directory.display()))?;
    write_whole(files)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_whole_and_nothing_is_left_beside_it() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.json");
        for content in [&b"one, and long"[..], b"two"] {
            write_whole(&[(path.clone(), content.to_vec())]).unwrap();
            assert_eq!(std::fs::read(&path).unwrap(), content);
        }
        assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_file_that_cannot_be_written_leaves_nothing_behind_nor_those_before_it() {
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
    fn a_name_that_is_taken_by_a_directory_is_no_file_to_write() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("taken");
        std::fs::create_dir(&path).unwrap();
        let error = write_whole(&[(path, b"one".to_vec())]).unwrap_err();
        assert!(format!("{error:#}").contains("taken"), "{error:#}");
        assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 1);
    }
}
