//! The paper's experiments, repeated by the program.

use crate::common::{Ran, names, number, starpipe};
use serde_json::Value;

/// Tolerances of the mean faintest star: the detector's model is off by a few hundredths, and a
/// number of standard errors.
const FAINTEST_TOLERANCE_MAG: f64 = 0.08;
const FAINTEST_SIGMAS: f64 = 3.5;

fn experiment(arguments: &[&str]) -> Ran {
    Ran::new(starpipe().arg("experiment").args(arguments))
}

#[test]
fn limits_and_stars_are_the_papers_and_frames_reach_the_expected_limit() {
    for (which, limit, stars, as_bright) in [("1", 8.15, 7, 7), ("2", 9.0, 9, 17)] {
        let ran = experiment(&[which, "--count", "12", "--format", "json"]);
        assert_eq!(ran.status, 0, "{}", ran.stderr);
        let [report] = &ran.reports()[..] else {
            panic!("{}", ran.stdout);
        };
        assert!((number(report, "/limit/limit_vmag") - limit).abs() < 0.02);
        assert_eq!(report["table"]["right"], stars);
        assert_eq!(report["table"]["stars"].as_array().unwrap().len(), stars);
        assert_eq!(report["table"]["field"]["stars_as_bright"], as_bright);
        let stated = number(report, "/table/stated_zenith_distance_deg");
        let true_deg = number(report, "/table/zenith_distance_deg");
        assert!((true_deg - stated).abs() > 30.0, "{true_deg}");
        let simulated = &report["simulated"];
        assert_eq!(simulated["frames_identified"], 12, "{simulated}");
        assert_eq!(simulated["named_wrongly"], 0, "{simulated}");
        let difference = number(report, "/simulated/faintest/difference_mag");
        let sigma = number(report, "/simulated/faintest/difference_sigma_mag");
        let tolerance = FAINTEST_TOLERANCE_MAG + FAINTEST_SIGMAS * sigma;
        assert!(
            difference.abs() < tolerance,
            "{which}: {difference} ± {sigma}"
        );
        faint_stars_are_named_where_they_are_found(simulated);
    }
}

fn faint_stars_are_named_where_they_are_found(simulated: &Value) {
    let bins = simulated["completeness"].as_array().unwrap();
    let sum = |key: &str| {
        bins.iter()
            .map(|bin| bin[key].as_f64().unwrap())
            .sum::<f64>()
    };
    let (found, named) = (sum("detected"), sum("named"));
    assert!(named > 0.98 * found && named <= found, "{named} of {found}");
    let first = &bins[0];
    assert_eq!(first["stars"], first["named"]);
    let last = &bins[bins.len() - 1];
    assert!(last["detected"].as_u64() <= Some(1), "{last}");
}

#[test]
fn a_page_and_a_picture() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().to_str().unwrap();
    for _ in 0..2 {
        let ran = experiment(&["1", "--count", "2", "--out", out]);
        assert_eq!(ran.status, 0, "{}", ran.stderr);
        assert!(
            ran.stdout.contains("these contradict each other"),
            "{}",
            ran.stdout
        );
        assert!(
            ran.stdout.contains("7 of 7 as in the paper"),
            "{}",
            ran.stdout
        );
        assert!(ran.stdout.lines().count() < 50);
        assert_eq!(names(directory.path()), ["experiment-1.png"]);
    }
    let picture = image::open(directory.path().join("experiment-1.png")).unwrap();
    assert!(picture.width() >= 752 && picture.height() > 582);
}

#[test]
fn the_same_seed_gives_the_same_page_on_any_number_of_threads() {
    let page = |seed: &str, threads: &str| {
        let arguments = ["1", "--count", "5", "--seed", seed, "--threads", threads];
        experiment(&arguments).stdout
    };
    let first = page("3", "1");
    assert_eq!(first, page("3", "4"));
    assert_ne!(first, page("4", "1"));
}

#[test]
fn a_foreign_picture_is_not_overwritten() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("experiment-2.png");
    std::fs::write(&path, "my own").unwrap();
    let ran = experiment(&[
        "2",
        "--count",
        "1",
        "--out",
        directory.path().to_str().unwrap(),
    ]);
    assert_eq!(ran.status, 2, "{}", ran.stderr);
    assert_eq!(std::fs::read(&path).unwrap(), b"my own");
}

#[test]
fn there_is_no_third_experiment() {
    for arguments in [&["3"][..], &["one"], &[], &["1", "--count", "0"]] {
        let ran = experiment(arguments);
        assert_eq!(ran.status, 2, "{}", ran.stderr);
    }
}
