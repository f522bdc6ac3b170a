//! `solve-field`, as its callers use it: lines, files, names, exit statuses; and its coordinates against the lens and
//! the attitude that they are made of.

use crate::common::{Ran, fixture, names, orion, shared_dir, sky, starpipe};
use crate::orientation::{angle_deg, header, header_direction};
use starpipe::{Context, PixelPoint, Workspace, frame, solve_file};
use std::fs;
use std::path::{Path, PathBuf};

const ORION_FILES: [&str; 9] = [
    "orion-indx.xyls",
    "orion.axy",
    "orion.corr",
    "orion.match",
    "orion.new",
    "orion.png",
    "orion.rdls",
    "orion.solved",
    "orion.wcs",
];

/// A directory with the frame of Orion, and that frame.
fn workplace() -> (tempfile::TempDir, PathBuf) {
    let directory = tempfile::tempdir().unwrap();
    let copy = directory.path().join("orion.png");
    fs::copy(orion(), &copy).unwrap();
    (directory, copy)
}

fn solve_field(options: &[&str], inputs: &[&Path]) -> Ran {
    let mut command = starpipe();
    Ran::new(command.arg("solve-field").args(options).args(inputs))
}

/// The numbers of the line that begins with `start`.
fn numbers(text: &str, start: &str) -> Vec<f64> {
    let line = text.lines().find_map(|line| line.strip_prefix(start));
    let line = line.unwrap_or_else(|| panic!("{start} is not in {text}"));
    let words = line.split(|c: char| !(c.is_ascii_digit() || "+-.e".contains(c)));
    words.filter_map(|word| word.parse().ok()).collect()
}

#[test]
fn files_are_beside_the_input_and_lines_tell_its_field() {
    let (directory, input) = workplace();
    let ran = solve_field(&["--no-plots", "-L", "15", "-H30"], &[&input]);
    assert_eq!((ran.status, ran.stderr.as_str()), (0, ""));
    assert_eq!(names(directory.path()), ORION_FILES);
    let [width, height] = numbers(&ran.stdout, "Field size: ")[..] else {
        panic!("{}", ran.stdout);
    };
    assert!((width - 19.9).abs() < 0.5 && (height / width - 0.75).abs() < 0.01);
    let header = header(&input.with_extension("wcs"));
    let centre = header_direction(&header, 320.5, 240.5);
    let told = numbers(&ran.stdout, "Field center: (RA,Dec) = ");
    assert!(
        angle_deg((told[0], told[1]), centre) < 1e-5,
        "{told:?} {centre:?}"
    );
    for line in ["Field parity: neg", "Field 1: solved with index starpipe."] {
        assert!(
            ran.stdout.lines().any(|found| found == line),
            "{}",
            ran.stdout
        );
    }
    assert_eq!(fs::read(input.with_extension("solved")).unwrap(), [1]);
    // The copy has the pixels and the coordinates.
    let (new, old) = (input.with_extension("new"), frame::read(&input).unwrap());
    assert_eq!(frame::read(&new).unwrap().pixels, old.pixels);
    assert_eq!(self::header(&new)["CD1_1"], header["CD1_1"]);
}

#[test]
fn what_exists_is_kept_unless_it_may_be_overwritten() {
    let (directory, input) = workplace();
    let old = input.with_extension("solved");
    fs::write(&old, "old").unwrap();
    let refused = solve_field(&[], &[&input]);
    let message = format!("Output file already exists: \"{}\".", old.display());
    assert!(refused.stdout.contains(&message), "{}", refused.stdout);
    assert_eq!((refused.status, names(directory.path()).len()), (0, 2));
    let skipped = solve_field(&["--skip-solved", "--overwrite"], &[&input]);
    assert!(skipped.stdout.contains("skipping"), "{}", skipped.stdout);
    let solved = solve_field(
        &["--overw", "--wcs", "none", "-Nnone", "--temp-axy"],
        &[&input],
    );
    assert_eq!(solved.status, 0, "{}", solved.stderr);
    assert_eq!(fs::read(&old).unwrap(), [1]);
    let absent = ["orion.wcs", "orion.new", "orion.axy"];
    let written = names(directory.path());
    assert!(
        absent
            .iter()
            .all(|name| !written.iter().any(|found| found == name))
    );
    // An input that a file would replace.
    let itself = input.to_str().unwrap();
    let refused = solve_field(&["-O", "--wcs", itself], &[&input]);
    assert!(
        refused.stdout.contains("Refusing to continue"),
        "{}",
        refused.stdout
    );
    assert_eq!(fs::read(&input).unwrap(), fs::read(orion()).unwrap());
}

#[test]
fn the_detections_of_a_frame_are_a_list_that_is_solved_to_the_same_field() {
    let (directory, input) = workplace();
    assert_eq!(solve_field(&[], &[&input]).status, 0);
    let list = input.with_extension("axy");
    let options = ["--out", "list", "--sort-column", "FLUX", "--depth", "1-50"];
    let ran = solve_field(&options, &[&list]);
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    assert_eq!(
        ran.stderr,
        "starpipe: solve-field: without effect: --depth\n"
    );
    let found = header(&directory.path().join("list.wcs"));
    let expected = header(&input.with_extension("wcs"));
    assert_eq!(found["IMAGEW"], 640.0);
    for (x, y) in [(1.0, 1.0), (640.0, 1.0), (320.0, 480.0)] {
        let (a, b) = (
            header_direction(&found, x, y),
            header_direction(&expected, x, y),
        );
        // A pixel is 0.031° wide.
        assert!(angle_deg(a, b) < 0.01, "{a:?} {b:?}");
    }
    assert!(!directory.path().join("list.new").exists());
}

