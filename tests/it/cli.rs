//! The program as a whole: options, exit statuses, output, bad input.

use crate::common::{Ran, cache_dir, fixture, number, orion, starpipe};
use serde_json::Value;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

fn run(arguments: &[&str]) -> Ran {
    Ran::new(starpipe().args(arguments))
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// An error message is one line and repeats nothing.
fn assert_one_line_that_repeats_nothing(message: &str) {
    assert_eq!(message.lines().count(), 1, "{message}");
    let mut parts: Vec<&str> = message.trim_end_matches('\n').split(": ").collect();
    assert!(parts.iter().all(|part| part.trim() == *part), "{message}");
    let all = parts.len();
    parts.sort_unstable();
    parts.dedup();
    assert_eq!(parts.len(), all, "{message}");
}

/// The JSON without the times.
fn without_times(reports: Vec<Value>) -> Vec<Value> {
    let strip = |mut report: Value| {
        report.as_object_mut().unwrap().remove("timing_ms").unwrap();
        report
    };
    reports.into_iter().map(strip).collect()
}

// ---- The command line

#[test]
fn version_and_help_are_results() {
    let version = run(&["--version"]);
    assert_eq!(version.status, 0);
    assert!(
        version.stdout.starts_with("starpipe "),
        "{}",
        version.stdout
    );
    for command in [
        &["--help"][..],
        &["process", "--help"],
        &["identify", "--help"],
        &["catalog", "--help"],
        &["catalog", "import", "--help"],
    ] {
        let help = run(command);
        assert_eq!(help.status, 0);
        assert!(help.stdout.contains("Usage: starpipe"), "{}", help.stdout);
    }
}

#[test]
fn a_wrong_command_line_ends_with_2_and_says_what_is_wrong() {
    for (arguments, expected) in [
        (&[][..], "Usage"),
        (&["--frob"], "--frob"),
        (&["process"], "<FRAME>"),
        (&["process", "--frob", "a.png"], "--frob"),
        (&["process", "--format", "xml", "a.png"], "xml"),
        (
            &["process", "--fov", "10", "--pixel-scale", "5", "a.png"],
            "--pixel-scale",
        ),
        (&["process", "--near", "5h61m,20", "a.png"], "number"),
        (&["process", "--radius", "20", "a.png"], "--near"),
        (
            &["process", "--near", "400,20", "--radius", "5", "a.png"],
            "right ascension",
        ),
        (
            &["process", "--near", "-1,20", "--radius", "5", "a.png"],
            "right ascension",
        ),
        (
            &["process", "--near", "10,-91", "--radius", "5", "a.png"],
            "declination",
        ),
        (
            &["process", "--near", "10", "--radius", "5", "a.png"],
            "comma",
        ),
        (
            &["process", "--near", "10,NaN", "--radius", "5", "a.png"],
            "NaN",
        ),
        (
            &["process", "--near", "10,20", "--radius", "0", "a.png"],
            "radius",
        ),
        (&["process", "--scale-error", "5", "a.png"], "--scale-error"),
        (&["process", "--fov", "NaN", "a.png"], "NaN"),
        (&["process", "--fov", "-10", "a.png"], "--fov"),
        (&["process", "--fov", "360", "a.png"], "less than 360"),
        (&["process", "--pixel-scale", "0", "a.png"], "--pixel-scale"),
        (
            &["process", "--fov", "10", "--scale-error", "100", "a.png"],
            "--scale-error",
        ),
        (
            &["process", "--sigma", "5", "--false-alarms", "1", "a.png"],
            "--false-alarms",
        ),
        (&["process", "--sigma", "0", "a.png"], "--sigma"),
        (&["process", "--sigma", "-3", "a.png"], "more than 0"),
        (
            &["process", "--out", "o", "a.tif", "b/a.tif"],
            "Usage: starpipe process [OPTIONS]",
        ),
        (&["process", "--date", "yesterday", "a.png"], "ISO 8601"),
        (&["process", "--date", "2019-02-29", "a.png"], "ISO 8601"),
        (&["process", "--date", "", "a.png"], "ISO 8601"),
        (
            &["process", "--date", "0044-03-15", "a.png"],
            "1850 to 2100",
        ),
        (&["identify", "--date", "2019-13-01", "a.csv"], "ISO 8601"),
        (&["process", "--threads", "0", "a.png"], "--threads"),
        (&["identify", "--width", "0", "a.csv"], "--width"),
        (&["catalog"], "Usage"),
        (&["catalog", "import", "a.gz"], "--output"),
    ] {
        let ran = run(arguments);
        assert_eq!(ran.status, 2, "{arguments:?}: {}", ran.stderr);
        assert!(
            ran.stderr.contains(expected),
            "{arguments:?}: {}",
            ran.stderr
        );
        assert_eq!(ran.stdout, "", "{arguments:?}");
    }
}

// ---- What is printed

#[test]
fn text_names_the_stars_and_json_and_csv_agree_with_it() {
    let frame = orion();
    let report = run(&["process", text(&frame)]);
    assert_eq!((report.status, report.stderr.as_str()), (0, ""));
    assert!(
        report.stdout.contains("\n  identified  "),
        "{}",
        report.stdout
    );
    let json = run(&["process", "--format", "json", text(&frame)]).reports();
    let stars = json[0]["stars"].as_array().unwrap();
    assert_eq!(number(&json[0], "/match/detected") as usize, stars.len());
    let named = stars.iter().filter(|star| !star["id"].is_null());
    assert_eq!(number(&json[0], "/match/matched") as usize, named.count());
    let table = run(&["process", "--format", "csv", text(&frame)]).stdout;
    assert!(table.starts_with("frame,x,y,"), "{table}");
    assert_eq!(table.lines().count(), stars.len() + 1);
}

#[test]
fn json_has_the_fields_of_schema_2() {
    let frame = orion();
    let reports = run(&["process", "--format", "json", text(&frame)]).reports();
    let report = &reports[0];
    assert_eq!(report["schema"], 2);
    assert_eq!(report["status"], "identified");
    assert!(report["reason"].is_null());
    for pointer in [
        "/width",
        "/height",
        "/attitude/ra_deg",
        "/attitude/dec_deg",
        "/attitude/up_pa_deg",
        "/attitude/quaternion/3",
        "/attitude/sigma_arcsec/x",
        "/attitude/sigma_arcsec/y",
        "/attitude/sigma_arcsec/roll",
        "/optics/fov_x_deg",
        "/optics/fov_y_deg",
        "/optics/focal_length_px",
        "/match/detected",
        "/match/matched",
        "/match/rms_px",
        "/match/rms_arcsec",
        "/match/log10_false_alarm",
        "/magnitude/faintest_vmag",
        "/background/level",
        "/background/noise",
        "/stars/0/x",
        "/stars/0/y",
        "/stars/0/sigma_x",
        "/stars/0/sigma_y",
        "/stars/0/flux",
        "/stars/0/peak",
        "/stars/0/snr",
        "/timing_ms/read",
        "/timing_ms/detect",
        "/timing_ms/identify",
        "/timing_ms/pointing",
        "/timing_ms/naming",
        "/timing_ms/total",
    ] {
        number(report, pointer);
    }
    assert_eq!(report["optics"]["mirrored"], false);
    assert!(report["magnitude"]["faintest_id"].is_string());
    for key in ["predicted_limit_vmag", "difference_mag"] {
        assert!(report["magnitude"].get(key).is_some_and(Value::is_null));
    }
    let fluxes: Vec<f64> = report["stars"]
        .as_array()
        .unwrap()
        .iter()
        .map(|star| star["flux"].as_f64().unwrap())
        .collect();
    assert!(fluxes.is_sorted_by(|a, b| a >= b), "brightest first");
}

#[test]
fn a_site_that_is_not_on_the_earth_is_refused() {
    for (site, expected) in [
        ("91,0", "latitude"),
        ("-50,361", "longitude"),
        ("50,0,1e6", "height"),
        ("NaN,0", "NaN"),
        ("50", "comma"),
        ("50;10", "comma"),
    ] {
        for command in ["process", "identify"] {
            let ran = run(&[command, "--site", site, "a.png"]);
            assert_eq!((ran.status, ran.stdout.as_str()), (2, ""), "{site}");
            assert!(ran.stderr.contains(expected), "{site}: {}", ran.stderr);
        }
    }
}

#[test]
fn with_site_and_time_the_frame_has_a_zenith_distance() {
    let report = |arguments: &[&str]| {
        let frame = orion();
        let mut command = starpipe();
        command
            .args(["process", "--format", "json"])
            .args(arguments);
        Ran::new(command.arg(&frame)).reports().remove(0)
    };
    let winter = "2020-01-15T22:00:00Z";
    let seen = report(&["--site", "50,10,300", "--date", winter]);
    // Orion is then south of the zenith by about the site's latitude.
    let zenith_distance_deg = number(&seen, "/observation/zenith_distance_deg");
    assert!((zenith_distance_deg - 51.0).abs() < 3.0, "{seen}");
    assert!((number(&seen, "/observation/azimuth_deg") - 180.0).abs() < 20.0);
    assert!((number(&seen, "/observation/airmass") - 1.59).abs() < 0.1);
    assert_eq!(seen["observation"]["site"]["height_m"], 300.0);
    for unknown in [
        &["--site", "50,10"][..],
        &["--site", "50,10", "--date", "2020-01-15"],
        &["--date", winter],
    ] {
        assert_eq!(report(unknown)["observation"], Value::Null, "{unknown:?}");
    }
    let summer = report(&["--site", "50,10", "--date", "2020-07-15T22:00:00Z"]);
    assert_eq!(summer["observation"]["airmass"], Value::Null);
    let note = summer["notes"][0]["text"].as_str().unwrap();
    assert!(note.contains("below the horizon"), "{note}");
    assert_eq!(summer["notes"][0]["code"], "below_horizon");
}

#[test]
fn a_scale_is_a_hard_constraint_and_a_direction_is_tried_first() {
    let frame = orion();
    let fits = run(&[
        "process",
        "--fov",
        "20",
        "--near",
        "84,0",
        "--radius",
        "5",
        text(&frame),
    ]);
    assert_eq!(fits.status, 0, "{}", fits.stdout);
    let wrong_scale = run(&["process", "--fov", "30", text(&frame)]);
    assert_eq!(wrong_scale.status, 3, "{}", wrong_scale.stdout);
    let elsewhere = ["--near", "264,0", "--radius", "5"];
    let wrong_place = Ran::new(starpipe().arg("process").args(elsewhere).arg(&frame));
    assert_eq!(wrong_place.status, 0, "{}", wrong_place.stdout);
}

#[test]
fn the_date_is_taken_from_the_option_else_from_the_name_and_moves_the_stars() {
    let directory = tempfile::tempdir().unwrap();
    let dated = directory.path().join("2019-07-29T204726_orion.png");
    fs::copy(orion(), &dated).unwrap();
    let report = |options: &[&str], frame: &Path| {
        let mut command = starpipe();
        command.args(["process", "--format", "json"]).args(options);
        Ran::new(command.arg(frame)).reports().remove(0)
    };
    let unknown = report(&[], &orion());
    assert!(unknown.get("date").is_some_and(Value::is_null));
    let from_name = report(&[], &dated);
    assert_eq!(from_name["date"]["iso"], "2019-07-29T20:47:26Z");
    assert_eq!(from_name["date"]["source"], "file name");
    assert_eq!(number(&from_name, "/date/year"), 2019.5739);
    let given = report(&["--date", "2099-12-31T01:00+02:00"], &dated);
    assert_eq!(given["date"]["iso"], "2099-12-30T23:00:00Z");
    assert_eq!(given["date"]["source"], "option");
    // φ² Orionis moves 0.304″ a year southward.
    let dec_deg = |report: &Value| {
        let stars = report["stars"].as_array().unwrap();
        let star = stars.iter().find(|star| star["name"] == "40 phi2 Ori");
        star.unwrap()["dec_deg"].as_f64().unwrap()
    };
    let moved_arcsec = (dec_deg(&given) - dec_deg(&unknown)) * 3600.0;
    assert!((moved_arcsec + 30.4).abs() < 0.1, "{moved_arcsec}");
}

#[test]
fn detection_options_change_what_is_detected() {
    let frame = orion();
    let detected = |options: &[&str]| {
        let mut command = starpipe();
        command
            .args(["process", "--format", "json"])
            .args(options)
            .arg(&frame);
        let reports = Ran::new(&mut command).reports();
        reports[0]["stars"].as_array().unwrap().len()
    };
    let usual = detected(&[]);
    assert!(detected(&["--sigma", "20"]) < usual);
    assert!(detected(&["--false-alarms", "100"]) > usual);
}

#[test]
fn the_output_is_the_same_for_any_number_of_threads_and_in_the_order_given() {
    let (orion, cygnus) = (orion(), fixture("cygnus/cygnus.tif"));
    let frames = [&cygnus, &orion, &cygnus, &orion, &orion];
    let with = |threads: &str| {
        let mut command = starpipe();
        command.args(["process", "--format", "json", "--threads", threads]);
        without_times(Ran::new(command.args(frames)).reports())
    };
    let one = with("1");
    let named: Vec<_> = one.iter().map(|r| r["frame"].as_str().unwrap()).collect();
    assert_eq!(named, frames.map(|frame| text(frame)));
    assert_eq!(one, with("4"));
}

#[test]
fn a_closed_pipe_is_no_panic() {
    let mut command = Command::new(env!("CARGO_BIN_EXE_starpipe"));
    let mut child = command
        .args(["process", "--format", "json"])
        .args(vec![orion(); 5])
        .env("STARPIPE_CACHE_DIR", cache_dir())
        .env("STARPIPE_CATALOGS", "")
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let ended = child.wait_with_output().unwrap();
    let message = String::from_utf8(ended.stderr).unwrap();
    assert_eq!(message, "");
    assert_eq!(ended.status.code(), Some(0));
}

// ---- Files

#[test]
fn out_holds_the_json_and_the_stars_of_each_frame() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().join("made/for/it");
    let ran = Ran::new(
        starpipe()
            .args(["process", "--format", "json", "--out"])
            .arg(&out)
            .args([orion(), fixture("cygnus/cygnus.tif")]),
    );
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    let mut names: Vec<_> = fs::read_dir(&out)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    assert_eq!(
        names,
        [
            "cygnus.csv",
            "cygnus.json",
            "cygnus.png",
            "cygnus.wcs",
            "orion.csv",
            "orion.json",
            "orion.png",
            "orion.wcs"
        ]
    );
    let line = ran.stdout.lines().next().unwrap();
    assert_eq!(
        fs::read_to_string(out.join("orion.json"))
            .unwrap()
            .trim_end(),
        line
    );
    let table = fs::read_to_string(out.join("orion.csv")).unwrap();
    let stars = ran.reports()[0]["stars"].as_array().unwrap().len();
    assert_eq!(table.lines().count(), stars + 1);
}

