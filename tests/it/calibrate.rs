//! The lens of a camera, measured in several frames and held, through the program.

use crate::common::{Ran, number, starpipe};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

const DATE: &str = "--date=2000-01-01T12:00:00Z";
/// Third order, and an axis off the centre, in pixels.
const LENS: [&str; 3] = ["--distortion-px=-30", "--axis-x-px=12", "--axis-y-px=-8"];
const CAMERA: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/validation/camera.toml");

/// Frames of a camera in a directory, without their tables.
fn frames(out: &Path, more: &[&str]) -> Vec<Value> {
    let ran = Ran::new(
        starpipe()
            .args(["simulate", "--format=json", "--random-attitude", DATE])
            .arg(format!("--camera={CAMERA}"))
            .arg(format!("--out={}", out.display()))
            .args(more),
    );
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    for entry in fs::read_dir(out).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|extension| extension == "csv") {
            fs::remove_file(path).unwrap();
        }
    }
    ran.reports()
}

fn calibrated(frames: &[&Path], more: &[&str]) -> (Value, i32) {
    let ran = Ran::new(
        starpipe()
            .args(["calibrate", "--format=json", DATE])
            .args(frames)
            .args(more),
    );
    assert!(ran.status == 0 || ran.status == 3, "{}", ran.stderr);
    (ran.reports().remove(0), ran.status)
}

fn lens_file(directory: &Path) -> (PathBuf, String) {
    let path = directory.join("lens.toml");
    let out = format!("--out={}", path.display());
    (path, out)
}

#[test]
fn a_lens_is_measured_within_its_errors_and_frames_that_do_not_fit_are_named() {
    let directory = tempfile::tempdir().unwrap();
    let [night, other] = ["night", "other"].map(|name| directory.path().join(name));
    let made = frames(&night, &[&LENS[..], &["--seed=3", "--count=8"]].concat());
    // Another focus: 0.4 % longer.
    frames(
        &other,
        &[
            &LENS[..],
            &["--seed=4", "--count=1", "--focal-length-mm=26.897"],
        ]
        .concat(),
    );
    let (path, out) = lens_file(directory.path());
    let plot = format!("--plot={}", directory.path().join("map.svg").display());
    let (found, status) = calibrated(&[&night, &other], &[&out, &plot]);
    assert_eq!(status, 3, "a frame is left out");
    let left_out = found["left_out"].as_array().unwrap();
    assert_eq!(
        (left_out.len(), &left_out[0]["code"]),
        (1, &Value::from("misfit"))
    );
    assert!(left_out[0]["frame"].as_str().unwrap().contains("other"));

    let lens = &found["lens"];
    assert_eq!(lens["model"], "pinhole");
    assert!(lens["valid_to_deg"].is_null());
    let focal_px = number(lens, "/focal_length_px") - number(&made[0], "/focal_length_px");
    // The error of the focal length is that on the axis.
    assert!(
        focal_px.abs() < 5.0 * number(lens, "/focal_length_sigma_px"),
        "{focal_px}"
    );
    for (term, truth) in [(0, -30.0), (3, 12.0), (4, -8.0)] {
        let off = number(lens, &format!("/coefficients_px/{term}")) - truth;
        let sigma = number(lens, &format!("/sigma_px/{term}"));
        assert!(off.abs() < 4.5 * sigma, "{term}: {off} {sigma}");
    }
    let ratio = number(&found, "/held_out_rms_px") / number(&found, "/rms_px");
    assert!((0.95..1.08).contains(&ratio), "{ratio}");
    let text = fs::read_to_string(&path).unwrap();
    assert!(text.starts_with("# Measured by starpipe") && text.contains("[lens]"));
    assert!(
        fs::read_to_string(directory.path().join("map.svg"))
            .unwrap()
            .contains("<svg")
    );
}

#[test]
fn a_lens_that_is_held_gives_a_surer_attitude_and_another_lens_is_noticed() {
    let directory = tempfile::tempdir().unwrap();
    let night = directory.path().join("night");
    frames(&night, &[&LENS[..], &["--seed=3", "--count=8"]].concat());
    let (path, out) = lens_file(directory.path());
    calibrated(&[&night], &[&out]);

    let new = directory.path().join("new");
    let made = frames(&new, &[&LENS[..], &["--seed=9", "--count=3"]].concat());
    let camera = format!("--camera={}", path.display());
    let solve = |frames: &Path, more: &[&str]| {
        let ran = Ran::new(
            starpipe()
                .args(["process", "--format=json", DATE])
                .args(more)
                .arg(frames),
        );
        assert_eq!(ran.status, 0, "{}", ran.stderr);
        ran.reports()
    };
    let held = solve(&new, &[&camera]);
    let free = solve(&new, &[&camera, "--refine-lens"]);
    let sigma = |report: &Value| number(report, "/attitude/sigma_arcsec/x");
    for ((held, free), made) in held.iter().zip(&free).zip(&made) {
        assert_eq!(
            (&held["optics"]["held"], &free["optics"]["held"]),
            (&true.into(), &false.into())
        );
        assert!(
            sigma(held) < 0.8 * sigma(free),
            "{} {}",
            sigma(held),
            sigma(free)
        );
        let at =
            |report: &Value, name: &str| number(report, &format!("/attitude/{name}")).to_radians();
        let north = at(held, "dec_deg") - at(made, "dec_deg");
        let east = (at(held, "ra_deg") - at(made, "ra_deg")) * at(made, "dec_deg").cos();
        let off_arcsec = east.hypot(north).to_degrees() * 3600.0;
        assert!(off_arcsec < 5.0 * sigma(held), "{off_arcsec}");
    }

    let refocused = directory.path().join("refocused");
    frames(
        &refocused,
        &[
            &LENS[..],
            &["--seed=9", "--count=1", "--focal-length-mm=26.897"],
        ]
        .concat(),
    );
    let noted = |report: &Value, code: &str| {
        let notes = report["notes"].as_array().unwrap();
        notes.iter().any(|note| note["code"] == code)
    };
    let found = solve(&refocused, &[&camera]).remove(0);
    assert!(noted(&found, "lens_differs") && found["optics"]["held"] == false);
    let orion = Path::new(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/fixtures/orion/orion.png"
    ));
    let found = solve(orion, &[&camera]).remove(0);
    assert!(noted(&found, "lens_of_other_size"));
}

