//! `starpipe track` and [`Tracker`] on sequences of simulated frames.

use crate::common::sequence::{EXPOSURE_S, INTERVAL_S, attitude, dark, frame};
use crate::common::{Ran, number, starpipe};
use nalgebra::Vector3;
use starpipe::Context;
use starpipe::frame::{Frame, TiffOptions, TiffSamples, write_tiff};
use starpipe::identify::IndexedCatalog;
use starpipe::track::{Loss, Mode, Tracker};
use std::fs::File;
use std::path::{Path, PathBuf};

const RATE_DEG_S: Vector3<f64> = Vector3::new(0.4, -0.9, 0.6);

fn write(directory: &Path, name: &str, frame: &Frame) -> PathBuf {
    let path = directory.join(name);
    let options = TiffOptions::new(TiffSamples::Unsigned16);
    write_tiff(&mut File::create(&path).unwrap(), frame, &options).unwrap();
    path
}

/// Nine frames of a turning camera, the sixth without light.
fn sequence(directory: &Path) -> Vec<PathBuf> {
    let write = |index: u32| {
        let frame = match index {
            5 => dark(5),
            _ => frame(attitude(RATE_DEG_S, index), RATE_DEG_S, u64::from(index)),
        };
        write(directory, &format!("frame-{index}.tif"), &frame)
    };
    (0..9).map(write).collect()
}

#[test]
fn a_sequence_is_tracked_and_a_frame_without_light_is_lost() {
    let directory = tempfile::tempdir().unwrap();
    let paths = sequence(directory.path());
    let options = ["track", "--interval", "0.1", "--exposure", "0.02"];
    let ran = Ran::new(starpipe().args(options).arg(directory.path()));
    assert_eq!(ran.status, 3, "{}", ran.stderr);
    let reports = ran.reports();
    let modes: Vec<_> = reports
        .iter()
        .map(|r| r["mode"].as_str().unwrap())
        .collect();
    assert_eq!(modes[..2], ["acquired", "acquired"]);
    assert_eq!(modes[2..5], ["tracked"; 3]);
    assert_eq!(modes[5], "lost");
    assert!(modes[6..].iter().all(|mode| *mode != "lost"), "{modes:?}");
    assert_eq!(modes[8], "tracked");
    for (index, report) in reports.iter().enumerate() {
        assert_eq!(report["frame"], paths[index].display().to_string());
        assert_eq!(
            number(report, "/time_s"),
            (index as f64 * 1e5).round() / 1e6
        );
    }
    assert_eq!(reports[0]["not_tracked"]["code"], "no_attitude");
    assert_eq!(reports[1]["not_tracked"]["code"], "no_rate");
    assert!(reports[2]["not_tracked"].is_null());
    let lost = &reports[5];
    assert_eq!(lost["not_tracked"]["code"], "no_agreement");
    assert!(lost["attitude"].is_null() && lost["reason"].is_string());
    assert_eq!(lost["reason_code"], "black");
    assert_eq!(lost["stars_used"], 0);
    let last = &reports[8];
    for (axis, rate) in [("x", 0.4), ("y", -0.9), ("z", 0.6)] {
        let sigma = number(last, &format!("/rate_sigma_deg_s/{axis}"));
        let off = number(last, &format!("/rate_deg_s/{axis}")) - rate;
        assert!(
            off.abs() < 5.0 * sigma && sigma < 0.1,
            "{axis}: {off} {sigma}"
        );
    }
    // The quaternion is the attitude, within its error.
    let truth = attitude(RATE_DEG_S, 8).to_quaternion();
    for (i, truth) in truth.iter().enumerate() {
        let found = number(last, &format!("/attitude/quaternion/{i}"));
        assert!((found - truth).abs() < 1e-4, "{i}: {found} {truth}");
    }
    let sigma = number(last, "/attitude/sigma_arcsec/x");
    let variance = number(last, "/attitude/covariance_arcsec2/0/0");
    assert!((variance / sigma.powi(2) - 1.0).abs() < 1e-3);
}

