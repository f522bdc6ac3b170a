//! `process --out-parquet` and `archive`: parts of tables, for any number of workers.

use crate::common::disk::SmallDisk;
use crate::common::{Ran, files, fixture, starpipe};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// A directory with `frames/`, of which the last file is no image.
fn night(frames: usize) -> TempDir {
    let directory = tempfile::tempdir().unwrap();
    let night = directory.path().join("frames");
    fs::create_dir(&night).unwrap();
    for number in 0..frames - 1 {
        let name = night.join(format!("2020-03-01T2{number}0000.tif"));
        fs::copy(fixture("cygnus/cygnus.tif"), name).unwrap();
    }
    fs::write(night.join("broken.tif"), "no image").unwrap();
    directory
}

/// Runs the program in `directory`.
fn run(directory: &Path, arguments: &[&str]) -> Ran {
    Ran::new(starpipe().args(arguments).current_dir(directory))
}

fn process(directory: &Path, out: &str, options: &[&str]) -> Ran {
    let fixed = ["process", "frames/*.tif", "--out-parquet", out];
    let parts = ["--frames-per-part", "2"];
    run(directory, &[&fixed[..], &parts[..], options].concat())
}

#[test]
fn tables_do_not_depend_on_workers_or_threads_and_a_rerun_skips_what_is_there() {
    let night = night(5);
    let night = night.path();
    let whole = process(night, "whole", &[]);
    assert_eq!(whole.status, 1, "{}", whole.stderr);
    let told = "3 parts, 5 frames: 4 identified, 0 not identified, 1 unreadable\n";
    assert_eq!(whole.stdout, told);
    assert!(whole.stderr.contains("broken.tif"), "{}", whole.stderr);

    for worker in ["2/2", "1/2"] {
        process(night, "shards", &["--shard", worker, "--threads", "1"]);
    }
    let expected = files(&night.join("whole"));
    // Two tables of three parts and their checksums, the list of inputs, and whose it is.
    assert_eq!(expected.len(), 11);
    assert!(files(&night.join("shards")) == expected);

    // A worker that was killed has left a part behind that is not finished.
    let lost = expected
        .keys()
        .find(|path| path.starts_with("frames.parquet"));
    fs::remove_file(night.join("shards").join(lost.unwrap())).unwrap();
    let missing = run(night, &["archive", "status", "shards"]);
    assert_eq!(missing.status, 3);
    assert!(
        missing.stdout.contains("missing    parts 0\n"),
        "{}",
        missing.stdout
    );
    let again = process(night, "shards", &[]);
    assert!(
        again.stdout.starts_with("1 part, 2 frames"),
        "{}",
        again.stdout
    );
    assert!(again.stdout.ends_with("; 2 parts already done\n"));
    assert!(files(&night.join("shards")) == expected);
}

#[test]
fn a_directory_is_of_one_configuration_and_of_one_list_of_frames() {
    let night = night(3);
    let night = night.path();
    process(night, "out", &[]);
    let before = files(&night.join("out"));
    for (options, difference) in [
        (&["--sigma", "6"][..], "sigma was null, now 6.0"),
        (&["--max-stars", "20"], "max_stars was 20000, now 20"),
        (
            &["--dark", "frames/2020-03-01T200000.tif"],
            "dark was null, now \"",
        ),
    ] {
        let refused = process(night, "out", options);
        assert_eq!(refused.status, 2, "{}", refused.stderr);
        assert!(refused.stderr.contains(difference), "{}", refused.stderr);
    }
    fs::remove_file(night.join("frames/broken.tif")).unwrap();
    let refused = process(night, "out", &[]);
    assert_eq!(refused.status, 2);
    assert!(
        refused.stderr.contains("frames was 3, now 2"),
        "{}",
        refused.stderr
    );
    assert!(files(&night.join("out")) == before);

    fs::create_dir_all(night.join("foreign/stars.parquet")).unwrap();
    let refused = process(night, "foreign", &[]);
    assert_eq!(refused.status, 2);
    assert!(
        refused.stderr.contains("stars.parquet but no archive.json"),
        "{}",
        refused.stderr
    );
}

