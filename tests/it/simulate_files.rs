//! `starpipe simulate` through the program: its files, their headers, and what it refuses.

use crate::common::{Ran, Truth, names, number, starpipe};
use serde_json::Value;
use starpipe::frame;
use std::collections::HashMap;
use std::fs;
use std::path::Path;

/// A field of 14° with hundreds of detectable stars.
const CAMERA: &[&str] = &[
    "--preset=nanosat-tracker",
    "--width-px=640",
    "--height-px=480",
    "--pitch-x-um=6",
    "--pitch-y-um=6",
];
/// A direction in the Milky Way.
const SKY: &[&str] = &["--ra=310", "--dec=40", "--roll=25"];

fn simulate(out: &Path, more: &[&str]) -> Ran {
    let out = format!("--out={}", out.display());
    Ran::new(
        starpipe()
            .args(["simulate", "--format=json", &out])
            .args(CAMERA)
            .args(more),
    )
}

fn made(out: &Path, more: &[&str]) -> Vec<Value> {
    let ran = simulate(out, more);
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    ran.reports()
}

fn refused(out: &Path, more: &[&str], what: &str) {
    let ran = simulate(out, more);
    assert_eq!((ran.status, ran.stdout.as_str()), (2, ""), "{more:?}");
    assert!(ran.stderr.contains(what), "{more:?}: {}", ran.stderr);
}

/// A row of a table, by column.
type Row = HashMap<String, String>;

fn rows(path: &Path) -> Vec<Row> {
    let mut reader = csv::Reader::from_path(path).unwrap();
    reader.deserialize().map(Result::unwrap).collect()
}

#[test]
fn a_frame_says_how_it_was_made_in_fits_and_in_tiff() {
    let directory = tempfile::tempdir().unwrap();
    let at = |name: &str| directory.path().join(name);
    let more = ["--exposure=0.25", "--date=2026-03-04T05:06:07Z", "--seed=9"];
    let all = [SKY, &more].concat();
    made(&at("a.fits"), &all);
    made(&at("a.tif"), &[&all[..], &["--force"]].concat());
    made(&at("packed.tif"), &[&all[..], &["--compress"]].concat());
    let fits = frame::read(at("a.fits")).unwrap();
    assert_eq!((fits.width, fits.height), (640, 480));
    let known = &fits.metadata;
    assert_eq!(known.exposure_s, Some(0.25));
    assert_eq!(known.pixel_size_um, Some(6.0));
    assert_eq!(known.focal_length_mm, Some(16.0));
    assert_eq!(known.date.unwrap().to_iso(), "2026-03-04T05:06:07Z");
    // The same pixels in every file format.
    for name in ["a.tif", "packed.tif"] {
        assert_eq!(frame::read(at(name)).unwrap().pixels, fits.pixels, "{name}");
    }
    let size = |name: &str| fs::metadata(at(name)).unwrap().len();
    assert!(size("packed.tif") < size("a.tif"));
    let content = fs::read(at("a.fits")).unwrap();
    let tiff = fs::read(at("a.tif")).unwrap();
    let holds = |content: &[u8], text: &str| {
        content
            .windows(text.len())
            .any(|part| part == text.as_bytes())
    };
    for text in [
        "IMAGETYP= 'Light Frame'",
        "EXPTIME =",
        "EGAIN   =",
        "RDNOISE =",
        "SATURATE=",
        "CTYPE1  = 'RA---TAN-SIP'",
        "HISTORY seed = 9, frame 0",
    ] {
        assert!(holds(&content, text), "{text}");
    }
    for text in [
        "seed = 9, frame 0",
        "exposure_s = 0.25",
        "spot_form = gaussian",
    ] {
        assert!(holds(&content, text) && holds(&tiff, text), "{text}");
    }
}

#[test]
fn the_table_has_stars_trails_and_rays_at_their_positions() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().join("a.fits");
    let more = ["--false-stars=20", "--trails=3", "--cosmic-rays-cm2-s=100"];
    made(&out, &[SKY, &more].concat());
    let frame = frame::read(&out).unwrap();
    let rows = rows(&out.with_extension("csv"));
    let kind = |name: &str| rows.iter().filter(|row| row["kind"] == name).count();
    for name in ["star", "false_star", "trail", "cosmic_ray"] {
        assert!(kind(name) > 0, "{name}");
    }
    let value = |row: &Row, name: &str| row[name].parse::<f64>().unwrap();
    let mut sorted = frame.values().into_owned();
    sorted.sort_by(f32::total_cmp);
    let median = sorted[sorted.len() / 2];
    let bright = rows.iter().filter(|row| row["kind"] == "star").take(20);
    for row in bright.filter(|row| row["on_frame"] == "true") {
        let (x, y) = (
            value(row, "x").round() as usize,
            value(row, "y").round() as usize,
        );
        let level = frame.pixels.value(y.min(479) * 640 + x.min(639));
        assert!(level > median + 20.0, "{row:?}");
        assert!(!row["id"].is_empty() && value(row, "vmag") < 7.0);
    }
}

