//! `starpipe defocus` through the program: the paper's surface, real stars, the user's dark frames,
//! and bad input.

use crate::common::{Ran, number, starpipe};
use serde_json::Value;
use std::fs;
use std::path::Path;

fn defocus(arguments: &[&str]) -> Ran {
    Ran::new(starpipe().arg("defocus").args(arguments))
}

fn json(arguments: &[&str]) -> Value {
    let ran = defocus(&[arguments, &["--format", "json"]].concat());
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    serde_json::from_str(&ran.stdout).unwrap()
}

/// Few radii, noises and trials: tests the program's behaviour, not its numbers.
const SMALL_PEAK: [&str; 6] = [
    "--radius-px",
    "0.4:2.4:12",
    "--noise-relative",
    "2e-4:20e-4:8",
    "--count",
    "20",
];
const SMALL_ENERGY: [&str; 10] = [
    "--preset",
    "nanosat-tracker",
    "--vmag",
    "5",
    "--radius-px",
    "0.3:1.5:7",
    "--noise-e",
    "2:20:5:log",
    "--count",
    "40",
];

#[test]
fn the_papers_surface_is_reproduced_and_errors_follow_the_closed_form() {
    let answer = json(&["--count", "100"]);
    assert_eq!(answer["normalisation"], "peak");
    let surface = "/stars/0/surface";
    let difference = number(&answer, &format!("{surface}/paper/surface_difference_px"));
    assert!(difference <= 0.0036, "{difference}");
    let residual = number(&answer, &format!("{surface}/residual_px"));
    assert!(residual <= 0.0025, "{residual}");
    assert_eq!(
        number(&answer, &format!("{surface}/paper/residual_px")),
        0.0025
    );
    let closed = "/stars/0/closed_form";
    let ratio = number(&answer, &format!("{closed}/mean_square_ratio"));
    let sigma = number(&answer, &format!("{closed}/mean_square_ratio_sigma"));
    assert!((ratio - 1.0).abs() < 4.0 * sigma, "{ratio} ± {sigma}");
    let off = number(&answer, &format!("{closed}/difference_px"));
    let chance = number(&answer, &format!("{surface}/scatter_px"));
    assert!((off / chance - 1.0).abs() < 0.05, "{off} {chance}");
    // The paper's statement: a parabola describes the lines much better than a straight line.
    let lines = answer["stars"][0]["equal_error"].as_array().unwrap();
    let parabolas = lines
        .iter()
        .filter(|line| line["points"].as_array().unwrap().len() > 40);
    for line in parabolas {
        assert!(number(line, "/radius_of_noise/explained") > 0.98, "{line}");
    }
}

#[test]
fn the_numbers_are_the_same_on_any_number_of_threads() {
    for arguments in [&SMALL_PEAK[..], &SMALL_ENERGY] {
        let on = |threads: &str| {
            let ran = defocus(&[arguments, &["--format", "csv", "--threads", threads]].concat());
            assert_eq!(ran.status, 0, "{}", ran.stderr);
            ran.stdout
        };
        let one = on("1");
        assert_eq!(one, on("3"));
        let rows = one.lines().count() - 1;
        assert!(rows == 12 * 8 || rows == 7 * 5, "{rows}");
        let other = defocus(&[arguments, &["--format", "csv", "--seed", "2"]].concat());
        assert_ne!(one, other.stdout);
    }
}

#[test]
fn the_page_for_people_begins_with_the_answer() {
    let ran = defocus(&[&SMALL_PEAK[..], &["--required-error", "0.02,1e-4"]].concat());
    assert_eq!(ran.status, 3, "{}", ran.stderr);
    insta::assert_snapshot!("defocus_peak", ran.stdout);
}

#[test]
fn a_real_star_needs_a_narrow_spot_and_the_paper_a_wide_one() {
    let real = json(&SMALL_ENERGY);
    assert_eq!(real["normalisation"], "energy");
    let paper = json(&SMALL_PEAK);
    assert!(number(&real, "/stars/0/best/radius_px") < 0.5);
    assert!(number(&paper, "/stars/0/best/radius_px") > 1.5);
    // The fit reaches the bound, and a wider spot has a brighter limit.
    let curve = real["stars"][0]["curve"].as_array().unwrap();
    for row in curve {
        // With 1000 stars the error is known to 1.6 %.
        let ratio = number(row, "/error_px") / number(row, "/bound_px");
        assert!((0.93..1.12).contains(&ratio), "{row}");
    }
    let limits: Vec<f64> = curve.iter().map(|row| number(row, "/limit_vmag")).collect();
    assert!(
        limits.windows(2).all(|pair| pair[1] < pair[0]),
        "{limits:?}"
    );
    // The grey-weighted centroid needs a wider spot, and is never better than the fit.
    let grey = json(&[&SMALL_ENERGY[..], &["--centroid", "grey-weighted"]].concat());
    assert_eq!(grey["centroid"], "grey-weighted");
    let best = |answer: &Value| number(answer, "/stars/0/best/error_px");
    assert!(best(&grey) > best(&real));
}

