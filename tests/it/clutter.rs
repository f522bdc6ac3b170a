//! `starpipe validate --suite clutter`: its table, on any number of threads.

use crate::common::{Ran, names, starpipe};
use serde_json::Value;

fn ran(options: &[&str]) -> Ran {
    let mut command = starpipe();
    command.args(["validate", "--suite", "clutter", "--preset", "imx174-35mm"]);
    Ran::new(command.args(options))
}

fn rows(options: &[&str]) -> Vec<Value> {
    let ran = ran(&[options, &["--format", "json"]].concat());
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    ran.reports()
}

#[test]
fn the_table_has_every_kind_and_is_the_same_on_any_number_of_threads() {
    let table = |threads: &str| rows(&["--count", "2", "--threads", threads]);
    let rows = table("1");
    assert_eq!(rows, table("3"));
    assert_eq!(rows.len(), 21);
    for row in &rows {
        assert_eq!(row["frames"], 2);
        assert_eq!(row["wrong"], 0, "{row}");
        let [detected, falsely] =
            ["detected", "false_detections"].map(|name| row[name].as_u64().unwrap());
        assert!(falsely <= detected, "{row}");
        if row["is_sky"] == false {
            assert_eq!((&row["right"], &row["named"]), (&0.into(), &0.into()));
            assert_eq!(falsely, detected);
        }
    }
    // Stars alone: all is right.
    let clean = &rows[0];
    assert_eq!(clean["kind"], "clean");
    assert_eq!(
        (&clean["right"], &clean["misnamed"]),
        (&2.into(), &0.into())
    );
    assert!(clean["named"].as_u64().unwrap() > 20);
}

#[test]
fn clutter_is_detected_where_no_star_is() {
    let rows = rows(&[
        "--count",
        "3",
        "--kinds",
        "clean,foliage,reflections,false-stars",
    ]);
    let falsely = |row: &Value| row["false_per_mpx"].as_f64().unwrap();
    let [clean, others @ ..] = &rows[..] else {
        panic!("no rows");
    };
    assert!(falsely(clean) < 1.0, "{clean}");
    assert_eq!(others.len(), 3);
    for row in others {
        assert!(falsely(row) > 3.0, "{row}");
    }
}

/// A quarter of the detector of the camera with the widest spots.
#[test]
fn blended_stars_are_seldom_named_wrongly() {
    let mut command = starpipe();
    command.args([
        "validate",
        "--suite=clutter",
        "--preset",
        "nanosat-tracker",
        "--kinds",
        "blends",
    ]);
    command.args(["--width-px", "1296", "--height-px", "972", "--count", "8"]);
    let row = &Ran::new(command.args(["--format", "json"])).reports()[0];
    let [named, misnamed] = ["named", "misnamed"].map(|name| row[name].as_u64().unwrap());
    assert_eq!((&row["right"], &row["wrong"]), (&8.into(), &0.into()));
    assert!(named > 2000 && 1000 * misnamed <= named, "{row}");
}

#[test]
fn every_built_in_camera_is_simulated_where_none_is_chosen() {
    let mut command = starpipe();
    command.args(["clutter", "--kinds", "clean", "--count", "1"]);
    command.args([
        "--width-px",
        "400",
        "--height-px",
        "300",
        "--format",
        "json",
    ]);
    let rows = Ran::new(&mut command).reports();
    let cameras: Vec<&str> = rows
        .iter()
        .map(|row| row["camera"].as_str().unwrap())
        .collect();
    assert_eq!(
        cameras,
        [
            "experiment-1",
            "experiment-2",
            "nanosat-tracker",
            "imx174-35mm",
            "asi183mm-135mm"
        ]
    );
}

#[test]
fn pictures_are_written_and_unknown_kinds_refused() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().to_str().unwrap();
    let options = ["--kinds", "jpeg,snow", "--count", "1", "--pictures", out];
    let text = ran(&options);
    assert_eq!(text.status, 0, "{}", text.stderr);
    assert!(text.stdout.contains("jpeg") && text.stdout.contains("snow"));
    assert_eq!(
        names(directory.path()),
        ["jpeg-00000.tif", "snow-00000.tif"]
    );
    let refused = ran(&["--kinds", "sea"]);
    assert_eq!(refused.status, 2);
    assert!(
        refused.stderr.contains("'sea' is not one of"),
        "{}",
        refused.stderr
    );
}