#[test]
fn frames_are_numbered_and_each_depends_on_its_number_alone() {
    let directory = tempfile::tempdir().unwrap();
    let (all, third) = (directory.path().join("all"), directory.path().join("third"));
    let more = ["--random-attitude", "--image=fits", "--seed=7"];
    let four = made(&all, &[&more[..], &["--count=4", "--threads=3"]].concat());
    let one = made(&third, &[&more[..], &["--first=2", "--threads=1"]].concat());
    assert_eq!(names(&all).len(), 8);
    assert_eq!(names(&third), ["frame-00002.csv", "frame-00002.fits"]);
    for name in names(&third) {
        let content = |from: &Path| fs::read(from.join(&name)).unwrap();
        assert!(content(&all) == content(&third), "{name}");
    }
    assert_eq!(four[2]["attitude"], one[0]["attitude"]);
    assert_ne!(four[1]["attitude"], one[0]["attitude"]);
}

#[test]
fn a_frame_at_random_is_that_of_validate_with_the_same_number() {
    let directory = tempfile::tempdir().unwrap();
    let (study, frames) = (directory.path().join("study"), directory.path().join("s"));
    let more = ["--seed=7", "--date=2000-01-01T12:00:00Z"];
    let out = format!("--out={}", study.display());
    let validated = Ran::new(
        starpipe()
            .args(["validate", "--count=2", "--seed=7", &out])
            .args(CAMERA),
    );
    assert_eq!(validated.status, 0, "{}", validated.stderr);
    let random = ["--random-attitude", "--count=2"];
    let simulated = made(&frames, &[&more[..], &random].concat());
    let expected = rows(&study.join("frames.csv"));
    for (simulated, row) in simulated.iter().zip(&expected) {
        assert_eq!(simulated["seed"].to_string(), row["seed"]);
        for name in ["ra_deg", "dec_deg", "up_pa_deg"] {
            let off =
                simulated["attitude"][name].as_f64().unwrap() - row[name].parse::<f64>().unwrap();
            assert!(off.abs() < 1e-6, "{name}: {off}");
        }
        // The pixel noise is the same, too: compares the level that the pipeline measures.
        let path = simulated["frame"].as_str().unwrap();
        let processed = Ran::new(starpipe().args(["process", "--format=json", path]));
        let level = number(&processed.reports()[0], "/background/level");
        let of_study = row["background_adu"].parse::<f64>().unwrap();
        assert!((level - of_study).abs() < 1e-4, "{level} {of_study}");
    }
}

#[test]
fn stars_of_a_list_are_drawn_where_it_says() {
    let directory = tempfile::tempdir().unwrap();
    let list = directory.path().join("list.csv");
    fs::write(&list, "x,y,vmag\n100.25,200.5,3\n400,90.75,4\n").unwrap();
    let out = directory.path().join("field.fits");
    let simulated = made(&out, &["--stars", list.to_str().unwrap()]);
    assert!(simulated[0]["attitude"].is_null());
    let rows = rows(&out.with_extension("csv"));
    assert_eq!(rows.len(), 2);
    assert_eq!((&*rows[0]["x"], &*rows[0]["y"]), ("100.25", "200.5"));
    let frame = frame::read(&out).unwrap();
    let level = |x: usize, y: usize| frame.pixels.value(y * 640 + x);
    assert!(level(100, 200) > level(400, 91) && level(400, 91) > level(300, 300) + 100.0);
    // Instrumental magnitudes cannot be drawn.
    fs::write(&list, "x,y,flux\n1,2,3\n").unwrap();
    let ran = simulate(&out, &["--force", "--stars", list.to_str().unwrap()]);
    assert_eq!(ran.status, 1);
    assert!(ran.stderr.contains("vmag"), "{}", ran.stderr);
}

