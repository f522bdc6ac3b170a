//! The size of the frame of a list of centroids: as stated, as the camera's, or guessed with honest errors.

use crate::common::{Ran, fixture, sky, starpipe};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use serde_json::Value;
use starpipe::base::coords::{PixelPoint, Rotation, UnitVector};
use starpipe::camera::{CameraModel, Distortion, DistortionModel, focal_length_px};
use starpipe::centroids::ListedCentroid;
use starpipe::identify::Photometry;
use starpipe::{CentroidList, Context, Workspace, solve_centroids};
use std::f64::consts::{PI, TAU};
use std::fs;
use std::path::{Path, PathBuf};

/// The stars of the frame of Cygnus without those on its right, so that they reach less far than the frame.
fn list(directory: &Path) -> PathBuf {
    let table = Ran::new(
        starpipe()
            .args(["process", "--format", "csv"])
            .arg(fixture("cygnus/cygnus.tif")),
    );
    let is_kept = |line: &&str| {
        let x = line.split(',').nth(1).and_then(|x| x.parse::<f64>().ok());
        x.is_none_or(|x| x < 480.0)
    };
    let lines: Vec<&str> = table.stdout.lines().filter(is_kept).collect();
    let path = directory.join("stars.csv");
    fs::write(&path, lines.join("\n").replace(",vmag,", ",answer,")).unwrap();
    path
}

fn camera() -> PathBuf {
    fixture("cygnus/camera.toml")
}

fn identify(list: &Path, arguments: &[&str]) -> Ran {
    let mut command = starpipe();
    command.args(["identify", "--format", "json"]);
    Ran::new(command.args(arguments).arg(list))
}

fn has_note(report: &Value, code: &str) -> bool {
    let notes = report["notes"].as_array().unwrap();
    notes.iter().any(|note| note["code"] == code)
}

#[test]
fn the_size_is_the_cameras() {
    let directory = tempfile::tempdir().unwrap();
    let list = list(directory.path());
    let camera = camera();
    let with_camera = ["--camera", camera.to_str().unwrap()];
    let [of_camera, stated] = [
        identify(&list, &with_camera),
        identify(
            &list,
            &[&with_camera[..], &["--width", "512", "--height", "384"]].concat(),
        ),
    ];
    let (of_camera, stated) = (&of_camera.reports()[0], &stated.reports()[0]);
    assert_eq!(
        (&of_camera["width"], &of_camera["height"]),
        (&512.into(), &384.into())
    );
    for field in ["attitude", "optics", "match"] {
        assert_eq!(of_camera[field], stated[field]);
    }
    assert!(!has_note(of_camera, "size_guessed"));
}

#[test]
fn the_size_is_that_of_the_frames_in_which_the_lens_was_measured() {
    let directory = tempfile::tempdir().unwrap();
    let list = list(directory.path());
    let lens = "[lens]\nwidth_px = 512\nheight_px = 384\nmirrored = false\nprojection = \"pinhole\"\n\
                focal_length_px = 2435.6\ncovariance = [[1e-8]]\n";
    let alone = directory.path().join("lens.toml");
    fs::write(&alone, lens).unwrap();
    let alone = alone.to_str().unwrap();
    for more in [&[][..], &["--refine-lens"]] {
        let ran = identify(&list, &[&["--camera", alone], more].concat());
        assert_eq!(ran.reports()[0]["width"], 512, "{}", ran.stderr);
        assert!(!has_note(&ran.reports()[0], "size_guessed"));
    }
    // Frames of half the detector's resolution: data sheet and lens contradict each other.
    let both = directory.path().join("both.toml");
    let sheet = fs::read_to_string(camera()).unwrap();
    fs::write(
        &both,
        sheet + "\n" + &lens.replace("512", "256").replace("384", "192"),
    )
    .unwrap();
    let both = both.to_str().unwrap();
    let ran = identify(&list, &["--camera", both]);
    assert_eq!((ran.status, ran.stdout.as_str()), (2, ""));
    assert!(
        ran.stderr.contains("give the width and height"),
        "{}",
        ran.stderr
    );
    let ran = identify(&list, &["--camera", both, "--width", "512"]);
    assert_eq!(ran.reports()[0]["height"], 384, "{}", ran.stderr);
}

