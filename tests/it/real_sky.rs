//! The real sky: photographs and published lists, compared with independent solutions.

use crate::common::{Ran, Truth, fixture, number, shared_dir, starpipe};
use serde_json::Value;
use std::collections::HashMap;
use std::f64::consts::PI;
use std::fs;
use std::path::Path;

/// The solutions in truth.csv agree with each other to 0.02°.
const CENTRE_TOLERANCE_DEG: f64 = 0.05;
const FOV_TOLERANCE: f64 = 0.01;
/// What another program reaches on the uncompressed frames: number of stars and residuals.
const SHARP_FRAME: &str = ".tiff";
const SHARP_MATCHED: f64 = 60.0;
const SHARP_RMS_ARCSEC: f64 = 13.0;
/// Compressed frames, whose blocks must not become stars, and their number of sources.
const COMPRESSED: [(&str, f64); 4] = [
    ("hale_bopp.jpg", 1600.0),
    ("jan1_g90_e50ms.jpg", 390.0),
    ("jan1_g90_e100ms.jpg", 190.0),
    ("test2_g100_e50ms.jpg", 80.0),
];
/// Tolerance of that number, relative.
const COMPRESSED_TOLERANCE: f64 = 0.1;
/// Above this signal-to-noise ratio, residuals show errors of camera model and catalogue rather
/// than noise.
const BRIGHT_SNR: f64 = 20.0;

/// How the first row of the table of docs/results.md begins.
const FIRST_ROW: &str = "| 2019-07-29T204726_Alt40_Azi-135_Try1.tiff |";

/// Pointing tolerance of a frame drawn without distortion: a small part of a pixel (of 1.4 to
/// 1.9′).
const DRAWN_CENTRE_TOLERANCE_DEG: f64 = 0.003;
const DRAWN_ROLL_TOLERANCE_DEG: f64 = 0.02;
const DRAWN_FOV_TOLERANCE: f64 = 5e-4;

/// Rows of a CSV file by column.
fn rows(path: &Path) -> Vec<HashMap<String, String>> {
    let mut reader = csv::Reader::from_path(path).unwrap();
    reader.deserialize().map(Result::unwrap).collect()
}

#[test]
fn all_real_frames_are_identified_as_by_others() {
    let Some(shared) = shared_dir() else { return };
    let rows = rows(&shared.join("frames/truth.csv"));
    assert_eq!(rows.len(), 11);
    let frames = rows
        .iter()
        .map(|row| shared.join("frames").join(&row["file"]));
    let ran = Ran::new(
        starpipe()
            .args(["process", "--format", "json"])
            .args(frames),
    );
    let mut wrong = Vec::new();
    let mut table = String::new();
    for (row, report) in rows.iter().zip(ran.reports()) {
        let file = &row["file"];
        if report["status"] != "identified" {
            wrong.push(format!("{file}: {}", report["reason"]));
            continue;
        }
        let value = |name: &str| row[name].parse::<f64>().unwrap();
        // The angle in the file has another convention and another reference point: the drawn
        // frames test the angle.
        let truth = Truth {
            ra_deg: value("ra_deg"),
            dec_deg: value("dec_deg"),
            fov_x_deg: value("fov_x_deg"),
        };
        let (centre_deg, fov) = (truth.centre_error_deg(&report), truth.fov_error(&report));
        let matched = number(&report, "/match/matched");
        let rms_arcsec = number(&report, "/match/rms_arcsec");
        let detected = number(&report, "/match/detected");
        table += &format!(
            "| {file} | {matched} of {} | {:.1}″ | {:+.2} % | {rms_arcsec:.1}″ | {} | {:.0} |\n",
            detected,
            centre_deg * 3600.0,
            fov * 100.0,
            bright_rms_arcsec(&report).map_or("–".to_owned(), |rms| format!("{rms:.1}″")),
            number(&report, "/match/log10_false_alarm"),
        );
        let expected = COMPRESSED.iter().find(|(name, _)| name == file);
        if expected.is_some_and(|(_, n)| (detected / n - 1.0).abs() > COMPRESSED_TOLERANCE) {
            wrong.push(format!("{file}: {detected} sources"));
        }
        let sharp = !file.ends_with(SHARP_FRAME)
            || (matched >= SHARP_MATCHED && rms_arcsec <= SHARP_RMS_ARCSEC);
        let right = centre_deg < CENTRE_TOLERANCE_DEG
            && fov.abs() < FOV_TOLERANCE
            && report["optics"]["mirrored"] == false;
        if !(sharp && right) {
            wrong.push(format!(
                "{file}: centre {centre_deg}°, field {fov}, {matched} stars, {rms_arcsec}″"
            ));
        }
    }
    println!("{table}");
    assert!(wrong.is_empty(), "{wrong:#?}");
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    check_page(&table.replace("| -", "| −"));
}

