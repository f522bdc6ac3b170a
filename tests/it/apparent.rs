//! Aberration and refraction, through the program.

use crate::common::{Ran, number, starpipe};
use serde_json::Value;
use std::path::Path;

const DATE: &str = "--date=2024-11-05T22:10:00Z";
const SITE: &str = "--site=46.5,7.9,3500";
/// Some 65° from the zenith then and there.
const LOW: [&str; 2] = ["--ra=83.8", "--dec=-1.2"];

fn simulated(out: &Path, more: &[&str]) -> Value {
    let ran = Ran::new(
        starpipe()
            .args([
                "simulate",
                "--format=json",
                "--preset=imx174-35mm",
                "--seed=5",
            ])
            .args(LOW)
            .arg(format!("--out={}", out.display()))
            .args(more),
    );
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    ran.reports().remove(0)
}

fn processed(frame: &Path, more: &[&str]) -> Value {
    let ran = Ran::new(
        starpipe()
            .args(["process", "--format=json"])
            .args(more)
            .arg(frame),
    );
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    ran.reports().remove(0)
}

/// Angle between two centres.
fn apart_arcsec(found: &Value, made: &Value) -> f64 {
    let at = |report: &Value, name: &str| number(report, &format!("/attitude/{name}")).to_radians();
    let east = (at(found, "ra_deg") - at(made, "ra_deg")) * at(made, "dec_deg").cos();
    let north = at(found, "dec_deg") - at(made, "dec_deg");
    east.hypot(north).to_degrees() * 3600.0
}

/// Errors of the focal length and of the centre, in their standard errors.
fn pulls(found: &Value, made: &Value) -> [f64; 2] {
    let focal_px = number(found, "/optics/focal_length_px") - number(made, "/focal_length_px");
    [
        focal_px / number(found, "/optics/focal_length_sigma_px"),
        apart_arcsec(found, made) / number(found, "/attitude/sigma_arcsec/x"),
    ]
}

#[test]
fn the_focal_length_is_the_cameras_own_where_date_and_site_are_known() {
    let directory = tempfile::tempdir().unwrap();
    let frame = directory.path().join("low.tif");
    let made = simulated(&frame, &[DATE, SITE, "--air=640,-5"]);

    let found = processed(&frame, &[DATE, SITE, "--air=640,-5"]);
    let [focal, centre] = pulls(&found, &made);
    assert!(focal.abs() < 4.0 && centre < 5.0, "{focal} {centre}");
    let applied =
        serde_json::json!({"aberration": true, "refraction": true, "date_assumed": false});
    assert_eq!(found["apparent"], applied);

    let airless = processed(&frame, &[DATE]);
    assert_eq!(airless["apparent"]["refraction"], false);
    let [focal, _] = pulls(&airless, &made);
    assert!(focal.abs() > 10.0, "{focal}");
}

#[test]
fn a_wrong_time_refracts_nothing() {
    let directory = tempfile::tempdir().unwrap();
    let frame = directory.path().join("space.tif");
    let date = "--date=2024-11-05T10:10:00Z";
    let made = simulated(&frame, &[date]);
    let found = processed(&frame, &[date, SITE]);
    assert_eq!(found["apparent"]["refraction"], false);
    let notes = found["notes"].as_array().unwrap();
    assert!(notes.iter().any(|note| note["code"] == "below_horizon"));
    let [focal, centre] = pulls(&found, &made);
    assert!(focal.abs() < 4.0 && centre < 5.0, "{focal} {centre}");
}

#[test]
fn a_spacecraft_is_turned_as_it_is_and_looks_where_the_stars_are() {
    let directory = tempfile::tempdir().unwrap();
    let frame = directory.path().join("orbit.tif");
    let moving = [DATE, "--velocity=-7.4,1.1,0.6"];
    let made = simulated(&frame, &moving);
    let found = processed(&frame, &moving);
    let [focal, centre] = pulls(&found, &made);
    assert!(focal.abs() < 4.0 && centre < 5.0, "{focal} {centre}");

    let own = processed(&frame, &[&moving[..], &["--frame-of=apparent"]].concat());
    assert_eq!(own["attitude"]["frame_of"], "apparent");
    // Aberration by the Earth's motion and the spacecraft's.
    let away_arcsec = apart_arcsec(&own, &found);
    assert!((5.0..26.0).contains(&away_arcsec), "{away_arcsec}");
}

#[test]
fn a_frame_without_date_says_so_and_its_focal_length_is_less_certain() {
    let directory = tempfile::tempdir().unwrap();
    let frame = directory.path().join("undated.tif");
    simulated(&frame, &[]);
    let found = processed(&frame, &[]);
    let notes = found["notes"].as_array().unwrap();
    assert!(notes.iter().any(|note| note["code"] == "date_unknown"));
    assert_eq!(found["apparent"]["date_assumed"], true);
    let dated = processed(&frame, &[DATE]);
    let sigma_px = |report: &Value| number(report, "/optics/focal_length_sigma_px");
    let unknown = sigma_px(&found).powi(2) - sigma_px(&dated).powi(2);
    let relative = unknown.sqrt() / number(&found, "/optics/focal_length_px");
    assert!((2e-5..7.1e-5).contains(&relative), "{relative}");
}

#[test]
fn what_cannot_be_of_one_observer_is_refused() {
    for (arguments, expected) in [
        (&["--air=1000,10"][..], "--site"),
        (&[SITE, "--velocity=1,2,3"], "cannot be used with"),
        (&["--velocity=1,2"], "three numbers"),
        (&[SITE, "--air=5000,10"], "from 0 to 1200 hPa"),
    ] {
        let ran = Ran::new(starpipe().arg("process").args(arguments).arg("none.tif"));
        assert_eq!(ran.status, 2, "{arguments:?}");
        assert!(
            ran.stderr.contains(expected),
            "{arguments:?}: {}",
            ran.stderr
        );
    }
}
