//! Unusual input: odd names, odd files, results among the frames.

#![cfg(unix)]

use crate::common::{Ran, cache_dir, fixture, names, orion, starpipe};
use serde_json::Value;
use std::ffi::OsString;
use std::fs;
use std::io::Write;
use std::os::unix::ffi::OsStringExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

fn process(arguments: &[&Path]) -> Ran {
    Ran::new(
        starpipe()
            .args(["process", "--format", "json"])
            .args(arguments),
    )
}

fn frames(ran: &Ran) -> Vec<String> {
    let frame = |report: &Value| report["frame"].as_str().unwrap().to_owned();
    ran.reports().iter().map(frame).collect()
}

// ---- Results among the frames

#[test]
fn a_directory_may_hold_its_own_results() {
    let directory = tempfile::tempdir().unwrap();
    let place = directory.path();
    fs::copy(fixture("cygnus/cygnus.tif"), place.join("a.tif")).unwrap();
    fs::copy(orion(), place.join("b.fits")).unwrap();
    let run = || process(&[place, Path::new("--out"), place]);
    let (first, written) = (run(), names(place));
    assert_eq!((first.status, first.stderr.as_str()), (0, ""));
    assert_eq!(written.len(), 2 + 2 * 4);
    // Overlays and headers are not processed as frames, and earlier results may be overwritten.
    let again = run();
    assert_eq!(again.status, 0);
    let mut told = again.stderr.lines();
    assert!(
        told.all(|line| line.starts_with("starpipe: skipped 4 ")),
        "{}",
        again.stderr
    );
    assert_eq!(frames(&again), frames(&first));
    assert_eq!(names(place), written);
    // An overlay named explicitly is processed.
    let asked = process(&[&place.join("a.png")]);
    assert_eq!(asked.reports().len(), 1);
}

#[test]
fn a_png_frame_is_never_overwritten_by_its_overlay() {
    let directory = tempfile::tempdir().unwrap();
    let place = directory.path();
    fs::copy(orion(), place.join("a.png")).unwrap();
    let ran = process(&[place, Path::new("--out"), place]);
    assert_eq!(ran.status, 2, "{}", ran.stderr);
    assert_eq!(names(place), ["a.png"]);
}

#[test]
fn only_results_are_overwritten() {
    for extension in ["json", "csv", "png", "wcs"] {
        let directory = tempfile::tempdir().unwrap();
        let out = directory.path();
        let other = out.join("orion").with_extension(extension);
        let contents: [&[u8]; 2] = [b"mine", &fs::read(orion()).unwrap()];
        for content in contents {
            fs::write(&other, content).unwrap();
            let ran = process(&[&orion(), Path::new("--out"), out]);
            assert_eq!((ran.status, ran.stdout.as_str()), (2, ""), "{extension}");
            assert!(
                ran.stderr.contains(&format!(
                    "would overwrite a file that starpipe did not write: {}",
                    other.display()
                )),
                "{}",
                ran.stderr
            );
            assert_eq!(fs::read(&other).unwrap(), content);
            assert_eq!(names(out).len(), 1);
        }
        // An empty file may be overwritten.
        fs::write(&other, "").unwrap();
        let ran = process(&[&orion(), Path::new("--out"), out]);
        assert_eq!((ran.status, ran.stderr.as_str()), (0, ""), "{extension}");
    }
}

#[test]
fn a_link_to_a_device_is_not_overwritten() {
    let directory = tempfile::tempdir().unwrap();
    let link = directory.path().join("orion.csv");
    std::os::unix::fs::symlink("/dev/null", &link).unwrap();
    let ran = process(&[&orion(), Path::new("--out"), directory.path()]);
    assert_eq!(ran.status, 2, "{}", ran.stderr);
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
}

#[test]
fn an_import_overwrites_neither_input_nor_device() {
    let directory = tempfile::tempdir().unwrap();
    let source = directory.path().join("bright.csv");
    let bright = concat!(env!("CARGO_MANIFEST_DIR"), "/catalogs/sky2000-bright.csv");
    fs::copy(bright, &source).unwrap();
    let import = |output: &Path| {
        let mut command = starpipe();
        command.args(["catalog", "import"]).arg(&source).arg("-o");
        Ran::new(command.arg(output))
    };
    let itself = import(&source);
    assert_eq!(itself.status, 2, "{}", itself.stderr);
    assert!(itself.stderr.contains("would overwrite the input"));
    assert_eq!(fs::read(&source).unwrap(), fs::read(bright).unwrap());
    // A link, so that a failing test would replace the link and not the device.
    let link = directory.path().join("link");
    std::os::unix::fs::symlink("/dev/null", &link).unwrap();
    let device = import(&link);
    assert_eq!((device.status, device.stdout.as_str()), (1, ""));
    assert!(
        device
            .stderr
            .ends_with("link: it exists and is not a regular file\n"),
        "{}",
        device.stderr
    );
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
}

