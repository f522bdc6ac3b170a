//! `starpipe night` on a simulated night of an all-sky camera that stands still, is clouded, and is knocked.

use crate::common::{Ran, starpipe};
use nalgebra::Vector3;
use serde_json::Value;
use starpipe::base::coords::{Camera, Horizon, Rotation};
use starpipe::base::epoch::ObservationDate;
use starpipe::ephemeris::observer::Site;
use starpipe::ephemeris::places::StarPlaces;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

const SITE: &str = "50,10,300";
const FRAMES: usize = 12;
/// Frames with clouds all over, and the first one after the knock.
const CLOUDED: std::ops::Range<usize> = 4..7;
const KNOCKED: usize = 9;
const KNOCK_DEG: f64 = 2.0;
/// 600 pixels across a field of 176°.
const CAMERA: &str = r#"
name = "all-sky camera"
width_px = 600
height_px = 600
pitch_x_um = 6
pitch_y_um = 6
focal_length_mm = 1.172
aperture_mm = 1.2
lens_transmission = 0.87
quantum_efficiency = 0.7
band_from_nm = 400
band_to_nm = 800
read_noise_e = 5
dark_current_e_s = 0.1
full_well_e = 60000
gain_e_per_adu = 1
bits = 16
bias_adu = 100
spot_sigma_px = 0.8
projection = "equidistant"
field_radius_deg = 88
"#;

/// A frame each five minutes.
fn date(number: usize) -> ObservationDate {
    const MJD: f64 = 61_055.875;
    ObservationDate::from_modified_julian_date(MJD + number as f64 * 300.0 / 86_400.0).unwrap()
}

/// 3° from the zenith, image-up to the north, and the image seen from below.
fn pointing(number: usize) -> Rotation<Horizon, Camera> {
    // East on the left, south below.
    let up = Rotation::from_quaternion([0.0, 0.0, 0.0, 1.0]);
    let tilted = up.then_turn(Vector3::new(3_f64.to_radians(), 0.0, 0.0));
    let knock_rad = if number < KNOCKED {
        0.0
    } else {
        KNOCK_DEG.to_radians()
    };
    tilted.then_turn(Vector3::new(0.0, knock_rad, 0.0))
}

/// Right ascension, declination and position angle of image-up, in degrees.
fn attitude(number: usize) -> [f64; 3] {
    let site: Site = SITE.parse().unwrap();
    let places = StarPlaces::at(&date(number), Some(site), None);
    let matrix = pointing(number).matrix() * places.horizon().unwrap().matrix();
    let (boresight, up_rad) = places
        .astrometric_attitude(&Rotation::from_matrix(matrix))
        .boresight_and_up();
    let (ra_rad, dec_rad) = boresight.to_ra_dec();
    [ra_rad, dec_rad, up_rad].map(f64::to_degrees)
}

/// The frames and the camera, drawn once.
fn drawn() -> &'static Path {
    static DRAWN: OnceLock<tempfile::TempDir> = OnceLock::new();
    let draw = || {
        let directory = tempfile::tempdir().unwrap();
        let camera = directory.path().join("camera.toml");
        fs::write(&camera, CAMERA).unwrap();
        fs::create_dir(directory.path().join("frames")).unwrap();
        for number in 0..FRAMES {
            let [ra, dec, roll] = attitude(number);
            let out = directory.path().join(format!("frames/{number:02}.fits"));
            let mut command = starpipe();
            command
                .args([
                    "simulate",
                    "--exposure=20",
                    "--by-altitude=1",
                    "--extinction=0.17",
                ])
                .args([
                    "--sky-mag-arcsec2=20.5",
                    "--hot-pixels-per-mpx=50",
                    "--hot-pixel-e-s=2000",
                ])
                .arg(format!("--camera={}", camera.display()))
                .arg(format!("--seed={}", 1 + number))
                .arg(format!("--ra={}", ra.rem_euclid(360.0)))
                .arg(format!("--dec={dec}"))
                .arg(format!("--roll={roll}"))
                .arg(format!("--date={}", date(number).to_iso()))
                .arg(format!("--site={SITE}"))
                .arg(format!("--out={}", out.display()));
            if CLOUDED.contains(&number) {
                command.args(["--cloud-mag=6", "--cloud-light=0.3", "--cloud-bank-px=-700"]);
            }
            let ran = Ran::new(&mut command);
            assert_eq!(ran.status, 0, "{}", ran.stderr);
        }
        directory
    };
    DRAWN.get_or_init(draw).path()
}

