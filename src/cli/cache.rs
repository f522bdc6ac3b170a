//! Where the index of the catalogue is kept between runs.

use std::env;
use std::path::PathBuf;

/// The directory asked for, else that of the environment, else the user's own cache directory.
pub(crate) fn directory(asked: Option<PathBuf>) -> Option<PathBuf> {
    asked
        .or_else(|| variable("STARPIPE_CACHE_DIR"))
        .or_else(|| user_cache_directory().map(|directory| directory.join("starpipe")))
}

/// A variable that is set to something.
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
