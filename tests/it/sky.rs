//! `starpipe sky` on simulated all-sky frames.

use crate::common::{Ran, fits_unit, number, starpipe};
use serde_json::Value;
use starpipe::Frame;
use std::fs;
use std::path::{Path, PathBuf};

const DATE: &str = "--date=2024-01-05T01:00:00Z";
const SITE: &str = "--site=50,10,300";
/// The zenith then and there, by astropy.
const ZENITH: [&str; 2] = ["--ra=128.69523", "--dec=50.08408"];
/// An all-sky camera.
const CAMERA: [(&str, &str); 7] = [
    ("width_px", "1200"),
    ("height_px", "1200"),
    ("pitch_x_um", "4"),
    ("pitch_y_um", "4"),
    ("focal_length_mm", "1.5626"),
    ("aperture_mm", "2"),
    ("spot_sigma_px", "0.9"),
];
/// Its sides.
const SIDE: u32 = 1200;
/// Bias, and dark current in 20 s.
const DARK_ADU: f64 = 10.0 + 0.7 * 20.0 / 8.0;
/// Quantum efficiencies behind the filters of a color camera: red, green, blue.
const FILTERS: [&str; 3] = [
    "[[400, 0.03], [480, 0.04], [560, 0.08], [580, 0.4], [600, 0.5], [640, 0.4], [700, 0.3], [1000, 0]]",
    "[[400, 0.03], [460, 0.12], [490, 0.45], [530, 0.8], [560, 0.72], [600, 0.3], [640, 0.12], [1000, 0]]",
    "[[400, 0.4], [430, 0.6], [460, 0.66], [490, 0.45], [520, 0.18], [560, 0.05], [640, 0.04], [1000, 0]]",
];
const EXTINCTION_MAG: f64 = 0.17;
const SKY_MAG: f64 = 20.5;

/// A file that describes the camera.
fn described(directory: &Path) -> PathBuf {
    let new = starpipe()
        .args(["camera", "new", "--preset=imx174-35mm"])
        .output()
        .unwrap();
    let mut text = String::from_utf8(new.stdout).unwrap();
    for (key, value) in CAMERA {
        let start = text.find(&format!("\n{key} = ")).unwrap() + 1;
        let end = start + text[start..].find('\n').unwrap();
        text.replace_range(start..end, &format!("{key} = {value}"));
    }
    text += "\nprojection = \"equidistant\"\nfield_radius_deg = 88\n";
    let file = directory.join("camera.toml");
    fs::write(&file, text).unwrap();
    file
}

/// A frame of that sky.
fn simulated(directory: &Path, camera: &Path, more: &[&str]) -> PathBuf {
    let dark = [
        "--exposure=20".to_owned(),
        format!("--sky-mag-arcsec2={SKY_MAG}"),
    ];
    let more: Vec<&str> = dark
        .iter()
        .map(String::as_str)
        .chain(more.iter().copied())
        .collect();
    drawn(directory, camera, &more)
}

fn drawn(directory: &Path, camera: &Path, more: &[&str]) -> PathBuf {
    let frame = directory.join("night.tif");
    let ran = Ran::new(
        starpipe()
            .args(["simulate", "--seed=3", "--by-altitude=1"])
            .args([DATE, SITE])
            .args(ZENITH)
            .arg(format!("--camera={}", camera.display()))
            .arg(format!("--extinction={EXTINCTION_MAG}"))
            .arg(format!("--out={}", frame.display()))
            .args(more),
    );
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    frame
}

fn sky(frame: &Path, more: &[String]) -> Value {
    let ran = Ran::new(
        starpipe()
            .args(["sky", "--format=json", DATE, SITE])
            .args(more)
            .arg(frame),
    );
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    ran.reports().remove(0)["sky"].clone()
}

fn cells<'a>(
    sky: &'a Value,
    wanted: impl Fn(&Value) -> bool + 'a,
) -> impl Iterator<Item = &'a Value> {
    let cells = sky["cells"].as_array().unwrap().iter();
    cells.filter(move |cell| wanted(cell))
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), v| (sum + v, count + 1.0));
    sum / count
}

