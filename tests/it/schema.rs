//! What other programs read: schema 2 of the reports, with numbers that can be checked from outside.

use crate::common::{Ran, fixture, number, report, starpipe};
use serde_json::Value;
use starpipe::base::table::{Column, TableRow};
use starpipe::report::StarRow;
use starpipe::store::FrameRow;

/// Largest difference between a residual and the distance computed here: the report's digits.
const SAME_PX: f64 = 2e-4;

/// The product of two quaternions [w, x, y, z].
fn product(a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
    [
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    ]
}

/// The pixel of a star's `ra_deg` and `dec_deg` by the report's own attitude and focal length.
fn pixel(report: &Value, star: &Value) -> [f64; 2] {
    assert!(report["optics"]["distortion"].is_null());
    assert_eq!(report["optics"]["mirrored"], false);
    let ra = star["ra_deg"].as_f64().unwrap().to_radians();
    let dec = star["dec_deg"].as_f64().unwrap().to_radians();
    let q = [0, 1, 2, 3].map(|i| number(report, &format!("/attitude/quaternion/{i}")));
    let conjugate = [q[0], -q[1], -q[2], -q[3]];
    let icrs = [0.0, dec.cos() * ra.cos(), dec.cos() * ra.sin(), dec.sin()];
    let [_, x, y, z] = product(product(q, icrs), conjugate);
    let focal_px = number(report, "/optics/focal_length_px");
    [(x, "/width"), (y, "/height")]
        .map(|(along, side)| focal_px * along / z + (number(report, side) - 1.0) / 2.0)
}

fn distance_px(report: &Value, star: &Value) -> f64 {
    let [x, y] = pixel(report, star);
    (x - star["x"].as_f64().unwrap()).hypot(y - star["y"].as_f64().unwrap())
}

#[test]
fn residuals_are_distances_from_the_named_stars_own_position() {
    // Epsilon Lyrae's components shift each other's light.
    let report = report("regression/touching.tif", &["--fov", "9"]);
    let stars = report["stars"].as_array().unwrap();
    let named: Vec<&Value> = stars.iter().filter(|star| star["id"].is_string()).collect();
    for star in &named {
        let residual_px = star["residual_px"].as_f64().unwrap();
        let distance_px = distance_px(&report, star);
        assert!((residual_px - distance_px).abs() < SAME_PX, "{star}");
    }
    // A blend is measured where its light is, not where the named star is.
    let is_shifted = |star: &&&Value| {
        let of = |field: &str| star[field].as_f64();
        let apart_px = of("residual_blend_px").map(|px| of("residual_px").unwrap() - px);
        apart_px.is_some_and(|px| px > 0.1)
    };
    assert!(named.iter().filter(is_shifted).count() > 0);
    assert!(named.iter().any(|star| star["residual_blend_px"].is_null()));
}

#[test]
fn every_detection_of_an_identified_frame_has_a_direction() {
    let report = report("regression/strays.tif", &[]);
    let stars = report["stars"].as_array().unwrap();
    let unnamed: Vec<&Value> = stars.iter().filter(|star| star["id"].is_null()).collect();
    assert!(unnamed.len() > 5, "{}", unnamed.len());
    for star in unnamed {
        assert!(distance_px(&report, star) < SAME_PX, "{star}");
        assert!(star["residual_px"].is_null() && star["residual_blend_px"].is_null());
    }
}

#[test]
fn identifiers_carry_their_catalogue_in_every_format() {
    let frame = fixture("orion/orion.png");
    let report = report("orion/orion.png", &[]);
    let is_skymap = |id: &str| {
        let digits = id.strip_prefix("SKYMAP ").unwrap_or_default();
        digits.len() == 8 && digits.bytes().all(|b| b.is_ascii_digit())
    };
    assert!(is_skymap(
        report["magnitude"]["faintest_id"].as_str().unwrap()
    ));
    let stars = report["stars"].as_array().unwrap();
    let ids: Vec<&str> = stars
        .iter()
        .filter_map(|star| star["id"].as_str())
        .collect();
    assert!(
        ids.len() > 300 && ids.iter().all(|id| is_skymap(id)),
        "{ids:?}"
    );
    for format in ["csv", "text"] {
        let mut command = starpipe();
        command.args(["process", "--format", format, "--all-stars"]);
        let text = Ran::new(command.arg(&frame)).stdout;
        assert!(ids.iter().all(|id| text.contains(id)), "{format}");
    }
}

#[test]
fn bright_stars_have_their_proper_names_before_their_designations() {
    let report = report("orion/orion.png", &[]);
    let stars = report["stars"].as_array().unwrap();
    let names: Vec<&str> = stars
        .iter()
        .filter_map(|star| star["name"].as_str())
        .collect();
    for name in [
        "Rigel (19 bet Ori)",
        "Betelgeuse (58 alp Ori)",
        "Alnilam (46 eps Ori)",
    ] {
        assert!(names.contains(&name), "{name}: {names:?}");
    }
}

