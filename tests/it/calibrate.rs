//! The lens of a camera, measured in several frames and held, through the program.

use crate::common::{Ran, number, starpipe};
use image::{ImageBuffer, Luma};
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
        "--site=20,-170,500".to_owned(),
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

#[test]
fn copies_of_a_frame_are_one_observation_and_are_named() {
    let directory = tempfile::tempdir().unwrap();
    let night = directory.path().join("night");
    frames(&night, &[&LENS[..], &["--seed=3", "--count=2"]].concat());
    let path = |name: &str| directory.path().join(name);
    let frame = night.join("frame-00000.tif");
    let copies = [path("copy.tif"), path("scaled.png"), path("turned.png")];
    fs::copy(&frame, &copies[0]).unwrap();
    let read = starpipe::frame::read(&frame).unwrap();
    let levels = read.pixels.to_f32();
    let levels: Vec<u16> = levels.iter().map(|level| *level as u16).collect();
    let (width, height) = (read.width as u32, read.height as u32);
    let picture = ImageBuffer::<Luma<u16>, _>::from_raw(width, height, levels).unwrap();
    let mut scaled = picture.clone();
    for pixel in scaled.pixels_mut() {
        pixel.0[0] = 500 + pixel.0[0] / 2;
    }
    scaled.save(&copies[1]).unwrap();
    image::imageops::rotate180(&picture)
        .save(&copies[2])
        .unwrap();
    let paths: Vec<&Path> = copies.iter().map(PathBuf::as_path).collect();
    let (alone, _) = calibrated(&[&frame], &[]);
    let (found, status) = calibrated(&[&[frame.as_path()], &paths[..]].concat(), &[]);
    assert_eq!(status, 3, "frames are left out");
    assert_eq!(found["lens"], alone["lens"]);
    let left_out = found["left_out"].as_array().unwrap();
    assert_eq!(left_out.len(), copies.len(), "{left_out:?}");
    for left_out in left_out {
        assert_eq!(left_out["code"], "copy");
        let text = left_out["text"].as_str().unwrap();
        assert!(text.contains("frame-00000.tif"), "{text}");
    }
    let other = night.join("frame-00001.tif");
    let (both, status) = calibrated(&[&frame, &other], &[]);
    assert_eq!((status, &both["directions"]), (0, &2.into()));
}

#[test]
fn frames_of_one_direction_are_known_to_be_and_their_outermost_stars_count_once() {
    let directory = tempfile::tempdir().unwrap();
    let night = directory.path().join("night");
    let pointing = ["--ra=83.8", "--dec=-1.2", "--count=4", "--seed=5", "--out"];
    let ran = Ran::new(
        starpipe()
            .args(["simulate", DATE])
            .arg(format!("--camera={CAMERA}"))
            .args(LENS)
            .args(pointing)
            .arg(&night),
    );
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    let frame = night.join("frame-00000.tif");
    let (one, _) = calibrated(&[&frame], &[]);
    let paths = (0..4).map(|number| night.join(format!("frame-{number:05}.tif")));
    let paths: Vec<PathBuf> = paths.collect();
    let paths: Vec<&Path> = paths.iter().map(PathBuf::as_path).collect();
    let (all, status) = calibrated(&paths, &[]);
    assert_eq!(
        (status, &all["directions"]),
        (0, &1.into()),
        "{}",
        all["left_out"]
    );
    let sigma = |found: &Value| number(found, "/lens/focal_length_sigma_px");
    // The noise of four frames is new: half the error.
    let ratio = sigma(&all) / sigma(&one);
    assert!((0.35..0.75).contains(&ratio), "{ratio}");
}

#[test]
fn what_cannot_be_exported_does_not_cost_the_lens() {
    let directory = tempfile::tempdir().unwrap();
    let night = directory.path().join("night");
    frames(&night, &[&LENS[..], &["--seed=3", "--count=2"]].concat());
    let (path, out) = lens_file(directory.path());
    let other = directory.path().join("cv.yaml");
    let ran = Ran::new(
        starpipe()
            .args(["calibrate", "--format=json", DATE, &out, "--platepar"])
            .arg(directory.path().join("rms.cal"))
            .arg("--opencv")
            .arg(&other)
            .arg("--plot")
            .arg(directory.path().join("not/there.svg"))
            .arg(&night),
    );
    assert_eq!(ran.status, 1);
    for told in ["rms.cal: no frame has both a site", "not/there.svg"] {
        assert!(ran.stderr.contains(told), "{}", ran.stderr);
    }
    assert!(path.exists() && other.exists());
    assert!(!directory.path().join("rms.cal").exists());
    assert_eq!(ran.reports()[0]["lens"]["model"], "pinhole");
}

#[test]
fn of_two_lenses_that_contradict_each_other_the_first_is_measured() {
    let directory = tempfile::tempdir().unwrap();
    let [night, other] = ["night", "other"].map(|name| directory.path().join(name));
    let barrel = |px: &'static str| [px, "--count=2", "--seed=3"];
    frames(&night, &barrel("--distortion-px=-30"));
    frames(
        &other,
        &[&barrel("--distortion-px=10")[..], &["--first=7"]].concat(),
    );
    let (found, status) = calibrated(&[&night, &other], &[]);
    assert_eq!(status, 3);
    let left_out = found["left_out"].as_array().unwrap();
    assert_eq!(left_out.len(), 2, "{left_out:?}");
    for left_out in left_out {
        assert_eq!(left_out["code"], "misfit");
        assert!(left_out["frame"].as_str().unwrap().contains("other"));
    }
    let off_px = number(&found, "/lens/coefficients_px/0") + 30.0;
    assert!(off_px.abs() < 0.5, "{off_px}");

    // As many of another focal length.
    let longer = directory.path().join("longer");
    frames(&longer, &["--focal-length-mm=35", "--count=2", "--seed=5"]);
    let (found, _) = calibrated(&[&night, &longer], &[]);
    let left_out = found["left_out"].as_array().unwrap();
    assert_eq!(left_out.len(), 2, "{left_out:?}");
    assert!(
        left_out
            .iter()
            .all(|left_out| left_out["code"] == "other_focal_length")
    );
}