#[test]
fn a_clear_sky_is_as_bright_and_as_clear_as_it_is() {
    let directory = tempfile::tempdir().unwrap();
    let camera = described(directory.path());
    let frame = simulated(directory.path(), &camera, &[]);
    let found = sky(&frame, &[format!("--camera={}", camera.display())]);
    let extinction = number(&found, "/extinction_mag_per_airmass");
    assert!((extinction - EXTINCTION_MAG).abs() < 0.02, "{extinction}");
    assert_eq!(found["extinction_measured"], true);
    // A dark frame tells the level without light as well.
    let dark = directory.path().join("dark.png");
    let level = DARK_ADU.round() as u16;
    image::ImageBuffer::from_pixel(SIDE, SIDE, image::Luma([level]))
        .save(&dark)
        .unwrap();
    let by_dark = sky(&frame, &[format!("--dark={}", dark.display())]);
    let difference =
        number(&by_dark, "/zenith/mag_arcsec2") - number(&found, "/zenith/mag_arcsec2");
    let sigma = number(&by_dark, "/zenith/sigma_mag");
    assert!(
        difference.abs() < 2.0 * sigma && sigma < 0.1,
        "{difference}"
    );
    // The sky is 0.02 mag brighter over the meter's cone than at the zenith.
    let zenith = number(&found, "/zenith/mag_arcsec2");
    assert!((zenith - SKY_MAG).abs() < 0.06, "{zenith}");
    // A few cells with few stars may be behind clouds.
    assert!(number(&found, "/cloud_share") < 0.2);
    let high = |cell: &Value| number(cell, "/altitude_deg/0") >= 20.0;
    let off = cells(&found, high).map(|cell| {
        let altitude_deg =
            0.5 * (number(cell, "/altitude_deg/0") + number(cell, "/altitude_deg/1"));
        let sin_sq = altitude_deg.to_radians().cos().powi(2);
        // Krisciunas & Schaefer 1991, eqs. (2) and (3).
        let airmass = (1.0 - 0.96 * sin_sq).powf(-0.5);
        let dimmed_mag = EXTINCTION_MAG * (airmass - 1.0);
        let expected = SKY_MAG - 2.5 * airmass.log10() + dimmed_mag;
        number(cell, "/mag_arcsec2") - expected
    });
    let off: Vec<f64> = off.collect();
    let common = mean(off.iter().copied());
    assert!(common.abs() < 0.06, "{common}");
    for off in off {
        assert!((off - common).abs() < 0.05, "{off} {common}");
    }
}

#[test]
fn what_the_lens_takes_from_the_corners_it_takes_from_the_sky_too() {
    let directory = tempfile::tempdir().unwrap();
    let camera = described(directory.path());
    let even = fs::read_to_string(&camera).unwrap();
    let [even, dim] = ["", "vignetting = 0.4\n"].map(|more| {
        fs::write(&camera, format!("{even}{more}")).unwrap();
        let frame = simulated(directory.path(), &camera, &["--force"]);
        sky(&frame, &[format!("--camera={}", camera.display())])
    });
    let low = |cell: &Value| (10.0..30.0).contains(&number(cell, "/altitude_deg/0"));
    for (even, dim) in cells(&even, low).zip(cells(&dim, low)) {
        assert_eq!(even["azimuth_deg"], dim["azimuth_deg"]);
        let difference = number(dim, "/mag_arcsec2") - number(even, "/mag_arcsec2");
        // Near the edge of the field 0.2 mag are lost.
        assert!(difference.abs() < 0.05, "{difference} {even}");
    }
}

#[test]
fn the_limit_to_be_expected_is_that_in_the_air_of_the_frame() {
    let directory = tempfile::tempdir().unwrap();
    let camera = described(directory.path());
    // Of a bright sky: in a dark one the faintest stars crowd each other.
    let bright = ["--exposure=5", "--sky-mag-arcsec2=18.5"];
    let frame = drawn(directory.path(), &camera, &bright);
    let found = sky(&frame, &[format!("--camera={}", camera.display())]);
    let high = |cell: &Value| number(cell, "/altitude_deg/0") >= 30.0;
    let limits = cells(&found, high).filter_map(|cell| {
        Some(cell["limit_vmag"].as_f64()? - cell["expected_limit_vmag"].as_f64()?)
    });
    let difference = mean(limits);
    // With the air of the model's usual night it is 0.14.
    assert!(difference.abs() < 0.08, "{difference}");
    // That of the whole frame is one of all altitudes: the limit at its centre is 0.4 mag fainter.
    let ran = Ran::new(
        starpipe()
            .args(["process", "--format=json", DATE, SITE])
            .arg(format!("--extinction={EXTINCTION_MAG}"))
            .arg(format!("--camera={}", camera.display()))
            .arg(&frame),
    );
    let difference = number(&ran.reports()[0], "/magnitude/limit_difference_mag");
    assert!(difference.abs() < 0.1, "{difference}");
}