#[test]
fn frames_may_be_named_in_lists() {
    let night = night(3);
    let night = night.path();
    process(night, "pattern", &[]);
    let expected = files(&night.join("pattern"));
    let names = String::from_utf8(expected[Path::new("inputs.txt")].clone()).unwrap();
    fs::write(night.join("frames.txt"), format!("\n{names}")).unwrap();
    let quoted: String = names
        .lines()
        .map(|name| format!("\"{name}\"  \r\n"))
        .collect();
    fs::write(night.join("marked.txt"), format!("\u{feff}{quoted}")).unwrap();
    let parts = ["--frames-per-part", "2"];
    for (input, out) in [
        ("frames.txt", "text"),
        ("marked.txt", "marked"),
        ("-", "stdin"),
    ] {
        let arguments = [&["process", input, "--out-parquet", out][..], &parts].concat();
        let mut command = starpipe();
        command
            .args(arguments)
            .current_dir(night)
            .write_stdin(names.as_str());
        let ran = Ran::new(&mut command);
        assert!(
            ran.stdout.starts_with("2 parts, 3 frames"),
            "{}{}",
            ran.stdout,
            ran.stderr
        );
        assert!(files(&night.join(out)) == expected);
    }
    let wide = names
        .encode_utf16()
        .flat_map(u16::to_le_bytes)
        .collect::<Vec<_>>();
    fs::write(night.join("wide.txt"), [&b"\xff\xfe"[..], &wide].concat()).unwrap();
    let refused = run(night, &["process", "wide.txt", "--out-parquet", "wide"]);
    assert_eq!(refused.status, 1);
    assert!(refused.stderr.contains("UTF-16"), "{}", refused.stderr);
    let merged = run(night, &["archive", "merge", "pattern", "--out", "merged"]);
    assert_eq!(merged.status, 0, "{}", merged.stderr);
    let arguments = [
        &["process", "merged/frames.parquet", "--out-parquet", "table"][..],
        &parts,
    ];
    let ran = run(night, &arguments.concat());
    assert!(
        ran.stdout.starts_with("2 parts, 3 frames"),
        "{}{}",
        ran.stdout,
        ran.stderr
    );
    assert!(files(&night.join("table")) == expected);
}

#[test]
fn a_report_tells_of_each_night() {
    let night = night(4);
    let night = night.path();
    process(night, "out", &["--exposure", "0.2"]);
    let unfinished = run(night, &["archive", "report", "out", "--format", "json"]);
    let reports = unfinished.reports();
    assert_eq!(reports.len(), 2, "{}", unfinished.stdout);
    // The broken file has no date.
    assert_eq!(reports[0]["unread"], 1);
    assert_eq!(reports[0]["reasons"]["unread"], 1);
    let dated = &reports[1];
    assert_eq!(dated["night"], "2020-03-01");
    assert_eq!(dated["identified"], 3);
    assert!(dated["limit50_vmag"].as_f64().unwrap() > 5.0);
    assert_eq!(dated["zero_point_change_mag"], 0.0);
    // The same sky an hour later: the camera has turned with it.
    let drift_deg = dated["pointing_drift_deg"].as_f64().unwrap();
    assert!(drift_deg > 5.0 && drift_deg < 15.1, "{drift_deg}");
    let table = run(night, &["archive", "report", "out", "--format", "csv"]);
    assert_eq!(table.stdout.lines().count(), 3);
    let text = run(night, &["archive", "report", "out"]);
    assert!(text.stdout.contains("2020-03-01"), "{}", text.stdout);
    let status = run(night, &["archive", "status", "out", "--format", "csv"]);
    assert!(
        status
            .stdout
            .starts_with("frame,reason\nframes/broken.tif,"),
        "{}",
        status.stdout
    );
}

