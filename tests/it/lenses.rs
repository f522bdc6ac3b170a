//! Lenses that are no pinholes, through the program: simulated ones, and photographs of the whole sky.

use crate::common::{Ran, Truth, number, shared_dir, starpipe};
use serde_json::Value;
use std::path::Path;

fn report(ran: &Ran) -> Value {
    ran.reports().remove(0)
}

fn simulated(out: &Path, projection: &str, more: &[&str]) -> Value {
    let ran = Ran::new(
        starpipe()
            .args([
                "simulate",
                "--format=json",
                "--preset=imx174-35mm",
                "--seed=3",
            ])
            .args([
                "--width-px=1280",
                "--height-px=960",
                "--pitch-x-um=4",
                "--pitch-y-um=4",
            ])
            .args(["--aperture-mm=1.2", "--exposure=10"])
            .arg(format!("--projection={projection}"))
            .arg(format!("--out={}", out.display()))
            .args(more),
    );
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    report(&ran)
}

/// All-sky cameras and where they look: the projection, and the rest.
const CAMERAS: [(&str, &[&str]); 3] = [
    (
        "equidistant",
        &[
            "--focal-length-mm=1.2",
            "--axis-x-px=14",
            "--axis-y-px=-9",
            "--distortion-px=-12",
            "--ra=310",
            "--dec=40",
            "--roll=25",
        ],
    ),
    (
        "stereographic",
        &[
            "--focal-length-mm=0.9",
            "--ra=80",
            "--dec=-35",
            "--roll=-120",
            "--mirrored",
        ],
    ),
    (
        "equisolid",
        &[
            "--focal-length-mm=1.25",
            "--decentring-x-px=2",
            "--ra=190",
            "--dec=55",
            "--roll=70",
        ],
    ),
];

/// Asserts that what was found is what was simulated, within five standard errors, over all of the sky.
fn assert_found(found: &Value, made: &Value) {
    assert_pointed(found, made);
    assert!(found["optics"]["fov_y_deg"].is_null() && made["fov_x_deg"].is_null());
    let valid_to_deg = number(found, "/optics/valid_to_deg");
    assert!((70.0..91.5).contains(&valid_to_deg), "{valid_to_deg}");
}

/// Asserts that attitude and focal length are what was simulated, within five standard errors.
fn assert_pointed(found: &Value, made: &Value) {
    const SIGMAS: f64 = 5.0;
    let (attitude, optics) = (&found["attitude"], &found["optics"]);
    assert_eq!(attitude["at"], "axis");
    assert_ne!(optics["model"], "pinhole");
    assert_eq!(optics["mirrored"], made["mirrored"]);
    let truth = Truth {
        ra_deg: number(made, "/attitude/ra_deg"),
        dec_deg: number(made, "/attitude/dec_deg"),
        fov_x_deg: f64::NAN,
    };
    let sigma = |axis: &str| number(found, &format!("/attitude/sigma_arcsec/{axis}"));
    let off_arcsec = truth.centre_error_deg(found) * 3600.0;
    let limit_arcsec = SIGMAS * sigma("x").hypot(sigma("y"));
    assert!(off_arcsec < limit_arcsec, "{off_arcsec} {limit_arcsec}");
    let focal_px = number(found, "/optics/focal_length_px") - number(made, "/focal_length_px");
    let sigma_px = number(found, "/optics/focal_length_sigma_px");
    assert!(focal_px.abs() < SIGMAS * sigma_px, "{focal_px} {sigma_px}");
}

#[test]
fn frames_of_the_whole_sky_are_identified_with_nothing_given() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().join("out");
    for (projection, more) in CAMERAS {
        let frame = directory.path().join(format!("{projection}.tif"));
        let made = simulated(&frame, projection, more);
        let ran = Ran::new(
            starpipe()
                .args(["process", "--format=json", "--out"])
                .args([&out, &frame]),
        );
        let found = report(&ran);
        assert_eq!(
            found["status"], "identified",
            "{projection}: {}",
            found["reason"]
        );
        assert_found(&found, &made);
        let pointed = Ran::new(
            starpipe()
                .args(["process", "--format=json", "--only=pointing"])
                .arg(&frame),
        );
        let pointed = report(&pointed);
        assert_pointed(&pointed, &made);
        let notes = pointed["notes"].as_array().unwrap();
        assert!(notes.iter().any(|note| note["code"] == "pointing_at_once"));
        let header = std::fs::read(out.join(format!("{projection}.wcs"))).unwrap();
        assert!(
            header
                .chunks(80)
                .any(|card| card.starts_with(b"CTYPE1  = 'RA---ZPN-SIP'"))
        );
    }
}

