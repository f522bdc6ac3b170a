//! What hides the sky, through the program: a skyline, and a mask.

use crate::common::{Ran, number, starpipe};
use image::{GrayImage, Luma};
use serde_json::Value;
use std::path::Path;

/// The frame of an all-sky lens, with trees or without.
fn all_sky(out: &Path, more: &[&str]) -> Value {
    let camera = [
        "simulate",
        "--format=json",
        "--preset=imx174-35mm",
        "--width-px=1024",
        "--height-px=1024",
        "--pitch-x-um=4",
        "--pitch-y-um=4",
        "--focal-length-mm=1.3",
        "--aperture-mm=1.2",
        "--exposure=10",
        "--spot-sigma-px=0.9",
        "--projection=equisolid",
        "--field-radius-deg=88",
        "--random-attitude",
        "--seed=3",
        "--zenith-distance-deg=0",
    ];
    let out = format!("--out={}", out.display());
    let ran = Ran::new(starpipe().args(camera).args(more).arg(out));
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    ran.reports().remove(0)
}

fn processed(frame: &Path, more: &[&str]) -> Value {
    let process = ["process", "--format=json"];
    let ran = Ran::new(starpipe().args(process).args(more).arg(frame));
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    ran.reports().remove(0)
}

#[test]
fn trees_are_no_sky_and_hide_no_answer() {
    let directory = tempfile::tempdir().unwrap();
    let at = |name: &str| directory.path().join(name);
    let trees = ["--skyline-deg=25", "--skyline-relief-deg=6"];
    all_sky(&at("trees.tif"), &trees);
    all_sky(&at("open.tif"), &[]);
    let [behind, open] = ["trees.tif", "open.tif"].map(|name| processed(&at(name), &[]));
    let share = |report: &Value| number(report, "/background/sky_share");
    // The circle of the lens, and what is left of it: the altitude of 25° lies at 0.75 of its radius.
    assert!((share(&open) - 0.63).abs() < 0.03, "{}", share(&open));
    let left = share(&behind) / share(&open);
    assert!((0.5..0.65).contains(&left), "{left}");
    let lost = number(&behind, "/photometry/lost_share");
    assert!(lost < 0.15, "{lost}");
    // Both see the same sky.
    let dec_deg = |report: &Value| number(report, "/attitude/dec_deg");
    assert!((dec_deg(&behind) - dec_deg(&open)).abs() < 0.01);
}

#[test]
fn a_mask_leaves_out_what_is_black() {
    let directory = tempfile::tempdir().unwrap();
    let mask = directory.path().join("mask.png");
    let is_left = |x: u32| Luma([if x < 320 { 0 } else { 255 }]);
    GrayImage::from_fn(640, 480, |x, _| is_left(x))
        .save(&mask)
        .unwrap();
    let option = format!("--mask={}", mask.display());
    let frame = Path::new("fixtures/orion/orion.png");
    let report = processed(frame, &[&option]);
    let stars = report["stars"].as_array().unwrap();
    assert!(stars.len() > 20);
    assert!(stars.iter().all(|star| number(star, "/x") > 318.0));
    assert!((number(&report, "/background/sky_share") - 0.5).abs() < 0.01);
    assert_eq!(report["calibration"]["mask"], mask.display().to_string());

    GrayImage::new(64, 48).save(&mask).unwrap();
    let ran = Ran::new(starpipe().args(["process", &option]).arg(frame));
    assert_ne!(ran.status, 0);
    assert!(ran.stderr.contains("the mask"), "{}", ran.stderr);
    assert!(ran.stderr.contains("64 x 48"), "{}", ran.stderr);
}
