//! Inputs that ask for more memory or time than they should get are refused, and say why.

#![cfg(unix)]

use crate::common::{Ran, fits_header, measured, orion, starpipe};
use flate2::Compression;
use flate2::write::{GzEncoder, ZlibEncoder};
use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::Command;

fn process(arguments: &[&Path]) -> Ran {
    Ran::new(starpipe().arg("process").args(arguments))
}

#[test]
fn the_documents_state_the_time_limit_of_the_program() {
    let limit_s = starpipe::solve::DEFAULT_TIME_LIMIT_S;
    for (name, stated) in [
        ("SECURITY.md", format!("`--time-limit` ({limit_s} s,")),
        ("docs/process.md", format!("in seconds (default {limit_s})")),
    ] {
        let text = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(name)).unwrap();
        assert!(text.contains(&stated), "{name}: {stated}");
    }
}

/// Asserts that the file is refused with a message that contains `expected`.
fn assert_refused(name: &str, content: &[u8], expected: &str) {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join(name);
    fs::write(&path, content).unwrap();
    let ran = process(&[&path]);
    assert_eq!((ran.status, ran.stdout.as_str()), (1, ""), "{name}");
    assert!(ran.stderr.contains(expected), "{}", ran.stderr);
}

/// A chunk of a PNG.
fn chunk(kind: &[u8; 4], data: &[u8]) -> Vec<u8> {
    let mut checked = flate2::Crc::new();
    checked.update(kind);
    checked.update(data);
    let length = (data.len() as u32).to_be_bytes();
    let sum = checked.sum().to_be_bytes();
    [&length[..], kind, data, &sum[..]].concat()
}

/// Zeros, compressed.
fn zeros(bytes: usize) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
    let block = vec![0; 1 << 20];
    for _ in 0..bytes >> 20 {
        encoder.write_all(&block).unwrap();
    }
    encoder.finish().unwrap()
}

/// A PNG of 16 bits in color with transparency.
fn png(side: u32, more: &[u8]) -> Vec<u8> {
    let mut header = [side.to_be_bytes(), side.to_be_bytes()].concat();
    header.extend([16, 6, 0, 0, 0]);
    let pixels = zeros(1 << 20);
    let signature = b"\x89PNG\r\n\x1a\n".to_vec();
    let end = [chunk(b"IDAT", &pixels), chunk(b"IEND", b"")].concat();
    [signature, chunk(b"IHDR", &header), more.to_vec(), end].concat()
}

#[test]
fn an_image_that_needs_too_much_memory_is_refused_before_it_is_decoded() {
    let expected = "14142 x 14142 pixels of this kind need 2400 MB of memory, expected at most";
    assert_refused("large.png", &png(14_142, &[]), expected);

    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("frame.png");
    fs::copy(orion(), &path).unwrap();
    let ran = process(&[Path::new("--max-memory"), Path::new("1"), &path]);
    assert_eq!(ran.status, 1);
    let expected = "640 x 480 pixels of this kind need 2 MB of memory, expected at most 1 MB; see --max-memory";
    assert!(ran.stderr.contains(expected), "{}", ran.stderr);
}

#[test]
fn a_color_profile_that_grows_without_end_is_not_unpacked() {
    let profile = [b"x\0\0".to_vec(), zeros(1 << 28)].concat();
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("profile.png");
    fs::write(&path, png(64, &chunk(b"iCCP", &profile))).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_starpipe"));
    command.env("STARPIPE_CATALOGS", "");
    let (_, peak_kb) = measured(command.arg("process").arg(&path));
    assert!(peak_kb < 300_000, "{peak_kb} kB");
}

#[test]
fn content_behind_an_image_is_unpacked_only_so_far() {
    let header = fits_header(&[
        card("SIMPLE", "T"),
        card("BITPIX", "8"),
        card("NAXIS", "2"),
        card("NAXIS1", "64"),
        card("NAXIS2", "64"),
    ]);
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(&header).unwrap();
    let block = vec![0; 1 << 20];
    for _ in 0..64 {
        encoder.write_all(&block).unwrap();
    }
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("behind.fits.gz");
    fs::write(&path, encoder.finish().unwrap()).unwrap();
    assert_eq!(process(&[&path]).status, 3);
    let ran = process(&[Path::new("--max-memory"), Path::new("40"), &path]);
    assert_eq!(ran.status, 1);
    let expected = "too large: its content needs";
    assert!(ran.stderr.contains(expected), "{}", ran.stderr);
}

