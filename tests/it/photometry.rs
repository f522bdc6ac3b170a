//! Zero point and completeness of drawn frames with known truth, and of the real sky.

use crate::common::{Ran, fixture, number, shared_dir, starpipe};
use serde_json::Value;
use std::path::PathBuf;

/// Electrons from a star of magnitude 0, as in `tools/draw_frame.rs`.
const DRAWN_ZERO_MAG_E: f64 = 250e3;

fn processed(arguments: &[&str], frames: &[PathBuf]) -> Vec<Value> {
    let mut command = starpipe();
    command.args(["process", "--format", "json"]);
    let ran = Ran::new(command.args(arguments).args(frames));
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    ran.reports()
}

/// The share detected in the part of the curve fainter, or brighter, than a magnitude.
fn share(report: &Value, wanted: impl Fn(f64) -> bool) -> f64 {
    let bins = report["photometry"]["completeness"].as_array().unwrap();
    let of = |what: &str| -> f64 {
        let wanted = bins
            .iter()
            .filter(|bin| wanted(bin["vmag"].as_f64().unwrap()));
        wanted.map(|bin| bin[what].as_f64().unwrap()).sum()
    };
    of("detected") / of("stars")
}

#[test]
fn drawn_frames_have_their_zero_point() {
    for (file, electrons_per_adu) in [("cygnus/cygnus.tif", 1.0), ("orion/orion.png", 8.0)] {
        let report = &processed(&[], &[fixture(file)])[0];
        let expected = 2.5 * (DRAWN_ZERO_MAG_E / electrons_per_adu).log10();
        let found = number(report, "/photometry/zero_point_vmag");
        let sigma = number(report, "/photometry/zero_point_sigma_mag");
        println!("{file}: zero point {found} ± {sigma}, drawn with {expected:.4}");
        // The spot's tails and the background contribute a hundredth of a magnitude.
        assert!(
            (found - expected).abs() < 3.0 * sigma + 0.01,
            "{file}: {found} {expected}"
        );
        assert!(sigma < 0.02, "{file}: {sigma}");
        let photometry = &report["photometry"];
        assert_eq!(photometry["flux_unit"], "ADU");
        assert!(photometry["color_term"].is_null(), "{photometry}");
        assert!((number(report, "/photometry/linearity") - 1.0).abs() < 0.05);
    }
}

#[test]
fn a_frame_without_a_zero_point_says_why() {
    let report = &processed(&["--max-stars", "20"], &[fixture("orion/orion.png")])[0];
    let photometry = &report["photometry"];
    assert!(photometry["zero_point_vmag"].is_null(), "{photometry}");
    let reason = &photometry["no_zero_point"];
    assert_eq!(reason["code"], "few_stars_fit");
    assert!(
        reason["text"]
            .as_str()
            .unwrap()
            .contains("a zero point needs 5")
    );
}

#[test]
fn the_limit_of_a_drawn_frame_is_that_of_its_noise() {
    let report = &processed(&["--sigma", "6"], &[fixture("cygnus/cygnus.tif")])[0];
    // A star is detected where the matched filter's signal exceeds 6 standard deviations of sky and
    // read noise; at just this brightness, half of the stars are. The effective area of the spot of
    // 1 px, integrated over pixels, is 4π(σ² + 1/12).
    let noise_e = f64::sqrt(100.0 + 25.0 + 1.0 / 12.0);
    let effective_px = 4.0 * std::f64::consts::PI * (1.0 + 1.0 / 12.0);
    let faintest_e = 6.0 * noise_e * effective_px.sqrt();
    // The filter is evaluated at whole pixels, on average 1/6 px² (squared distance) from the
    // spot's centre.
    let off_centre = (1.0 / 6.0) / (4.0 * (1.0 + 1.0 / 12.0));
    let expected = 2.5 * (DRAWN_ZERO_MAG_E / faintest_e).log10() - 1.0857 * off_centre;
    let found = number(report, "/photometry/limit50_vmag");
    let sigma = number(report, "/photometry/limit50_sigma_mag");
    println!("limit {found} ± {sigma}, by its noise {expected:.3}");
    assert!(
        (found - expected).abs() < 3.0 * sigma + 0.03,
        "{found} {sigma} {expected}"
    );
    // The faintest star detected lies beyond the limit.
    assert!(number(report, "/magnitude/faintest_vmag") > found);
    assert!(share(report, |vmag| vmag < found - 1.0) > 0.95);
    assert!(share(report, |vmag| vmag > found + 1.0) < 0.05);
}

#[test]
fn lists_of_centroids_have_no_photometry() {
    let directory = tempfile::tempdir().unwrap();
    let report = &processed(&[], &[fixture("orion/orion.png")])[0];
    let mut list = String::from("x,y,flux\n");
    for star in report["stars"].as_array().unwrap() {
        list += &format!("{},{},{}\n", star["x"], star["y"], star["flux"]);
    }
    let path = directory.path().join("orion.csv");
    std::fs::write(&path, list).unwrap();
    let mut command = starpipe();
    let ran = Ran::new(command.args(["identify", "--format", "json"]).arg(path));
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    assert_eq!(ran.reports()[0]["photometry"], Value::Null);
}

/// Site of the frames of [`one_night`], known to some kilometres, which is negligible in airmass.
const NIGHT_SITE: &str = "52.22,4.42";
/// Largest difference of zero points of one night after correction for extinction, in stated errors.
const SAME_SKY_SIGMAS: f64 = 2.0;
/// Largest scatter of SKY2000's stars about a zero point with a color term; mostly photon noise of
/// the faint ones.
const SCATTER_MAX_MAG: f64 = 0.2;

