//! Satellites as lines, found by the program.

use crate::common::{Ran, number, orion, shared_dir, starpipe};
use serde_json::Value;
use starpipe::detect::{self, DetectConfig};
use starpipe::{Context, Frame, IndexedCatalog, Workspace, solve_frame};
use std::fs;
use std::path::Path;

fn processed(frame: &Path, options: &[&str]) -> Value {
    let ran = Ran::new(
        starpipe()
            .args(["process", "--format=json"])
            .args(options)
            .arg(frame),
    );
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    ran.reports().remove(0)
}

fn trails(report: &Value) -> &[Value] {
    report["trails"].as_array().expect("they were searched")
}

/// Simulates a frame of Orion that satellites cross, and returns the ends of each.
fn simulated(frame: &Path) -> Vec<[f64; 4]> {
    let ran = Ran::new(
        starpipe()
            .args(["simulate", "--preset=imx174-35mm", "--ra=84", "--dec=3"])
            .args(["--date=2024-01-05T21:00:00Z", "--exposure=1", "--seed=2"])
            .args(["--trails=2", "--trail-rate-deg-s=2", "--trail-vmag=4"])
            .arg(format!("--out={}", frame.display())),
    );
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    let table = fs::read_to_string(frame.with_extension("csv")).unwrap();
    let mut lines = table.lines();
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let column = |name: &str| header.iter().position(|title| *title == name).unwrap();
    let columns = ["x", "y", "x_end", "y_end"].map(column);
    lines
        .map(|line| line.split(',').collect::<Vec<_>>())
        .filter(|row| row[column("kind")] == "trail")
        .map(|row| columns.map(|at| row[at].parse().unwrap()))
        .collect()
}

#[test]
fn satellites_are_found_where_they_are() {
    let directory = tempfile::tempdir().unwrap();
    let frame = directory.path().join("crossed.tif");
    let expected = simulated(&frame);
    let plain = processed(&frame, &[]);
    let report = processed(&frame, &["--trails", "--site=50,10,300"]);
    assert!(plain.get("trails").is_none());
    assert_eq!(
        plain["stars"].as_array().unwrap().len(),
        report["stars"].as_array().unwrap().len()
    );
    assert_eq!(trails(&report).len(), expected.len(), "{expected:?}");
    let [width, height] = ["width", "height"].map(|key| report[key].as_f64().unwrap());
    let is_inside = |x: f64, y: f64| (0.0..width).contains(&x) && (0.0..height).contains(&y);
    let mut whole = expected;
    whole.retain(|[x, y, x_end, y_end]| is_inside(*x, *y) && is_inside(*x_end, *y_end));
    assert!(!whole.is_empty());
    for [x, y, x_end, y_end] in whole {
        let off = |trail: &Value| {
            let value = |key: &str| trail[key].as_f64().unwrap();
            let from = |x: f64, y: f64, end: &str| {
                (value(&format!("x_{end}")) - x).hypot(value(&format!("y_{end}")) - y)
            };
            let one = from(x, y, "begin").max(from(x_end, y_end, "end"));
            one.min(from(x, y, "end").max(from(x_end, y_end, "begin")))
        };
        let nearest = trails(&report)
            .iter()
            .min_by(|a, b| off(a).total_cmp(&off(b)));
        let trail = nearest.unwrap();
        assert!(off(trail) < 3.0, "{x}, {y} to {x_end}, {y_end}: {trail}");
        assert!((number(trail, "/vmag") - 4.0).abs() < 0.15, "{trail}");
        assert!((number(trail, "/length_deg") - 2.0).abs() < 0.05, "{trail}");
        assert!(number(trail, "/altitude_begin_deg") > 30.0, "{trail}");
    }
    let notes = report["notes"].as_array().unwrap();
    assert!(notes.iter().any(|note| note["code"] == "trails"));
}

#[test]
fn stars_alone_are_no_trails() {
    assert!(trails(&processed(&orion(), &["--trails"])).is_empty());
}

#[test]
fn of_the_real_frames_one_has_a_satellite() {
    let Some(shared) = shared_dir() else { return };
    let of = |name: &str| {
        let name = format!("frames/2019-07-29T204726_{name}_Try1.tiff");
        trails(&processed(&shared.join(name), &["--trails"])).to_vec()
    };
    for name in ["Alt40_Azi-135", "Alt40_Azi135", "Alt60_Azi135"] {
        assert_eq!(of(name), [] as [Value; 0], "{name}");
    }
    let [trail] = &of("Alt60_Azi-135")[..] else {
        panic!("one satellite");
    };
    // As it is seen in the picture.
    for (key, expected_px) in [
        ("x_begin", 212.0),
        ("y_begin", 171.5),
        ("x_end", 326.5),
        ("y_end", 147.5),
    ] {
        assert!(
            (trail[key].as_f64().unwrap() - expected_px).abs() < 4.0,
            "{trail}"
        );
    }
}

/// Spots that are no stars of the sky, and a line, over light that grows across the frame.
fn unknown_stars_and_a_line() -> Frame<'static> {
    const SIDE: usize = 400;
    let random = |seed: usize| ((seed * 7919 + 104_729) * 6271 % 10_007) as f64 / 10_007.0;
    let spots: Vec<[f64; 3]> = (0..60)
        .map(|spot| {
            let of = |axis: usize| random(3 * spot + axis);
            [
                SIDE as f64 * of(0),
                SIDE as f64 * of(1),
                300.0 + 3000.0 * of(2),
            ]
        })
        .collect();
    let light = |x: f64, y: f64| {
        let of_spots = spots.iter().map(|[sx, sy, peak]| {
            let square = (x - sx).powi(2) + (y - sy).powi(2);
            peak * (-square / 4.5).exp()
        });
        let across = 0.6 * (x - 50.0) - 0.8 * (y - 40.0);
        let is_beside = (60.0..320.0).contains(&x);
        let of_line = if is_beside {
            60.0 * (-across * across / 4.5).exp()
        } else {
            0.0
        };
        0.01 * x * x + of_spots.sum::<f64>() + of_line
    };
    let pixel = |at: usize| {
        let (x, y) = (at % SIDE, at / SIDE);
        (100.0 + 20.0 * random(at + 77) + light(x as f64, y as f64)) as f32
    };
    Frame::new(SIDE, SIDE, (0..SIDE * SIDE).map(pixel).collect()).unwrap()
}

#[test]
fn trails_are_those_of_the_whole_frame_after_a_search_at_lower_resolution() {
    let indexed = IndexedCatalog::built_in();
    let mut context = Context::new(&indexed);
    context.find_trails = true;
    let frame = unknown_stars_and_a_line();
    let solution = solve_frame(&frame, &context, &mut Workspace::new()).unwrap();
    assert!(solution.outcome.identification().is_none());
    let mut detector = detect::Workspace::new();
    let found = detect::detect(&frame, &DetectConfig::default(), &mut detector).unwrap();
    let expected = detector.find_trails(&frame, &found);
    assert_eq!(expected.len(), 1);
    assert_eq!(solution.trails, Some(expected));
}