#[test]
fn a_catalogue_without_stars_is_neither_made_nor_used() {
    let directory = tempfile::tempdir().unwrap();
    let output = directory.path().join("none.cat");
    let bright = concat!(env!("CARGO_MANIFEST_DIR"), "/catalogs/sky2000-bright.csv");
    let mut command = starpipe();
    command.args(["catalog", "import", bright, "--vmag-limit", "-5", "-o"]);
    let ran = Ran::new(command.arg(&output));
    assert_eq!((ran.status, ran.stdout.as_str()), (1, ""));
    assert!(
        ran.stderr
            .ends_with("no star is brighter than V -5 (--vmag-limit)\n"),
        "{}",
        ran.stderr
    );
    assert!(!output.exists());
    starpipe::catalog::Catalog::built_in()
        .limited_to(-5.0)
        .write_compact(&output)
        .unwrap();
    let ran = process(&[Path::new("--catalog"), &output, &orion()]);
    assert_eq!(ran.status, 1, "{}", ran.stdout);
    assert!(ran.stderr.contains("none.cat: no star"), "{}", ran.stderr);
}

// ---- Names

/// A line break, quotes, a comma, a terminal escape sequence, and invalid UTF-8.
fn odd_names() -> [OsString; 4] {
    [
        "two\nlines.png".into(),
        "a \"quote\", and 'more'.png".into(),
        "clear\u{1b}[2J\u{9b}31m.png".into(),
        OsString::from_vec(b"not\xff\xfetext.png".to_vec()),
    ]
}

#[test]
fn odd_names_break_no_line_and_reach_no_terminal() {
    let directory = tempfile::tempdir().unwrap();
    let paths = odd_names().map(|name| directory.path().join(name));
    for path in &paths {
        fs::copy(orion(), path).unwrap();
    }
    let shown = paths.each_ref().map(|path| path.display().to_string());
    let paths = paths.each_ref().map(PathBuf::as_path);
    let out = directory.path().join("out");
    let options = [Path::new("--out"), &out];
    let json = process(&[&paths[..], &options].concat());
    assert_eq!((json.status, json.stderr.as_str()), (0, ""));
    assert_eq!(frames(&json), shown);
    assert_eq!(fs::read_dir(&out).unwrap().count(), 4 * 4);

    let of = |format: &str, paths: &[&Path]| {
        let mut command = starpipe();
        command.args(["process", "--format", format]);
        Ran::new(command.args(paths)).stdout
    };
    // A table has a line for each row.
    let table = of("csv", &paths[..2]);
    let mut reader = csv::Reader::from_reader(table.as_bytes());
    let mut named: Vec<String> = reader
        .records()
        .map(|row| row.unwrap()[0].to_owned())
        .collect();
    named.dedup();
    assert_eq!(named, [shown[0].replace('\n', r"\n"), shown[1].clone()]);
    // But a terminal that shows it is not cleared.
    let table = of("csv", &paths[2..3]);
    assert!(!table.contains(|c: char| c.is_control() && c != '\n'));
    assert!(table.contains(r"clear\u{1b}[2J\u{9b}31m.png,"), "{table}");
    let list = out.join("odd.csv");
    fs::write(&list, table).unwrap();
    let identify = [
        "identify", "--format", "json", "--width", "640", "--height", "480", "--frame",
    ];
    let mut command = starpipe();
    command.args(identify).arg(paths[2]).arg(&list);
    assert_eq!(Ran::new(&mut command).status, 0);

    let text = of("text", &paths);
    assert!(!text.contains(|c: char| c.is_control() && c != '\n'));
    assert!(text.contains("two\\nlines.png: "), "{text}");
    assert!(text.contains("clear\\u{1b}[2J\\u{9b}31m.png: "), "{text}");
}