/// Dark frames of the preset, with another read noise.
fn simulate_darks(directory: &Path, options: &[&str]) {
    let made = Ran::new(
        starpipe()
            .args([
                "simulate",
                "--preset",
                "nanosat-tracker",
                "--dark",
                "--count",
                "6",
            ])
            .args([
                "--width-px",
                "160",
                "--height-px",
                "120",
                "--read-noise-e",
                "9",
            ])
            .args(options)
            .arg("--out")
            .arg(directory),
    );
    assert_eq!(made.status, 0, "{}", made.stderr);
}

#[test]
fn the_noise_comes_from_dark_frames_named_by_a_pattern() {
    let directory = tempfile::tempdir().unwrap();
    simulate_darks(directory.path(), &[]);
    let pattern = directory.path().join("*.tif");
    let pattern = pattern.to_str().unwrap();
    let answer = json(
        &[
            &SMALL_ENERGY[..],
            &["--darks", pattern, "--required-error", "0.05"],
        ]
        .concat(),
    );
    // 9 e of read noise, and the dark current of a tenth of a second.
    let noise_e = number(&answer, "/noise/e");
    assert!((noise_e / 9.0 - 1.0).abs() < 0.03, "{noise_e}");
    assert_eq!(answer["noise"]["darks"]["frames"], 6);
    let required = &answer["stars"][0]["required"][0];
    let largest = &required["largest"];
    let [px, um, defocus_um] =
        ["/radius_px", "/radius_um", "/defocus_um"].map(|path| number(largest, path));
    let (pitch_um, f_number) = (
        number(&answer, "/lens/pitch_um"),
        number(&answer, "/lens/f_number"),
    );
    assert!((um / px / pitch_um - 1.0).abs() < 1e-9);
    assert!((defocus_um / (4.0 * f_number * um) - 1.0).abs() < 1e-9);
    assert!(number(largest, "/error_px") <= 0.05);
    // The paper uses the standard deviation of all pixels over full scale.
    let relative = json(
        &[
            &SMALL_PEAK[..],
            &[
                "--preset",
                "nanosat-tracker",
                "--normalisation",
                "peak",
                "--darks",
                pattern,
            ],
        ]
        .concat(),
    );
    let sigma = number(&relative, "/noise/darks/sigma_adu");
    assert!((number(&relative, "/noise/relative") / (sigma / 4096.0) - 1.0).abs() < 1e-9);
}

#[test]
fn frames_that_are_not_dark_are_refused() {
    let directory = tempfile::tempdir().unwrap();
    let place = |name: &str| directory.path().join(name);
    let refused = |darks: &[&Path], what: &str| {
        let mut arguments: Vec<&str> = SMALL_ENERGY.to_vec();
        arguments.push("--darks");
        arguments.extend(darks.iter().map(|path| path.to_str().unwrap()));
        let ran = defocus(&arguments);
        assert_eq!(ran.status, 1, "{what}: {}", ran.stdout);
        assert!(
            ran.stderr.contains(what) && ran.stdout.is_empty(),
            "{}",
            ran.stderr
        );
    };
    simulate_darks(&place("small"), &[]);
    let stars = Ran::new(
        starpipe()
            .args([
                "simulate",
                "--preset",
                "nanosat-tracker",
                "--random-attitude",
                "--count",
                "2",
            ])
            .arg("--out")
            .arg(place("stars")),
    );
    assert_eq!(stars.status, 0, "{}", stars.stderr);
    refused(&[&place("stars")], "spots in it look like stars");
    refused(
        &[&place("small"), &place("stars")],
        "expected frames of one size",
    );
    refused(&[&place("none/*.tif")], "no file matches");
    refused(&[&place("none.tif")], "none.tif");
    let one = fs::read_dir(place("small"))
        .unwrap()
        .map(|entry| entry.unwrap().path());
    let one = one
        .filter(|path| path.extension().is_some_and(|e| e == "tif"))
        .min()
        .unwrap();
    refused(&[&one], "no temporal noise");
    fs::write(place("empty.tif"), b"").unwrap();
    refused(&[&place("empty.tif")], "empty.tif");
}

