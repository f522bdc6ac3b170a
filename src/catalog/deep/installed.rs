//! Where catalogues are installed: by other programs, and by the user for this one.

use std::env;
use std::path::PathBuf;

/// Names the folders and files in which catalogues are looked for, as `PATH` names those of programs, instead of the
/// usual ones.
const VARIABLE: &str = "STARPIPE_CATALOGS";
/// Folders of other programs.
const FOLDERS: [&str; 7] = [
    "/usr/share/astrometry",
    "/usr/local/astrometry/data",
    "/usr/local/share/astrometry",
    "/opt/astap",
    "/usr/share/astap/data",
    "/usr/local/opt/astap",
    r"C:\Program Files\astap",
];

/// The folders and files that there are of those in which catalogues are looked for: what `STARPIPE_CATALOGS` names,
/// nothing if it is empty; unless it is set, `starpipe/catalogs` in the user's folder for data, and those of
/// astrometry.net and ASTAP.
pub fn installed_paths() -> Vec<PathBuf> {
    let named = env::var_os(VARIABLE);
    let mut paths: Vec<PathBuf> = match named {
        Some(named) => env::split_paths(&named).collect(),
        None => {
            let own = user_data_folder().map(|folder| folder.join("starpipe").join("catalogs"));
            own.into_iter().chain(FOLDERS.map(PathBuf::from)).collect()
        }
    };
    paths.retain(|path| !path.as_os_str().is_empty() && path.exists());
    paths
}

fn user_data_folder() -> Option<PathBuf> {
    let variable = |name: &str| {
        let path = PathBuf::from(env::var_os(name)?);
        // The XDG specification wants relative paths ignored.
        path.is_absolute().then_some(path)
    };
    variable("XDG_DATA_HOME").or_else(|| {
        if cfg!(windows) {
            variable("LOCALAPPDATA")
        } else if cfg!(target_os = "macos") {
            variable("HOME").map(|home| home.join("Library/Application Support"))
        } else {
            variable("HOME").map(|home| home.join(".local/share"))
        }
    })
}
