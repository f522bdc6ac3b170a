//! The brightest stars alone: `--only pointing`, the pointing, its errors and the optics from them, and
//! `--max-stars`, their measurement.

use crate::common::{Ran, fixture, number, report, shared_dir, starpipe};
use serde_json::Value;
use std::collections::HashSet;

fn named(report: &Value) -> Vec<&Value> {
    let stars = report["stars"].as_array().unwrap().iter();
    stars.filter(|star| star["id"].is_string()).collect()
}

/// The direction of the frame's centre.
fn boresight(report: &Value) -> [f64; 3] {
    let [ra, dec] =
        ["/attitude/ra_deg", "/attitude/dec_deg"].map(|at| number(report, at).to_radians());
    [dec.cos() * ra.cos(), dec.cos() * ra.sin(), dec.sin()]
}

#[test]
fn the_attitude_is_that_of_all_stars_within_its_errors() {
    // Errors of both, as if they were independent: they are not, so this is generous.
    const SIGMAS: f64 = 4.0;
    for name in ["orion/orion.png", "cygnus/cygnus.tif"] {
        let (all, bright) = (report(name, &[]), report(name, &["--only", "pointing"]));
        let [a, b] = [&all, &bright].map(boresight);
        let apart_rad = (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt();
        let sigma = |axis: &str| {
            let at = format!("/attitude/sigma_arcsec/{axis}");
            number(&all, &at).hypot(number(&bright, &at))
        };
        let across_arcsec = sigma("x").hypot(sigma("y"));
        let apart_arcsec = apart_rad.to_degrees() * 3600.0;
        assert!(
            apart_arcsec < SIGMAS * across_arcsec,
            "{name} {apart_arcsec}"
        );
        let turn_deg = number(&all, "/attitude/up_pa_deg") - number(&bright, "/attitude/up_pa_deg");
        assert!(
            turn_deg.abs() * 3600.0 < SIGMAS * sigma("roll"),
            "{name} {turn_deg}"
        );
    }
}

#[test]
fn only_the_brightest_stars_are_named_and_no_magnitude_is_measured() {
    let (all, bright) = (
        report("cygnus/cygnus.tif", &[]),
        report("cygnus/cygnus.tif", &["--only", "pointing"]),
    );
    assert!(named(&bright).len() < named(&all).len());
    assert!(named(&bright).len() >= 4);
    let names: HashSet<&str> = named(&all)
        .iter()
        .filter_map(|s| s["id"].as_str())
        .collect();
    for star in named(&bright) {
        assert!(names.contains(star["id"].as_str().unwrap()), "{star}");
        assert!(star["p_chance"].as_f64().unwrap() <= 1.0 / 101.0, "{star}");
    }
    for star in bright["stars"].as_array().unwrap() {
        assert!(star["ra_deg"].is_f64());
    }
    for absent in ["photometry", "magnitude", "prediction"] {
        assert!(bright[absent].is_null(), "{absent}");
    }
    let notes = bright["notes"].as_array().unwrap();
    for code in ["attitude_only", "pointing_at_once"] {
        assert!(notes.iter().any(|note| note["code"] == code), "{code}");
    }
}

#[test]
fn pointing_and_naming_are_parts_of_the_time_of_identification() {
    for options in [&[][..], &["--only", "pointing"]] {
        let report = report("orion/orion.png", options);
        let [all, pointing, naming] = ["identify", "pointing", "naming"]
            .map(|stage| number(&report, &format!("/timing_ms/{stage}")));
        assert!(pointing > 0.0);
        assert_eq!(naming > 0.0, options.is_empty());
        // Each is rounded to a thousandth.
        assert!(
            pointing + naming <= all + 0.002,
            "{pointing} {naming} {all}"
        );
    }
}

#[test]
fn lists_of_centroids_have_the_mode_too() {
    let table = Ran::new(
        starpipe()
            .args(["process", "--format", "csv"])
            .arg(fixture("orion/orion.png")),
    );
    let run = |options: &[&str]| {
        let mut command = starpipe();
        command.args(["identify", "--format", "json"]).args(options);
        command.arg("-").write_stdin(table.stdout.clone());
        Ran::new(&mut command).reports().remove(0)
    };
    let (all, bright) = (run(&[]), run(&["--only", "pointing"]));
    assert_eq!(bright["status"], "identified");
    assert!(named(&bright).len() <= named(&all).len());
    let [a, b] = [&all, &bright].map(|report| number(report, "/attitude/dec_deg"));
    assert!((a - b).abs() < 0.01, "{a} {b}");
}

#[test]
fn only_as_many_stars_are_measured_as_are_wanted() {
    let (all, bright) = (
        report("cygnus/cygnus.tif", &[]),
        report("cygnus/cygnus.tif", &["--max-stars", "30"]),
    );
    let stars = |report: &Value| report["stars"].as_array().unwrap().clone();
    let (all_stars, brightest) = (stars(&all), stars(&bright));
    assert!(all_stars.len() > 100 && brightest.len() == 30);
    // The strongest by signal-to-noise ratio; of equal ones, either.
    let least = |stars: &[Value]| {
        let snr = stars.iter().map(|star| number(star, "/snr"));
        snr.fold(f64::INFINITY, f64::min)
    };
    let stronger = all_stars.iter().map(|star| number(star, "/snr"));
    assert!(
        stronger
            .filter(|snr| *snr > 1.1 * least(&brightest))
            .count()
            <= 30
    );
    for star in &brightest {
        let place = |star: &Value| [number(star, "/x"), number(star, "/y")];
        let [x, y] = place(star);
        let is_same = |other: &Value| {
            let [u, v] = place(other);
            (x - u).hypot(y - v) < 0.1
        };
        assert!(all_stars.iter().any(is_same), "{star}");
    }
    // The limit of a frame is not that of the brightest stars.
    assert!(all["photometry"]["limit50_vmag"].is_number());
    assert!(bright["photometry"]["limit50_vmag"].is_null());
    let reason = bright["photometry"]["limit50_reason"].as_str().unwrap();
    assert!(reason.contains("brightest 30 detections"), "{reason}");
    assert!(bright["photometry"]["zero_point_vmag"].is_number());
}

#[test]
fn fewer_stars_never_cost_the_answer() {
    let Some(shared) = shared_dir() else {
        return;
    };
    let frame = shared.join("frames/hard/orion-phone.jpg");
    let frame = frame.to_str().unwrap();
    let of_all = report(frame, &[]);
    let of_few = report(frame, &["--max-stars", "200"]);
    assert_eq!(of_few["status"], "identified");
    for field in ["attitude", "optics", "match"] {
        assert_eq!(of_few[field], of_all[field]);
    }
    let notes = of_few["notes"].as_array().unwrap();
    assert!(notes.iter().any(|note| note["code"] == "more_stars"));
}

#[test]
fn too_few_wanted_stars_are_refused() {
    let mut command = starpipe();
    command.args(["process", "--max-stars", "3"]);
    let ran = Ran::new(command.arg(fixture("orion/orion.png")));
    assert_eq!(ran.status, 2);
    assert!(ran.stderr.contains("--max-stars"), "{}", ran.stderr);
}

#[test]
fn what_alone_is_wanted_is_the_pointing_or_refused() {
    let without_times = |options: &[&str]| {
        let mut report = report("cygnus/cygnus.tif", options);
        report["timing_ms"] = Value::Null;
        report
    };
    let asked = without_times(&["--only", "pointing"]);
    assert_eq!(asked, without_times(&["--attitude-only"]));
    let mut command = starpipe();
    command
        .args(["process", "--only", "names"])
        .arg(fixture("cygnus/cygnus.tif"));
    command.assert().code(2);
}
