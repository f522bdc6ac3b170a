//! FITS images compressed tile by tile, by fpack and astropy, against the same images uncompressed.

use crate::common::{fixture, names};
use proptest::prelude::*;
use starpipe::frame::{self, Frame, FrameError, Pixels};
use std::num::NonZeroUsize;
use std::path::PathBuf;

fn path(name: &str) -> PathBuf {
    fixture("tiles").join(name)
}

fn read_page(name: &str, page: Option<usize>) -> Frame<'static> {
    let page = page.map(|page| NonZeroUsize::new(page).unwrap());
    frame::read_page(path(name), page).unwrap()
}

/// Asserts that both frames agree to the last bit.
fn assert_same(found: &Frame, expected: &Frame, name: &str) {
    assert_eq!((found.width, found.height), (40, 30), "{name}");
    for (i, (found, expected)) in found.values().iter().zip(&*expected.values()).enumerate() {
        let (x, y) = (i % 40, i / 40);
        let both_nan = found.is_nan() && expected.is_nan();
        assert!(
            both_nan || found.to_bits() == expected.to_bits(),
            "{name}: found {found} at ({x}, {y}), expected {expected}"
        );
    }
    let levels = |frame: &Frame| (frame.step_adu, frame.saturation_adu);
    assert_eq!(levels(found), levels(expected), "{name}");
    let has_words = |frame: &Frame| matches!(frame.pixels, Pixels::U16(_));
    assert_eq!(has_words(found), has_words(expected), "{name}");
    assert_eq!(found.metadata, expected.metadata, "{name}");
}

#[test]
fn exact_compressions_give_the_image_that_was_compressed() {
    for (name, plain) in [
        ("fpack-rice-u8", "u8"),
        ("fpack-rice-i16", "i16"),
        ("fpack-rice-u16", "u16"),
        ("fpack-rice-i32", "i32"),
        ("fpack-gzip1-u16", "u16"),
        ("fpack-gzip2-i32", "i32"),
        ("fpack-hcompress-i16", "i16"),
        ("fpack-hcompress-i32", "i32"),
        ("fpack-plio-mask", "mask"),
        ("fpack-plio-u16", "u16"),
        ("fpack-none-u16", "u16"),
        ("fpack-gzip1-f32", "f32"),
        ("fpack-gzip2-f64", "f64"),
        ("astropy-rice-u16", "u16"),
        ("astropy-gzip1-i64", "i64"),
        ("astropy-gzip2-i32", "i32"),
        ("astropy-none-u8", "u8"),
        ("astropy-plio-mask", "mask"),
    ] {
        let found = read_page(&format!("{name}.fits.fz"), None);
        let expected = read_page(&format!("plain-{plain}.fits.gz"), None);
        if plain == "i16" {
            assert!(found.at(3, 27).is_nan(), "{name}: BLANK");
        }
        assert_same(&found, &expected, name);
    }
}

#[test]
fn what_compression_has_lost_is_what_cfitsio_finds() {
    for name in [
        "fpack-lossy-u16",
        // fpack stores a number instead of NaN in these.
        "fpack-none-f32",
        "fpack-rice-f32",
        "fpack-zero-f32",
        "fpack-plain-f32",
        "fpack-rice-f64",
        "fpack-hcompress-f32",
        "astropy-smooth-u16",
        "astropy-gzip2-f32",
        "astropy-rice-f64",
    ] {
        let found = read_page(&format!("{name}.fits.fz"), None);
        let expected = read_page(&format!("funpack-{name}.fits.gz"), None);
        assert_same(&found, &expected, name);
    }
}

#[test]
fn planes_of_a_compressed_cube_are_pages() {
    for page in 1..=4 {
        let found = read_page("fpack-rice-cube.fits.fz", Some(page));
        let expected = read_page("plain-cube.fits.gz", Some(page));
        assert_same(&found, &expected, &format!("page {page}"));
    }
    let page = NonZeroUsize::new(5);
    let refused = frame::read_page(path("fpack-rice-cube.fits.fz"), page).unwrap_err();
    assert!(refused.to_string().contains("found 4 pages"), "{refused}");
    let color = frame::read(path("fpack-rice-cube.fits.fz")).unwrap();
    let assumed: Vec<_> = color.metadata.assumed.iter().map(|a| a.code()).collect();
    assert_eq!(assumed, ["four_planes"]);
}

#[test]
fn the_keywords_of_the_image_are_read() {
    for name in ["fpack-rice-u16.fits.fz", "astropy-rice-u16.fits.fz"] {
        let metadata = read_page(name, None).metadata;
        assert_eq!(metadata.date.unwrap().to_iso(), "2019-07-29T20:47:26.123Z");
        assert_eq!(metadata.exposure_s, Some(0.5), "{name}");
    }
}

#[test]
fn a_file_that_ends_early_names_itself_and_the_tile() {
    let bytes = std::fs::read(path("fpack-rice-u8.fits.fz")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let short = folder.path().join("short.fits.fz");
    std::fs::write(&short, &bytes[..bytes.len() - 2880 + 700]).unwrap();
    let refused = frame::read(&short).unwrap_err();
    let FrameError::File { path, source } = &refused else {
        panic!("{refused}");
    };
    assert_eq!(*path, short);
    assert!(matches!(**source, FrameError::Truncated { .. }), "{source}");
    assert!(source.to_string().contains("(tile "), "{source}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(500))]

    #[test]
    fn damaged_files_never_panic(
        name in proptest::sample::select(names(&fixture("tiles"))),
        changes in proptest::collection::vec((0_usize..9000, any::<u8>()), 1..20),
    ) {
        let mut bytes = std::fs::read(path(&name)).unwrap();
        let length = bytes.len();
        for (from_end, byte) in changes {
            bytes[length - 1 - from_end % length] = byte;
        }
        let _ = frame::decode(&bytes);
    }
}
