//! The files of a folder.

use super::CatalogError;
use std::path::{Path, PathBuf};
use std::{fs, io};

/// The files in a directory that are not hidden, by name.
pub(super) fn files_in(path: &Path) -> Result<Vec<PathBuf>, CatalogError> {
    let mut files = entries_of(path)?;
    files.retain(|file| file.is_file());
    Ok(files)
}

/// The directories in it, the same.
#[cfg(feature = "archive")]
pub(super) fn directories_in(path: &Path) -> Result<Vec<PathBuf>, CatalogError> {
    let mut directories = entries_of(path)?;
    directories.retain(|directory| directory.is_dir());
    Ok(directories)
}

fn entries_of(path: &Path) -> Result<Vec<PathBuf>, CatalogError> {
    let list = || -> io::Result<Vec<PathBuf>> {
        let paths = fs::read_dir(path)?.map(|entry| Ok(entry?.path()));
        let mut files = paths.collect::<io::Result<Vec<PathBuf>>>()?;
        let is_hidden = |file: &Path| {
            let name = file.file_name();
            name.is_some_and(|name| name.as_encoded_bytes().starts_with(b"."))
        };
        files.retain(|file| !is_hidden(file));
        files.sort();
        Ok(files)
    };
    list().map_err(CatalogError::open(path))
}