#[test]
fn results_never_overwrite_each_other_or_an_input() {
    let directory = tempfile::tempdir().unwrap();
    let frame = directory.path().join("a.png");
    let list = directory.path().join("list.csv");
    fs::copy(orion(), &frame).unwrap();
    fs::copy(orion(), directory.path().join("a.jpg")).unwrap();
    fs::write(&list, "x,y,mag\n1,2,3\n").unwrap();
    let out = text(directory.path());
    let other = directory.path().join("a.jpg");
    let both = run(&["process", "--out", out, text(&frame), text(&other)]);
    assert_eq!(both.status, 2, "{}", both.stderr);
    assert!(both.stderr.contains("a.png") && both.stderr.contains("a.jpg"));
    let itself = run(&["identify", "--out", out, text(&list)]);
    assert_eq!(itself.status, 2, "{}", itself.stderr);
    assert_eq!(fs::read_to_string(&list).unwrap(), "x,y,mag\n1,2,3\n");
}

#[test]
fn an_output_directory_that_cannot_be_made_is_a_failure() {
    let file = tempfile::NamedTempFile::new().unwrap();
    let out = file.path().join("below");
    let ran = run(&["process", "--out", text(&out), text(&orion())]);
    assert_eq!(ran.status, 1);
    assert!(ran.stderr.contains(text(&out)), "{}", ran.stderr);
    assert_one_line_that_repeats_nothing(&ran.stderr);
}