#[test]
fn darks_and_flats_have_no_table_and_no_sky() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().join("frames");
    fs::create_dir(&out).unwrap();
    // Existing files that are not to be written do not matter.
    fs::write(out.join("dark-00000.csv"), "mine").unwrap();
    made(&out, &["--dark", "--count=2"]);
    made(&out, &["--flat=2000", "--image=fits"]);
    let expected = [
        "dark-00000.csv",
        "dark-00000.tif",
        "dark-00001.tif",
        "flat-00000.fits",
    ];
    assert_eq!(names(&out), expected);
    let mean = |name: &str| {
        let pixels = frame::read(out.join(name)).unwrap();
        let pixels = pixels.values();
        pixels.iter().map(|level| f64::from(*level)).sum::<f64>() / pixels.len() as f64
    };
    // 42 of bias; 2 e of dark current and 2000 of light at 1.58 e / ADU.
    assert!((mean("dark-00001.tif") - 43.266).abs() < 0.02);
    assert!((mean("flat-00000.fits") - 1309.09).abs() < 0.3);
    refused(
        &out,
        &["--dark", "--force", "--trails=2"],
        "the options of the scene do not apply",
    );
    refused(
        &out,
        &["--flat=1", "--rate-x-deg-s=1"],
        "the options of the scene do not apply",
    );
}

#[test]
fn nothing_is_overwritten_without_force() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().join("a.tif");
    fs::write(&out, "mine").unwrap();
    refused(&out, SKY, "exists; --force overwrites it");
    assert_eq!(fs::read(&out).unwrap(), b"mine");
    assert_eq!(names(directory.path()), ["a.tif"]);
    made(&out, &[SKY, &["--force"]].concat());
    // An existing table counts as well.
    fs::remove_file(&out).unwrap();
    refused(&out, SKY, "a.csv exists");
}

#[test]
fn nonsensical_options_are_refused() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().join("a.fits");
    let sky = |more: &[&str], what: &str| refused(&out, &[SKY, more].concat(), what);
    refused(&out, &[], "--random-attitude");
    refused(&out, &["--ra=1"], "--dec");
    refused(&out, &["--random-attitude", "--roll=3"], "--ra");
    sky(&["--random-attitude"], "cannot be used with");
    sky(&["--dark"], "cannot be used with");
    sky(&["--count=2"], "expected a directory for 2 frames");
    sky(&["--count=0"], "1..=100000");
    sky(&["--image=tiff"], "contradict each other");
    sky(&["--compress"], "--compress is for TIFF files");
    sky(&["--vignetting=2"], "expected a number from 0 to 1");
    sky(&["--depth-um=1e12"], "expected a number from 0.1 to 1000");
    sky(&["--spot-form=square"], "gaussian");
    sky(&["--date=1990-13-01"], "is not a valid date");
    sky(
        &["--rate-x-deg-s=180", "--exposure=1"],
        "rotates by up to 180°",
    );
    sky(
        &["--swing-deg=180", "--swing-period-s=1e-300"],
        "the camera rotates",
    );
    sky(
        &["--trails=1", "--trail-rate-deg-s=1e12"],
        "a satellite rotates",
    );
    sky(&["--distortion-px=300"], "distortion is too large");
    sky(&["--distortion-px=-300"], "distortion is too large");
    sky(
        &["--cosmic-rays-cm2-s=1e6", "--exposure=1e6"],
        "cosmic rays per frame",
    );
    sky(&["--sky-mag-arcsec2=-1e300"], "sky_luminance_cd_m2 is inf");
    assert!(!out.exists());
}

#[test]
fn the_name_of_a_picture_that_is_not_written_is_no_directory() {
    let directory = tempfile::tempdir().unwrap();
    for name in ["one.png", "one.JPG", "one.fits.gz"] {
        let path = directory.path().join(name);
        let out = format!("--out={}", path.display());
        let preset = ["simulate", "--preset=nanosat-tracker", &out];
        let ran = Ran::new(starpipe().args(preset).args(SKY));
        assert_eq!((ran.status, ran.stdout.as_str()), (2, ""));
        assert!(ran.stderr.contains("(.tif) or FITS"), "{}", ran.stderr);
        assert!(ran.stderr.contains(name) && !path.exists());
    }
}