#[test]
fn a_list_on_standard_input_is_as_the_files_and_what_cannot_be_read_is_reported() {
    let directory = tempfile::tempdir().unwrap();
    let mut paths = sequence(directory.path());
    paths.truncate(4);
    std::fs::write(directory.path().join("none.tif"), "no frame").unwrap();
    paths.insert(3, directory.path().join("none.tif"));
    let list: String = paths.iter().map(|p| format!("{}\n", p.display())).collect();
    let mut command = starpipe();
    command
        .args(["track", "--format", "text", "-"])
        .write_stdin(list);
    let output = command.output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    let (stdout, stderr) = (
        String::from_utf8(output.stdout).unwrap(),
        String::from_utf8(output.stderr).unwrap(),
    );
    assert_eq!(stdout.lines().count(), 4, "{stdout}");
    assert!(
        stdout.contains("acquired") && stdout.contains("°/frame"),
        "{stdout}"
    );
    assert!(
        stderr.contains("none.tif") && stderr.lines().count() == 1,
        "{stderr}"
    );
}

#[test]
fn contradictory_options_are_refused() {
    for (options, message) in [
        (&["-", "-"][..], "given twice"),
        (&["--stars", "3", "a.tif"], "3 is not in 4..=1000"),
        (&["--interval", "0", "a.tif"], "--interval"),
        (
            &["--fov", "20", "--pixel-scale", "100", "a.tif"],
            "cannot be used with",
        ),
        (&["--radius", "2", "a.tif"], "--near"),
        (&["--scale-error", "5", "a.tif"], "--scale-error"),
    ] {
        let ran = Ran::new(starpipe().arg("track").args(options));
        assert_eq!(ran.status, 2, "{options:?}: {}", ran.stderr);
        assert!(ran.stderr.contains(message), "{options:?}: {}", ran.stderr);
    }
}

#[test]
fn a_jump_is_noticed_and_answered_in_the_same_frame() {
    let indexed = IndexedCatalog::built_in();
    let mut context = Context::new(&indexed);
    context.priors.exposure_s = Some(EXPOSURE_S);
    let mut tracker = Tracker::new(context);
    let mut modes = Vec::new();
    for index in 0..8u32 {
        let mut truth = attitude(RATE_DEG_S, index);
        if index >= 5 {
            truth = truth.then_turn(Vector3::new(0.0, 0.3, 1.0));
        }
        let frame = frame(truth, RATE_DEG_S, u64::from(index));
        let time_s = INTERVAL_S * f64::from(index);
        let track = tracker.process_frame(&frame, Some(time_s)).unwrap();
        if index == 5 {
            assert!(matches!(track.loss, Some(Loss::NoAgreement { .. })));
        }
        if index >= 2 && track.mode == Mode::Tracked {
            assert!(track.stars_used >= 20, "{}", track.stars_used);
            assert_eq!(tracker.used_stars().count(), track.stars_used);
        }
        let found = track.attitude.unwrap();
        let sigma = found.covariance_rad2.diagonal().map(f64::sqrt);
        let off = found.icrs_to_camera.angle_to(&truth);
        assert!(off < 5.0 * sigma.norm(), "{index}: {off} {sigma:?}");
        modes.push(track.mode);
    }
    let expected = [Mode::Acquired, Mode::Tracked].map(|mode| [mode; 3]);
    assert_eq!(modes[2..5], expected[1]);
    assert_eq!(modes[5], Mode::Acquired);
    assert_eq!(modes[7], Mode::Tracked);
}

#[test]
fn frames_of_another_size_and_times_that_stand_still_are_solved_in_full() {
    let indexed = IndexedCatalog::built_in();
    let mut tracker = Tracker::new(Context::new(&indexed)).with_stars(12);
    let still = Vector3::zeros();
    let frames: Vec<Frame<'static>> = (0..4)
        .map(|i| frame(attitude(still, i), still, u64::from(i)))
        .collect();
    for frame in &frames[..3] {
        let track = tracker.process_frame(frame, None).unwrap();
        assert!(track.attitude.is_some() && track.time_s.is_none());
        assert!(track.stars_used <= 12 || track.mode == Mode::Acquired);
    }
    let cropped = Frame::new(640, 470, frames[3].values()[..640 * 470].to_vec()).unwrap();
    let track = tracker.process_frame(&cropped, None).unwrap();
    assert_eq!(
        (track.mode, track.loss),
        (Mode::Acquired, Some(Loss::OtherSize))
    );
    let mut at =
        |frame: &Frame, time_s: f64| tracker.process_frame(frame, Some(time_s)).unwrap().loss;
    assert_eq!(at(&frames[0], 1.0), Some(Loss::OtherSize));
    assert_eq!(at(&frames[1], 2.0), Some(Loss::NoRate));
    assert_eq!(at(&frames[2], 2.0), Some(Loss::NotLater));
}