// ---- The cache

#[test]
fn a_cache_that_cannot_be_written_costs_time_and_nothing_else() {
    let file = tempfile::NamedTempFile::new().unwrap();
    let cache = file.path().join("below");
    let ran = run(&["process", "--cache-dir", text(&cache), text(&orion())]);
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    assert!(
        ran.stderr.starts_with("starpipe: warning: "),
        "{}",
        ran.stderr
    );
    assert!(ran.stderr.contains(text(file.path())), "{}", ran.stderr);
}

#[test]
fn a_damaged_cache_is_rebuilt() {
    let cache = tempfile::tempdir().unwrap();
    // A small catalogue, because its index is built several times.
    let bright = concat!(env!("CARGO_MANIFEST_DIR"), "/catalogs/sky2000-bright.csv");
    let process = || {
        let mut command = starpipe();
        command.args(["process", "--format", "csv", "--catalog", bright]);
        command.arg("--cache-dir").arg(cache.path());
        Ran::new(command.arg(orion()))
    };
    let files = || -> Vec<PathBuf> {
        let entries = fs::read_dir(cache.path()).unwrap();
        entries
            .map(|entry| entry.unwrap().path())
            .filter(|path| path.is_file())
            .collect()
    };
    let first = process();
    assert_eq!((first.status, first.stderr.as_str()), (0, ""));
    assert!(!files().is_empty(), "something is kept");
    type Damage = fn(Vec<u8>) -> Vec<u8>;
    let damages: [(&str, Damage); 5] = [
        ("emptied", |_| Vec::new()),
        ("cut", |bytes| bytes[..bytes.len() / 2].to_vec()),
        ("garbage", |bytes| vec![0xa5; bytes.len()]),
        ("one byte of the table changed", |mut bytes| {
            bytes[1000] ^= 0x40;
            bytes
        }),
        // Chunks that are not needed are not read, so their damage is not noticed.
        ("every triangle changed", |mut bytes| {
            let middle = bytes.len() / 2;
            let triangles = bytes[middle..].iter_mut().step_by(16);
            triangles.for_each(|byte| *byte ^= 0x40);
            bytes
        }),
    ];
    for (what, damage) in damages {
        for file in files() {
            fs::write(&file, damage(fs::read(&file).unwrap())).unwrap();
        }
        let ran = process();
        assert_eq!(ran.status, 0, "{what}: {}", ran.stderr);
        assert!(
            ran.stderr.starts_with("starpipe: warning: "),
            "{what}: {}",
            ran.stderr
        );
        assert_eq!(ran.stdout, first.stdout, "{what}");
        let again = process();
        assert_eq!((again.status, again.stderr.as_str()), (0, ""), "{what}");
    }
}

