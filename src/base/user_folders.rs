//! The user's folders for the files of programs.

use std::env;
use std::path::PathBuf;

/// A variable that is set and not empty.
pub fn variable(name: &str) -> Option<PathBuf> {
    env::var_os(name)
        .filter(|value| !value.is_empty())
        .map(PathBuf::from)
}

/// The user's folder for caches: `XDG_CACHE_HOME` or `~/.cache`, `~/Library/Caches` on macOS, `LOCALAPPDATA` on
/// Windows.
pub fn cache() -> Option<PathBuf> {
    folder("XDG_CACHE_HOME", "Library/Caches", ".cache")
}

/// The user's folder for data: `XDG_DATA_HOME` or `~/.local/share`, `~/Library/Application Support` on macOS,
/// `LOCALAPPDATA` on Windows.
pub fn data() -> Option<PathBuf> {
    folder(
        "XDG_DATA_HOME",
        "Library/Application Support",
        ".local/share",
    )
}

/// The folder that a variable names, else one in the user's own on macOS and elsewhere.
fn folder(named: &str, on_macos: &str, elsewhere: &str) -> Option<PathBuf> {
    // The XDG specification wants relative paths ignored.
    if let Some(folder) = variable(named).filter(|path| path.is_absolute()) {
        return Some(folder);
    }
    if cfg!(windows) {
        return variable("LOCALAPPDATA");
    }
    let in_home = if cfg!(target_os = "macos") {
        on_macos
    } else {
        elsewhere
    };
    variable("HOME").map(|home| home.join(in_home))
}