#[test]
fn nonsensical_options_are_refused_before_any_work() {
    let camera = ["--preset", "nanosat-tracker"];
    let refused: [(&[&str], &str); 18] = [
        (&["--count", "0"], "0 is not in 1..="),
        (
            &["--radius-px", "1:1:1"],
            "the number of sweep values is 1, expected 2 to 1000",
        ),
        (&["--radius-px", "1:1:5"], "expected increasing values"),
        (&["--radius-px", "0.01:1:5"], "expected 0.1 to 5 px"),
        (&["--radius-px", "1:2"], "is not of the form FROM:TO:COUNT"),
        (
            &["--noise-relative", "0:1e-3:5"],
            "expected a number above 0",
        ),
        (&["--noise-relative", "nan:1e-3:5"], "is not a number"),
        (&["--at-noise", "0"], "above 0"),
        (&["--required-error", "0"], "above 0"),
        (&["--required-error", "-1"], "above 0"),
        (&["--peak", "0"], "above 0 and at most 1"),
        (&["--half-window-px", "0"], "0 is not in 1..=15"),
        (
            &["--vmag", "5"],
            "--vmag applies to --normalisation energy only",
        ),
        (
            &["--normalisation", "energy"],
            "expected --camera or --preset",
        ),
        (&["--read-noise-e", "5"], "expected --camera or --preset"),
        (
            &["--centroid", "gaussian-fit"],
            "applies to --normalisation energy only",
        ),
        (&["--figures", "png"], "--out"),
        (&["--focused-px", "-1"], "0 or above"),
    ];
    for (arguments, what) in refused {
        let ran = defocus(arguments);
        assert_eq!(ran.status, 2, "{arguments:?}: {}", ran.stdout);
        assert!(ran.stderr.contains(what), "{arguments:?}: {}", ran.stderr);
    }
    for (arguments, status, what) in [
        (
            &["--peak", "0.5"][..],
            2,
            "--peak applies to --normalisation peak only",
        ),
        (
            &["--at-noise", "1e-3"],
            2,
            "--at-noise applies to --normalisation peak only",
        ),
        (
            &["--read-noise-e", "0", "--dark-current-e-s", "0"],
            1,
            "is 0 e, expected more",
        ),
        (&["--vmag", "25"], 1, "half of the stars of V"),
        (&["--camera", "none.toml"], 2, "cannot be used with"),
    ] {
        let ran = defocus(&[&camera[..], &SMALL_ENERGY[4..], arguments].concat());
        assert_eq!(ran.status, status, "{arguments:?}: {}", ran.stderr);
        assert!(ran.stderr.contains(what), "{arguments:?}: {}", ran.stderr);
    }
    let ran = defocus(&["--camera", "none.toml"]);
    assert_eq!(ran.status, 1);
    assert!(ran.stderr.contains("none.toml"), "{}", ran.stderr);
}

#[test]
fn an_unreachable_error_is_answered_with_the_best_radius() {
    let ran = defocus(&[&SMALL_ENERGY[..], &["--required-error", "1e-6"]].concat());
    assert_eq!(ran.status, 3, "{}", ran.stderr);
    assert!(
        ran.stdout.contains("no radius: the smallest error is 0.0"),
        "{}",
        ran.stdout
    );
    assert!(
        ran.stderr.contains("no radius meets a required error"),
        "{}",
        ran.stderr
    );
}

#[test]
fn files_of_a_study_are_written_together() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().join("study");
    let place = out.to_str().unwrap();
    let ran = defocus(&[&SMALL_ENERGY[..], &["--out", place]].concat());
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    let names = [
        "grid.csv",
        "curve.csv",
        "defocus.json",
        "defocus.txt",
        "errors.svg",
        "sections.svg",
        "best-radius.svg",
        "accuracy-and-reach.svg",
    ];
    for name in names {
        let content = fs::read_to_string(out.join(name)).unwrap();
        assert!(content.len() > 300, "{name}");
        assert!(
            !content.contains("NaN") && !content.contains("inf,"),
            "{name}"
        );
    }
    assert_eq!(fs::read_dir(&out).unwrap().count(), names.len());
    assert_eq!(
        fs::read_to_string(out.join("defocus.txt")).unwrap(),
        ran.stdout
    );
    let drawn = directory.path().join("drawn");
    let ran = defocus(
        &[
            &SMALL_PEAK[..],
            &["--out", drawn.to_str().unwrap(), "--figures", "png"],
        ]
        .concat(),
    );
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    assert!(
        fs::read(drawn.join("errors.png"))
            .unwrap()
            .starts_with(b"\x89PNG")
    );
    // A file where the directory should be.
    fs::write(directory.path().join("taken"), b"").unwrap();
    let taken = directory.path().join("taken");
    let ran = defocus(&[&SMALL_PEAK[..], &["--out", taken.to_str().unwrap()]].concat());
    assert_eq!(ran.status, 1);
    assert!(
        ran.stderr.contains("making the directory"),
        "{}",
        ran.stderr
    );
}
