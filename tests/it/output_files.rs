//! The files that `--out` writes: all of them whole, or none and a clear message.

use crate::common::disk::SmallDisk;
use crate::common::{Ran, fixture, names, number, orion, shared_dir, starpipe};
use image::{GrayImage, Luma};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::Command;

fn process(out: &Path, frame: &Path) -> Ran {
    let mut command = starpipe();
    command.args(["process", "--format", "json", "--out"]);
    Ran::new(command.args([out, frame]))
}

#[test]
fn the_overlay_is_a_picture_of_the_frame_and_the_header_has_its_size() {
    let directory = tempfile::tempdir().unwrap();
    let ran = process(directory.path(), &orion());
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    let picture = image::open(directory.path().join("orion.png"))
        .unwrap()
        .to_rgb8();
    // 640 pixels are drawn twice as large; the strip below adds to the 960 rows.
    assert_eq!(picture.width(), 1280);
    assert!(
        (1000..1100).contains(&picture.height()),
        "{}",
        picture.height()
    );
    // The brightest identified stars are white in the middle of their rings.
    let report = &ran.reports()[0];
    for star in report["stars"].as_array().unwrap().iter().take(5) {
        let value = |name: &str| star[name].as_f64().unwrap();
        let at = |value: f64| ((value + 0.5) * 2.0) as u32;
        let pixel = picture.get_pixel(at(value("x")), at(value("y"))).0;
        assert!(pixel.iter().all(|&level| level > 230), "{star}: {pixel:?}");
    }
    let header = fs::read(directory.path().join("orion.wcs")).unwrap();
    assert_eq!(header.len() % 2880, 0);
    let text = String::from_utf8(header).unwrap();
    for card in [
        "SIMPLE  =                    T",
        "IMAGEW  =                  640",
        "CTYPE1  = 'RA---TAN'",
    ] {
        assert!(text.contains(card), "{card}");
    }
    assert!(number(report, "/match/matched") > 300.0);
}

#[test]
fn an_overlay_is_of_the_kind_and_width_that_are_wanted() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path();
    let draw = |format: &str, more: &[&str]| {
        let mut command = starpipe();
        command.args([
            "process",
            "--overlay-width",
            "1000",
            "--overlay-format",
            format,
        ]);
        Ran::new(command.args(more).arg("--out").args([out, &orion()]))
    };
    let all = "constellations,deep-sky,grid,altaz-grid";
    let more = [
        "--draw",
        all,
        "--label",
        "hd",
        "--date",
        "2024-01-05T22:00Z",
        "--site",
        "52,5",
    ];
    assert_eq!(draw("svg", &more).status, 0);
    let svg = fs::read_to_string(out.join("orion.svg")).unwrap();
    for text in [
        "width=\"1000\"",
        ">HD 37742 ",
        ">Orion Nebula<",
        ">0°<",
        ">5h40m<",
        ">alt ",
    ] {
        assert!(svg.contains(text), "{text}");
    }
    assert_eq!(draw("jpg", &[]).status, 0);
    let picture = image::open(out.join("orion.jpg")).unwrap();
    assert_eq!(picture.width(), 1000);
    assert!(!out.join("orion.png").exists());
    // A directory of frames does not have them.
    fs::copy(orion(), out.join("frame.png")).unwrap();
    let listed = Ran::new(starpipe().args(["process", "--format", "json"]).arg(out));
    assert_eq!(listed.reports().len(), 1, "{}", listed.stderr);
    // Files that starpipe did not draw stay.
    fs::write(out.join("orion.svg"), "<svg/>").unwrap();
    let refused = draw("svg", &[]);
    assert_eq!(refused.status, 2, "{}", refused.stderr);
    assert!(refused.stderr.contains("orion.svg"), "{}", refused.stderr);
}

#[test]
fn a_quiet_run_prints_errors_only() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path();
    let (orion, missing) = (orion(), out.join("missing.tif"));
    let mut command = starpipe();
    command.args([
        "process",
        "-q",
        "--stars",
        "fits,votable,ecsv,corr,rdls",
        "--out",
    ]);
    let ran = Ran::new(command.args([out, &orion, &missing]));
    assert_eq!((ran.status, ran.stdout.as_str()), (1, ""));
    assert!(
        ran.stderr.contains("missing.tif") && ran.stderr.lines().count() == 1,
        "{}",
        ran.stderr
    );
    let expected = [
        "orion.corr",
        "orion.csv",
        "orion.json",
        "orion.png",
        "orion.rdls",
        "orion.stars.ecsv",
        "orion.stars.fits",
        "orion.stars.vot",
        "orion.wcs",
    ];
    assert_eq!(names(out), expected);
}

