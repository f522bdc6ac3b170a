//! `starpipe validate`: the same bytes whether interrupted or not and on any number of threads; and
//! its results.

use crate::common::{Ran, names, number, starpipe};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::json;
use std::fs::{self, OpenOptions};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

/// A small camera with a field of 9° and stars to V 6.5: a frame takes milliseconds.
const CAMERA: &[&str] = &[
    "--preset",
    "nanosat-tracker",
    "--width-px",
    "192",
    "--height-px",
    "192",
    "--pitch-x-um",
    "20",
    "--pitch-y-um",
    "20",
    "--focal-length-mm",
    "24.4",
    "--aperture-mm",
    "6",
    "--spot-sigma-px",
    "0.8",
    "--full-well-e",
    "100000",
    "--gain-e-per-adu",
    "2",
];

fn arguments(out: &Path, more: &[&str]) -> Vec<String> {
    let out = out.to_str().unwrap();
    let all = [&["validate", "--out", out], CAMERA, more].concat();
    all.into_iter().map(str::to_owned).collect()
}

fn validate(out: &Path, more: &[&str]) -> Ran {
    Ran::new(starpipe().args(arguments(out, more)))
}

/// A larger camera, with a star to V 7 every 80 pixels: in denser fields the light of faint stars
/// raises the noise.
const LARGE_CAMERA: &[&str] = &[
    "--preset",
    "nanosat-tracker",
    "--width-px",
    "512",
    "--height-px",
    "512",
    "--pitch-x-um",
    "8",
    "--pitch-y-um",
    "8",
    "--focal-length-mm",
    "19.5",
    "--aperture-mm",
    "5.5",
    "--spot-sigma-px",
    "0.8",
];

