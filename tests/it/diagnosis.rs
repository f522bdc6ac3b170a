//! Reasons for frames that are not identified: each on a frame drawn for it, and on no other.

use crate::common::drawing::{Canvas, Picture, View, bright_stars, flux_adu, save};
use crate::common::{Ran, starpipe};
use image::Luma;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::path::Path;

const WIDTH: u32 = 640;
const HEIGHT: u32 = 480;

const ORION: View = View {
    ra_deg: 83.0,
    dec_deg: 0.0,
    up_pa_deg: 20.0,
    fov_deg: 24.0,
    width: WIDTH,
    height: HEIGHT,
    mirrored: false,
};

/// Code and text of the reason why `path` is not identified.
fn reason(path: &Path, options: &[&str]) -> (String, String) {
    let mut command = starpipe();
    command.args(["process", "--format", "json"]).args(options);
    let ran = Ran::new(command.arg(path));
    let report = ran.reports().remove(0);
    assert_eq!(report["status"], "not_identified", "{}", ran.stderr);
    assert_eq!(ran.status, 3, "{}", ran.stderr);
    let word = |name: &str| report[name].as_str().unwrap().to_owned();
    let (code, text) = (word("reason_code"), word("reason"));
    let mut command = starpipe();
    let for_people = Ran::new(command.arg("process").args(options).arg(path)).stdout;
    // Lines are broken where they are full.
    let words: Vec<&str> = for_people.split_whitespace().collect();
    let for_people = words.join(" ");
    let beginning: String = text.chars().take(30).collect();
    assert!(
        for_people.contains(&format!("not identified: {beginning}")),
        "{for_people}"
    );
    (code, text)
}

fn check(picture: &Picture, options: &[&str], code: &str, words_in_reason: &[&str]) {
    let directory = tempfile::tempdir().unwrap();
    let (found, text) = reason(&save(picture, directory.path(), "frame.png"), options);
    assert_eq!(found, code, "{text}");
    for words in words_in_reason {
        assert!(text.contains(words), "{words}: {text}");
    }
}

/// Random positions and fluxes.
fn random_dots(seed: u64, count: usize) -> Vec<(f64, f64, f64)> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut between = |low: f64, high: f64| random.random_range(low..high);
    let right = f64::from(WIDTH) - 60.0;
    let bottom = f64::from(HEIGHT) - 60.0;
    (0..count)
        .map(|_| {
            (
                between(60.0, right),
                between(60.0, bottom),
                flux_adu(between(1.0, 5.0)),
            )
        })
        .collect()
}

#[test]
fn a_frame_with_too_few_stars_says_how_many_it_takes() {
    let mut canvas = Canvas::new(WIDTH, HEIGHT);
    canvas.spot(100.0, 200.0, flux_adu(3.0));
    canvas.spot(300.0, 150.0, flux_adu(3.0));
    check(
        &canvas.develop(2),
        &[],
        "too_few_stars",
        &["only 2 stars", "longer exposure"],
    );
}

#[test]
fn an_empty_frame_says_that_it_is_empty() {
    check(
        &Picture::from_pixel(WIDTH, HEIGHT, Luma([700])),
        &[],
        "no_variation",
        &["700"],
    );
}

#[test]
fn an_overexposed_frame_says_its_share_of_saturated_pixels() {
    let mut picture = ORION.picture(&bright_stars());
    for (x, _, pixel) in picture.enumerate_pixels_mut() {
        if x >= WIDTH / 10 {
            *pixel = Luma([u16::MAX]);
        }
    }
    check(&picture, &[], "saturated", &["90 %", "65535"]);
    // Twelve-bit levels in a 16-bit file.
    for pixel in picture.pixels_mut() {
        pixel.0[0] = pixel.0[0].min(4095);
    }
    check(&picture, &[], "saturated", &["90 %", "4095"]);
}

#[test]
fn a_negative_is_named_and_says_what_to_do() {
    // Of a sky that is grey, and of one that is white.
    for white in [60_000_u32, 65_535 + 2_000] {
        let mut picture = ORION.picture(&bright_stars());
        for pixel in picture.pixels_mut() {
            let inverted = white.saturating_sub(pixel.0[0].into());
            pixel.0[0] = inverted.min(u16::MAX.into()) as u16;
        }
        check(&picture, &[], "negative", &["dark spots", "invert"]);
    }
}

#[test]
fn a_field_too_narrow_for_the_catalog_says_so() {
    let mut canvas = Canvas::new(WIDTH, HEIGHT);
    for (x, y, flux) in random_dots(1, 40) {
        canvas.spot(x, y, flux);
    }
    let picture = canvas.develop(3);
    for options in [["--fov", "0.5"], ["--pixel-scale", "2"]] {
        let expected = ["that was given", "fields of 1.50° or more"];
        check(&picture, &options, "too_narrow", &expected);
    }
    for fov in ["20", "130"] {
        check(&picture, &["--fov", fov], "no_match", &["40 detections"]);
    }
}

