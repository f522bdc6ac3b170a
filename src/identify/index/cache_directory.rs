//! Where indices are kept between runs.

use crate::base::user_folders;
use std::path::PathBuf;

/// The directory in which starpipe keeps the indices of catalogs, or `None` if the user has none.
///
/// It is `STARPIPE_CACHE_DIR` if that is set, else `starpipe` in the user's cache directory:
/// `XDG_CACHE_HOME` or `~/.cache`, `~/Library/Caches` on macOS, `LOCALAPPDATA` on Windows.
pub fn cache_directory() -> Option<PathBuf> {
    user_folders::variable("STARPIPE_CACHE_DIR")
        .or_else(|| user_folders::cache().map(|folder| folder.join("starpipe")))
}