// ---- Bad frames

#[test]
fn a_file_that_holds_no_frame_is_named_and_ends_with_1() {
    let directory = tempfile::tempdir().unwrap();
    let write = |name: &str, content: &[u8]| {
        let path = directory.path().join(name);
        fs::write(&path, content).unwrap();
        path
    };
    let empty = directory.path().join("empty");
    fs::create_dir(&empty).unwrap();
    let half = |bytes: &[u8]| bytes[..bytes.len() / 2].to_vec();
    let png = fs::read(orion()).unwrap();
    let tiff = fs::read(fixture("cygnus/cygnus.tif")).unwrap();
    let mut jpeg = Vec::new();
    let encoder = image::codecs::jpeg::JpegEncoder::new(&mut jpeg);
    image::DynamicImage::ImageLuma8(image::open(orion()).unwrap().to_luma8())
        .write_with_encoder(encoder)
        .unwrap();
    let pixel = directory.path().join("pixel.png");
    image::GrayImage::new(1, 1).save(&pixel).unwrap();
    for (frame, expected) in [
        (directory.path().join("missing.png"), "cannot be read: "),
        (empty, "a directory without frames: "),
        (write("empty.png", b""), "empty: "),
        (
            write("words.tif", b"this is no picture\n"),
            "not an image: ",
        ),
        (write("cut.png", &half(&png)), "truncated PNG: "),
        (write("cut.tif", &half(&tiff)), "truncated TIFF: "),
        (write("cut.jpg", &half(&jpeg)), "truncated JPEG: "),
        (write("magic-only.png", &png[..8]), "truncated PNG: "),
        (write("magic-only.tif", &tiff[..4]), "truncated TIFF: "),
        (write("magic-only.jpg", &jpeg[..3]), "truncated JPEG: "),
        (pixel, "too small: "),
    ] {
        let ran = run(&["process", text(&frame)]);
        assert_eq!(ran.status, 1, "{}: {}", frame.display(), ran.stdout);
        assert_eq!(ran.stdout, "");
        assert_one_line_that_repeats_nothing(&ran.stderr);
        let begins = format!("starpipe: reading {}: {expected}", frame.display());
        assert!(ran.stderr.starts_with(&begins), "{}", ran.stderr);
    }
}