#[test]
fn names_are_no_formulas_and_do_not_look_like_others() {
    let directory = tempfile::tempdir().unwrap();
    let place = directory.path();
    // Right-to-left override: drawn as `agnp.png`.
    let names = ["=1+1.png", "@sum.png", "a\u{202e}gnp.png"];
    let run = |arguments: &[&str]| {
        let mut command = starpipe();
        Ran::new(command.args(arguments).current_dir(place))
    };
    for name in names {
        fs::copy(orion(), place.join(name)).unwrap();
    }
    let table = run(&[&["process", "--format", "csv"][..], &names].concat()).stdout;
    for shown in ["\n'=1+1.png,", "\n'@sum.png,", "\na\\u{202e}gnp.png,"] {
        assert!(table.contains(shown), "{shown}");
    }
    let cells = table
        .split([',', '\n'])
        .filter(|cell| cell.starts_with(['=', '+', '-', '@']));
    let numbers: Vec<_> = cells.map(str::parse::<f64>).collect();
    assert!(!numbers.is_empty() && numbers.iter().all(Result::is_ok));
    fs::write(place.join("stars.csv"), &table).unwrap();
    for name in names {
        let size = ["--width", "640", "--height", "480", "--frame", name];
        let ran = run(&[&["identify", "stars.csv"][..], &size].concat());
        assert_eq!(ran.status, 0, "{}", ran.stderr);
    }
    for format in ["text", "json"] {
        let shown = run(&[
            "process",
            "--format",
            format,
            names[2],
            "missing\u{202e}.png",
        ]);
        assert!(
            !(shown.stdout + &shown.stderr).contains('\u{202e}'),
            "{format}"
        );
    }
    let json = process(&[&place.join(names[2])]);
    assert!(frames(&json)[0].ends_with(names[2]));
}

#[test]
fn errors_with_odd_names_are_one_line_each() {
    let missing = odd_names();
    let ran = process(&missing.each_ref().map(Path::new));
    assert_eq!((ran.status, ran.stdout.as_str()), (1, ""));
    assert_eq!(ran.stderr.lines().count(), missing.len(), "{}", ran.stderr);
    assert!(!ran.stderr.contains(|c: char| c.is_control() && c != '\n'));
}

// ---- Streams

#[test]
fn a_pipe_is_read_like_a_file_and_an_endless_stream_is_refused() {
    let mut shell = Command::new("bash");
    let script = "\"$0\" process --format json <(cat \"$1\") && \"$0\" process - < /dev/zero; \"$0\" identify - < /dev/zero";
    let cache = cache_dir();
    shell
        .args(["-c", script, env!("CARGO_BIN_EXE_starpipe")])
        .arg(orion())
        .env("STARPIPE_CACHE_DIR", cache)
        .env("STARPIPE_CATALOGS", "");
    let Ok(ran) = shell.output() else {
        eprintln!("skipped: no bash");
        return;
    };
    let (stdout, stderr) = (
        String::from_utf8(ran.stdout).unwrap(),
        String::from_utf8(ran.stderr).unwrap(),
    );
    assert!(stdout.contains("\"status\":\"identified\""), "{stderr}");
    assert_eq!(ran.status.code(), Some(1));
    assert!(
        stderr.starts_with("starpipe: reading -: not an image: found the bytes 00 00")
            && stderr.contains("starpipe: reading -: too large: found more than 268435456 bytes"),
        "{stderr}"
    );
}

#[test]
fn a_file_that_is_too_long_is_refused_before_it_is_read() {
    let mut file = tempfile::NamedTempFile::new().unwrap();
    file.write_all(b"P5 3 3 255\n").unwrap();
    // A sparse file, larger than any disk.
    if file.as_file().set_len(1 << 40).is_err() {
        eprintln!("skipped: no file of 1 TiB can be made here");
        return;
    }
    let ran = process(&[file.path()]);
    assert_eq!((ran.status, ran.stdout.as_str()), (1, ""));
    assert!(
        ran.stderr
            .contains("too large: found more than 4816777216 bytes"),
        "{}",
        ran.stderr
    );
}