#[test]
fn notes_have_a_code_and_a_text() {
    let report = report("orion/orion.png", &["--site", "50,10"]);
    let note = &report["notes"][0];
    assert_eq!(note["code"], "time_of_day_unknown");
    assert!(note["text"].as_str().unwrap().contains("zenith distance"));
}

#[test]
fn every_code_of_a_note_is_documented() {
    let page = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/json.md"));
    let page = page.unwrap();
    let sources = [
        include_str!("../../src/solve/note.rs"),
        include_str!("../../src/photometry/comparison/contradiction.rs"),
    ];
    let codes: Vec<&str> = sources
        .iter()
        .flat_map(|source| source.split("=> \"").skip(1))
        .filter_map(|rest| rest.split_once("\",").map(|(code, _)| code))
        .filter(|code| code.bytes().all(|b| b.is_ascii_lowercase() || b == b'_'))
        .collect();
    assert!(codes.len() >= 14, "{codes:?}");
    for code in codes {
        assert!(page.contains(&format!("| `{code}` |")), "{code}");
    }
}

#[test]
fn every_column_is_documented() {
    let page = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/archives.md"));
    let page = page.unwrap();
    fn rows<R>(columns: Vec<Column<R>>) -> String {
        let row = |column: Column<R>| {
            let (name, meaning) = (column.name, column.meaning);
            format!(
                "| `{name}` | {} | {} |\n",
                meaning.unit, meaning.description
            )
        };
        columns.into_iter().map(row).collect()
    }
    assert!(page.contains(&rows(FrameRow::columns())));
    assert!(page.contains(&rows(StarRow::columns())));
}

#[test]
fn identify_reads_the_table_that_process_writes() {
    let directory = tempfile::tempdir().unwrap();
    let table = directory.path().join("stars.csv");
    // Blends, false stars and trails are in these frames.
    for name in ["orion/orion.png", "regression/strays.tif"] {
        let mut process = starpipe();
        process.args(["process", "--format", "csv"]);
        std::fs::write(&table, Ran::new(process.arg(fixture(name))).stdout).unwrap();
        let whole = report(name, &[]);
        let mut identify = starpipe();
        identify.args(["identify", "--format", "json"]);
        for side in ["width", "height"] {
            identify.args([format!("--{side}"), whole[side].to_string()]);
        }
        let ran = Ran::new(identify.arg(&table));
        assert_eq!(ran.status, 0, "{}", ran.stderr);
        let listed = &ran.reports()[0];
        let detected = |report: &Value| report["match"]["detected"].clone();
        assert_eq!(detected(listed), detected(&whole));
        for angle in ["ra_deg", "dec_deg"] {
            let pointer = format!("/attitude/{angle}");
            let difference_deg = number(listed, &pointer) - number(&whole, &pointer);
            // A list has no spot size, by which blends are named.
            let sigma_deg = number(&whole, "/attitude/sigma_arcsec/x") / 3600.0;
            assert!(
                difference_deg.abs() < sigma_deg,
                "{name} {angle}: {difference_deg}"
            );
        }
        // What process took for no star has no name.
        let flagged = whole["stars"].as_array().unwrap().iter().filter(|star| {
            let flags = star["flags"].as_array().unwrap().iter();
            flags
                .into_iter()
                .any(|flag| flag == "trail" || flag == "hot_pixel")
        });
        for star in flagged {
            let same = |other: &&Value| other["x"] == star["x"] && other["y"] == star["y"];
            let stars = listed["stars"].as_array().unwrap();
            assert!(stars.iter().find(same).unwrap()["id"].is_null(), "{star}");
        }
    }
}

#[test]
fn one_frame_of_a_table_of_several_is_chosen_by_name() {
    let directory = tempfile::tempdir().unwrap();
    let table = directory.path().join("stars.csv");
    let frames = ["orion/orion.png", "regression/clean.tif"].map(fixture);
    let mut process = starpipe();
    process.args(["process", "--format", "csv"]);
    std::fs::write(&table, Ran::new(process.args(&frames)).stdout).unwrap();
    let identify = |options: &[&str]| {
        let mut command = starpipe();
        command.args(["identify", "--format", "json"]).args(options);
        Ran::new(command.arg(&table))
    };
    let refused = identify(&[]);
    assert_eq!(refused.status, 1);
    assert!(refused.stderr.contains("2 frames"), "{}", refused.stderr);
    assert!(refused.stderr.contains("--frame"), "{}", refused.stderr);
    let chosen = identify(&["--frame", frames[1].to_str().unwrap()]);
    assert_eq!(chosen.status, 0, "{}", chosen.stderr);
}
