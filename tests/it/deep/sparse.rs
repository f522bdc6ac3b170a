//! Files that are larger than the memory: only the part that is asked for is read.
//!
//! Most of them are holes, which take no place on the disk.

use super::areas;
use super::fields::identify_drawn;
use super::index_file::{Series, write_sparse};
use super::patch::Patch;
use super::reading::stars_in;
use crate::common::{cache_dir, measured};
use starpipe::base::units::RAD_PER_DEG;
use starpipe::catalog::deep::Region;
use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

const FILE_BYTES: u64 = 20_000_000_000;
const MAX_PEAK_KB: u64 = 200_000;
const MAX_S: f64 = 60.0;

/// Whether files may have holes in a folder; says so where they may not.
fn has_holes(folder: &Path) -> bool {
    let path = folder.join("hole");
    let file = File::create(&path).unwrap();
    file.set_len(1 << 26).unwrap();
    let filled_bytes = file.metadata().unwrap().blocks() * 512;
    fs::remove_file(&path).unwrap();
    if filled_bytes > 1 << 20 {
        eprintln!("skipped: files have no holes in {}", folder.display());
    }
    filled_bytes <= 1 << 20
}

fn patch() -> Patch {
    Patch::draw([83.0, 22.0], 3.0, 900.0, 20)
}

/// The program does this within the time and the memory.
fn assert_small(arguments: &[OsString]) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_starpipe"));
    command.env("STARPIPE_CACHE_DIR", cache_dir());
    command.env("STARPIPE_CATALOGS", "");
    let start = Instant::now();
    let (status, peak_kb) = measured(command.args(arguments));
    assert_eq!(status, Some(0), "{arguments:?}");
    assert!(peak_kb < MAX_PEAK_KB, "{peak_kb} kB: {arguments:?}");
    let taken_s = start.elapsed().as_secs_f64();
    assert!(taken_s < MAX_S, "{taken_s} s: {arguments:?}");
}

/// The program tells what a catalogue has, and identifies a frame of the patch with it; its stars are those of the
/// patch.
fn assert_used(catalog: &Path, patch: &Patch, folder: &Path) {
    let catalog_and = |arguments: &[&str]| -> Vec<OsString> {
        let arguments = arguments.iter().map(OsString::from);
        arguments.chain([catalog.into()]).collect()
    };
    assert_small(&catalog_and(&["catalog", "info"]));
    let mut identify = identify_drawn(patch, folder);
    identify.extend(catalog_and(&["--catalog"]));
    assert_small(&identify);
    // Of a database the stars after so many are not looked at: those of the holes do not end.
    let region = Region {
        centre: patch.centre,
        radius_rad: 0.5 * RAD_PER_DEG,
        per_sq_deg: 4000.0,
    };
    let drawn = patch.stars.iter();
    let drawn = drawn.filter(|star| region.contains(&star.direction));
    let read = stars_in(catalog, region);
    assert!(read.len().abs_diff(drawn.count()) < 5, "{}", read.len());
}

#[test]
fn an_index_file_of_20_gb_is_read_in_part() {
    /// Bytes of a star: its vector, BT and VT.
    const STAR_BYTES: u64 = 12 + 8;
    let folder = tempfile::tempdir().unwrap();
    if !has_holes(folder.path()) {
        return;
    }
    let patch = patch();
    let path = folder.path().join("index.fits");
    let before = (FILE_BYTES / STAR_BYTES) as u32;
    let file = File::create(&path).unwrap();
    write_sparse(file, &patch.stars, before, Series::Tycho);
    let found = path.metadata().unwrap();
    assert!(found.len() > FILE_BYTES && found.blocks() * 512 < 100_000_000);
    assert_used(&path, &patch, folder.path());
}

#[test]
fn a_database_of_areas_of_20_gb_each_is_read_in_part() {
    let folder = tempfile::tempdir().unwrap();
    if !has_holes(folder.path()) {
        return;
    }
    let patch = patch();
    let database = folder.path().join("d80");
    fs::create_dir(&database).unwrap();
    areas::write(&database, "d80", &patch.stars, false, false);
    for file in fs::read_dir(&database).unwrap() {
        let file = OpenOptions::new().write(true).open(file.unwrap().path());
        file.unwrap().set_len(FILE_BYTES).unwrap();
    }
    assert_used(&database, &patch, folder.path());
}
