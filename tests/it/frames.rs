//! Frame files through the program: every format at its depth, and bad files.

use crate::common::{Ran, fits_unit, fixture, number, starpipe};
use image::{DynamicImage, ImageFormat};
use serde_json::Value;
use starpipe::frame;
use std::fs;
use std::io::{Cursor, Write};
use std::path::{Path, PathBuf};
use tiff::encoder::colortype::{ColorType, Gray8, Gray16, Gray32Float, Gray64Float};
use tiff::encoder::{Compression, TiffEncoder, TiffKind, TiffValue};

// ---- Writers

fn tiff_of<C: ColorType>(size: (u32, u32), data: &[C::Inner], compression: Compression) -> Vec<u8>
where
    [C::Inner]: TiffValue,
{
    let mut out = Cursor::new(Vec::new());
    let encoder = TiffEncoder::new(&mut out).unwrap();
    write_tiff::<C, _>(encoder.with_compression(compression), size, data);
    out.into_inner()
}

fn write_tiff<C: ColorType, K: TiffKind>(
    mut encoder: TiffEncoder<&mut Cursor<Vec<u8>>, K>,
    (width, height): (u32, u32),
    data: &[C::Inner],
) where
    [C::Inner]: TiffValue,
{
    encoder.write_image::<C>(width, height, data).unwrap();
}

fn big_tiff(size: (u32, u32), data: &[u16]) -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    write_tiff::<Gray16, _>(TiffEncoder::new_big(&mut out).unwrap(), size, data);
    out.into_inner()
}

fn by_image(image: &DynamicImage, format: ImageFormat) -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    image.write_to(&mut out, format).unwrap();
    out.into_inner()
}

fn fits(bitpix: i32, (width, height): (u32, u32), more: &[&str], data: &[u8]) -> Vec<u8> {
    let first = format!("SIMPLE  = {:>20}", "T");
    fits_unit(&first, bitpix, &[width, height], more, data)
}

const UNSIGNED: &str = "BZERO   =                32768";

/// 16-bit levels as FITS stores them with [`UNSIGNED`].
fn stored(levels: &[u16]) -> Vec<u8> {
    let signed = levels.iter().map(|v| (*v ^ 0x8000).to_be_bytes());
    signed.flatten().collect()
}