/// The same command, as a process to be killed.
fn start(out: &Path, more: &[&str]) -> Child {
    let command = starpipe();
    let mut again = Command::new(command.get_program());
    for (name, value) in command.get_envs() {
        again.env(name, value.unwrap());
    }
    again
        .args(arguments(out, more))
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

/// All files with their content, except those with times.
fn contents(directory: &Path) -> Vec<(String, Vec<u8>)> {
    let mut all = Vec::new();
    for name in names(directory) {
        let path = directory.join(&name);
        if path.is_dir() {
            let inner = contents(&path).into_iter();
            all.extend(inner.map(|(file, content)| (format!("{name}/{file}"), content)));
        } else if name != "timing.json" {
            all.push((name, fs::read(path).unwrap()));
        }
    }
    all
}

#[track_caller]
fn assert_same(one: &Path, other: &Path) {
    let (one, other) = (contents(one), contents(other));
    let listed = |files: &[(String, Vec<u8>)]| -> Vec<String> {
        files.iter().map(|(name, _)| name.clone()).collect()
    };
    assert_eq!(listed(&one), listed(&other));
    for ((name, one), (_, other)) in one.iter().zip(&other) {
        assert!(one == other, "{name} differs");
    }
}

fn lines(path: &Path) -> usize {
    let text = fs::read(path).unwrap_or_default();
    text.iter().filter(|byte| **byte == b'\n').count()
}

#[test]
fn a_killed_and_continued_run_gives_the_same_files() {
    let directory = tempfile::tempdir().unwrap();
    let (whole, broken) = (
        directory.path().join("whole"),
        directory.path().join("broken"),
    );
    let frames = &["--count", "1030", "--threads", "1"];
    assert_eq!(validate(&whole, frames).status, 0);
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut kills = 0;
    loop {
        let mut child = start(&broken, &["--count", "1030", "--threads", "2"]);
        let table = broken.join("frames.csv");
        let enough = lines(&table) + random.random_range(1..350);
        let ended = loop {
            if let Some(status) = child.try_wait().unwrap() {
                break Some(status);
            }
            if lines(&table) >= enough {
                break None;
            }
            std::thread::sleep(Duration::from_millis(1));
        };
        if let Some(status) = ended {
            assert!(status.success());
            break;
        }
        child.kill().unwrap();
        child.wait().unwrap();
        kills += 1;
    }
    assert!(kills >= 2, "{kills}");
    assert_same(&whole, &broken);
    let parts = ["part-00000.parquet", "part-00001.parquet"];
    assert_eq!(names(&whole.join("frames.parquet")), parts);
    assert_eq!(names(&whole.join("stars.parquet")), parts);
}

/// A directory with forty frames that a test may modify.
fn forty_frames() -> (tempfile::TempDir, PathBuf) {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().join("run");
    assert_eq!(validate(&out, &["--count", "40"]).status, 0);
    (directory, out)
}

#[test]
fn tables_truncated_at_any_byte_are_repaired() {
    let (directory, whole) = forty_frames();
    let cut = directory.path().join("cut");
    let mut random = ChaCha8Rng::seed_from_u64(2);
    assert_eq!(validate(&cut, &["--count", "40"]).status, 0);
    for _ in 0..6 {
        for name in ["frames.csv", "stars.csv"] {
            let file = OpenOptions::new().write(true).open(cut.join(name)).unwrap();
            let length = file.metadata().unwrap().len();
            file.set_len(random.random_range(0..=length)).unwrap();
        }
        let ran = validate(&cut, &["--count", "40", "--threads", "2"]);
        assert_eq!(ran.status, 0, "{}", ran.stderr);
        assert_same(&whole, &cut);
    }
}

#[test]
fn an_extended_run_equals_the_longer_run() {
    let (directory, out) = forty_frames();
    let ran = validate(&out, &["--count", "50", "--format", "json"]);
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    assert!(ran.stderr.contains("after 40 frames"), "{}", ran.stderr);
    assert_eq!(ran.reports()[0]["frames"], 50);
    let at_once = directory.path().join("at once");
    assert_eq!(validate(&at_once, &["--count", "50"]).status, 0);
    assert_same(&at_once, &out);
    let fewer = validate(&out, &["--count", "40"]);
    assert_eq!(fewer.status, 2);
    assert!(
        fewer.stderr.contains("already holds 50 frames"),
        "{}",
        fewer.stderr
    );
}

#[test]
fn a_directory_of_another_run_is_refused() {
    let (directory, out) = forty_frames();
    for (more, expected) in [
        (&["--seed", "2"][..], "seed was 1, now 2"),
        (&["--exposure", "0.3"], "exposure_s was 0.1, now 0.3"),
        (&["--scale-unknown"], "scale_known was true, now false"),
    ] {
        let ran = validate(&out, &[&["--count", "40"], more].concat());
        assert_eq!(ran.status, 2, "{}", ran.stderr);
        assert!(ran.stderr.contains(expected), "{}", ran.stderr);
    }
    let foreign = directory.path().join("foreign");
    fs::create_dir(&foreign).unwrap();
    fs::write(foreign.join("frames.csv"), "mine\n").unwrap();
    let ran = validate(&foreign, &["--count", "1"]);
    assert_eq!(ran.status, 2, "{}", ran.stderr);
    assert!(
        ran.stderr.contains("has frames.csv but no run.json"),
        "{}",
        ran.stderr
    );
    assert_eq!(
        fs::read_to_string(foreign.join("frames.csv")).unwrap(),
        "mine\n"
    );
}

#[test]
fn a_modified_table_is_reported_with_the_position() {
    let (_directory, out) = forty_frames();
    let path = out.join("frames.csv");
    let good = fs::read_to_string(&path).unwrap();
    let rows: Vec<&str> = good.lines().collect();
    let with_line = |number: usize, line: &str| {
        let mut rows = rows.clone();
        rows[number - 1] = line;
        rows.join("\n") + "\n"
    };
    let bad_word = rows[4].replace(",right,", ",rihgt,");
    let bad_number = rows[4].replacen('.', "x", 1);
    for (text, expected) in [
        (with_line(5, &bad_number), "line 5: ra_deg is \""),
        (
            with_line(5, &bad_word),
            "line 5: unknown variant `rihgt`, expected one of `right`",
        ),
        (with_line(5, "3,1"), "line 5: 2 fields, expected 42"),
        (with_line(5, rows[5]), "line 5: frame 4 with seed"),
        (
            with_line(1, "a,b"),
            "line 1: not the heading of a table of frames",
        ),
    ] {
        fs::write(&path, &text).unwrap();
        let ran = validate(&out, &["--count", "50"]);
        assert_eq!(ran.status, 1, "{}", ran.stderr);
        assert!(ran.stderr.contains("frames.csv"), "{}", ran.stderr);
        assert!(ran.stderr.contains(expected), "{}", ran.stderr);
        assert_eq!(fs::read_to_string(&path).unwrap(), text);
    }
    fs::write(&path, &good).unwrap();
    let stars = out.join("stars.csv");
    let text = fs::read_to_string(&stars).unwrap();
    fs::write(&stars, text.replacen("\n0,star", "\n7,star", 1)).unwrap();
    let ran = validate(&out, &["--count", "50"]);
    assert_eq!(ran.status, 1);
    let expected = "line 2: a star of frame 7, expected one of frame 0";
    assert!(ran.stderr.contains(expected), "{}", ran.stderr);
}

#[test]
fn results_agree_with_theory() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().to_str().unwrap();
    let options = ["--count", "200", "--format", "json", "--figures", "none"];
    let options = [&["validate", "--out", out], LARGE_CAMERA, &options].concat();
    let ran = Ran::new(starpipe().args(options));
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    let summary = &ran.reports()[0];
    let of = |pointer: &str| number(summary, pointer);
    assert_eq!(of("/identification/wrong"), 0.0);
    assert!(of("/identification/right_percent") > 95.0, "{summary}");
    let ratio = of("/centroids/ratio");
    assert!((0.95..1.15).contains(&ratio), "{ratio}");
    for pull in ["x", "y", "flux", "attitude_x", "attitude_y", "roll"] {
        let sd = of(&format!("/pulls/{pull}/sd"));
        assert!((0.8..1.3).contains(&sd), "{pull} {sd}");
    }
    let difference = of("/completeness/difference_mag");
    assert!(difference.abs() < 0.05, "{difference}");
    let nees = of("/attitude/nees_mean");
    assert!((2.0..4.5).contains(&nees), "{nees}");
}