#[test]
fn a_jpeg_of_very_many_scans_is_refused() {
    let segment = |marker: u8, data: &[u8]| {
        let length = (data.len() as u16 + 2).to_be_bytes();
        [&[0xff, marker], &length[..], data].concat()
    };
    let tables = [&[0][..], &[1; 64]].concat();
    let mut file = [vec![0xff, 0xd8], segment(0xdb, &tables)].concat();
    // 14000 x 14000 pixels, progressive, grey.
    file.extend(segment(0xc2, &[8, 0x36, 0xb0, 0x36, 0xb0, 1, 1, 0x11, 0]));
    for class in [0x00, 0x10] {
        let mut code = vec![class, 1];
        code.resize(18, 0);
        file.extend(segment(0xc4, &code));
    }
    for scan in 0..100 {
        let spectrum = if scan == 0 { [0, 0] } else { [1, 63] };
        file.extend(segment(0xda, &[1, 1, 0, spectrum[0], spectrum[1], 0]));
        file.extend([0, 0]);
    }
    file.extend([0xff, 0xd9]);
    let expected = "found 100 scans of 14000 x 14000 pixels, expected fewer";
    assert_refused("scans.jpg", &file, expected);
}

#[test]
fn pipes_and_devices_are_refused() {
    let directory = tempfile::tempdir().unwrap();
    let pipe = directory.path().join("pipe");
    assert!(
        Command::new("mkfifo")
            .arg(&pipe)
            .status()
            .unwrap()
            .success()
    );
    let frame = orion();
    for path in [pipe.as_path(), Path::new("/dev/zero")] {
        for option in ["--catalog", "--camera", "--hot-pixels", "--dark"] {
            let ran = process(&[Path::new(option), path, &frame]);
            assert_eq!(ran.status, 1, "{option} {}", path.display());
            let expected = "a pipe, a socket or a device";
            assert!(ran.stderr.contains(expected), "{option}: {}", ran.stderr);
        }
        let ran = process(&[path]);
        assert_eq!(ran.status, 1);
        let ran = Ran::new(starpipe().arg("identify").arg(path));
        assert_eq!(ran.status, 1);
    }
}

#[test]
fn a_catalogue_of_too_many_stars_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("stars.csv.gz");
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(b"id,ra_deg,dec_deg,vmag\n").unwrap();
    let block = b"1,10.0,20.0,5.0\n".repeat(1 << 16);
    for _ in 0..100 {
        encoder.write_all(&block).unwrap();
    }
    fs::write(&path, encoder.finish().unwrap()).unwrap();
    let ran = process(&[Path::new("--catalog"), &path, &orion()]);
    assert_eq!(ran.status, 1);
    let expected = "too large: more than 5000000 records";
    assert!(ran.stderr.contains(expected), "{}", ran.stderr);
}

#[test]
fn threads_beyond_those_that_help_are_not_started() {
    let mut command = Command::new(env!("CARGO_BIN_EXE_starpipe"));
    command.env("STARPIPE_CATALOGS", "");
    command.args(["process", "--threads", "1024"]).arg(orion());
    let (status, peak_kb) = measured(&mut command);
    assert_eq!(status, Some(0));
    assert!(peak_kb < 150_000, "{peak_kb} kB");
}

/// A picture that is full of spots, each 14 pixels from the next.
fn crowded_pgm(width: usize, height: usize) -> Vec<u8> {
    let along = |at: usize| (at % 14) as f64 - 6.5;
    let pixels = (0..width * height).map(|index| {
        let (x, y) = (along(index % width), along(index / width));
        let noise = (index as u32).wrapping_mul(0x9e37_79b9) >> 30;
        20 + noise as u8 + (100.0 * (-(x * x + y * y) / 3.0).exp()) as u8
    });
    let header = format!("P5\n{width} {height}\n255\n");
    header.into_bytes().into_iter().chain(pixels).collect()
}

#[test]
fn a_crowded_picture_takes_no_more_memory_than_it_may() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("crowded.pgm");
    fs::write(&path, crowded_pgm(2100, 1400)).unwrap();
    let with_memory = |mb: &str| {
        let options = ["--fov", "10", "--max-memory", mb].map(Path::new);
        process(&[&options[..], &[path.as_path()]].concat())
    };
    let ran = with_memory("20");
    assert_eq!(ran.status, 1);
    let expected =
        "pixels are above the detection threshold, and measuring them needs too much memory";
    assert!(ran.stderr.contains(expected), "{}", ran.stderr);
    let ran = with_memory("200");
    assert_eq!(ran.status, 3, "{}", ran.stderr);
}

fn card(keyword: &str, value: &str) -> String {
    format!("{keyword:<8}= {value:>20}")
}

