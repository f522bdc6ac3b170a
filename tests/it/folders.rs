//! Folders as programs for all-sky cameras leave them: frames beside what is none.

use crate::common::{Ran, starpipe};
use serde_json::Value;
use std::fs;
use std::path::Path;

const CAMERA: &str = "docs/validation/camera.toml";
const FRAMES: usize = 5;

/// Frames of a camera with dates in their headers, one each minute.
fn frames(folder: &Path) {
    let drawn = tempfile::tempdir().unwrap();
    for number in 0..FRAMES {
        let ran = Ran::new(
            starpipe()
                .args(["simulate", "--force", "--image=fits", "--camera", CAMERA])
                .args(["--site=47,8,500", "--dec=46.9"])
                .arg(format!("--ra={}", 62.8 + 0.25 * number as f64))
                .arg(format!("--date=2026-01-15T20:{number:02}Z"))
                .arg(format!("--seed={}", number + 1))
                .arg(format!("--out={}", drawn.path().join("a.fits").display())),
        );
        assert_eq!(ran.status, 0, "{}", ran.stderr);
        let name = format!("ccd1_20260115_21{number:02}00.fits");
        fs::copy(drawn.path().join("a.fits"), folder.join(name)).unwrap();
    }
}

/// Width and height of the frames.
fn size(folder: &Path) -> [u32; 2] {
    let frame = starpipe::frame::read(folder.join("ccd1_20260115_210000.fits")).unwrap();
    [frame.width as u32, frame.height as u32]
}

fn picture(path: &Path, [width, height]: [u32; 2], level: u8) {
    let pixel =
        |x: u32, y: u32| image::Luma([level + ((x * 7 + y * 13) % 11) as u8 + (x / 40) as u8]);
    image::GrayImage::from_fn(width, height, pixel)
        .save(path)
        .unwrap();
}

/// A folder of frames and of what is none.
fn drawn() -> tempfile::TempDir {
    let directory = tempfile::tempdir().unwrap();
    let folder = directory.path();
    frames(folder);
    let [width, height] = size(folder);
    picture(
        &folder.join("keogram-20260115.png"),
        [FRAMES as u32 * 8, height],
        90,
    );
    picture(&folder.join("startrails-20260115.png"), [width, height], 30);
    picture(
        &folder.join("small_20260115_210000.png"),
        [width / 4, height / 4],
        30,
    );
    picture(
        &folder.join("ccd1_20260115_130000.png"),
        [width, height],
        180,
    );
    fs::copy(
        folder.join("ccd1_20260115_210400.fits"),
        folder.join("latest.fits"),
    )
    .unwrap();
    fs::write(
        folder.join("allsky-20260115.mp4"),
        b"\0\0\0\x18ftypisom\0\0\0\0isom",
    )
    .unwrap();
    fs::write(folder.join("sensors.txt"), "temperature 3.5\n").unwrap();
    fs::write(folder.join(".lock"), "").unwrap();
    let dark = fs::read(folder.join("ccd1_20260115_210000.fits")).unwrap();
    fs::write(folder.join("master.fits"), as_dark(dark)).unwrap();
    fs::write(folder.join("ccd1_20260115_210500.jpg"), b"\xff\xd8\xff\xe0").unwrap();
    directory
}

/// The same FITS file, said to be a dark.
fn as_dark(mut file: Vec<u8>) -> Vec<u8> {
    const CARD: usize = 80;
    let mut cards = file.chunks_mut(CARD);
    let card = cards.find(|card| card.starts_with(b"IMAGETYP")).unwrap();
    card.copy_from_slice(format!("{:CARD$}", "IMAGETYP= 'Dark Frame'").as_bytes());
    file
}

fn run(folder: &Path, arguments: &[&str]) -> Ran {
    Ran::new(starpipe().args(arguments).arg(folder))
}

fn counts(night: &Value) -> Vec<(String, u64)> {
    let kinds = night["passed_over"].as_array().unwrap().iter();
    let count = |kind: &Value| {
        let (count, files) = (kind["count"].as_u64().unwrap(), kind["files"].as_array());
        assert_eq!(files.unwrap().len() as u64, count);
        (kind["kind"].as_str().unwrap().to_owned(), count)
    };
    kinds.map(count).collect()
}

#[test]
fn a_night_of_a_folder_passes_over_what_is_no_frame() {
    let folder = drawn();
    let folder = folder.path();
    let out = tempfile::tempdir().unwrap();
    let out = out.path().join("night");
    let out = format!("--out={}", out.display());
    let arguments = ["night", "--format=json", "--camera", CAMERA, out.as_str()];
    let ran = run(folder, &arguments);
    // The damaged frame is told.
    assert_eq!(ran.status, 1, "{}", ran.stderr);
    assert!(
        ran.stderr.contains("ccd1_20260115_210500.jpg"),
        "{}",
        ran.stderr
    );
    assert!(ran.stderr.contains("skipped 1 video: "), "{}", ran.stderr);
    let night: Value = serde_json::from_str(&ran.stdout).unwrap();
    assert_eq!(night["frames"], FRAMES + 1);
    assert_eq!(night["identified"], FRAMES);
    assert_eq!(night["unread"], 1);
    let expected = [
        "calibration",
        "copy",
        "day",
        "hidden",
        "keogram",
        "no_image",
        "startrails",
        "thumbnail",
        "video",
    ];
    assert_eq!(counts(&night), expected.map(|kind| (kind.to_owned(), 1)));
    // The same again, from what is there.
    assert_eq!(run(folder, &arguments).stdout, ran.stdout);
}

#[test]
fn other_commands_pass_over_the_same_of_a_folder() {
    let folder = drawn();
    let folder = folder.path();
    let out = tempfile::tempdir().unwrap();
    let solved = run(folder, &["process", "--format=json", "--camera", CAMERA]);
    let count = |text: &str, part: &str| text.matches(part).count();
    // The copy is a frame, and the frame of the day is read.
    assert_eq!(
        count(&solved.stdout, "\"status\":\"identified\""),
        FRAMES + 1,
        "{}",
        solved.stderr
    );
    assert_eq!(count(&solved.stdout, "\"status\":\"not_identified\""), 1);
    assert_eq!(count(&solved.stderr, "skipped 1 "), 7, "{}", solved.stderr);
    let parquet = format!("--out-parquet={}", out.path().join("archive").display());
    let archive = run(folder, &["process", &parquet, "--camera", CAMERA]);
    let told = format!(
        "1 part, 8 frames: {} identified, 1 not identified, 1 unreadable\n",
        FRAMES + 1
    );
    assert_eq!(archive.stdout, told, "{}", archive.stderr);
    let calibrated = run(folder, &["calibrate", "--format=json"]);
    assert_eq!(
        count(&calibrated.stderr, "skipped 1 "),
        7,
        "{}",
        calibrated.stderr
    );
}
