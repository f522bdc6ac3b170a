//! Where catalogues are installed: by other programs, and by the user for this one.

use crate::base::user_folders;
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
            let own = user_folders::data().map(|folder| folder.join("starpipe").join("catalogs"));
            own.into_iter().chain(FOLDERS.map(PathBuf::from)).collect()
        }
    };
    paths.retain(|path| !path.as_os_str().is_empty() && path.exists());
    paths
}