#[test]
fn a_huge_detector_is_refused_before_memory_is_allocated() {
    let directory = tempfile::tempdir().unwrap();
    let out = format!("--out={}", directory.path().join("a.fits").display());
    let sides = ["--width-px=100000", "--height-px=100000"];
    let preset = ["simulate", "--preset=nanosat-tracker", &out];
    let ran = Ran::new(starpipe().args(preset).args(sides).args(SKY));
    assert_eq!((ran.status, ran.stdout.as_str()), (1, ""));
    assert!(ran.stderr.contains("100000"), "{}", ran.stderr);
}

#[test]
fn a_bad_description_is_an_error_of_its_file() {
    let directory = tempfile::tempdir().unwrap();
    let camera = directory.path().join("camera.toml");
    let described = Ran::new(starpipe().args(["camera", "new", "--preset=nanosat-tracker"]));
    for (line, what) in [
        ("vignetting = 1.5", "vignetting"),
        ("mirrored = 3", "mirrored"),
        ("spot_form = \"square\"", "spot_form"),
        ("distortion_px = -900", "distortion is too large"),
        ("decentring_px = 9", "decentring_px"),
    ] {
        fs::write(&camera, format!("{}\n{line}\n", described.stdout)).unwrap();
        let out = directory.path().join("a.fits");
        let paths = [camera.to_str().unwrap(), "--out", out.to_str().unwrap()];
        let ran = Ran::new(
            starpipe()
                .args(["simulate", "--dark", "--camera"])
                .args(paths),
        );
        assert_eq!(ran.status, 1, "{line}: {}", ran.stderr);
        let says = |text: &str| ran.stderr.contains(text);
        assert!(says("camera.toml") && says(what), "{line}: {}", ran.stderr);
        assert!(!out.exists());
    }
}

#[test]
fn the_pipeline_finds_the_attitude_that_was_simulated() {
    /// Tolerance of the attitude, in standard errors.
    const SIGMAS: f64 = 5.0;
    let directory = tempfile::tempdir().unwrap();
    for (name, more) in [
        ("plain.fits", &["--date=2026-11-22"][..]),
        ("mirrored.fits", &["--mirrored", "--date=2026-11-22"]),
        (
            "distorted.fits",
            &["--distortion-px=-6", "--vignetting=0.3"],
        ),
    ] {
        let out = directory.path().join(name);
        let simulated = &made(&out, &[SKY, more].concat())[0];
        let processed = Ran::new(starpipe().args(["process", "--format=json"]).arg(&out));
        let report = &processed.reports()[0];
        assert_eq!(report["status"], "identified", "{name}");
        assert_eq!(
            report["optics"]["mirrored"], simulated["mirrored"],
            "{name}"
        );
        let truth = Truth {
            ra_deg: number(simulated, "/attitude/ra_deg"),
            dec_deg: number(simulated, "/attitude/dec_deg"),
            fov_x_deg: number(simulated, "/fov_x_deg"),
        };
        let sigma = |axis: &str| number(report, &format!("/attitude/sigma_arcsec/{axis}"));
        let off_arcsec = truth.centre_error_deg(report) * 3600.0;
        let limit_arcsec = SIGMAS * sigma("x").hypot(sigma("y"));
        assert!(
            off_arcsec < limit_arcsec,
            "{name}: {off_arcsec} {limit_arcsec}"
        );
        let roll_deg = number(report, "/attitude/up_pa_deg") - 25.0;
        assert!(
            (roll_deg * 3600.0).abs() < SIGMAS * sigma("roll"),
            "{name}: {roll_deg}"
        );
        assert!(truth.fov_error(report).abs() < 5e-4, "{name}");
    }
}

/// Numbers to four digits, and no paths.
fn rounded(value: &mut Value) {
    match value {
        Value::Number(number) if number.is_f64() => {
            let digits = format!("{:.3e}", number.as_f64().unwrap());
            *value = digits.parse::<f64>().unwrap().into();
        }
        Value::String(text) if text.contains("a.fits") => *text = "a.fits".to_owned(),
        Value::String(text) if text.contains("a.csv") => *text = "a.csv".to_owned(),
        Value::Array(values) => values.iter_mut().for_each(rounded),
        Value::Object(fields) => fields.values_mut().for_each(rounded),
        _ => {}
    }
}

#[test]
fn the_fields_of_a_frame_are_these() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().join("a.fits");
    let more = [
        "--date=2026-03-04T05:06:07Z",
        "--rate-y-deg-s=0.1",
        "--seed=9",
    ];
    let mut simulated = made(&out, &[SKY, &more].concat());
    rounded(&mut simulated[0]);
    insta::assert_json_snapshot!(simulated[0]);
}