#[test]
fn a_bad_frame_does_not_disturb_the_others() {
    let ran = run(&[
        "process",
        "--format",
        "json",
        text(&orion()),
        "missing.png",
        text(&orion()),
    ]);
    assert_eq!(ran.status, 1);
    assert_eq!(ran.reports().len(), 2);
    assert!(ran.stderr.contains("missing.png"), "{}", ran.stderr);
}

#[test]
fn a_catalogue_that_cannot_be_read_ends_with_1() {
    let mut file = tempfile::NamedTempFile::new().unwrap();
    file.write_all(b"this is no catalogue").unwrap();
    for catalog in [text(file.path()), "missing.cat"] {
        for arguments in [
            &["process", "--catalog", catalog, text(&orion())][..],
            &["catalog", "import", catalog, "-o", "never-written.cat"],
        ] {
            let ran = run(arguments);
            assert_eq!(ran.status, 1, "{}", ran.stdout);
            assert!(ran.stderr.contains(catalog), "{}", ran.stderr);
            assert_one_line_that_repeats_nothing(&ran.stderr);
            assert!(!Path::new("never-written.cat").exists());
        }
    }
}

#[test]
fn an_imported_catalogue_gives_the_same_result() {
    let directory = tempfile::tempdir().unwrap();
    let compact = directory.path().join("bright.cat");
    let source = concat!(env!("CARGO_MANIFEST_DIR"), "/catalogs/sky2000-bright.csv");
    let arguments = ["catalog", "import", source, "--vmag-limit", "6", "-o"];
    let imported = Ran::new(starpipe().args(arguments).arg(&compact));
    assert_eq!(imported.status, 0, "{}", imported.stderr);
    assert!(
        imported.stdout.contains("5008 stars"),
        "{}",
        imported.stdout
    );
    let ran = run(&[
        "process",
        "--format",
        "json",
        "--catalog",
        text(&compact),
        text(&orion()),
    ]);
    assert_eq!(ran.status, 0, "{}{}", ran.stdout, ran.stderr);
    assert!(number(&ran.reports()[0], "/magnitude/faintest_vmag") < 6.0);
}