#[test]
fn a_quiet_run_prints_the_report_that_is_asked_for() {
    let directory = tempfile::tempdir().unwrap();
    let missing = directory.path().join("missing.tif");
    let process = |arguments: &[&str]| {
        let mut command = starpipe();
        command.arg("process").args(arguments);
        Ran::new(command.args([&orion(), &missing]))
    };
    for format in ["json", "csv", "text", "frames-csv"] {
        let [quiet, usual] = [&["-q", "--format", format][..], &["--format", format]].map(process);
        assert_eq!(quiet.status, 1, "{}", quiet.stderr);
        assert_eq!(quiet.stdout.lines().count(), usual.stdout.lines().count());
        assert_eq!(quiet.stderr.lines().count(), 1, "{}", quiet.stderr);
    }
    // A cache that cannot be written is a warning.
    let run = |arguments: &[&str]| {
        let mut command = starpipe();
        command.arg("process").args(arguments);
        Ran::new(
            command
                .arg("--cache-dir")
                .args([orion().join("below"), orion()]),
        )
    };
    let [quiet, usual] = [&["-q", "--format", "json"][..], &["--format", "json"]].map(run);
    assert!(usual.stderr.contains("warning"), "{}", usual.stderr);
    assert_eq!((quiet.status, quiet.stderr.as_str()), (0, ""));
    assert_eq!(quiet.reports().len(), 1);
}

#[test]
fn a_frame_that_is_not_identified_has_no_header_left_from_before() {
    let directory = tempfile::tempdir().unwrap();
    let frame = directory.path().join("frame.png");
    let out = directory.path().join("out");
    fs::copy(orion(), &frame).unwrap();
    assert_eq!(process(&out, &frame).status, 0);
    assert_eq!(
        names(&out),
        ["frame.csv", "frame.json", "frame.png", "frame.wcs"]
    );
    GrayImage::from_fn(100, 80, |x, y| Luma([((x * 7 + y * 13) % 11) as u8]))
        .save(&frame)
        .unwrap();
    assert_eq!(process(&out, &frame).status, 3);
    assert_eq!(names(&out), ["frame.csv", "frame.json", "frame.png"]);
    assert!(
        fs::read_to_string(out.join("frame.json"))
            .unwrap()
            .contains("not_identified")
    );
}

#[test]
fn pages_regions_and_copies_are_written_where_they_are_asked_for() {
    let directory = tempfile::tempdir().unwrap();
    let frame = directory.path().join("night.fits");
    fs::copy(orion(), &frame).unwrap();
    let process = || {
        let mut command = starpipe();
        command.args(["process", "--html", "--regions", "--write-fits", "--out"]);
        Ran::new(command.args([directory.path(), &frame]))
    };
    // The copy of night.fits is not night.fits, and is written again and not solved.
    for _ in 0..2 {
        let ran = process();
        assert_eq!(ran.status, 0, "{}", ran.stderr);
    }
    let page = fs::read_to_string(directory.path().join("night.html")).unwrap();
    assert!(page.contains("Orion, with M 42") && page.contains("data:image/jpeg;base64,"));
    assert!(page.contains("Betelgeuse"), "no name in the page");
    let regions = fs::read_to_string(directory.path().join("night.reg")).unwrap();
    assert!(regions.contains("text={Betelgeuse"), "{regions}");

    let mut command = starpipe();
    command.args(["process", "--format", "json"]);
    let copy = directory.path().join("night.solved.fits");
    let ran = Ran::new(command.arg(&copy));
    let mut command = starpipe();
    command.args(["process", "--format", "json"]);
    let original = Ran::new(command.arg(&frame));
    for field in ["/attitude/ra_deg", "/match/matched", "/background/level"] {
        let [of_copy, of_original] = [&ran, &original].map(|ran| number(&ran.reports()[0], field));
        assert_eq!(of_copy, of_original, "{field}");
    }
    let mut command = starpipe();
    let listed = Ran::new(
        command
            .args(["process", "--format", "json"])
            .arg(directory.path()),
    );
    assert_eq!(listed.reports().len(), 1, "{}", listed.stdout);
}

#[test]
fn an_overlay_never_overwrites_the_frame_that_it_is_made_of() {
    let directory = tempfile::tempdir().unwrap();
    let frame = directory.path().join("night.png");
    fs::copy(orion(), &frame).unwrap();
    let ran = process(directory.path(), &frame);
    assert_eq!(ran.status, 2, "{}", ran.stderr);
    assert!(
        ran.stderr.contains("would overwrite the input"),
        "{}",
        ran.stderr
    );
    assert_eq!(fs::read(&frame).unwrap(), fs::read(orion()).unwrap());
    // A frame's overlay does not overwrite another frame.
    let other = directory.path().join("other");
    fs::create_dir(&other).unwrap();
    let elsewhere = other.join("night.tif");
    fs::copy(fixture("cygnus/cygnus.tif"), &elsewhere).unwrap();
    let mut command = starpipe();
    command.args(["process", "--out"]).arg(directory.path());
    let ran = Ran::new(command.args([&elsewhere, &frame]));
    assert_eq!(ran.status, 2, "{}", ran.stderr);
}