fn night(out: &Path, more: &[&str]) -> Ran {
    let drawn = drawn();
    Ran::new(
        starpipe()
            .args(["night", "--format=json"])
            .arg(format!("--site={SITE}"))
            .arg(format!("--camera={}", drawn.join("camera.toml").display()))
            .arg(format!("--out={}", out.display()))
            .args(more)
            .arg(drawn.join("frames")),
    )
}

fn rows(out: &Path) -> Vec<Value> {
    let text = fs::read_to_string(out.join("night.jsonl")).unwrap();
    text.lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect()
}

fn contents(out: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let files = fs::read_dir(out)
        .unwrap()
        .map(|entry| entry.unwrap().path());
    let mut all: Vec<_> = files
        .map(|path| {
            let content = fs::read(&path).unwrap();
            (path.strip_prefix(out).unwrap().to_owned(), content)
        })
        .collect();
    all.sort();
    all
}

#[test]
fn a_night_tells_clouds_and_the_knock_and_goes_on_where_it_stopped() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().join("night");
    let ran = night(&out, &[]);
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    let summary: Value = serde_json::from_str(&ran.stdout).unwrap();

    let rows = rows(&out);
    assert_eq!(rows.len(), FRAMES);
    for (number, row) in rows.iter().enumerate() {
        let is_clouded = CLOUDED.contains(&number);
        let cloud_share = row["cloud_share"].as_f64().unwrap();
        assert_eq!(cloud_share > 0.3, is_clouded, "{number}: {cloud_share}");
        let zenith = row["zenith_mag_arcsec2"].as_f64().unwrap();
        assert!((19.8..20.8).contains(&zenith), "{number}: {zenith}");
        if row["pointing"] == "held" {
            assert!(is_clouded);
            continue;
        }
        assert_eq!(row["status"], "identified");
        let shift_deg = row["shift_arcmin"].as_f64().unwrap() / 60.0;
        // Three frames confirm the knock, and all are of the last batch.
        let expected_deg = if number < KNOCKED { 0.0 } else { KNOCK_DEG };
        assert!(
            (shift_deg - expected_deg).abs() < 0.05,
            "{number}: {shift_deg}"
        );
    }
    let moments = summary["moments"].as_array().unwrap().iter();
    let knocks: Vec<&Value> = moments.filter(|moment| moment["kind"] == "knock").collect();
    assert_eq!(knocks.len(), 1);
    assert_eq!(knocks[0]["frame"], KNOCKED);
    assert!((summary["knocks"][0]["shift_deg"].as_f64().unwrap() - KNOCK_DEG).abs() < 0.05);

    let whole = contents(&out);
    let journal = out.join("night.jsonl");
    let text = fs::read(&journal).unwrap();
    // As if it had been killed within the second batch.
    fs::write(&journal, &text[..text.len() * 5 / 6]).unwrap();
    for name in ["night.csv", "night.json", "night.svg"] {
        fs::remove_file(out.join(name)).unwrap();
    }
    assert_eq!(night(&out, &["--threads=1"]).status, 0);
    assert!(contents(&out) == whole);

    // A byte of the sixth row flipped, two rows exchanged, and a state file that is not JSON any longer.
    let mut lines: Vec<Vec<u8>> = text
        .split_inclusive(|b| *b == b'\n')
        .map(<[u8]>::to_vec)
        .collect();
    lines[5][100] ^= 1;
    lines.swap(8, 9);
    fs::write(&journal, lines.concat()).unwrap();
    fs::write(out.join("night-run.json"), "{").unwrap();
    let mended = night(&out, &[]);
    assert_eq!(mended.status, 0);
    for told in [
        "night.jsonl: 1 line damaged; their frames are processed again: 6\n",
        "night-run.json was damaged",
    ] {
        assert!(mended.stderr.contains(told), "{}", mended.stderr);
    }
    assert!(contents(&out) == whole);
    // Whose rows these are, nothing tells.
    fs::write(out.join("night-run.json"), "{").unwrap();
    let refused = night(&out, &["--exposure=10"]);
    assert_eq!(refused.status, 2);
    assert!(
        refused.stderr.contains("night-run.json is damaged"),
        "{}",
        refused.stderr
    );
    assert_eq!(night(&out, &[]).status, 0);

    let refused = night(&out, &["--exposure=10"]);
    assert_eq!(refused.status, 2);
    assert!(
        refused
            .stderr
            .contains("has the results of a run with other settings"),
        "{}",
        refused.stderr
    );
    assert!(contents(&out) == whole);
}

#[test]
fn one_date_for_all_frames_is_refused() {
    let ran = night(Path::new("never-made"), &["--date=2026-01-15T20:00Z"]);
    assert_eq!(ran.status, 2);
    assert!(ran.stderr.contains("--utc-offset"), "{}", ran.stderr);
    assert!(!Path::new("never-made").exists());
}