#[test]
fn a_study_has_a_run_and_a_row_for_each_value() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().join("study");
    let study = &[
        "--count",
        "12",
        "--sweep",
        "aperture_mm=9:13:2",
        "--sweep",
        "fov-deg=8:16:2",
        "--format",
        "json",
    ];
    let ran = validate(&out, study);
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    let rows = ran.reports();
    let values: Vec<_> = rows
        .iter()
        .map(|row| {
            (
                row["parameter"].as_str().unwrap(),
                row["value"].as_f64().unwrap(),
            )
        })
        .collect();
    assert_eq!(
        values,
        [
            ("aperture_mm", 9.0),
            ("aperture_mm", 13.0),
            ("fov_deg", 8.0),
            ("fov_deg", 16.0)
        ]
    );
    let limit = |row: usize| rows[row]["predicted_limit_vmag"].as_f64().unwrap();
    assert!(limit(1) > limit(0) + 0.3);
    assert_eq!(
        names(&out),
        [
            "aperture_mm.svg",
            "aperture_mm=13",
            "aperture_mm=9",
            "fov_deg.svg",
            "fov_deg=16",
            "fov_deg=8",
            "study.csv",
            "study.json"
        ]
    );
    assert_eq!(lines(&out.join("study.csv")), 5);
    assert_eq!(lines(&out.join("fov_deg=16/frames.csv")), 13);
    // A second run reads the existing results.
    let again = validate(&out, study);
    assert_eq!((again.status, again.stdout), (0, ran.stdout));
}

#[test]
fn the_focal_length_is_right_for_every_lens_of_the_hard_suite() {
    /// Largest error in units of the stated one, root mean square of so few frames.
    const MAX_SIGMAS: f64 = 2.5;
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().join("hard");
    let camera = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/validation/camera.toml");
    let options = [
        "--camera", camera, "--count", "8", "--suite", "hard", "--format", "json",
    ];
    let run = || {
        let to = ["validate", "--out", out.to_str().unwrap()];
        Ran::new(starpipe().args([&to[..], &options].concat()))
    };
    let ran = run();
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    let rows = ran.reports();
    assert_eq!(lines(&out.join("suite.csv")), rows.len() + 1);
    for row in &rows {
        let case = row["case"].as_str().unwrap();
        assert_eq!(row["frames"], 8, "{case}");
        assert_eq!(row["wrong"], 0, "{case}");
        if case.starts_with("lens") || case.starts_with("detector") {
            assert_eq!(row["right"], 8, "{case}");
            let of = |name: &str| row[name].as_f64().unwrap();
            let sigmas = of("pull_focal_length_mean").hypot(of("pull_focal_length_sd"));
            assert!(sigmas < MAX_SIGMAS, "{case}: {sigmas}");
        }
    }
    // A second run reads the existing results.
    let again = run();
    assert_eq!((again.status, again.stdout), (0, ran.stdout));
}

