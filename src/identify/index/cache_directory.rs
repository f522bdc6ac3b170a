//! Where indices are kept between runs.

use std::env;
use std::path::PathBuf;

/// The directory in which starpipe keeps the indices of catalogs, or `None` if the user has none.
///
/// It is `STARPIPE_CACHE_DIR` if that is set, else `starpipe` in the user's cache directory:
/// `XDG_CACHE_HOME` or `~/.cache`, `~/Library/Caches` on macOS, `LOCALAPPDATA` on Windows.
pub fn cache_directory() -> Option<PathBuf> {
    variable("STARPIPE_CACHE_DIR")
        .or_else(|| user_cache_directory().map(|directory| directory.join("starpipe")))
}

/// A variable that is set and not empty.
fn variable(name: &str) -> Option<PathBuf> {
    env::var_os(name)
        .filter(|value| !value.is_empty())
        .map(PathBuf::from)
}

fn user_cache_directory() -> Option<PathBuf> {
    // The XDG specification wants relative paths ignored.
    if let Some(directory) = variable("XDG_CACHE_HOME").filter(|path| path.is_absolute()) {
        return Some(directory);
    }
    if cfg!(windows) {
        variable("LOCALAPPDATA")
    } else if cfg!(target_os = "macos") {
        variable("HOME").map(|home| home.join("Library/Caches"))
    } else {
        variable("HOME").map(|home| home.join(".cache"))
    }
}