#[test]
fn what_contradicts_the_camera_is_an_error() {
    let directory = tempfile::tempdir().unwrap();
    let list = list(directory.path());
    let camera = camera();
    let camera = ["--camera", camera.to_str().unwrap()];
    for side in [
        &["--width", "600"][..],
        &["--height", "380"],
        &["--width", "384", "--height", "512"],
    ] {
        let ran = identify(&list, &[&camera[..], side].concat());
        assert_eq!((ran.status, ran.stdout.as_str()), (2, ""), "{side:?}");
        assert!(ran.stderr.contains("512 × 384"), "{}", ran.stderr);
    }
    let outside = directory.path().join("outside.csv");
    fs::write(&outside, "x,y,flux\n10,10,9\n600,20,8\n").unwrap();
    let ran = identify(&outside, &camera);
    assert_eq!(ran.status, 1);
    assert!(
        ran.stderr.contains("line 3: column x: 600"),
        "{}",
        ran.stderr
    );
}

#[test]
fn a_guessed_size_is_told_and_in_the_errors() {
    let directory = tempfile::tempdir().unwrap();
    let list = list(directory.path());
    let guessed = &identify(&list, &[]).reports()[0];
    let known = &identify(&list, &["--width", "512", "--height", "384"]).reports()[0];
    assert!(has_note(guessed, "size_guessed") && !has_note(known, "size_guessed"));
    let at = |report: &Value, pointer: &str| report.pointer(pointer).unwrap().as_f64().unwrap();
    for pointer in [
        "/attitude/sigma_arcsec/x",
        "/attitude/sigma_arcsec/y",
        "/optics/fov_x_sigma_deg",
    ] {
        assert!(at(guessed, pointer) > 2.0 * at(known, pointer), "{pointer}");
    }
    let covariance = at(guessed, "/attitude/covariance_arcsec2/1/1");
    let sigma = at(guessed, "/attitude/sigma_arcsec/y");
    assert!((covariance / (sigma * sigma) - 1.0).abs() < 1e-2);
    // One side that is stated is known.
    let half = &identify(&list, &["--width", "512"]).reports()[0];
    assert!(has_note(half, "size_guessed"));
    let along_x = at(half, "/attitude/sigma_arcsec/y") / at(known, "/attitude/sigma_arcsec/y");
    assert!(along_x < 1.5, "{along_x}");
}

// ---- Drawn lists

const SIDES_PX: [f64; 2] = [1200.0, 900.0];

/// The part of its frame that a list is of: as far as this share of each side.
const PARTS: [(&str, [f64; 2]); 4] = [
    ("whole", [1.0, 1.0]),
    ("left half", [0.5, 1.0]),
    ("upper half", [1.0, 0.5]),
    ("quarter", [0.5, 0.5]),
];

struct Drawn {
    camera: CameraModel,
    attitude: Rotation<starpipe::Icrs, starpipe::Camera>,
    list: CentroidList,
}