#[test]
fn skies_are_compared_with_the_truth_and_a_stopped_run_goes_on() {
    let directory = tempfile::tempdir().unwrap();
    let camera = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/start/all-sky.toml");
    let run = |name: &str, count: &str, threads: &str| {
        let out = directory.path().join(name);
        let out = out.to_str().unwrap();
        let options = [
            "validate",
            "--suite",
            "sky",
            "--camera",
            camera,
            "--seed",
            "2",
            "--figures",
            "none",
            "--format",
            "json",
        ];
        let more = ["--count", count, "--out", out];
        let ran = Ran::new(
            starpipe()
                .env("RAYON_NUM_THREADS", threads)
                .args([&options[..], &more].concat()),
        );
        assert_eq!(ran.status, 0, "{}", ran.stderr);
        ran
    };
    let whole = run("whole", "5", "2");
    // The last row is cut off, as by a stop while it was written.
    run("stopped", "3", "1");
    let rows = directory.path().join("stopped/frames.jsonl");
    let text = fs::read(&rows).unwrap();
    fs::write(&rows, &text[..text.len() - 100]).unwrap();
    let continued = run("stopped", "5", "1");
    assert_eq!(continued.stdout, whole.stdout);
    for file in [
        "frames.csv",
        "cells.csv",
        "suite.json",
        "suite.csv",
        "suite.txt",
    ] {
        let read = |name: &str| fs::read(directory.path().join(name).join(file)).unwrap();
        assert_eq!(read("whole"), read("stopped"), "{file}");
    }
    let all = &whole.reports()[0]["groups"][0];
    assert_eq!(
        (&all["group"], &all["frames"], &all["wrong"]),
        (&json!("all"), &json!(5), &json!(0))
    );
    let measured = all["measured"].as_u64().unwrap();
    assert!(measured >= 3, "{all}");
    let zenith_mag = all["zenith_mean_mag"].as_f64().unwrap();
    // 300 frames have a mean of 0.03 and a standard deviation of 0.07: four are off by more in one case of 1000.
    assert!(zenith_mag.abs() < 0.15, "{all}");
}

#[test]
fn nonsensical_options_are_refused_by_name() {
    let directory = tempfile::tempdir().unwrap();
    for (more, expected) in [
        (&["--count", "0"][..], "0 is not in 1..=10000000"),
        (&["--sweep", "apertur=1:2:2"], "did you mean 'aperture_mm'?"),
        (&["--sweep", "fov_deg=100:190:2"], "below 180 degrees"),
        (
            &["--sweep", "bits=8:9:2", "--sweep", "bits=8:9:2"],
            "--sweep is given twice for bits",
        ),
        (&["--sweep", "band_to_nm=300:500:2"], "band_to_nm of 300"),
        (&["--figures", "gif"], "invalid value 'gif'"),
        (
            &["--suite", "sea"],
            "[possible values: hard, sky, robustness, clutter]",
        ),
        (
            &["--suite", "hard", "--sweep", "bits=8:9:2"],
            "Usage: starpipe validate --suite hard",
        ),
        (
            &["--suite", "sky", "--scale-unknown"],
            "Usage: starpipe validate --suite sky",
        ),
        (
            &["--suite=clutter"],
            "Usage: starpipe validate --suite clutter",
        ),
        (
            &["--suite", "robustness"],
            "Usage: starpipe validate --suite robustness",
        ),
        (&["--camera", "a.toml"], "cannot be used with"),
    ] {
        let ran = validate(directory.path(), more);
        assert_eq!(ran.status, 2, "{more:?}: {}", ran.stderr);
        assert!(ran.stderr.contains(expected), "{more:?}: {}", ran.stderr);
    }
    assert!(names(directory.path()).is_empty());
    let ran = Ran::new(starpipe().args(["validate", "--out", "x"]));
    assert_eq!(ran.status, 2);
    assert!(
        ran.stderr
            .contains("--camera <camera.toml>|--preset <NAME>"),
        "{}",
        ran.stderr
    );
}