/// Compares the rows of `table` with those on the page of results, or writes them there where
/// STARPIPE_WRITE_RESULTS=1.
fn check_page(table: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/results.md");
    let page = fs::read_to_string(&path).unwrap();
    let start = page.find(FIRST_ROW).unwrap();
    let end = start + page[start..].find("\n\n").unwrap() + 1;
    if std::env::var_os("STARPIPE_WRITE_RESULTS").is_some_and(|value| value == "1") {
        fs::write(&path, [&page[..start], table, &page[end..]].concat()).unwrap();
    } else {
        let advice =
            "docs/results.md is of another program: run this with STARPIPE_WRITE_RESULTS=1";
        assert!(&page[start..end] == table, "{advice}\n{table}");
    }
}

/// Root mean square residual of the identified stars above [`BRIGHT_SNR`], if there are any.
fn bright_rms_arcsec(report: &Value) -> Option<f64> {
    let residuals_px: Vec<f64> = report["stars"]
        .as_array()?
        .iter()
        .filter(|star| star["snr"].as_f64().is_some_and(|snr| snr > BRIGHT_SNR))
        .filter_map(|star| star["residual_px"].as_f64())
        .collect();
    let sum_sq: f64 = residuals_px.iter().map(|px| px * px).sum();
    let pixel_arcsec = 648_000.0 / PI / number(report, "/optics/focal_length_px");
    let count = residuals_px.len();
    (count > 0).then(|| (sum_sq / count as f64).sqrt() * pixel_arcsec)
}

#[test]
fn all_stars_of_the_published_experiments_are_named_with_and_without_a_scale() {
    let Some(shared) = shared_dir() else { return };
    for experiment in ["experiment-1.csv", "experiment-2.csv"] {
        let list = shared.join("seeds").join(experiment);
        let published = rows(&list);
        for hint in [&["--pixel-scale", "10.8"][..], &[]] {
            let mut command = starpipe();
            command
                .args(["identify", "--format", "json"])
                .args(hint)
                .arg(&list);
            let ran = Ran::new(&mut command);
            assert_eq!(ran.status, 0, "{experiment} {hint:?}: {}", ran.stdout);
            let reports = ran.reports();
            let stars = reports[0]["stars"].as_array().unwrap();
            for row in &published {
                let value = |name: &str| row[name].parse::<f64>().unwrap();
                let found = stars
                    .iter()
                    .find(|star| star["x"] == value("x_px") && star["y"] == value("y_px"))
                    .unwrap();
                let id = found["id"].as_str().map(str::to_owned);
                let number = row["skymap_number"].parse::<u32>().ok();
                let expected = number.map(|number| format!("SKYMAP {number:08}"));
                assert_eq!(id, expected, "{experiment} {hint:?}: {found}");
            }
        }
    }
}

#[test]
fn drawn_frames_point_where_they_were_drawn_to() {
    for (folder, file) in [("orion", "orion.png"), ("cygnus", "cygnus.tif")] {
        let provenance = fs::read_to_string(fixture(folder).join("PROVENANCE.toml")).unwrap();
        let value = |name: &str| -> f64 {
            let line = provenance
                .lines()
                .find_map(|line| line.strip_prefix(&format!("{name} = ")));
            line.unwrap_or_else(|| panic!("{folder} has no {name}"))
                .parse()
                .unwrap()
        };
        let truth = Truth {
            ra_deg: value("ra_deg"),
            dec_deg: value("dec_deg"),
            fov_x_deg: value("fov_x_deg"),
        };
        let frame = fixture(folder).join(file);
        let ran = Ran::new(starpipe().args(["process", "--format", "json"]).arg(frame));
        let report = &ran.reports()[0];
        assert_eq!(ran.status, 0, "{}", report["reason"]);
        let centre_deg = truth.centre_error_deg(report);
        assert!(
            centre_deg < DRAWN_CENTRE_TOLERANCE_DEG,
            "{folder}: {centre_deg}°"
        );
        let roll_deg = number(report, "/attitude/up_pa_deg") - value("up_pa_deg");
        assert!(
            roll_deg.abs() < DRAWN_ROLL_TOLERANCE_DEG,
            "{folder}: {roll_deg}°"
        );
        let fov = truth.fov_error(report);
        assert!(fov.abs() < DRAWN_FOV_TOLERANCE, "{folder}: {fov}");
    }
}