#[test]
fn what_cannot_be_done_is_told() {
    let night = night(3);
    let night = night.path();
    for (arguments, status, message) in [
        (
            &["process", "none/*.fits", "--out-parquet", "out"][..],
            1,
            "there are no frames",
        ),
        (
            &["process", "none.txt", "--out-parquet", "out"],
            1,
            "none.txt",
        ),
        (
            &["process", "none.parquet", "--out-parquet", "out"],
            1,
            "none.parquet",
        ),
        (
            &["process", "frames", "--out-parquet", "frames.txt/out"],
            1,
            "making the directory",
        ),
        (&["process", "frames", "--shard", "1/2"], 2, "--out-parquet"),
        (
            &[
                "process",
                "frames",
                "--out-parquet",
                "out",
                "--shard",
                "3/2",
            ],
            2,
            "K from 1 to N",
        ),
        (
            &["process", "frames", "--out-parquet", "out", "--out", "x"],
            2,
            "cannot be used with",
        ),
        (&["archive", "status", "frames"], 1, "has no archive.json"),
    ] {
        fs::write(night.join("frames.txt"), "").unwrap();
        let ran = run(night, arguments);
        assert_eq!(ran.status, status, "{arguments:?} {}", ran.stderr);
        assert!(ran.stderr.contains(message), "{arguments:?} {}", ran.stderr);
    }
    process(night, "half", &["--shard", "1/2"]);
    let refused = run(night, &["archive", "merge", "half", "--out", "merged"]);
    assert_eq!(refused.status, 1);
    assert!(
        refused.stderr.contains("1 of 2 parts are missing"),
        "{}",
        refused.stderr
    );
}

#[test]
fn each_image_of_a_mosaic_is_a_row() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    fs::copy(
        fixture("tiles/fpack-rice-cube.fits.fz"),
        directory.join("cube.fits.fz"),
    )
    .unwrap();
    let arguments = ["process", "cube.fits.fz", "--out-parquet", "out"];
    let ran = run(directory, &[&arguments[..], &["--page", "all"]].concat());
    assert_eq!(ran.status, 3, "{}", ran.stderr);
    let told = "1 part, 4 frames: 0 identified, 4 not identified, 0 unreadable\n";
    assert_eq!(ran.stdout, told);
    run(directory, &["archive", "merge", "out", "--out", "tables"]);
    let names = starpipe::store::names_in(&directory.join("tables/frames.parquet")).unwrap();
    let expected: Vec<String> = (1..=4)
        .map(|page| format!("cube.fits.fz[{page}]"))
        .collect();
    assert_eq!(names, expected);
    // All images and the first are other frames.
    assert_eq!(run(directory, &arguments).status, 2);
}

#[test]
fn two_runs_at_once_into_one_directory_write_what_one_writes() {
    let night = night(9);
    let night = night.path();
    process(night, "alone", &[]);
    std::thread::scope(|scope| {
        for _ in 0..3 {
            scope.spawn(|| {
                // Who finds all parts written has read no frame.
                let ran = process(night, "both", &[]);
                assert!(ran.status <= 1, "{}", ran.stderr);
            });
        }
    });
    assert!(files(&night.join("both")) == files(&night.join("alone")));
}

#[test]
fn a_full_disk_is_told_and_the_run_goes_on_later() {
    let Some(disk) = SmallDisk::new("size=60k") else {
        return;
    };
    let night = night(7);
    let night = night.path();
    process(night, "alone", &[]);
    let out = disk.path().join("out");
    let refused = process(night, out.to_str().unwrap(), &[]);
    assert_eq!(refused.status, 1, "{}", refused.stderr);
    let told = refused.stderr.lines().last().unwrap();
    assert!(told.contains("No space left"), "{told}");
    disk.enlarge("size=10m");
    let ran = process(night, out.to_str().unwrap(), &[]);
    assert_eq!(ran.status, 1, "{}", ran.stderr);
    assert!(files(&out) == files(&night.join("alone")));
}