#[test]
fn errors_that_cannot_be_printed_set_the_exit_status() {
    let Ok(full) = fs::OpenOptions::new().write(true).open("/dev/full") else {
        eprintln!("skipped: no /dev/full");
        return;
    };
    let status = Command::new(env!("CARGO_BIN_EXE_starpipe"))
        .args(["process", "missing.png"])
        .env("STARPIPE_CACHE_DIR", cache_dir())
        .env("STARPIPE_CATALOGS", "")
        .stderr(Stdio::from(full))
        .status()
        .unwrap();
    assert_eq!(status.code(), Some(1));
}

#[test]
fn a_full_standard_output_is_a_failure() {
    let Ok(full) = fs::OpenOptions::new().write(true).open("/dev/full") else {
        eprintln!("skipped: no /dev/full");
        return;
    };
    let ran = Command::new(env!("CARGO_BIN_EXE_starpipe"))
        .arg("process")
        .arg(orion())
        .env("STARPIPE_CACHE_DIR", cache_dir())
        .env("STARPIPE_CATALOGS", "")
        .stdout(Stdio::from(full))
        .output()
        .unwrap();
    assert_eq!(ran.status.code(), Some(1));
    let stderr = String::from_utf8(ran.stderr).unwrap();
    assert!(stderr.contains("writing to standard output"), "{stderr}");
}

#[cfg(target_os = "linux")]
#[test]
fn a_closed_standard_output_is_a_failure_and_dev_null_is_none() {
    let cache = cache_dir();
    for (redirection, expected) in [(">&-", 1), ("> /dev/null", 0), ("1<> /dev/null", 0)] {
        let ran = Command::new("sh")
            .arg("-c")
            .arg(format!("exec \"$0\" \"$@\" {redirection}"))
            .arg(env!("CARGO_BIN_EXE_starpipe"))
            .arg("process")
            .arg(orion())
            .env("STARPIPE_CACHE_DIR", &cache)
            .env("STARPIPE_CATALOGS", "")
            .output()
            .unwrap();
        assert_eq!(ran.status.code(), Some(expected), "{redirection} {ran:?}");
        let told = String::from_utf8(ran.stderr).unwrap();
        let is_told = told.contains("writing to standard output: it is closed");
        assert_eq!(is_told, expected == 1, "{redirection} {told}");
    }
}

// ---- The cache

#[test]
fn concurrent_runs_share_an_empty_cache() {
    let cache = tempfile::tempdir().unwrap();
    let bright = concat!(env!("CARGO_MANIFEST_DIR"), "/catalogs/sky2000-bright.csv");
    let start = || {
        Command::new(env!("CARGO_BIN_EXE_starpipe"))
            .args(["process", "--format", "csv", "--catalog", bright])
            .arg("--cache-dir")
            .arg(cache.path())
            .arg(orion())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap()
    };
    let running = [start(), start(), start()];
    let ended = running.map(|child| child.wait_with_output().unwrap());
    for output in &ended {
        assert_eq!(output.status.code(), Some(0));
        assert_eq!(String::from_utf8_lossy(&output.stderr), "");
        assert_eq!(output.stdout, ended[0].stdout);
    }
    assert_eq!(names(cache.path()).len(), 1, "one index, and no rest");
}

// ---- Limits

#[test]
fn a_frame_that_takes_too_long_is_told() {
    let frame = fixture("orion/orion.png");
    let limited = |command: &str, input: &Path| {
        Ran::new(
            starpipe()
                .args([command, "--format", "json", "--time-limit", "1e-9"])
                .arg(input),
        )
    };
    // While it is read.
    let ran = limited("process", &frame);
    assert_eq!(ran.status, 1);
    assert!(ran.stderr.contains("; see --time-limit"), "{}", ran.stderr);

    let out = tempfile::tempdir().unwrap();
    let table = starpipe()
        .args(["process", "--format", "csv"])
        .arg(&frame)
        .output()
        .unwrap();
    let list = out.path().join("orion.csv");
    fs::write(&list, table.stdout).unwrap();
    let ran = limited("identify", &list);
    assert_eq!((ran.status, ran.stderr.as_str()), (3, ""));
    let report = &ran.reports()[0];
    assert_eq!(report["reason_code"], "interrupted");
    assert!(
        report["reason"].as_str().unwrap().contains("time limit"),
        "{report}"
    );
}

// ---- A bug that one frame meets

/// The program, which meets a bug in every frame of `size`. Releases do not have that bug.
#[cfg(debug_assertions)]
fn with_a_bug_at(size: &str) -> assert_cmd::Command {
    let mut command = starpipe();
    command.env("STARPIPE_PLANTED_PANIC", size);
    command
}

