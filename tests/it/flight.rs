//! `catalog export`: a catalogue for a computer that flies.

use crate::common::{Ran, starpipe};
use starpipe::flight::ExportedCatalog;
use std::fs;
use std::path::Path;

fn export(directory: &Path, options: &[&str]) -> Ran {
    let arguments = ["catalog", "export", "--trials", "50", "--output", "sky.bin"];
    Ran::new(
        starpipe()
            .current_dir(directory)
            .args(arguments)
            .args(options),
    )
}

#[test]
fn a_catalog_for_flight_is_within_its_budget_and_identifies_frames() {
    let directory = tempfile::tempdir().unwrap();
    let options = ["--fov", "15:20", "--limit", "5.5", "--budget", "700kB"];
    let ran = export(directory.path(), &options);
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    let exported = fs::read(directory.path().join("sky.bin")).unwrap();
    let read = ExportedCatalog::new(&exported).unwrap();
    assert!(exported.len() <= 700_000 && read.len() > 2000);
    assert_eq!((read.fov_deg(), read.v_limit()), ([15.0, 20.0], 5.5));
    let first = ran.stdout.lines().next().unwrap();
    assert!(
        first.ends_with(&format!("hash {:016x}", read.hash())),
        "{first}"
    );
    let trials: Vec<&str> = ran.stdout.lines().skip(1).collect();
    assert_eq!(trials.len(), 3, "{}", ran.stdout);
    assert!(
        trials.iter().all(|line| line.contains(" 0 wrong")),
        "{trials:?}"
    );
    // The same stars and options give the same bytes and the same report.
    let again = export(directory.path(), &options);
    assert_eq!(again.stdout, ran.stdout);
    assert!(fs::read(directory.path().join("sky.bin")).unwrap() == exported);
}

#[test]
fn what_cannot_be_exported_is_told_and_nothing_is_written() {
    let directory = tempfile::tempdir().unwrap();
    for (options, reason) in [
        (
            ["--fov", "15", "--limit", "6", "--budget", "100kB"],
            "needs at least",
        ),
        (
            ["--fov", "15", "--limit", "-2", "--budget", "1MB"],
            "--limit",
        ),
        (["--fov", "0.5", "--limit", "6", "--budget", "1MB"], "--fov"),
        (
            ["--fov", "20:10", "--limit", "6", "--budget", "1MB"],
            "narrower",
        ),
        (["--fov", "10", "--limit", "6", "--budget", "1TB"], "MiB"),
    ] {
        let ran = export(directory.path(), &options);
        assert_eq!(ran.status, 2, "{options:?}: {}", ran.stderr);
        assert!(ran.stderr.contains(reason), "{}", ran.stderr);
        assert!(!directory.path().join("sky.bin").exists());
    }
}