#[test]
fn a_camera_on_the_ground_is_found_to_stand_still() {
    let directory = tempfile::tempdir().unwrap();
    let site = "--site=46.5,7.9,3500";
    let paths: Vec<PathBuf> = [
        ("a", "22:00", "83.8"),
        ("b", "22:10", "86.30684"),
        ("c", "22:30", "91.32053"),
    ]
    .into_iter()
    .map(|(name, time, ra)| {
        let path = directory.path().join(format!("{name}.fits"));
        // The sky turns; the boresight stays at declination 5 in the true equator's frame, nearly.
        let ran = Ran::new(
            starpipe()
                .args(["simulate", "--preset=imx174-35mm", site, "--dec=5"])
                .arg(format!("--date=2000-01-01T{time}:00Z"))
                .arg(format!("--ra={ra}"))
                .arg(format!("--out={}", path.display())),
        );
        assert_eq!(ran.status, 0, "{}", ran.stderr);
        path
    })
    .collect();
    let paths: Vec<&Path> = paths.iter().map(PathBuf::as_path).collect();
    let ran = Ran::new(
        starpipe()
            .args(["calibrate", "--format=json", site])
            .args(&paths),
    );
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    let found = ran.reports().remove(0);
    let mount = &found["mount"];
    let altitude_deg = number(mount, "/altitude_deg");
    assert!((35.0..55.0).contains(&altitude_deg), "{altitude_deg}");
    assert!(number(mount, "/scatter_arcsec") < 30.0, "{mount}");
    assert!(found["drift"]["scale_ppm_per_day"].is_number());
}

#[test]
fn lenses_of_other_programs_are_written_and_held() {
    let directory = tempfile::tempdir().unwrap();
    let night = directory.path().join("night");
    frames(&night, &[&LENS[..], &["--seed=3", "--count=4"]].concat());
    let path = |name: &str| directory.path().join(name);
    let option = |name: &str, file: &str| format!("--{name}={}", path(file).display());
    let more = [
        option("opencv", "cv.yaml"),
        option("ros", "ros.yaml"),
        option("platepar", "rms.cal"),
        "--site=46.5,7.9,500".to_owned(),
    ];
    let more: Vec<&str> = more.iter().map(String::as_str).collect();
    calibrated(&[&night], &more);
    let frame = night.join("frame-00000.tif");
    for name in ["cv.yaml", "ros.yaml", "rms.cal"] {
        let camera = format!("--camera={}", path(name).display());
        let ran = Ran::new(
            starpipe()
                .args(["process", "--format=json", DATE, &camera])
                .arg(&frame),
        );
        assert_eq!(ran.status, 0, "{name}: {}", ran.stderr);
        let found = ran.reports().remove(0);
        assert_eq!(found["optics"]["held"], true, "{name}: {}", found["notes"]);
    }
    let ran = Ran::new(starpipe().args(["calibrate", more[0]]).arg(&night));
    assert_eq!(ran.status, 2, "the file exists");
}

#[test]
fn what_is_no_night_is_refused_and_files_are_kept() {
    let directory = tempfile::tempdir().unwrap();
    let kept = directory.path().join("kept.toml");
    fs::write(&kept, "name = \"mine\"\n").unwrap();
    let out = format!("--out={}", kept.display());
    let ran = Ran::new(starpipe().args(["calibrate", &out, "none.tif"]));
    assert_eq!(ran.status, 2);
    assert!(ran.stderr.contains("--force overwrites it"));
    assert_eq!(fs::read_to_string(&kept).unwrap(), "name = \"mine\"\n");

    let blank = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/fixtures/regression/no-stars.tif"
    );
    let ran = Ran::new(starpipe().args(["calibrate", blank]));
    assert_eq!(ran.status, 1);
    assert!(
        ran.stderr.contains("none of the frames is identified"),
        "{}",
        ran.stderr
    );
}