// ---- Lists of centroids

#[test]
fn a_bad_list_is_named_with_its_line() {
    let directory = tempfile::tempdir().unwrap();
    for (content, expected) in [
        ("", "empty"),
        ("a,b\n1,2\n", "line 1"),
        ("x,y,flux\n", "without centroids"),
        ("x,y,flux\n1,2,three\n", "line 2: column flux"),
        ("x,y,flux\n1,2,-3\n", "line 2: column flux"),
        ("x,y,flux\n1,NaN,3\n", "line 2: column y"),
        ("x,y,flux\n1,2\n", "line 2: column flux is missing"),
        (
            "x|y|flux\n1|2|3\n",
            "the single column x|y|flux; expected x or x_px among them",
        ),
        (
            "x,y,flux\n1,-7,3\n",
            "line 2: column y: -7 is more than 5 px outside",
        ),
    ] {
        let list = directory.path().join("list.csv");
        fs::write(&list, content).unwrap();
        let ran = run(&["identify", text(&list)]);
        assert_eq!(ran.status, 1, "{content:?}");
        assert!(ran.stderr.contains(expected), "{content:?}: {}", ran.stderr);
        assert!(ran.stderr.contains(text(&list)), "{}", ran.stderr);
        assert_one_line_that_repeats_nothing(&ran.stderr);
        assert_eq!(ran.stdout, "");
    }
}

