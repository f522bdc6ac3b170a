//! Files for readers that take a path.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use tempfile::TempDir;

/// Writes `content` to a file of this process, and calls `read` with its path.
pub fn with_file<R>(name: &str, content: &[u8], read: impl FnOnce(&Path) -> R) -> R {
    let path = directory().join(format!("{:?}-{name}", std::thread::current().id()));
    fs::write(&path, content).expect("the temporary directory can be written");
    read(&path)
}

/// A directory of this process, in memory where there is such.
pub fn directory() -> PathBuf {
    static DIRECTORY: OnceLock<TempDir> = OnceLock::new();
    let made = DIRECTORY.get_or_init(|| {
        let in_memory = tempfile::tempdir_in("/dev/shm");
        in_memory
            .or_else(|_| tempfile::tempdir())
            .expect("a temporary directory can be made")
    });
    made.path().to_owned()
}