/// An image of tiles of one pixel whose data are the same item of the heap.
fn shared_tiles(side: usize) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(&[0, 7]).unwrap();
    let item = encoder.finish().unwrap();
    let (side_text, tiles) = (side.to_string(), (side * side).to_string());
    let heap = item.len().to_string();
    let primary = [("SIMPLE", "T"), ("BITPIX", "8"), ("NAXIS", "0")];
    let table = [
        ("XTENSION", "'BINTABLE'"),
        ("BITPIX", "8"),
        ("NAXIS", "2"),
        ("NAXIS1", "8"),
        ("NAXIS2", &tiles),
        ("PCOUNT", &heap),
        ("GCOUNT", "1"),
        ("TFIELDS", "1"),
        ("TTYPE1", "'COMPRESSED_DATA'"),
        ("TFORM1", "'1PB'"),
        ("ZIMAGE", "T"),
        ("ZCMPTYPE", "'GZIP_1'"),
        ("ZBITPIX", "16"),
        ("ZNAXIS", "2"),
        ("ZNAXIS1", &side_text),
        ("ZNAXIS2", &side_text),
        ("ZTILE1", "1"),
        ("ZTILE2", "1"),
    ];
    let of = |cards: &[(&str, &str)]| {
        let cards: Vec<String> = cards.iter().map(|(k, v)| card(k, v)).collect();
        fits_header(&cards)
    };
    let descriptor = [(item.len() as u32).to_be_bytes(), [0; 4]].concat();
    [
        of(&primary),
        of(&table),
        descriptor.repeat(side * side),
        item,
    ]
    .concat()
}

#[test]
fn tiles_that_share_their_data_are_refused() {
    let expected = "expected data of its own for each";
    assert_refused("shared.fits", &shared_tiles(100), expected);
    let expected = "found more than 1000000 tiles in an image";
    assert_refused("many.fits", &shared_tiles(1100), expected);
}

#[test]
fn a_header_of_very_many_axes_is_refused() {
    let mut cards = vec![
        card("SIMPLE", "T"),
        card("BITPIX", "8"),
        card("NAXIS", "999"),
    ];
    cards.extend((1..=999).map(|axis| card(&format!("NAXIS{axis}"), "1")));
    let expected = "found 999, expected a number of axes from 0 to 32";
    assert_refused("axes.fits", &fits_header(&cards), expected);
}

#[test]
fn a_catalogue_without_end_is_refused() {
    let head = b"id,ra_deg,dec_deg,vmag\n\"\n";
    for (body, expected) in [
        (b",\n".repeat(10_000_001), "found more than 10000000 lines"),
        (vec![b'x'; 1 << 20], "found a line of more than 65536 bytes"),
    ] {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("stars.csv.gz");
        let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
        encoder.write_all(head).unwrap();
        encoder.write_all(&body).unwrap();
        fs::write(&path, encoder.finish().unwrap()).unwrap();
        let ran = process(&[Path::new("--catalog"), &path, &orion()]);
        assert_eq!(ran.status, 1);
        assert!(ran.stderr.contains(expected), "{}", ran.stderr);
    }
}

#[test]
fn a_frame_that_is_not_read_in_time_is_told_of() {
    let side = 9000;
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    write!(encoder, "P2\n{side} {side}\n9\n").unwrap();
    let row = b"1 ".repeat(side);
    for _ in 0..side {
        encoder.write_all(&row).unwrap();
    }
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("slow.pgm.gz");
    fs::write(&path, encoder.finish().unwrap()).unwrap();
    let limited = ["--time-limit", "0.1"].map(Path::new);
    let ran = process(&[&limited[..], &[&path, &orion()]].concat());
    assert_eq!(ran.status, 1);
    let expected =
        "slow.pgm.gz: not finished within the time limit per frame: interrupted; see --time-limit";
    assert!(ran.stderr.contains(expected), "{}", ran.stderr);
    assert!(ran.stdout.contains("orion.png"), "{}", ran.stdout);
}

#[test]
fn devices_by_way_of_those_that_the_shell_opens_are_refused() {
    for path in [
        "/dev/fd/../../../dev/zero",
        "/proc/self/fd/../../../dev/zero",
    ] {
        for option in ["--catalog", "--camera", "--hot-pixels", "--dark"] {
            let ran = process(&[Path::new(option), Path::new(path), &orion()]);
            assert_eq!(ran.status, 1, "{option} {path}");
            let expected = "a pipe, a socket or a device";
            assert!(ran.stderr.contains(expected), "{option}: {}", ran.stderr);
        }
    }
}