#[test]
fn a_distortion_has_the_order_that_is_wanted_or_none() {
    let directory = tempfile::tempdir().unwrap();
    let input = fixture("regression/distorted.tif");
    let order = |options: &[&str]| {
        let out = ["-O", "-D", directory.path().to_str().unwrap()];
        assert_eq!(solve_field(&[options, &out].concat(), &[&input]).status, 0);
        let header = header(&directory.path().join("distorted.wcs"));
        header.get("A_ORDER").copied()
    };
    assert_eq!(order(&["--no-tweak"]), None);
    assert_eq!(order(&["--tweak-order", "2"]), Some(2.0));
    assert!(order(&[]) >= Some(3.0));
}

#[test]
fn an_input_without_stars_is_not_solved_and_no_failure() {
    let directory = tempfile::tempdir().unwrap();
    let input = directory.path().join("dark.png");
    image::GrayImage::from_pixel(320, 240, image::Luma([9]))
        .save(&input)
        .unwrap();
    fs::write(input.with_extension("wcs"), "old").unwrap();
    let ran = solve_field(&["--overwrite"], &[&input]);
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    let line = "Did not solve (or no WCS file was written).";
    assert!(
        ran.stdout.lines().any(|found| found == line),
        "{}",
        ran.stdout
    );
    assert_eq!(names(directory.path()), ["dark.axy", "dark.png"]);
    // What cannot be read is one.
    let missing = solve_field(&[], &[&directory.path().join("missing.png"), &input]);
    assert_eq!(missing.status, 1);
    assert!(missing.stderr.contains("missing.png"), "{}", missing.stderr);
}

#[cfg(unix)]
#[test]
fn the_program_answers_to_the_name_of_the_other() {
    let directory = tempfile::tempdir().unwrap();
    let link = directory.path().join("solve-field");
    std::os::unix::fs::symlink(env!("CARGO_BIN_EXE_starpipe"), &link).unwrap();
    let run = |options: &[&str]| Ran::new(assert_cmd::Command::new(&link).args(options));
    let version = run(&["--version"]);
    assert!(
        version.stdout.starts_with("0.93 (starpipe "),
        "{}",
        version.stdout
    );
    assert_eq!(version.stdout.lines().count(), 1);
    let unknown = run(&["--bogus", "a.fits"]);
    assert_eq!(unknown.status, 2);
    assert!(unknown.stderr.contains("--bogus"), "{}", unknown.stderr);
    assert!(unknown.stderr.contains("starpipe solve-field ["));
    assert_eq!(run(&["--ra", "north", "a.fits"]).status, 2);
    assert_eq!(run(&[]).status, 2);
}

#[test]
fn coordinates_are_those_of_the_attitude_and_the_lens() {
    /// Points of a frame; a step of the golden ratio spreads them.
    const POINTS: u32 = 1000;
    const STEP: f64 = 0.618_033_988_749_895;
    const TOLERANCE_PX: f64 = 0.01;
    let Some(shared) = shared_dir() else {
        return;
    };
    for direction in [
        "Alt40_Azi-135",
        "Alt40_Azi135",
        "Alt60_Azi-135",
        "Alt60_Azi135",
    ] {
        let name = format!("frames/2019-07-29T204726_{direction}_Try1.tiff");
        let input = shared.join(name);
        let solution =
            solve_file(&input, None, &Context::new(sky()), &mut Workspace::new()).unwrap();
        let found = solution.outcome.identification().unwrap();
        let directory = tempfile::tempdir().unwrap();
        let wcs = directory.path().join("solution.wcs");
        let out = [
            "-D",
            directory.path().to_str().unwrap(),
            "-W",
            wcs.to_str().unwrap(),
        ];
        // Hints that are wrong do no harm.
        let hints = [
            "-u", "app", "-L", "10", "-H", "12", "--ra", "10:00:00", "--dec", "-5", "--radius", "5",
        ];
        let ran = solve_field(&[out.as_slice(), &hints].concat(), &[&input]);
        assert_eq!(ran.status, 0, "{}", ran.stderr);
        let header = header(&wcs);
        let scale_deg = (1.0 / found.camera.central_focal_length_px()).to_degrees();
        for point in 1..=POINTS {
            let along = |steps: f64| (f64::from(point) * steps).fract();
            let x = along(STEP) * (solution.width - 1) as f64;
            let y = along(STEP * STEP * 7.0) * (solution.height - 1) as f64;
            let apparent = found.apparent_direction_of(&PixelPoint::new(x, y)).unwrap();
            let (ra, dec) = found.places.astrometric(&apparent).to_ra_dec();
            let by_header = header_direction(&header, x + 1.0, y + 1.0);
            let off_px = angle_deg((ra.to_degrees(), dec.to_degrees()), by_header) / scale_deg;
            assert!(off_px < TOLERANCE_PX, "{direction} ({x}, {y}): {off_px} px");
        }
    }
}
