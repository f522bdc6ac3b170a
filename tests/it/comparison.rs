//! Frames of a described camera: prediction compared with measurement.

use crate::common::{Ran, fixture, number, starpipe};
use image::{ImageBuffer, Luma};
use serde_json::Value;
use starpipe::base::coords::{Rotation, UnitVector};
use starpipe::camera::data_sheet::{Preset, template};
use starpipe::catalog::Catalog;
use starpipe::ephemeris::places::StarPlaces;
use starpipe::lab::simulate::{Pointing, Scene, Simulator};
use starpipe::predict::{Scenario, SkyBrightness};
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Systematic error of a zero point from about a hundred stars.
const ZERO_POINT_TOLERANCE_MAG: f64 = 0.03;
/// The background level is a median of whole grey levels.
const SKY_TOLERANCE_MAG: f64 = 0.05;
/// Systematic error of the detector's model, which ignores touching stars.
const LIMIT_TOLERANCE_MAG: f64 = 0.05;

const CAMERA: Preset = Preset::Imx174;
const SKY_MAG_ARCSEC2: f64 = 18.5;
const EXPOSURE_S: &str = "0.05";

/// A directory with a frame of Cygnus near the zenith and the camera's description.
struct Night {
    directory: TempDir,
    frame: PathBuf,
}

impl Night {
    fn new() -> Self {
        Self::with_vignetting(0.0)
    }

    /// The same, of a lens that loses this share of the light in the corners.
    fn with_vignetting(vignetting: f64) -> Self {
        let mut scenario = Scenario::of(CAMERA);
        scenario.camera.imperfections.vignetting = vignetting;
        scenario.conditions.exposure_s = EXPOSURE_S.parse().unwrap();
        scenario.conditions.sky = SkyBrightness::MagArcsec2(SKY_MAG_ARCSEC2);
        let boresight = UnitVector::from_ra_dec(300f64.to_radians(), 35f64.to_radians());
        let pointing = Pointing {
            icrs_to_camera: Rotation::looking_at(&boresight, 0.3),
            places: StarPlaces::default(),
        };
        let stars = Catalog::built_in().stars();
        let simulator = Simulator::new(&scenario, &Scene::default(), stars).unwrap();
        let (frame, _) = simulator.frame(&pointing, 5).unwrap();
        let levels = frame.values().iter().map(|level| *level as u16).collect();
        let picture: ImageBuffer<Luma<u16>, Vec<u16>> =
            ImageBuffer::from_raw(frame.width as u32, frame.height as u32, levels).unwrap();
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("cygnus.png");
        picture.save(&path).unwrap();
        let night = Self {
            directory,
            frame: path,
        };
        night.describe(|text| text);
        night
    }

    fn camera(&self) -> PathBuf {
        self.directory.path().join("camera.toml")
    }

    /// Writes the camera's description with a change.
    fn describe(&self, change: impl Fn(String) -> String) {
        fs::write(self.camera(), change(template(CAMERA))).unwrap();
    }

    fn process(&self, arguments: &[&str]) -> Ran {
        let mut command = starpipe();
        command.arg("process").arg(&self.frame);
        Ran::new(command.arg("--camera").arg(self.camera()).args(arguments))
    }

    fn report(&self, arguments: &[&str]) -> Value {
        let ran = self.process(&[&["--format", "json"], arguments].concat());
        assert_eq!(ran.status, 0, "{}", ran.stderr);
        ran.reports().remove(0)
    }
}

/// `text` with another value for a key.
fn with(text: &str, key: &str, value: &str) -> String {
    let is_key = |line: &str| line.split(" = ").next() == Some(key);
    let line = |line: &str| match is_key(line) {
        true => format!("{key} = {value}\n"),
        false => format!("{line}\n"),
    };
    assert!(text.lines().any(is_key), "{key}");
    text.lines().map(line).collect()
}