fn zipped(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

// ---- What the program makes of them

/// A directory of files to run the program on.
struct Files(tempfile::TempDir);

impl Files {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn add(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.0.path().join(name);
        fs::write(&path, bytes).unwrap();
        path
    }
}

fn process(arguments: impl IntoIterator<Item = PathBuf>) -> Ran {
    let mut command = starpipe();
    Ran::new(
        command
            .args(["process", "--format", "json"])
            .args(arguments),
    )
}

/// The part of the report that must not depend on the format.
fn result(report: &Value) -> Value {
    let mut result = report.clone();
    for differs in ["frame", "timing_ms"] {
        result.as_object_mut().unwrap().remove(differs).unwrap();
    }
    result
}

/// Asserts that each file gives exactly the same detections and the same answer.
fn assert_all_alike(named: &[(&str, Vec<u8>)]) {
    let files = Files::new();
    let paths: Vec<PathBuf> = named.iter().map(|(n, b)| files.add(n, b)).collect();
    let ran = process(paths);
    assert_eq!((ran.status, ran.stderr.as_str()), (0, ""));
    let reports = ran.reports();
    assert_eq!(reports.len(), named.len());
    assert!(number(&reports[0], "/match/matched") > 50.0);
    for (report, (name, _)) in reports.iter().zip(named) {
        assert_eq!(result(report), result(&reports[0]), "{name}");
    }
}

fn cygnus() -> ((u32, u32), Vec<u16>) {
    let frame = frame::read(fixture("cygnus/cygnus.tif")).unwrap();
    let levels = frame.values().iter().map(|p| *p as u16).collect();
    ((frame.width as u32, frame.height as u32), levels)
}

fn orion() -> DynamicImage {
    image::open(fixture("orion/orion.png")).unwrap()
}

#[test]
fn a_16_bit_frame_is_the_same_in_every_format() {
    let (size, levels) = cygnus();
    let image = image::ImageBuffer::from_raw(size.0, size.1, levels.clone()).unwrap();
    let image = DynamicImage::ImageLuma16(image);
    let plain: Vec<String> = levels.iter().map(u16::to_string).collect();
    let plain = format!("P2\n{} {}\n65535\n{}\n", size.0, size.1, plain.join("\n"));
    let words: Vec<u8> = levels.iter().flat_map(|v| v.to_be_bytes()).collect();
    let pgm = format!("P5 {} {} 65535\n", size.0, size.1).into_bytes();
    let fits = fits(16, size, &[UNSIGNED], &stored(&levels));
    let tiff = |compression| tiff_of::<Gray16>(size, &levels, compression);
    assert_all_alike(&[
        ("plain.tif", tiff(Compression::Uncompressed)),
        ("lzw.tif", tiff(Compression::Lzw)),
        (
            "deflate.tif",
            tiff(Compression::Deflate(Default::default())),
        ),
        ("packbits.tif", tiff(Compression::Packbits)),
        ("big.tif", big_tiff(size, &levels)),
        ("a.png", by_image(&image, ImageFormat::Png)),
        ("ascii.pgm", plain.into_bytes()),
        ("binary.pgm", [pgm, words].concat()),
        ("zipped.fits.gz", zipped(&fits)),
        ("a.fits", fits),
    ]);
}

#[test]
fn an_8_bit_frame_is_the_same_in_every_format() {
    let image = orion();
    let levels = image.as_bytes();
    let size = (image.width(), image.height());
    assert_all_alike(&[
        ("a.png", fs::read(fixture("orion/orion.png")).unwrap()),
        ("a.tif", tiff_of::<Gray8>(size, levels, Compression::Lzw)),
        ("a.bmp", by_image(&image, ImageFormat::Bmp)),
        ("a.pgm", by_image(&image, ImageFormat::Pnm)),
        ("a.fits", fits(8, size, &[], levels)),
    ]);
}

#[test]
fn a_frame_of_floats_is_the_same_in_every_format() {
    let (size, levels) = cygnus();
    let floats: Vec<f32> = levels.iter().map(|v| f32::from(*v) / 7.0).collect();
    let doubles: Vec<f64> = floats.iter().map(|v| f64::from(*v)).collect();
    let bytes = |v: &f32| v.to_be_bytes();
    let plain = Compression::Uncompressed;
    assert_all_alike(&[
        ("32.tif", tiff_of::<Gray32Float>(size, &floats, plain)),
        ("64.tif", tiff_of::<Gray64Float>(size, &doubles, plain)),
        (
            "32.fits",
            fits(
                -32,
                size,
                &[],
                &floats.iter().flat_map(bytes).collect::<Vec<_>>(),
            ),
        ),
        (
            "64.fits",
            fits(
                -64,
                size,
                &[],
                &doubles
                    .iter()
                    .flat_map(|v| v.to_be_bytes())
                    .collect::<Vec<_>>(),
            ),
        ),
    ]);
}

#[test]
fn a_jpeg_loses_little() {
    let files = Files::new();
    let mut jpeg = Vec::new();
    let encoder = image::codecs::jpeg::JpegEncoder::new_with_quality(&mut jpeg, 98);
    orion().write_with_encoder(encoder).unwrap();
    let reports = process([fixture("orion/orion.png"), files.add("a.jpg", &jpeg)]).reports();
    for pointer in ["/attitude/ra_deg", "/attitude/dec_deg"] {
        let difference = number(&reports[0], pointer) - number(&reports[1], pointer);
        assert!(difference.abs() < 0.002, "{pointer}: {difference}");
    }
}

#[test]
fn files_of_other_programs_are_read_to_the_last_bit() {
    let level = |x: usize, y: usize| match (x, y) {
        (20, 10) => 65535.0,
        _ => (1000 + 7 * x + 13 * y) as f32,
    };
    // astropy stores the rows of an array in their order, and the first one is the bottom of a FITS
    // image; ImageMagick stores the bottom of the picture first, and CFITSIO copies that.
    let from_bottom = |y: usize| 23 - y;
    let from_top = |y: usize| y;
    for (name, row) in [
        ("astropy.fits.gz", from_bottom as fn(usize) -> usize),
        ("imagemagick.fits", from_top),
        ("cfitsio.fits.gz", from_top),
        ("fpack.fits.fz", from_top),
    ] {
        let frame = frame::read(fixture("formats").join(name)).unwrap();
        assert_eq!((frame.width, frame.height), (32, 24));
        for (i, pixel) in frame.values().iter().enumerate() {
            let (x, y) = (i % 32, i / 32);
            assert_eq!(*pixel, level(x, row(y)), "{name}: ({x}, {y})");
        }
        let levels = (frame.step_adu, frame.saturation_adu);
        assert_eq!(levels, (1.0, Some(65535.0)), "{name}");
    }
    let metadata = frame::read(fixture("formats/astropy.fits.gz"))
        .unwrap()
        .metadata;
    assert_eq!(metadata.date.unwrap().to_iso(), "2019-07-29T20:47:26.123Z");
    assert_eq!(metadata.exposure_s, Some(0.5));
    assert_eq!(
        (metadata.focal_length_mm, metadata.pixel_size_um),
        (Some(35.0), Some(4.65))
    );
}

// ---- What a header tells

/// The fixture of Orion as FITS with these keywords.
fn orion_fits(keywords: &[&str]) -> Vec<u8> {
    let image = orion();
    fits(
        8,
        (image.width(), image.height()),
        keywords,
        image.as_bytes(),
    )
}

#[test]
fn formats_that_are_not_read_are_named_with_what_to_convert_them_to() {
    let files = Files::new();
    for (name, begin, found, advice) in [
        (
            "a.heic",
            &b"\0\0\0\x18ftypheic\0\0\0\0mif1heic"[..],
            "a HEIC photograph",
            "heif-convert",
        ),
        (
            "a.cr3",
            b"\0\0\0\x18ftypcrx \0\0\0\x01crx isom",
            "(CR3)",
            "16-bit TIFF",
        ),
        (
            "a.xisf",
            b"XISF0100\0\0\0\0\0\0\0\0",
            "an XISF image",
            "FITS",
        ),
        (
            "a.webp",
            b"RIFF\x10\0\0\0WEBPVP8 ",
            "a WebP picture",
            "dwebp",
        ),
        ("a.ser", b"LUCAM-RECORDER\0\0\0\0", "a SER video", "FITS"),
        // The name does not matter.
        ("a.png", b"GIF89a\0\0\0\0\0\0\0\0", "a GIF picture", "PNG"),
    ] {
        let ran = process([files.add(name, &[begin, &[0; 2000]].concat())]);
        assert_eq!(ran.status, 1, "{name}");
        let expected = format!("{name}: found {found}");
        assert!(
            ran.stderr.contains(found) && ran.stderr.contains(advice),
            "{expected}: {}",
            ran.stderr
        );
        assert!(
            ran.stderr.contains("expected FITS, TIFF, PNG, JPEG"),
            "{}",
            ran.stderr
        );
    }
}

#[test]
fn a_directory_of_photographs_that_are_not_read_says_so() {
    let files = Files::new();
    files.add("a.txt", b"remarks");
    files.add("b.heic", b"\0\0\0\x18ftypheic\0\0\0\0mif1heic");
    let ran = process([files.0.path().to_owned()]);
    assert_eq!(ran.status, 1);
    assert!(
        ran.stderr.contains("b.heic: found a HEIC photograph"),
        "{}",
        ran.stderr
    );
    // Beside a frame such a file is passed over, as cameras write both.
    files.add("c.fits", &orion_fits(&[]));
    let ran = process([files.0.path().to_owned()]);
    assert_eq!(ran.status, 0);
    let told = "skipped 1 file in an unsupported format: ";
    assert!(ran.stderr.contains(told), "{}", ran.stderr);
    assert_eq!(ran.reports().len(), 1);
}

#[test]
fn a_fits_file_stored_bottom_up_is_the_same_picture() {
    let files = Files::new();
    let image = orion();
    let (width, height) = (image.width(), image.height());
    let rows = image.as_bytes().rchunks(width as usize);
    let bottom_up: Vec<u8> = rows.flatten().copied().collect();
    let stored = |card: &str| fits(8, (width, height), &[card], &bottom_up);
    let ran = process([
        fixture("orion/orion.png"),
        files.add("top.fits", &orion_fits(&[])),
        files.add("says.fits", &stored("ROWORDER= 'BOTTOM-UP'")),
        // As most programs write FITS: without the keyword. This card is not one.
        files.add("silent.fits", &stored("ROWORDER")),
    ]);
    assert_eq!((ran.status, ran.stderr.as_str()), (0, ""));
    let reports = ran.reports();
    let orders = ["top-down", "top-down", "bottom-up", "bottom-up"];
    for (report, order) in reports.iter().zip(orders) {
        assert_eq!(report["row_order"], order);
        for field in ["attitude", "optics", "match", "stars"] {
            assert_eq!(report[field], reports[0][field], "{field}");
        }
    }
    assert_eq!(reports[0]["optics"]["mirrored"], false);
}

#[test]
fn the_date_is_that_of_the_option_else_of_the_header_else_of_the_name() {
    let files = Files::new();
    let keywords = ["DATE-OBS= '2011-02-03T04:05:06.7'", "EXPTIME = 0.25"];
    let dated = files.add("2019-07-29.fits", &orion_fits(&keywords));
    let undated = files.add("2019-07-30.fits", &orion_fits(&[]));
    let report = |options: &[&str], path: &Path| {
        let options = options.iter().map(PathBuf::from);
        process(options.chain([path.to_owned()]))
            .reports()
            .remove(0)
    };
    let header = report(&[], &dated);
    assert_eq!(header["date"]["iso"], "2011-02-03T04:05:06.7Z");
    assert_eq!(header["date"]["source"], "file header");
    assert_eq!(header["exposure_s"], 0.25);
    let name = report(&[], &undated);
    assert_eq!(name["date"]["iso"], "2019-07-30");
    assert_eq!(name["date"]["source"], "file name");
    assert!(name["exposure_s"].is_null());
    let option = report(&["--date", "2020-01-01"], &dated);
    assert_eq!(option["date"]["source"], "option");
    let text = Ran::new(starpipe().arg("process").arg(&dated)).stdout;
    assert!(
        text.contains("2011-02-03 04:05:06.7 UTC, from the file's header"),
        "{text}"
    );
}

#[test]
fn a_right_scale_in_the_header_helps_and_a_wrong_one_does_no_harm() {
    let files = Files::new();
    // 113.65″ a pixel.
    let right = files.add(
        "right.fits",
        &orion_fits(&["FOCALLEN= 10", "XPIXSZ  = 5.51"]),
    );
    let wrong = files.add(
        "wrong.fits",
        &orion_fits(&["FOCALLEN= 20", "XPIXSZ  = 5.51"]),
    );
    let absurd = files.add(
        "absurd.fits",
        &orion_fits(&["FOCALLEN= 0", "XPIXSZ  = 5.51"]),
    );
    let ran = process([right, wrong, absurd]);
    assert_eq!((ran.status, ran.stderr.as_str()), (0, ""));
    let reports = ran.reports();
    let note = |report: &Value| report["notes"][0]["text"].as_str().map(str::to_owned);
    assert!(
        note(&reports[0])
            .unwrap()
            .starts_with("the date is unknown")
    );
    let wrong = note(&reports[1]).unwrap();
    assert!(
        wrong.ends_with("they give 45.5″ to 68.2″ per pixel"),
        "{wrong}"
    );
    let absurd = note(&reports[2]).unwrap();
    assert!(
        absurd.starts_with("FOCALLEN is ignored: found 0, expected"),
        "{absurd}"
    );
    for report in &reports {
        assert_eq!(
            report["attitude"]["quaternion"],
            reports[0]["attitude"]["quaternion"]
        );
    }
    let chance = |report| number(report, "/match/log10_false_alarm");
    assert!(
        chance(&reports[0]) < chance(&reports[1]),
        "fewer hypotheses were tried"
    );
}

// ---- Standard input, directories, pages

#[test]
fn a_frame_or_a_list_is_read_from_standard_input() {
    let out = tempfile::tempdir().unwrap();
    let bytes = fs::read(fixture("orion/orion.png")).unwrap();
    let mut command = starpipe();
    command.args(["process", "--format", "json", "-", "--out"]);
    let ran = Ran::new(command.arg(out.path()).write_stdin(bytes));
    assert_eq!((ran.status, ran.stderr.as_str()), (0, ""));
    assert_eq!(ran.reports()[0]["frame"], "-");
    for name in ["stdin.json", "stdin.csv"] {
        assert!(out.path().join(name).is_file(), "{name}");
    }
    let table = fs::read_to_string(out.path().join("stdin.csv")).unwrap();
    let list = table.replace(",vmag,", ",answer,");
    let sizes = ["--width", "640", "--height", "480"];
    let mut command = starpipe();
    command
        .args(["identify", "--format", "json", "-"])
        .args(sizes);
    let ran = Ran::new(command.write_stdin(list));
    assert_eq!((ran.status, ran.stderr.as_str()), (0, ""));
    assert_eq!(ran.reports()[0]["frame"], "-");
}

#[test]
fn standard_input_is_read_once_and_bad_input_is_reported() {
    for command in ["process", "identify"] {
        let ran = Ran::new(starpipe().args([command, "-", "a.csv", "-"]));
        assert_eq!(ran.status, 2, "{}", ran.stderr);
        assert!(ran.stderr.contains("standard input"), "{}", ran.stderr);
    }
    let ran = Ran::new(starpipe().args(["process", "-"]).write_stdin("no frame"));
    assert_eq!(ran.status, 1);
    let begins = "starpipe: reading -: not an image: found the text \"no frame\" at byte 0";
    assert!(ran.stderr.starts_with(begins), "{}", ran.stderr);
    let ran = Ran::new(starpipe().args(["identify", "-"]).write_stdin("a,b\n"));
    assert_eq!(ran.status, 1);
    assert!(
        ran.stderr.starts_with("starpipe: reading -: line 1"),
        "{}",
        ran.stderr
    );
}

#[test]
fn a_directory_stands_for_the_frames_in_it() {
    let files = Files::new();
    let orion = orion_fits(&[]);
    let expected = [
        files.add("a.fits.gz", &zipped(&orion)),
        files.add("b.fits", &orion),
        files.add("no-extension", &orion),
    ];
    files.add("notes.txt", b"PSF was poor\n");
    files.add("list.csv.gz", &zipped(b"x,y,flux\n"));
    fs::create_dir(files.0.path().join("below.fits")).unwrap();
    let named = |ran: &Ran| -> Vec<PathBuf> {
        let name = |report: &Value| report["frame"].as_str().unwrap().into();
        ran.reports().iter().map(name).collect()
    };
    let ran = process([files.0.path().to_owned()]);
    assert_eq!(ran.status, 0);
    let passed_over = "starpipe: skipped 2 files that are not images: ";
    assert!(ran.stderr.starts_with(passed_over), "{}", ran.stderr);
    assert_eq!(ran.stderr.lines().count(), 1);
    assert_eq!(named(&ran), expected);
    // A file that is named as a frame and is none is told of: a transfer was cut off.
    let cut = files.add("cut.TIF", b"");
    let ran = process([files.0.path().to_owned()]);
    assert_eq!((ran.status, named(&ran)), (1, expected.to_vec()));
    let told = format!("starpipe: reading {}: ", cut.display());
    assert!(ran.stderr.contains(&told), "{}", ran.stderr);
    assert_eq!(ran.stderr.lines().count(), 2);
    // A directory without frames is an error; the rest is processed.
    let empty = tempfile::tempdir().unwrap();
    let ran = process([empty.path().to_owned(), expected[1].clone()]);
    assert_eq!(ran.status, 1);
    assert_eq!(named(&ran), expected[1..2]);
    fs::write(empty.path().join("notes.txt"), "nothing").unwrap();
    let ran = process([empty.path().to_owned()]);
    assert_eq!((ran.status, ran.stdout.as_str()), (1, ""));
    assert_eq!(
        ran.stderr,
        format!(
            "starpipe: reading {}: a directory without frames: found 1 file that is not an image in it, \
             expected FITS, TIFF, PNG, JPEG, BMP or PGM\n",
            empty.path().display()
        )
    );
}

#[test]
fn a_page_is_selected_by_its_number() {
    let image = orion();
    let size = [image.width(), image.height()];
    let dark = vec![10_u8; image.as_bytes().len()];
    let primary = format!("SIMPLE  = {:>20}", "T");
    let file = [
        fits_unit(&primary, 8, &size, &[], &dark),
        fits_unit("XTENSION= 'IMAGE   '", 8, &size, &[], image.as_bytes()),
    ]
    .concat();
    let files = Files::new();
    let path = files.add("two.fits", &file);
    let status = |page: &str| {
        let ran = process(["--page".into(), page.into(), path.clone()]);
        (ran.status, ran.stderr)
    };
    assert_eq!(status("1").0, 3);
    assert_eq!(status("2"), (0, String::new()));
    let (failed, message) = status("3");
    assert_eq!(failed, 1);
    assert!(
        message.ends_with("no page 3: found 2 pages, expected at least 3\n"),
        "{message}"
    );
    assert_eq!(status("0").0, 2);
}

/// A mosaic: an image without stars, a table of no axes, the stars of Orion, and an image that
/// breaks off.
fn mosaic() -> Vec<u8> {
    let image = orion();
    let size = [image.width(), image.height()];
    let dark = vec![10_u8; image.as_bytes().len()];
    let extension = "XTENSION= 'IMAGE   '";
    let whole = [
        fits_unit("SIMPLE  =                    T", 8, &[], &[], &[]),
        fits_unit(extension, 8, &size, &[], &dark),
        fits_unit(extension, 8, &size, &[], image.as_bytes()),
        fits_unit(extension, 8, &size, &[], image.as_bytes()),
    ]
    .concat();
    whole[..whole.len() - 100_000].to_vec()
}

#[test]
fn all_images_of_a_mosaic_are_frames() {
    let files = Files::new();
    let path = files.add("mosaic.fits.gz", &zipped(&mosaic()));
    let out = files.0.path().join("out");
    let all = |path: &Path| {
        let arguments: [PathBuf; 5] = [
            "--page".into(),
            "all".into(),
            path.into(),
            "--out".into(),
            out.clone(),
        ];
        process(arguments)
    };
    let ran = all(&path);
    assert_eq!(ran.status, 1);
    let name = path.display();
    let begins = format!("starpipe: reading {name}[3]: truncated FITS");
    assert!(ran.stderr.starts_with(&begins), "{}", ran.stderr);
    assert_eq!(ran.stderr.lines().count(), 1);
    let [dark, orion] = &ran.reports()[..] else {
        panic!("{}", ran.stdout)
    };
    assert_eq!(dark["frame"], format!("{name}[1]"));
    assert_eq!(dark["status"], "not_identified");
    assert_eq!(orion["frame"], format!("{name}[2]"));
    assert_eq!(orion["status"], "identified");
    let alone = process(["--page".into(), "2".into(), path.clone()]);
    assert_eq!(orion["attitude"], alone.reports()[0]["attitude"]);

    // Results are overwritten, other files are not.
    let result = out.join("mosaic.fits-2.json");
    let saved = fs::read_to_string(&result).unwrap();
    assert!(saved.contains("mosaic.fits.gz[2]"), "{saved}");
    assert_eq!(all(&path).stderr, ran.stderr);
    fs::write(&result, "mine").unwrap();
    let refused = all(&path).stderr;
    let expected = "[2] would overwrite a file that starpipe did not write";
    assert!(refused.contains(expected), "{refused}");
    assert_eq!(fs::read(&result).unwrap(), b"mine");

    // Any other file is a mosaic of one, if it is an image.
    let tiff = files.add("orion.png", &fs::read(fixture("orion/orion.png")).unwrap());
    let ran = all(&tiff);
    assert_eq!((ran.status, ran.stderr.as_str()), (0, ""));
    let ran = all(&files.add("notes.txt", b"PSF was poor"));
    assert!(ran.stderr.contains("not an image"), "{}", ran.stderr);
}

// ---- Bad files

/// Asserts that each file is refused in one line that begins so, with nothing on standard output.
fn assert_refused(cases: &[(&str, Vec<u8>, &str)]) {
    let files = Files::new();
    let paths: Vec<PathBuf> = cases.iter().map(|(n, b, _)| files.add(n, b)).collect();
    let ran = process(paths.clone());
    assert_eq!((ran.status, ran.stdout.as_str()), (1, ""));
    let lines: Vec<&str> = ran.stderr.lines().collect();
    assert_eq!(lines.len(), cases.len(), "{}", ran.stderr);
    for ((line, path), (_, _, expected)) in lines.iter().zip(&paths).zip(cases) {
        let begins = format!("starpipe: reading {}: {expected}", path.display());
        assert!(line.starts_with(&begins), "{line}\nexpected {begins}");
    }
}

#[test]
fn a_truncated_file_of_any_format_says_so() {
    let image = orion();
    let size = (image.width(), image.height());
    let half = |bytes: Vec<u8>| bytes[..bytes.len() / 2].to_vec();
    let tiff = tiff_of::<Gray8>(size, image.as_bytes(), Compression::Uncompressed);
    let words = image.to_luma16().into_raw();
    assert_refused(&[
        ("a.tif", half(tiff), "truncated TIFF: found 153699 bytes"),
        (
            "a.png",
            half(by_image(&image, ImageFormat::Png)),
            "truncated PNG: found ",
        ),
        (
            "a.jpg",
            half(by_image(&image, ImageFormat::Jpeg)),
            "truncated JPEG: found ",
        ),
        (
            "a.bmp",
            half(by_image(&image, ImageFormat::Bmp)),
            "truncated BMP: found ",
        ),
        (
            "a.pgm",
            half(by_image(&image, ImageFormat::Pnm)),
            "truncated PNM: found ",
        ),
        (
            "b.pgm",
            b"P2 3 3 255 1 2 3".to_vec(),
            "truncated PNM: found 16 bytes",
        ),
        (
            "a.fits",
            half(fits(16, size, &[UNSIGNED], &stored(&words))),
            "truncated FITS: found 309600 bytes, expected more (the image of 640 x 480 pixels ends at byte 617280)",
        ),
        (
            "b.fits",
            b"SIMPLE  =                    T".to_vec(),
            "truncated FITS: found 30 bytes",
        ),
        (
            "a.gz",
            half(zipped(&orion_fits(&[]))),
            "truncated gzip: found ",
        ),
    ]);
}

#[test]
fn an_absurd_size_is_refused_whatever_the_format() {
    const SIDE: u32 = 1_000_000_000;
    let png = {
        let mut bytes = by_image(&orion(), ImageFormat::Png);
        bytes[16..20].copy_from_slice(&SIDE.to_be_bytes());
        bytes[20..24].copy_from_slice(&SIDE.to_be_bytes());
        bytes
    };
    let bmp = {
        let mut bytes = by_image(&orion(), ImageFormat::Bmp);
        bytes[18..22].copy_from_slice(&SIDE.to_le_bytes());
        bytes[22..26].copy_from_slice(&SIDE.to_le_bytes());
        bytes
    };
    let jpeg = {
        let mut bytes = by_image(&orion(), ImageFormat::Jpeg);
        let at = bytes.windows(2).position(|w| w == [0xff, 0xc0]).unwrap();
        bytes[at + 5..at + 9].copy_from_slice(&[0xff; 4]);
        bytes
    };
    let tiff = {
        let mut bytes = tiff_of::<Gray8>((3, 3), &[1; 9], Compression::Uncompressed);
        // Width, height, and rows in the one strip.
        for tag in [256_u16, 257, 278] {
            let entry = [tag.to_le_bytes(), 4_u16.to_le_bytes()].concat();
            let at = bytes.windows(4).position(|w| w == entry).unwrap();
            bytes[at + 8..at + 12].copy_from_slice(&SIDE.to_le_bytes());
        }
        bytes
    };
    let large = "too large: found 1000000000 x 1000000000 pixels, expected at most 200000000";
    assert_refused(&[
        ("a.png", png, large),
        ("a.bmp", bmp, large),
        ("a.jpg", jpeg, "too large: found 65535 x 65535 pixels"),
        ("a.tif", tiff, large),
        ("a.pgm", b"P5 1000000000 1000000000 65535\n".to_vec(), large),
        ("b.pgm", b"P2 1000000000 1000000000 255\n".to_vec(), large),
        ("a.fits", fits(16, (SIDE, SIDE), &[], &[]), large),
        (
            "b.fits",
            fits(16, (15_000, 10_000), &[], &[]),
            "truncated FITS: found 2880 bytes",
        ),
        (
            "line.fits",
            fits(8, (1, 100_000), &[], &[1; 100_000]),
            "too small: found 1 x 100000 pixels",
        ),
        (
            "line.pgm",
            [&b"P5 100000 1 255\n"[..], &[1; 100_000]].concat(),
            "too small: found 100000 x 1",
        ),
    ]);
}

#[test]
fn files_without_a_frame_say_what_they_are() {
    let primary = format!("SIMPLE  = {:>20}", "T");
    let empty = fits_unit(&primary, 8, &[], &[], &[]);
    let table = |more: &[&str]| fits_unit("XTENSION= 'BINTABLE'", 8, &[4, 3], more, &[0; 12]);
    let float = |value: f32| {
        let data: Vec<u8> = [value; 12].iter().flat_map(|v| v.to_be_bytes()).collect();
        fits(-32, (4, 3), &[], &data)
    };
    let with = |more| fits(16, (4, 3), &[more], &[0; 24]);
    let mut without_naxis1 = with("COMMENT");
    without_naxis1[240..248].copy_from_slice(b"COMMENT ");
    assert_refused(&[
        (
            "empty.fits",
            Vec::new(),
            "empty: found 0 bytes, expected an image (FITS, TIFF",
        ),
        (
            "text.fits",
            b"SIMPLE as that\n".to_vec(),
            "not an image: found the text \"SIMPLE a\"",
        ),
        (
            "table.fits",
            [empty.clone(), table(&[])].concat(),
            "unsupported FITS: found no image in it, and 1 table",
        ),
        (
            "z.fits",
            [empty, table(&["ZIMAGE  = T"])].concat(),
            "damaged FITS: the header at byte 2880 has no ZBITPIX, expected 8, 16, 32, 64, -32 or -64",
        ),
        (
            "inf.fits",
            float(f32::INFINITY),
            "no pixel has a value: found only NaN or infinity",
        ),
        (
            "inf.tif",
            tiff_of::<Gray32Float>((3, 3), &[f32::NEG_INFINITY; 9], Compression::Uncompressed),
            "no pixel has a value",
        ),
        (
            "bitpix.fits",
            fits(17, (4, 3), &[], &[0; 24]),
            "damaged FITS: keyword BITPIX at byte 80: found 17, expected 8, 16, 32, 64, -32 or -64",
        ),
        (
            "naxis1.fits",
            without_naxis1,
            "damaged FITS: the header at byte 0 has no NAXIS1, expected a length of 0 or more",
        ),
        (
            "bscale.fits",
            with("BSCALE  = NaN"),
            "damaged FITS: keyword BSCALE at byte 400: found NaN, expected a finite number",
        ),
    ]);
}