/// A list of about so many centroids of a part of a frame. The lens has its axis somewhere near the centre.
fn draw(rng: &mut ChaCha8Rng, fov_deg: f64, part: [f64; 2], stars: usize) -> Drawn {
    let [width_px, height_px] = SIDES_PX;
    let focal_px = focal_length_px(width_px, fov_deg.to_radians());
    let camera = CameraModel::pinhole(width_px, height_px, focal_px, rng.random_bool(0.5));
    let mut usual = |sigma_px: f64| sigma_px * rng.sample::<f64, _>(StandardNormal);
    let terms = [
        usual(2.0),
        0.0,
        0.0,
        usual(15.0),
        usual(15.0),
        usual(0.3),
        usual(0.3),
    ];
    let radius_px = camera.radius_px();
    let distortion = Distortion::new(DistortionModel::BrownConrady, radius_px, &terms);
    let camera = camera.with_distortion(Some(distortion));
    let dec_rad = rng.random_range(-1.0..1.0f64).asin();
    let centre = UnitVector::from_ra_dec(rng.random_range(0.0..TAU), dec_rad);
    let attitude = Rotation::looking_at(&centre, rng.random_range(-PI..PI));
    let mut seen: Vec<ListedCentroid> = Vec::new();
    sky()
        .grid
        .for_each_within(&centre, camera.radius_rad() * 1.1, 9.0, |star| {
            let star = &sky().stars()[star.index.get()];
            let Some(at) = camera.pixel_of(&attitude.apply(&star.direction)) else {
                return;
            };
            // Detectors keep some pixels from the border.
            let is_inside = (4.0..part[0] * width_px - 5.0).contains(&at.x)
                && (4.0..part[1] * height_px - 5.0).contains(&at.y);
            if is_inside {
                let [dx, dy, dm] =
                    [0.2, 0.2, 0.1].map(|s| s * rng.sample::<f64, _>(StandardNormal));
                let at = PixelPoint::new(at.x + dx, at.y + dy);
                let mut listed = ListedCentroid::new(at, f64::from(star.v_mag) + dm);
                listed.sigma_px = Some(0.2);
                seen.push(listed);
            }
        });
    seen.sort_by(|a, b| a.mag.total_cmp(&b.mag));
    seen.truncate(stars);
    let list = CentroidList {
        width: None,
        height: None,
        photometry: Photometry::Instrumental,
        has_brightness: true,
        centroids: seen,
    };
    Drawn {
        camera,
        attitude,
        list,
    }
}

/// Squared error of the attitude of a frame of guessed size over the stated one, for each of its three
/// angles; `None` where it is not identified.
fn squared_errors(drawn: &Drawn) -> Option<f64> {
    let context = Context::new(sky());
    let solution = solve_centroids(&drawn.list, &context, &mut Workspace::new()).unwrap();
    let found = solution.outcome.identification()?;
    assert_eq!(found.camera.mirrored, drawn.camera.mirrored);
    let turn = found.icrs_to_camera.matrix() * drawn.attitude.matrix().transpose();
    let half = (turn - turn.transpose()) * 0.5;
    let error = starpipe::nalgebra::Vector3::new(half[(2, 1)], half[(0, 2)], half[(1, 0)]);
    let inverse = found.attitude_covariance_rad2.try_inverse().unwrap();
    Some((error.transpose() * inverse * error)[0] / 3.0)
}

#[test]
fn errors_of_a_guessed_size_are_as_stated() {
    let trials: usize = std::env::var("TRIALS").map_or(6, |count| count.parse().unwrap());
    let mut rng = ChaCha8Rng::seed_from_u64(17);
    for (fov_deg, stars) in [(20.0, 300), (20.0, 30), (6.0, 60)] {
        let mut of_all = Vec::new();
        for (name, part) in PARTS {
            let drawn = (0..trials).map(|_| draw(&mut rng, fov_deg, part, stars));
            let squares: Vec<f64> = drawn.filter_map(|drawn| squared_errors(&drawn)).collect();
            let mean = squares.iter().sum::<f64>() / squares.len() as f64;
            let largest = squares.iter().copied().fold(0.0, f64::max);
            println!(
                "{fov_deg}° {stars} stars, {name}: {} identified, mean {mean:.3}, largest {largest:.2}",
                squares.len()
            );
            assert!(largest < 25.0, "{name}: {squares:?}");
            of_all.extend(squares);
        }
        let mean = of_all.iter().sum::<f64>() / of_all.len() as f64;
        println!("{fov_deg}° {stars} stars: mean {mean:.3}");
        assert!((0.2..2.5).contains(&mean), "{mean}");
    }
}