/// The notes, but that there is no date.
fn notes(report: &Value) -> String {
    let notes = report["notes"].as_array().unwrap().iter();
    let notes = notes.filter(|note| note["code"] != "date_unknown");
    notes
        .map(|note| note["text"].as_str().unwrap().to_owned() + "\n")
        .collect()
}

#[test]
fn vignetting_is_removed_where_it_is_stated_and_else_measured() {
    let night = Night::with_vignetting(0.6);
    let zero_point_off = |report: &Value| {
        let off = number(report, "/prediction/zero_point_difference_mag");
        let sigma = number(report, "/prediction/zero_point_difference_sigma_mag");
        assert!(off.abs() < ZERO_POINT_TOLERANCE_MAG + 3.0 * sigma, "{off}");
    };
    let unstated = night.report(&["--exposure", EXPOSURE_S]);
    zero_point_off(&unstated);
    assert_eq!(unstated["notes"][0]["code"], "vignetting");
    let loss = number(&unstated, "/photometry/corner_loss_mag");
    let sigma = number(&unstated, "/photometry/corner_loss_sigma_mag");
    let expected = -2.5 * 0.4f64.log10();
    assert!((loss - expected).abs() < 0.1 + 3.0 * sigma, "{loss}");

    night.describe(|text| {
        with(&text, "# vignetting", "0").replace("# vignetting = 0", "vignetting = 0.6")
    });
    let stated = night.report(&["--exposure", EXPOSURE_S]);
    zero_point_off(&stated);
    assert_eq!(notes(&stated), "");
    assert_limit_as_predicted(&stated);
}

#[test]
fn a_frame_agrees_with_its_cameras_prediction() {
    let night = Night::new();
    let report = night.report(&["--exposure", EXPOSURE_S]);
    assert_eq!(notes(&report), "");
    let prediction = |key: &str| number(&report, &format!("/prediction/{key}"));
    let zero = prediction("zero_point_difference_mag").abs();
    let zero_sigma = prediction("zero_point_difference_sigma_mag");
    assert!(zero < ZERO_POINT_TOLERANCE_MAG + 3.0 * zero_sigma, "{zero}");
    let sky = prediction("sky_camera_mag_arcsec2") - SKY_MAG_ARCSEC2;
    assert!(sky.abs() < SKY_TOLERANCE_MAG, "{sky}");
    let sky = prediction("sky_mag_arcsec2") - SKY_MAG_ARCSEC2;
    assert!(
        sky.abs() < SKY_TOLERANCE_MAG + zero + 3.0 * zero_sigma,
        "{sky}"
    );
    let magnitude = |key: &str| number(&report, &format!("/magnitude/{key}"));
    assert_limit_as_predicted(&report);
    let faintest = magnitude("faintest_difference_mag").abs();
    let spread = magnitude("expected_faintest_sigma_mag");
    assert!(faintest < 3.5 * spread, "{faintest} ± {spread}");
    let difference = magnitude("faintest_vmag") - magnitude("predicted_limit_vmag");
    assert!((magnitude("difference_mag") - difference).abs() < 2e-3);
    let gain = 8.0;
    let [star, ..] = &report["stars"].as_array().unwrap()[..] else {
        panic!("stars");
    };
    for key in ["flux", "peak"] {
        let electrons = star[format!("{key}_e")].as_f64().unwrap();
        let levels = star[key].as_f64().unwrap();
        assert!((electrons / levels - gain).abs() < 0.1, "{key}");
    }
}

fn assert_limit_as_predicted(report: &Value) {
    let magnitude = |key: &str| number(report, &format!("/magnitude/{key}"));
    let limit = magnitude("limit_difference_mag").abs();
    let sigma = magnitude("limit_difference_sigma_mag");
    assert!(
        limit < LIMIT_TOLERANCE_MAG + 3.0 * sigma,
        "{limit} ± {sigma}"
    );
}