#[test]
#[cfg(debug_assertions)]
fn a_bug_that_one_frame_meets_ends_that_frame_alone() {
    let directory = tempfile::tempdir().unwrap();
    let place = directory.path();
    for name in ["a.png", "c.png"] {
        fs::copy(orion(), place.join(name)).unwrap();
    }
    fs::copy(fixture("cygnus/cygnus.tif"), place.join("b.tif")).unwrap();
    let bug = "b.tif: a bug in starpipe, please report it: planted";
    let run = |arguments: &str| {
        let mut command = with_a_bug_at("512x384");
        Ran::new(command.args(arguments.split(' ')).current_dir(place))
    };
    for threads in ["1", "3"] {
        let ran = run(&format!("process . --format json --threads {threads}"));
        assert_eq!((ran.status, ran.reports().len()), (1, 2), "{}", ran.stderr);
        assert_eq!(ran.stderr.lines().count(), 1, "{}", ran.stderr);
        assert!(ran.stderr.contains(bug), "{}", ran.stderr);
    }
    // A frame alone is solved on all threads.
    let alone = run("process b.tif --out results");
    assert_eq!((alone.status, alone.stdout.as_str()), (1, ""));
    assert_eq!(alone.stderr.lines().count(), 1, "{}", alone.stderr);
    assert!(names(&place.join("results")).is_empty());

    let tracked = run("track a.png b.tif c.png a.png");
    assert_eq!((tracked.status, tracked.reports().len()), (1, 3));
    assert!(tracked.stderr.contains(bug), "{}", tracked.stderr);

    let part = run("process a.png b.tif c.png --out-parquet archive");
    assert_eq!(part.status, 1);
    let told = "1 part, 3 frames: 2 identified, 0 not identified, 1 unreadable\n";
    assert_eq!(part.stdout, told);
    let status = run("archive status archive");
    assert!(status.stdout.contains(bug), "{}", status.stdout);
}

#[test]
#[cfg(debug_assertions)]
fn a_bug_that_one_list_or_one_image_of_a_file_meets_ends_that_alone() {
    let directory = tempfile::tempdir().unwrap();
    let place = directory.path();
    let stars = "x,y,mag\n3,4,1\n60,20,2\n20,50,3\n70,80,4\n";
    for (name, last) in [("a.csv", "99,99,5"), ("b.csv", "199,99,5")] {
        fs::write(place.join(name), format!("{stars}{last}\n")).unwrap();
    }
    let mut command = with_a_bug_at("200x100");
    let lists = ["identify", "--format", "json", "b.csv", "a.csv"];
    let ran = Ran::new(command.args(lists).current_dir(place));
    assert_eq!((ran.status, ran.reports().len()), (1, 1), "{}", ran.stderr);
    assert!(ran.stderr.contains("b.csv: a bug"), "{}", ran.stderr);

    let primary = noise_image("SIMPLE  =                    T", 40, 50);
    let rest = [(60, 30), (50, 50)]
        .map(|(width, height)| noise_image("XTENSION= 'IMAGE   '", width, height));
    let mosaic = place.join("mosaic.fits");
    fs::write(&mosaic, [primary, rest.concat()].concat()).unwrap();
    let mut command = with_a_bug_at("60x30");
    let pages = ["process", "--format", "json", "--page", "all"];
    let ran = Ran::new(command.args(pages).arg(&mosaic));
    assert_eq!((ran.status, ran.reports().len()), (1, 2), "{}", ran.stderr);
    assert!(
        ran.stderr.contains("mosaic.fits[2]: a bug"),
        "{}",
        ran.stderr
    );
}

/// An image of a FITS file: a header that begins with `first`, and noise.
#[cfg(debug_assertions)]
fn noise_image(first: &str, width: u32, height: u32) -> Vec<u8> {
    let more: &[&str] = match first.starts_with("XTENSION") {
        true => &[
            "PCOUNT  =                    0",
            "GCOUNT  =                    1",
        ],
        false => &[],
    };
    // Linear congruential: any noise will do.
    let mut state = 1_u32;
    let levels = (0..width * height).flat_map(|_| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        [3, (state >> 24) as u8]
    });
    crate::common::fits_unit(
        first,
        16,
        &[width, height],
        more,
        &levels.collect::<Vec<u8>>(),
    )
}