#[test]
fn clouds_are_found_without_a_description_and_the_corners_tell_the_dark_level() {
    let directory = tempfile::tempdir().unwrap();
    let camera = described(directory.path());
    let clouds = ["--cloud-mag=2", "--cloud-size-px=300", "--cloud-light=0.5"];
    let frame = simulated(directory.path(), &camera, &clouds);
    let out = directory.path().join("out");
    // What it has written it may overwrite.
    let found = [(), ()].map(|()| sky(&frame, &[format!("--out={}", out.display())]));
    assert_eq!(found[0], found[1]);
    let [found, _] = found;
    assert_eq!(found["dark_level_source"], "unlit");
    let level_adu = number(&found, "/dark_level_adu");
    let sigma_adu = number(&found, "/dark_level_sigma_adu");
    assert!(
        (level_adu - DARK_ADU).abs() < 2.0 * sigma_adu,
        "{level_adu}"
    );
    let share = number(&found, "/cloud_share");
    assert!((0.25..0.7).contains(&share), "{share}");
    let extinction = number(&found, "/extinction_mag_per_airmass");
    assert!((extinction - EXTINCTION_MAG).abs() < 0.06, "{extinction}");
    let figure = fs::read_to_string(out.join("night.sky.svg")).unwrap();
    assert!(figure.starts_with("<svg") && figure.contains("Extinction by clouds"));
    assert!(figure.contains("Brightness") && !figure.contains("NaN"));
}

#[test]
fn a_narrow_field_without_a_site_is_divided_by_columns_and_rows() {
    let ran = Ran::new(starpipe().args(["sky", "--format=json", "fixtures/orion/orion.png"]));
    let report = ran.reports().remove(0);
    let cell = &report["sky"]["cells"][0];
    assert!(
        cell["altitude_deg"].is_null() && cell["x"].is_array(),
        "{cell}"
    );
    assert!(report["sky"]["extinction_mag_per_airmass"].is_null());
    assert_eq!(report["sky"]["no_brightness"], "bias_unknown");
    // `process` does not measure it.
    let ran = Ran::new(starpipe().args(["process", "--format=json", "fixtures/orion/orion.png"]));
    assert!(ran.reports()[0].get("sky").is_none());
}

/// The file of the same camera with this quantum efficiency.
fn behind_filter(camera: &Path, efficiency: &str, name: &str) -> PathBuf {
    let mut text = fs::read_to_string(camera).unwrap();
    let start = text.find("quantum_efficiency = [").unwrap();
    let end = start + text[start..].find("\n]").unwrap() + 2;
    text.replace_range(start..end, &format!("quantum_efficiency = {efficiency}"));
    let file = camera.with_file_name(name);
    fs::write(&file, text).unwrap();
    file
}

const FILTER_NAMES: [&str; 3] = ["red.toml", "green.toml", "blue.toml"];

/// The sky as a camera sees it behind red, green and blue filters.
fn behind_filters(directory: &Path) -> [Frame<'static>; 3] {
    let camera = described(directory);
    [0, 1, 2].map(|filter| {
        let camera = behind_filter(&camera, FILTERS[filter], FILTER_NAMES[filter]);
        let file = simulated(directory, &camera, &["--force"]);
        starpipe::frame::read(&file).unwrap()
    })
}

/// Checks the sky's brightness, and its color: the simulated sky has that of the Sun, which the air reddens in
/// stars by 0.08 mag.
fn check_color(found: &Value) {
    let zenith = number(found, "/zenith/mag_arcsec2");
    assert!((zenith - SKY_MAG).abs() < 0.06, "{zenith}");
    let (color, sigma) = (
        number(found, "/zenith/bv_mag"),
        number(found, "/zenith/bv_sigma_mag"),
    );
    assert!(
        (color - 0.72).abs() < 2.0 * sigma && sigma < 0.2,
        "{color} {sigma}"
    );
}