#[test]
fn the_predicted_limit_is_that_of_the_requested_threshold() {
    let night = Night::new();
    for threshold in [["--sigma", "10"], ["--false-alarms", "100"]] {
        let arguments = [&["--exposure", EXPOSURE_S][..], &threshold].concat();
        assert_limit_as_predicted(&night.report(&arguments));
    }
}

#[test]
fn the_expected_faintest_star_is_not_limited_by_what_the_frame_shows() {
    let night = Night::new();
    // Such a lens would reach three magnitudes deeper: the expectation must not be limited by what
    // the frame shows.
    night.describe(|text| with(&text, "aperture_mm", "100"));
    let report = night.report(&["--exposure", EXPOSURE_S]);
    assert!(number(&report, "/magnitude/faintest_difference_mag") < -1.5);
}

#[test]
fn nothing_is_predicted_without_exposure_or_camera() {
    let night = Night::new();
    let report = night.report(&[]);
    assert_eq!(report["prediction"], Value::Null);
    assert!(notes(&report).contains("the exposure is unknown"));
    assert_eq!(report["magnitude"]["predicted_limit_vmag"], Value::Null);
    assert!(report["stars"][0]["flux_e"].is_number());
    let ran = Ran::new(
        starpipe()
            .args(["process", "--format", "json", "--exposure", EXPOSURE_S])
            .arg(&night.frame),
    );
    let report = &ran.reports()[0];
    assert_eq!(report["prediction"], Value::Null);
    assert_eq!(report["photometry"]["flux_unit"], "ADU/s");
    assert_eq!(report["stars"][0].get("flux_e"), None);
}

#[test]
fn a_frame_that_contradicts_its_description_says_so() {
    let night = Night::new();
    let exposed = ["--exposure", EXPOSURE_S];
    for (key, value, note) in [
        (
            "aperture_mm",
            "50",
            "mag from the predicted one; less light arrives",
        ),
        (
            "aperture_mm",
            "12",
            "mag from the predicted one; more light arrives",
        ),
        (
            "focal_length_mm",
            "50",
            "the camera's focal length and pixel pitch give",
        ),
        (
            "width_px",
            "1000",
            "the frame has 1936 × 1216 pixels, the camera 1000 × 1216",
        ),
        ("read_noise_e", "60", "the background noise is"),
        (
            "spot_sigma_px",
            "1.5",
            "that in the camera's description is 1.50 px",
        ),
    ] {
        night.describe(|text| with(&text, key, value));
        let reported = notes(&night.report(&exposed));
        assert!(reported.contains(note), "{key}: {reported}");
    }
    night.describe(|text| text);
    // In the polar night, seen from the north pole, a declination of 35° is always 55° from the zenith.
    let reported = notes(
        &night.report(
            &[
                &exposed[..],
                &[
                    "--site",
                    "90,0",
                    "--date",
                    "2019-12-29T20:47:26Z",
                    "--zenith-distance",
                    "10",
                ],
            ]
            .concat(),
        ),
    );
    assert!(
        reported.contains("stated zenith distance is 10.0°, but site, date and attitude give 5"),
        "{reported}"
    );
}

#[test]
fn a_wrong_scale_from_the_camera_is_tolerated() {
    let night = Night::new();
    night.describe(|text| with(&text, "focal_length_mm", "120"));
    let report = night.report(&[]);
    assert_eq!(report["status"], "identified");
    let fov = number(&report, "/optics/fov_x_deg");
    assert!((fov - 18.4).abs() < 0.2, "{fov}");
}

#[test]
fn the_text_compares_measurement_and_prediction() {
    let night = Night::new();
    let ran = night.process(&["--exposure", EXPOSURE_S]);
    for part in [
        "camera      IMX174, 35 mm",
        "predicted   limit V ",
        "measured minus predicted ",
        "faintest star V ",
        "mag/arcsec²",
    ] {
        assert!(ran.stdout.contains(part), "{part}: {}", ran.stdout);
    }
}