#[test]
fn a_wrong_hint_is_reported_with_the_solution_without_it() {
    let picture = ORION.picture(&bright_stars());
    let scale = ["24.0° wide", "range of widths, 36.0° to 44.0°"];
    check(&picture, &["--fov", "40"], "hints_exclude", &scale);
    let both = ["--fov", "40", "--near", "103,0", "--radius", "5"];
    check(&picture, &both, "hints_exclude", &scale);
}

#[test]
fn a_wrong_direction_is_dropped_and_a_note_says_so() {
    let directory = tempfile::tempdir().unwrap();
    let path = save(
        &ORION.picture(&bright_stars()),
        directory.path(),
        "frame.png",
    );
    let elsewhere = [
        ["--near", "103,0"].as_slice(),
        &["--ra", "06h52m", "--dec", "0"],
    ];
    for direction in elsewhere {
        let mut command = starpipe();
        command.args(["process", "--format", "json", "--radius", "5"]);
        let report = Ran::new(command.args(direction).arg(&path))
            .reports()
            .remove(0);
        assert_eq!(report["status"], "identified", "{direction:?}");
        let notes = report["notes"].to_string();
        assert!(notes.contains("20.0° from the given direction"), "{notes}");
    }
    let mut command = starpipe();
    command.args(["process", "--format", "json", "--ra", "83", "--dec", "0"]);
    let report = Ran::new(command.arg(&path)).reports().remove(0);
    assert!(!report["notes"].to_string().contains("direction"));
}

#[test]
fn trails_are_reported_with_direction_and_length() {
    let length = 30.0;
    for (angle_deg, direction) in [
        (35.0_f64, "35°, rising"),
        (-60.0, "60°, falling"),
        (90.0, "vertical"),
    ] {
        let mut canvas = Canvas::new(WIDTH, HEIGHT);
        let (sin, cos) = angle_deg.to_radians().sin_cos();
        // No sky: trails of true stars, all alike, are identified.
        for (x, y, _) in random_dots(7, 24) {
            // y runs down.
            canvas.trail((x, y), (x + length * cos, y - length * sin), flux_adu(1.5));
        }
        check(
            &canvas.develop(4),
            &[],
            "trails",
            &["trails", direction, "px long"],
        );
    }
}

#[test]
fn one_trail_among_stars_is_not_a_frame_of_trails() {
    let mut canvas = Canvas::new(WIDTH, HEIGHT);
    for (x, y, flux) in random_dots(2, 30) {
        canvas.spot(x, y, flux);
    }
    canvas.trail((50.0, 60.0), (500.0, 300.0), flux_adu(-2.0));
    check(&canvas.develop(5), &[], "no_match", &[]);
}

#[test]
fn a_double_exposure_is_reported_with_its_offset() {
    let mut canvas = Canvas::new(WIDTH, HEIGHT);
    for (x, y, flux) in random_dots(3, 30) {
        canvas.spot(x, y, flux);
        canvas.spot(x + 23.4, y - 11.2, flux * 0.8);
    }
    check(
        &canvas.develop(6),
        &[],
        "double_exposure",
        &["twice", "(+23.4, -11.2) px"],
    );
}

#[test]
fn a_double_exposure_of_the_sky_is_identified_or_reported() {
    let mut canvas = Canvas::new(WIDTH, HEIGHT);
    for (star, x, y) in ORION.stars(&bright_stars()) {
        canvas.spot(x, y, flux_adu(star.v_mag));
        canvas.spot(x + 40.0, y + 31.0, flux_adu(star.v_mag));
    }
    let directory = tempfile::tempdir().unwrap();
    let path = save(&canvas.develop(7), directory.path(), "twice.png");
    let report = Ran::new(starpipe().args(["process", "--format", "json"]).arg(path))
        .reports()
        .remove(0);
    let reported = report["status"] == "identified" || report["reason_code"] == "double_exposure";
    assert!(reported, "{}", report["reason"]);
}

#[test]
fn a_list_of_centroids_has_reasons_too() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("list.csv");
    let rows = ORION
        .stars(&bright_stars())
        .into_iter()
        .map(|(star, x, y)| format!("{x},{y},{}\n", star.v_mag));
    std::fs::write(&path, format!("x,y,vmag\n{}", rows.collect::<String>())).unwrap();
    let mut command = starpipe();
    command.args([
        "identify", "--format", "json", "--width", "640", "--height", "480", "--fov", "40",
    ]);
    let report = Ran::new(command.arg(path)).reports().remove(0);
    assert_eq!(
        report["reason_code"], "hints_exclude",
        "{}",
        report["reason"]
    );
}