#[test]
fn status_lists_the_first_of_many_frames_that_could_not_be_read() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    let names: Vec<String> = (10..33)
        .map(|number| format!("none-{number}.tif\n"))
        .collect();
    fs::write(directory.join("frames.txt"), names.concat()).unwrap();
    let list = [
        "process",
        "frames.txt",
        "--out-parquet",
        "out",
        "--frames-per-part",
        "1",
    ];
    run(directory, &[&list[..], &["--shard", "1/2"]].concat());
    let status = run(directory, &["archive", "status", "out"]).stdout;
    let lines: Vec<&str> = status.lines().collect();
    assert_eq!(
        lines[..4],
        [
            "parts      12 of 23",
            "files      12 of 23",
            "frames     12: 0 identified, 0 not identified, 12 unreadable",
            "missing    parts 1 3 5 7 9 11 13 15 17 19 21",
        ]
    );
    assert_eq!(lines.len(), 4 + 10 + 1);
    assert_eq!(lines[14], "unreadable 2 more, listed by --format csv");
    run(directory, &[&list[..], &["--shard", "1/1"]].concat());
    fs::remove_dir_all(directory.join("out/frames.parquet")).unwrap();
    let status = run(directory, &["archive", "status", "out"]).stdout;
    assert!(status.contains("missing    parts 0-22\n"), "{status}");
}

#[test]
fn a_damaged_table_is_told() {
    let night = night(3);
    let night = night.path();
    process(night, "out", &[]);
    let part = fs::read_dir(night.join("out/frames.parquet")).unwrap();
    let part = part.map(|entry| entry.unwrap().path()).next().unwrap();
    let whole = fs::read(&part).unwrap();
    for at in (0..whole.len()).step_by(29) {
        let mut damaged = whole.clone();
        damaged[at] ^= 0x55;
        fs::write(&part, &damaged).unwrap();
        let ran = run(night, &["archive", "report", "out"]);
        assert!(matches!(ran.status, 0 | 1), "{at}: {}", ran.stderr);
        assert!(!ran.stderr.contains("panicked"), "{at}: {}", ran.stderr);
    }
}

#[test]
fn what_is_damaged_loses_only_itself() {
    let night = night(7);
    let night = night.path();
    process(night, "out", &[]);
    let whole = files(&night.join("out"));
    let flip = |path: &Path, at: usize| {
        let mut bytes = fs::read(path).unwrap();
        bytes[at] ^= 1;
        fs::write(path, bytes).unwrap();
    };
    let tables = |table: &str| {
        let parts = fs::read_dir(night.join("out").join(table)).unwrap();
        let mut parts: Vec<_> = parts.map(|entry| entry.unwrap().path()).collect();
        parts.sort();
        parts
    };
    flip(&tables("frames.parquet")[1], 200);
    flip(&tables("stars.parquet")[2], 200);
    let status = run(night, &["archive", "status", "out"]);
    assert_eq!(status.status, 3);
    assert!(
        status.stdout.contains("damaged    parts 1-2"),
        "{}",
        status.stdout
    );
    let report = run(night, &["archive", "report", "out", "--format", "json"]);
    assert_eq!(report.status, 1);
    assert!(
        report.stderr.contains("is damaged: it is ignored"),
        "{}",
        report.stderr
    );
    assert!(!report.stdout.is_empty());
    assert_eq!(
        run(night, &["archive", "merge", "out", "--out", "merged"]).status,
        1
    );
    let ran = process(night, "out", &[]);
    assert!(
        ran.stderr
            .contains("part 1 is damaged and is processed again"),
        "{}",
        ran.stderr
    );
    assert!(ran.stdout.starts_with("2 parts, "), "{}", ran.stdout);
    assert!(files(&night.join("out")) == whole);

    for name in ["archive.json", "inputs.txt"] {
        flip(&night.join("out").join(name), 20);
        let told = run(night, &["archive", "status", "out"]);
        assert_eq!(told.status, 1);
        assert!(
            told.stderr.contains(&format!("{name} is damaged")),
            "{}",
            told.stderr
        );
        let ran = process(night, "out", &[]);
        let mended = format!("{name} was damaged and is rewritten");
        assert!(ran.stderr.contains(&mended), "{}", ran.stderr);
        assert!(files(&night.join("out")) == whole);
    }
    flip(&night.join("out/archive.json"), 20);
    let other = process(night, "out", &["--sigma", "7"]);
    assert_eq!(other.status, 2);
    assert!(
        other.stderr.contains("archive.json is damaged"),
        "{}",
        other.stderr
    );
}