/// A lens of the sine, a sky of which a pinhole with distortion explains the clear half in the middle.
#[test]
fn a_lens_is_followed_beyond_what_a_pinhole_explains() {
    let directory = tempfile::tempdir().unwrap();
    let frame = directory.path().join("frame.tif");
    let ran = Ran::new(
        starpipe()
            .args(["simulate", "--preset=imx174-35mm", "--seed=77029"])
            .args(["--width-px=2291", "--height-px=2291"])
            .args(["--pitch-x-um=4", "--pitch-y-um=4"])
            .args(["--focal-length-mm=4.9458", "--aperture-mm=1.567"])
            .args(["--spot-sigma-px=1.173", "--projection=orthographic"])
            .args(["--field-radius-deg=61.47", "--distortion-px=17.1"])
            .args(["--axis-x-px=-27.2", "--axis-y-px=34.1", "--vignetting=0.2"])
            .args([
                "--exposure=10",
                "--sky-mag-arcsec2=19.65",
                "--by-altitude=1",
            ])
            .args(["--ra=333.766", "--dec=37.268", "--roll=110.06"])
            .args(["--cloud-mag=2.35", "--cloud-size-px=156"])
            .args(["--cloud-light=0.756", "--skyline-deg=10.53"])
            .arg(format!("--out={}", frame.display())),
    );
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    let ran = Ran::new(starpipe().args(["process", "--format=json"]).arg(&frame));
    let found = report(&ran);
    assert_ne!(found["optics"]["model"], "pinhole");
    let named = number(&found, "/match/matched") / number(&found, "/match/detected");
    assert!(named > 0.75, "{named}");
    let valid_to_deg = number(&found, "/optics/valid_to_deg");
    assert!((59.0..62.0).contains(&valid_to_deg), "{valid_to_deg}");
}

#[test]
fn photographs_of_the_whole_sky_are_identified_with_nothing_given() {
    let Some(shared) = shared_dir() else {
        return;
    };
    for (name, stars, valid_to_deg) in [
        ("allsky-2015.png", 90.0, 60.0),
        ("allsky-svalbard.jpg", 1500.0, 75.0),
        ("allsky-toscano.jpg", 700.0, 70.0),
    ] {
        let frame = shared.join("frames/hard").join(name);
        let found = report(&Ran::new(
            starpipe().args(["process", "--format=json"]).arg(frame),
        ));
        assert_eq!(found["status"], "identified", "{name}: {}", found["reason"]);
        assert_ne!(found["optics"]["model"], "pinhole", "{name}");
        assert!(number(&found, "/match/matched") > stars, "{name}");
        assert!(number(&found, "/match/rms_px") < 1.0, "{name}");
        assert!(
            number(&found, "/optics/valid_to_deg") > valid_to_deg,
            "{name}"
        );
    }
}

/// Place and flux of a detection.
type Row = (f64, f64, f64);

/// The detections of a photograph of the whole sky, with places that are those of no sky.
#[test]
fn skies_that_are_none_are_not_identified() {
    let Some(shared) = shared_dir() else {
        return;
    };
    let directory = tempfile::tempdir().unwrap();
    let frame = shared.join("frames/hard/allsky-toscano.jpg");
    let seen = report(&Ran::new(
        starpipe().args(["process", "--format=json"]).arg(frame),
    ));
    let (width, height) = (number(&seen, "/width"), number(&seen, "/height"));
    let stars = seen["stars"].as_array().unwrap().iter();
    let stars = stars.filter_map(|star| {
        Some((
            star["x"].as_f64()?,
            star["y"].as_f64()?,
            star["flux"].as_f64()?,
        ))
    });
    let stars: Vec<Row> = stars.filter(|(.., flux)| *flux > 0.0).collect();
    let (cx, cy) = (0.5 * width, 0.5 * height);
    let twisted = |&(x, y, flux): &Row| {
        let (sin, cos) = (3.0 * (x - cx).hypot(y - cy) / width).sin_cos();
        (
            cx + (x - cx) * cos - (y - cy) * sin,
            cy + (x - cx) * sin + (y - cy) * cos,
            flux,
        )
    };
    let squeezed = |&(x, y, flux): &Row| (cx + 0.7 * (x - cx), y, flux);
    let shuffled = |(index, &(_, y, flux)): (usize, &Row)| {
        (stars[(index * 617 + 89) % stars.len()].0, y, flux)
    };
    let wrong: [(&str, Vec<Row>); 3] = [
        ("twisted", stars.iter().map(twisted).collect()),
        ("squeezed", stars.iter().map(squeezed).collect()),
        ("shuffled", stars.iter().enumerate().map(shuffled).collect()),
    ];
    for (name, stars) in wrong {
        let list = directory.path().join(format!("{name}.csv"));
        let rows = stars.iter().map(|(x, y, flux)| format!("{x},{y},{flux}\n"));
        std::fs::write(&list, format!("x,y,flux\n{}", rows.collect::<String>())).unwrap();
        let size = [format!("--width={width}"), format!("--height={height}")];
        let ran = Ran::new(
            starpipe()
                .args(["identify", "--format=json"])
                .args(size)
                .arg(list),
        );
        assert_eq!(report(&ran)["status"], "not_identified", "{name}");
    }
}