#[test]
fn the_limit_predicted_is_that_of_the_threshold_given() {
    let night = Night::new();
    for arguments in [&["--sigma", "20"][..], &["--false-alarms", "1e-9"]] {
        let report = night.report(&[&["--exposure", EXPOSURE_S], arguments].concat());
        let measured = number(&report, "/photometry/limit50_vmag");
        let predicted = number(&report, "/prediction/limit50_vmag");
        let sigma = number(&report, "/photometry/limit50_sigma_mag");
        let off = (measured - predicted).abs();
        assert!(
            off < 3.0 * sigma + LIMIT_TOLERANCE_MAG,
            "{arguments:?} {measured} {predicted}"
        );
    }
}

#[test]
fn a_site_without_the_time_is_noted() {
    let night = Night::new();
    let site = ["--exposure", EXPOSURE_S, "--site", "52.22,4.42"];
    for date in [&["--date", "2019-07-29"][..], &[]] {
        let report = night.report(&[&site[..], date].concat());
        assert_eq!(report["observation"], Value::Null);
        assert!(notes(&report).contains("the time of day is unknown"));
    }
    let below = [
        &site[..2],
        &["--site=-80,4.42", "--date", "2019-07-29T00:00"],
    ]
    .concat();
    let report = night.report(&below);
    assert!(notes(&report).contains("below the horizon"));
    assert_eq!(report["prediction"]["zenith_distance_known"], false);
}

#[test]
fn a_wrong_description_or_option_is_refused() {
    let night = Night::new();
    night.describe(|text| with(&text, "aperture_mm", "-5"));
    let ran = night.process(&[]);
    assert_eq!(ran.status, 1);
    let expected = "aperture_mm is -5, expected a number above 0";
    assert!(ran.stderr.contains(expected), "{}", ran.stderr);
    assert!(ran.stdout.is_empty());
    for arguments in [
        &["--exposure", "0"][..],
        &["--exposure", "NaN"],
        &["--camera", "x.toml", "--zenith-distance", "90"],
        &["--camera", "x.toml", "--extinction", "-1"],
        &["--camera", "x.toml", "--extinction", "1e300"],
        &["--zenith-distance", "10"],
    ] {
        let ran = Ran::new(starpipe().args(["process", "a.png"]).args(arguments));
        assert_eq!(ran.status, 2, "{arguments:?}");
    }
    let absent = Path::new("no-such-camera.toml");
    let ran = Ran::new(
        starpipe()
            .args(["process", "a.png", "--camera"])
            .arg(absent),
    );
    assert_eq!(ran.status, 1);
    assert!(ran.stderr.contains("no-such-camera.toml"), "{}", ran.stderr);
}

#[test]
fn the_cygnus_fixture_has_the_zero_point_and_the_sky_it_was_drawn_with() {
    let frame = fixture("cygnus/cygnus.tif");
    let camera = fixture("cygnus/camera.toml");
    let ran = Ran::new(
        starpipe()
            .args(["process", "--format", "json", "--exposure", "1"])
            .args(["--extinction", "0", "--camera"])
            .args([&camera, &frame]),
    );
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    let report = &ran.reports()[0];
    assert_eq!(notes(report), "");
    // V = 0 gives 250,000 electrons, the sky 100. The drawing ignores colors, which shifts the
    // prediction by a few hundredths.
    const COLORS_MAG: f64 = 0.05;
    let drawn = 2.5 * 250e3f64.log10();
    let predicted = number(report, "/prediction/zero_point_vmag");
    assert!((predicted - drawn).abs() < COLORS_MAG, "{predicted}");
    let off = number(report, "/prediction/zero_point_difference_mag").abs();
    let sigma = number(report, "/prediction/zero_point_difference_sigma_mag");
    assert!(off < COLORS_MAG + 3.0 * sigma, "{off}");
    let sky = number(report, "/prediction/background_e");
    assert!((sky - 100.0).abs() < 1.5, "{sky}");
}