#[test]
fn a_color_picture_shows_the_sky_and_its_color() {
    let directory = tempfile::tempdir().unwrap();
    let [red, green, blue] = behind_filters(directory.path());
    // White was balanced: red has twice its light, and twice its bias.
    let balanced = |x: u32, y: u32| {
        let at = |frame: &Frame| frame.at(x as usize, y as usize) as u16;
        [2 * at(&red), at(&green), at(&blue)]
    };
    let picture = image::ImageBuffer::from_fn(SIDE, SIDE, |x, y| image::Rgb(balanced(x, y)));
    let file = directory.path().join("colors.png");
    picture.save(&file).unwrap();
    let exposure = "--exposure=20".to_owned();
    check_color(&sky(&file, std::slice::from_ref(&exposure)));

    let planes = [&red, &green, &blue].map(|frame| frame.values().into_owned());
    let levels = planes
        .iter()
        .flatten()
        .flat_map(|level| level.to_be_bytes());
    let (first, levels) = (
        "SIMPLE  =                    T",
        levels.collect::<Vec<u8>>(),
    );
    let file = directory.path().join("colors.fits");
    fs::write(&file, fits_unit(first, -32, &[SIDE, SIDE, 3], &[], &levels)).unwrap();
    let camera = directory.path().join(FILTER_NAMES[1]);
    check_color(&sky(
        &file,
        &[exposure, format!("--camera={}", camera.display())],
    ));
}

#[test]
fn a_color_camera_sees_the_same_sky_and_its_color() {
    let directory = tempfile::tempdir().unwrap();
    let frames = behind_filters(directory.path());
    // Red and blue pixels on one diagonal, green ones on the other.
    let raw = image::ImageBuffer::from_fn(SIDE, SIDE, |x, y| {
        let filter = match (x % 2, y % 2) {
            (0, 0) => 0,
            (1, 1) => 2,
            _ => 1,
        };
        image::Luma([frames[filter].at(x as usize, y as usize) as u16])
    });
    let file = directory.path().join("raw.png");
    raw.save(&file).unwrap();
    let green = directory.path().join(FILTER_NAMES[1]);
    let options = [
        format!("--camera={}", green.display()),
        "--exposure=20".to_owned(),
    ];
    let found = sky(&file, &options);
    check_color(&found);
    let high = |cell: &Value| number(cell, "/altitude_deg/0") >= 30.0;
    let limits = cells(&found, high).filter_map(|cell| {
        Some(cell["limit_vmag"].as_f64()? - cell["expected_limit_vmag"].as_f64()?)
    });
    let difference = mean(limits);
    assert!(difference.abs() < 0.15, "{difference}");
}

/// A picture of that sky as color cameras make it, with a tone curve.
fn picture(directory: &Path, gamma: f64) -> PathBuf {
    let camera = described(directory);
    let frame = simulated(directory, &camera, &[]);
    let raw = starpipe::frame::read(&frame).unwrap();
    let values = raw.values();
    let lit = |value: &f32| ((f64::from(*value) - 8.0) / 1200.0).clamp(0.0, 1.0);
    let level = |value: &f32| (255.0 * libm::pow(lit(value), 1.0 / gamma)).round() as u8;
    let levels: Vec<u8> = values.iter().map(level).collect();
    let file = directory.join("picture.jpg");
    let mut bytes = Vec::new();
    image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, 92)
        .encode(&levels, SIDE, SIDE, image::ExtendedColorType::L8)
        .unwrap();
    fs::write(&file, bytes).unwrap();
    file
}

#[test]
fn a_jpeg_with_a_tone_curve_has_a_brightness_with_its_error() {
    for gamma in [1.6, 2.2] {
        let directory = tempfile::tempdir().unwrap();
        let file = picture(directory.path(), gamma);
        let found = sky(&file, &["--exposure=20".to_owned()]);
        assert!(found["no_brightness"].is_null(), "{found}");
        let mag = number(&found, "/zenith/mag_arcsec2");
        let sigma = number(&found, "/zenith/sigma_mag");
        let off = (mag - SKY_MAG).abs();
        assert!(sigma < 0.7 && off < 2.0 * sigma, "{gamma}: {mag} ± {sigma}");
        assert!(number(&found, "/tone_curve/exponent") < 0.9);
    }
}