/// Four 16-bit frames of one camera and one night, at two altitudes.
fn one_night() -> Option<Vec<Value>> {
    let frames = shared_dir()?.join("frames");
    let frames = [
        "Alt40_Azi-135",
        "Alt40_Azi135",
        "Alt60_Azi-135",
        "Alt60_Azi135",
    ]
    .map(|name| frames.join(format!("2019-07-29T204726_{name}_Try1.tiff")));
    Some(processed(&["--site", NIGHT_SITE], &frames))
}

/// Slope and intercept of the straight line through `points`.
fn line(points: &[[f64; 2]]) -> (f64, f64) {
    let count = points.len() as f64;
    let mean = |axis: usize| points.iter().map(|p| p[axis]).sum::<f64>() / count;
    let (x, y) = (mean(0), mean(1));
    let (above, below) = points.iter().fold((0.0, 0.0), |(above, below), p| {
        (above + (p[0] - x) * (p[1] - y), below + (p[0] - x).powi(2))
    });
    let slope = above / below;
    (slope, y - slope * x)
}

#[test]
fn zero_points_of_one_night_differ_by_extinction_alone() {
    let Some(reports) = one_night() else { return };
    let point = |report: &Value| {
        let airmass = number(report, "/observation/airmass");
        [airmass, number(report, "/photometry/zero_point_vmag")]
    };
    let points: Vec<[f64; 2]> = reports.iter().map(point).collect();
    let (slope, intercept) = line(&points);
    println!(
        "extinction {:.3} mag an airmass, zero point above the air {intercept:.3}",
        -slope
    );
    // From a clear mountain site to thick haze.
    assert!((0.1..0.8).contains(&-slope), "{slope}");
    for (report, [airmass, zero_point]) in reports.iter().zip(points) {
        let off = zero_point - (intercept + slope * airmass);
        let scatter = number(report, "/photometry/scatter_mag");
        println!(
            "airmass {airmass:.3}: zero point {zero_point:.3}, off by {off:+.3}, scatter {scatter:.3}"
        );
        let sigma = number(report, "/photometry/zero_point_sigma_mag");
        assert!(off.abs() < SAME_SKY_SIGMAS * sigma, "{off} ± {sigma}");
        assert!(scatter < SCATTER_MAX_MAG, "{scatter}");
        assert_eq!(report["photometry"]["zero_point_bv_mag"], 0.6);
    }
}

#[test]
fn limits_of_one_night_differ_as_extinction_explains() {
    let Some(reports) = one_night() else { return };
    let limits: Vec<[f64; 2]> = reports
        .iter()
        .map(|report| {
            let sigma = number(report, "/photometry/limit50_sigma_mag");
            let limit = number(report, "/photometry/limit50_vmag");
            println!("limit {limit:.3} ± {sigma:.3}");
            assert!(sigma < 0.1, "{sigma}");
            assert!(number(report, "/magnitude/faintest_vmag") > limit);
            assert!(share(report, |vmag| vmag < limit - 1.0) > 0.97);
            assert!(share(report, |vmag| vmag > limit + 1.0) < 0.03);
            [number(report, "/observation/airmass"), limit]
        })
        .collect();
    // The limit is the same at the same altitude, whatever the stars, and fainter higher up.
    for pair in limits.chunks(2) {
        assert!((pair[0][1] - pair[1][1]).abs() < 0.15, "{pair:?}");
    }
    assert!(limits[2][1] > limits[0][1] && limits[3][1] > limits[1][1]);
}

#[test]
fn a_photograph_with_a_tone_curve_says_so() {
    let Some(shared) = shared_dir() else { return };
    let report = &processed(&[], &[shared.join("frames/hale_bopp.jpg")])[0];
    // The tone curve of sRGB is a power of about 1 / 2.2.
    let linearity = number(report, "/photometry/linearity");
    assert!((0.4..0.6).contains(&linearity), "{linearity}");
    let notes = report["notes"].as_array().unwrap();
    let reported = |note: &Value| {
        let text = note["text"].as_str().unwrap();
        note["code"] == "not_linear" && text.contains("not linear")
    };
    assert!(notes.iter().any(reported), "{notes:?}");
}

#[test]
fn a_raw_color_frame_is_noted_and_its_zero_point_is_that_of_green_pixels() {
    /// Electrons from a star of magnitude 0 where all light passes, by the frame's table of stars,
    /// as a zero point; and 1.5 e⁻ per ADU.
    const TRUE_ZERO_POINT_VMAG: f64 = 13.62 - 0.44;
    let Some(shared) = shared_dir() else { return };
    let frame = shared.join("frames/foreign/d-cfa.tif");
    if !frame.is_file() {
        eprintln!("skipped: {} is absent", frame.display());
        return;
    }
    let report = processed(&[], &[frame]).remove(0);
    let notes = report["notes"].as_array().unwrap();
    assert!(
        notes.iter().any(|note| note["code"] == "color_mosaic"),
        "{notes:?}"
    );
    assert_eq!([&report["width"], &report["height"]], [1024, 768]);
    let zero_point = number(&report, "/photometry/zero_point_vmag");
    assert!(
        (zero_point - TRUE_ZERO_POINT_VMAG).abs() < 0.07,
        "{zero_point}"
    );
    let center = ["ra_deg", "dec_deg"].map(|axis| number(&report, &format!("/attitude/{axis}")));
    assert!((center[0] - 185.754_26).abs() < 6e-4 && (center[1] + 59.834_54).abs() < 3e-4);
}
