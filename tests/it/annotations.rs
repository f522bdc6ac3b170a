//! What has a name in a frame, by its pose: labels of bright stars, constellations, the sentence.

use crate::common::{Ran, fixture, shared_dir, starpipe};
use serde_json::Value;
use std::collections::HashMap;
use std::fs;
use tempfile::tempdir;

/// The share of the stars brighter than `NAMED_MAG` with light at their place that are named.
const NAMED_SHARE: f64 = 0.95;
const NAMED_MAG: f64 = 4.0;
/// Stars whose labels are compared with their light.
const LABELED_MAG: f64 = 3.0;

fn reports(frames: impl IntoIterator<Item = std::path::PathBuf>) -> Vec<Value> {
    let ran = Ran::new(
        starpipe()
            .args(["process", "--format", "json"])
            .args(frames),
    );
    ran.reports()
}

fn of_kind<'a>(report: &'a Value, kind: &str) -> Vec<&'a Value> {
    let all = report["annotations"].as_array().unwrap();
    all.iter().filter(|shown| shown["kind"] == kind).collect()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

#[test]
fn a_picture_of_orion_says_so_and_labels_its_stars() {
    let report = &reports([fixture("orion/orion.png")])[0];
    let sentence = report["sentence"].as_str().unwrap();
    let expected = "Orion, with M 42, the Orion Nebula; 20 by 15 degrees, north is";
    assert!(sentence.starts_with(expected), "{sentence}");
    assert_eq!(report["constellations"][0]["abbreviation"], "Ori");
    let stars = of_kind(report, "star");
    for label in [
        "Betelgeuse",
        "Rigel",
        "Bellatrix",
        "Mintaka",
        "Alnilam",
        "Alnitak",
        "σ Ori",
    ] {
        let star = stars.iter().find(|star| star["label"] == label).unwrap();
        assert!(star["detection"].is_u64(), "{star}");
    }
    let text = Ran::new(starpipe().arg("process").arg(fixture("orion/orion.png")));
    let first = text.stdout.lines().next().unwrap();
    assert!(first.contains("orion.png: Orion, with M 42"), "{first}");
}

#[test]
fn cuts_for_sharing_have_their_size() {
    let dir = tempdir().unwrap();
    for (name, size) in [("square", (1080, 1080)), ("story", (1080, 1350))] {
        let out = dir.path().join(name);
        let ran = Ran::new(
            starpipe()
                .args(["process", "--overlay-for", name, "--out"])
                .arg(&out)
                .arg(fixture("orion/orion.png")),
        );
        assert_eq!(ran.status, 0, "{}", ran.stderr);
        let picture = image::open(out.join("orion.png")).unwrap();
        assert_eq!((picture.width(), picture.height()), size, "{name}");
    }
}

#[test]
fn bright_stars_of_real_frames_are_named_and_labeled_where_their_light_is() {
    let Some(shared) = shared_dir() else { return };
    let pictures = ["frames", "frames/hard"].into_iter().flat_map(|folder| {
        let files = fs::read_dir(shared.join(folder)).unwrap();
        files.map(|file| file.unwrap().path())
    });
    let is_picture = |path: &std::path::PathBuf| {
        let extension = path.extension().and_then(|extension| extension.to_str());
        extension.is_some_and(|e| ["tiff", "jpg", "png", "bmp"].contains(&e))
    };
    let mut frames: Vec<_> = pictures.filter(is_picture).collect();
    frames.sort();
    let (mut bright, mut named, mut labels) = (0, 0, 0);
    for report in reports(frames) {
        for star in of_kind(&report, "star") {
            let light = &report["stars"][star["detection"].as_u64().unwrap() as usize];
            let v_mag = number(&star["vmag"]);
            if v_mag < NAMED_MAG {
                bright += 1;
                named += usize::from(star["why"].is_null());
            }
            if v_mag < LABELED_MAG {
                labels += 1;
                let [dx, dy] = ["x", "y"].map(|axis| number(&star[axis]) - number(&light[axis]));
                let off_px = light["residual_px"]
                    .as_f64()
                    .unwrap_or(0.0)
                    .max(dx.hypot(dy));
                let error_px = number(&star["uncertainty_px"]);
                assert!(off_px <= error_px, "{}: {star} {light}", report["frame"]);
            }
        }
    }
    println!(
        "{named} of {bright} stars of V < {NAMED_MAG} are named; {labels} labels of V < {LABELED_MAG}"
    );
    assert!(
        labels > 150 && named as f64 >= NAMED_SHARE * bright as f64,
        "{named} of {bright}"
    );
}

#[test]
fn labels_are_where_another_simulator_put_the_stars() {
    let Some(shared) = shared_dir() else { return };
    let folder = shared.join("frames/foreign");
    let files = fs::read_dir(&folder).unwrap();
    let mut frames: Vec<_> = files.map(|file| file.unwrap().path()).collect();
    frames.retain(|path| {
        // Stars drawn twice have two places.
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        path.extension().is_some_and(|extension| extension == "tif") && !name.contains("double")
    });
    frames.sort();
    let mut labels = 0;
    for (report, path) in reports(frames.clone()).iter().zip(&frames) {
        let mut truth = csv::Reader::from_path(path.with_extension("csv")).unwrap();
        let places: HashMap<String, [f64; 2]> = truth
            .records()
            .map(|row| {
                let row = row.unwrap();
                let place = [0, 1].map(|column| row[column].parse().unwrap());
                (format!("SKYMAP {}", &row[4]), place)
            })
            .collect();
        for star in of_kind(report, "star") {
            let Some([x, y]) = star["id"].as_str().and_then(|id| places.get(id)) else {
                continue;
            };
            labels += 1;
            let off_px = (number(&star["x"]) - x).hypot(number(&star["y"]) - y);
            let error_px = number(&star["uncertainty_px"]);
            assert!(
                off_px <= error_px,
                "{}: {off_px} px, {star}",
                path.display()
            );
        }
    }
    assert!(labels > 250, "{labels}");
}