#[test]
fn a_list_of_centroids_has_a_header_and_no_overlay() {
    let directory = tempfile::tempdir().unwrap();
    let list = directory.path().join("list.csv");
    let table = Ran::new(starpipe().args(["process", "--format", "csv"]).arg(orion())).stdout;
    fs::write(&list, table.replace(",vmag,", ",answer,")).unwrap();
    let out = directory.path().join("out");
    let mut command = starpipe();
    command.args(["identify", "--width", "640", "--height", "480", "--out"]);
    let ran = Ran::new(command.args([&out, &list]));
    assert_eq!(ran.status, 0, "{}{}", ran.stdout, ran.stderr);
    assert_eq!(names(&out), ["list.csv", "list.json", "list.wcs"]);
}

#[test]
fn a_directory_that_takes_no_files_is_named_and_the_result_is_still_printed() {
    let Some(disk) = SmallDisk::new("size=1m,ro") else {
        return;
    };
    let ran = process(disk.path(), &orion());
    assert_eq!(ran.status, 1, "{}", ran.stderr);
    for name in ["orion.json", "orion.csv", "orion.wcs", "orion.png"] {
        assert!(ran.stderr.contains(name), "{name}: {}", ran.stderr);
    }
    assert_eq!(ran.stderr.lines().count(), 4, "{}", ran.stderr);
    assert_eq!(ran.reports()[0]["status"], "identified");
}

#[test]
fn a_full_disk_is_named_and_holds_nothing_half_written() {
    // There is space for the tables, but not for the picture.
    let Some(disk) = SmallDisk::new("size=300k") else {
        return;
    };
    let ran = process(disk.path(), &orion());
    assert_eq!(ran.status, 1, "{}", ran.stderr);
    assert!(
        ran.stderr.contains("writing") && ran.stderr.contains("orion.png"),
        "{}",
        ran.stderr
    );
    assert_eq!(ran.stderr.lines().count(), 1, "{}", ran.stderr);
    // What has space is whole.
    assert_eq!(names(disk.path()), ["orion.csv", "orion.json", "orion.wcs"]);
    let json = fs::read_to_string(disk.path().join("orion.json")).unwrap();
    let report: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(report["status"], "identified");
}

#[test]
fn a_cache_without_room_costs_time_and_nothing_else() {
    let Some(disk) = SmallDisk::new("size=64k") else {
        return;
    };
    let bright = concat!(env!("CARGO_MANIFEST_DIR"), "/catalogs/sky2000-bright.csv");
    let mut command = starpipe();
    command
        .args(["process", "--catalog", bright, "--cache-dir"])
        .arg(disk.path());
    let ran = Ran::new(command.arg(orion()));
    assert_eq!(ran.status, 0, "{}{}", ran.stdout, ran.stderr);
    assert!(
        ran.stderr.starts_with("starpipe: warning: "),
        "{}",
        ran.stderr
    );
    assert_eq!(ran.stderr.lines().count(), 1, "{}", ran.stderr);
    let left: u64 = names(disk.path())
        .iter()
        .map(|name| fs::metadata(disk.path().join(name)).unwrap().len())
        .sum();
    assert_eq!(left, 0, "nothing half-written");
}

/// A Python that has astropy: $STARPIPE_PYTHON, else python3.
fn python_with_astropy() -> Option<String> {
    let python = std::env::var("STARPIPE_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let found = Command::new(&python)
        .args(["-c", "import astropy.wcs"])
        .output();
    if found.is_ok_and(|done| done.status.success()) {
        return Some(python);
    }
    eprintln!("skipped: {python} has no astropy; STARPIPE_PYTHON names another");
    None
}

#[test]
fn astropy_agrees_with_the_headers() {
    let Some(python) = python_with_astropy() else {
        return;
    };
    let mut frames = vec![orion(), fixture("cygnus/cygnus.tif")];
    if let Some(shared) = shared_dir() {
        let entries = fs::read_dir(shared.join("frames")).unwrap();
        let paths = entries.map(|entry| entry.unwrap().path());
        frames.extend(
            paths.filter(|path| path.extension().is_some_and(|e| e == "jpg" || e == "tiff")),
        );
    }
    let directory = tempfile::tempdir().unwrap();
    let mut command = starpipe();
    command
        .args(["process", "--out"])
        .arg(directory.path())
        .args(&frames);
    assert_eq!(Ran::new(&mut command).status, 0);
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/scripts/check-wcs.py");
    let checked = Command::new(python)
        .arg(script)
        .arg(directory.path())
        .output()
        .unwrap();
    let printed = String::from_utf8(checked.stdout).unwrap();
    println!("{printed}");
    assert!(
        checked.status.success(),
        "{printed}{}",
        String::from_utf8_lossy(&checked.stderr)
    );
    assert_eq!(printed.lines().count(), frames.len());
}