#[test]
fn a_list_of_a_frames_stars_is_identified_as_the_frame() {
    let directory = tempfile::tempdir().unwrap();
    let list = directory.path().join("orion.csv");
    let table = run(&["process", "--format", "csv", text(&orion())]).stdout;
    // The catalogue's magnitudes are results, not input.
    fs::write(&list, table.replace(",vmag,", ",answer,")).unwrap();
    let size = ["--width", "640", "--height", "480", "--format", "json"];
    let from_list = Ran::new(starpipe().arg("identify").args(size).arg(&list)).reports();
    let from_frame = run(&["process", "--format", "json", text(&orion())]).reports();
    for pointer in ["/attitude/ra_deg", "/attitude/dec_deg"] {
        let difference = number(&from_list[0], pointer) - number(&from_frame[0], pointer);
        assert!(difference.abs() < 0.01, "{pointer}: {difference}");
    }
    assert!(from_list[0]["background"]["level"].is_null());
    assert!(from_list[0]["stars"][0]["snr"].is_null());
}

#[test]
fn frames_alone_are_processed_and_other_names_of_commands_point_to_them() {
    let orion = "fixtures/orion/orion.png";
    let alone = run(&[orion, "--format", "json"]);
    let named = run(&["process", orion, "--format", "json"]);
    assert_eq!(alone.status, 0, "{}", alone.stderr);
    let stars = |ran: &Ran| ran.reports()[0]["stars"].clone();
    assert_eq!(stars(&alone), stars(&named));
    let solve = run(&["solve", orion]);
    assert_eq!(solve.status, 2);
    assert!(
        solve.stderr.contains("starpipe process --help"),
        "{}",
        solve.stderr
    );
}

#[test]
fn a_table_has_a_line_for_each_frame_and_a_summary() {
    let directory = tempfile::tempdir().unwrap();
    let black = directory.path().join("black.png");
    image::GrayImage::new(64, 64).save(&black).unwrap();
    let black = black.display().to_string();
    let frames = [
        "fixtures/orion/orion.png",
        "fixtures/cygnus/cygnus.tif",
        &black,
    ];
    let table = run(&[&["process", "--format", "table"][..], &frames].concat());
    assert_eq!(table.status, 3, "{}", table.stderr);
    let lines: Vec<&str> = table.stdout.lines().collect();
    assert_eq!(lines.len(), 6, "{}", table.stdout);
    assert!(lines[0].ends_with(" frame") && lines[1].starts_with(" 83.700  -0.400"));
    assert!(
        lines[3].starts_with("not identified: no_variation ") && lines[3].ends_with(&black),
        "{}",
        lines[3]
    );
    assert!(
        lines[5].starts_with("3 frames: 2 identified, 1 no_variation, "),
        "{}",
        lines[5]
    );
    // In a pipe, names are whole: they are in the last column.
    let columns = |line: &str| line.chars().position(|c| c == '/').unwrap_or_default();
    assert_eq!([columns(lines[1]), columns(lines[3])], [56, 48]);

    let rows = run(&[&["process", "--format", "frames-csv"][..], &frames].concat());
    let mut reader = csv::Reader::from_reader(rows.stdout.as_bytes());
    assert_eq!(reader.headers().unwrap().get(0), Some("frame"));
    let statuses: Vec<String> = reader
        .records()
        .map(|row| row.unwrap()[1].to_owned())
        .collect();
    assert_eq!(statuses, ["identified", "identified", "not_identified"]);
}

#[cfg(feature = "shell")]
#[test]
fn shells_and_manuals_know_the_options() {
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let script = run(&["completions", shell]);
        assert_eq!(script.status, 0, "{}", script.stderr);
        assert!(script.stdout.contains("pixel-scale"), "{shell}");
    }
    let page = run(&["man", "process"]).stdout;
    assert!(page.contains(".TH starpipe-process 1") && page.contains("pixel\\-scale"));
    assert!(run(&["man"]).stdout.contains("starpipe\\-process(1)"));
    assert_eq!(run(&["man", "proces"]).status, 2);
}
