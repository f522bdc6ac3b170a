//! Where catalogues are installed: by other programs, and by the user or a package for this one.

use crate::base::user_folders;
use std::env;
use std::path::{Path, PathBuf};

/// Names the folders and files in which catalogues are looked for, as `PATH` names those of programs, instead of the
/// usual ones.
const VARIABLE: &str = "STARPIPE_CATALOGS";
/// Folders of the system's packages, and of other programs.
const FOLDERS: [&str; 9] = [
    "/usr/local/share/starpipe/catalogs",
    "/usr/share/starpipe/catalogs",
    "/usr/share/astrometry",
    "/usr/local/astrometry/data",
    "/usr/local/share/astrometry",
    "/opt/astap",
    "/usr/share/astap/data",
    "/usr/local/opt/astap",
    r"C:\Program Files\astap",
];

/// The folders and files that there are of those in which catalogues are looked for: what `STARPIPE_CATALOGS` names,
/// nothing if it is empty; unless it is set, `starpipe/catalogs` in the user's folder for data,
/// `share/starpipe/catalogs` beside the program's folder and in those of the system, and the folders of astrometry.net
/// and ASTAP.
pub fn installed_paths() -> Vec<PathBuf> {
    paths_with(prefixes_of_program)
}

/// The same for what is installed below `prefix` and runs in another program, as a package of Python does.
pub fn installed_paths_below(prefix: &Path) -> Vec<PathBuf> {
    paths_with(|| vec![prefix.to_owned()])
}

fn paths_with(prefixes: impl FnOnce() -> Vec<PathBuf>) -> Vec<PathBuf> {
    let named: Vec<PathBuf> = match env::var_os(VARIABLE) {
        Some(named) => env::split_paths(&named).collect(),
        None => {
            let own = user_folders::data().into_iter();
            let shared = prefixes().into_iter().map(|prefix| prefix.join("share"));
            let of_this = own
                .chain(shared)
                .map(|folder| folder.join("starpipe").join("catalogs"));
            of_this.chain(FOLDERS.map(PathBuf::from)).collect()
        }
    };
    let mut paths = Vec::new();
    for path in named {
        // The program's folder may be one of the others.
        if !path.as_os_str().is_empty() && path.exists() && !paths.contains(&path) {
            paths.push(path);
        }
    }
    paths
}

/// The folders in whose `bin` the program is: by the name it was called by, and by that of its file, which differ
/// where the one is a link to the other.
fn prefixes_of_program() -> Vec<PathBuf> {
    let called = env::args_os().next().map(PathBuf::from);
    let called = called.and_then(|called| match called.components().count() {
        // A shell looked it up.
        1 => {
            let path = env::var_os("PATH")?;
            let mut places = env::split_paths(&path).map(|folder| folder.join(&called));
            places.find(|place| place.is_file())
        }
        _ => Some(called),
    });
    let names = called.into_iter().chain(env::current_exe().ok());
    names.flat_map(|name| prefixes_of(&name)).collect()
}

/// The folder in whose `bin` a file is, and that in whose `bin` the file is that it is a link to.
fn prefixes_of(file: &Path) -> Vec<PathBuf> {
    let folder = file.parent().and_then(|folder| folder.canonicalize().ok());
    let target = file.canonicalize().ok();
    let folders = folder.as_deref().into_iter();
    let folders = folders.chain(target.as_deref().and_then(Path::parent));
    folders
        .filter_map(Path::parent)
        .map(Path::to_owned)
        .collect()
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::fs;
    use std::os::unix::fs::symlink;

    #[test]
    fn a_link_has_the_folder_above_its_own_and_that_of_its_target() {
        let place = tempfile::tempdir().unwrap();
        let place = place.path().canonicalize().unwrap();
        for folder in ["a/bin", "b/bin"] {
            fs::create_dir_all(place.join(folder)).unwrap();
        }
        let (file, link) = (place.join("a/bin/program"), place.join("b/bin/program"));
        fs::write(&file, "").unwrap();
        symlink(&file, &link).unwrap();
        assert_eq!(prefixes_of(&link), [place.join("b"), place.join("a")]);
        assert_eq!(prefixes_of(&file), [place.join("a"), place.join("a")]);
        assert!(prefixes_of(&place.join("c/bin/program")).is_empty());
    }
}
