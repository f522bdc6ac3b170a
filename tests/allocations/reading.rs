//! Reading allocates no more than it may.

use bzip2::write::BzEncoder;
use flate2::Compression;
use flate2::write::GzEncoder;
use image::{DynamicImage, ImageBuffer, ImageFormat, Rgb};
use starpipe::frame::{self, Buffers, FrameError, MemoryLimit};
use std::fmt::Write as _;
use std::fs;
use std::io::{Cursor, Write as _};
use tiff::encoder::colortype::{ColorType, Gray16, Gray32Float, Gray64Float, RGB8, RGB16};
use tiff::encoder::{TiffEncoder, TiffValue};

/// What decoders hold beside the image: tables, windows, and a row or two.
const DECODER_BYTES: u64 = 600_000;

/// Width and height of the frame in each file.
const SIZE: (u32, u32) = (1000, 800);

type File = (String, Vec<u8>);

/// Grey levels of 12 bits, for so many samples.
fn levels(samples: u32) -> Vec<u16> {
    let level = |at: u32| (at.wrapping_mul(0x9e37_79b9) >> 20) as u16;
    (0..samples).map(level).collect()
}

fn octets(levels: &[u16]) -> Vec<u8> {
    levels.iter().map(|level| (level >> 4) as u8).collect()
}

/// PNG, JPEG, BMP and PNM.
fn rasters() -> Vec<File> {
    let (width, height) = SIZE;
    let color = octets(&levels(3 * width * height));
    let grey = ImageBuffer::from_raw(width, height, levels(width * height)).unwrap();
    let rgb = DynamicImage::from(
        ImageBuffer::<Rgb<u8>, _>::from_raw(width, height, color.clone()).unwrap(),
    );
    let images = [
        DynamicImage::ImageLuma16(grey),
        rgb.to_luma8().into(),
        rgb.to_rgb16().into(),
        rgb,
    ];
    let mut files = Vec::new();
    for image in &images {
        for format in [
            ImageFormat::Png,
            ImageFormat::Jpeg,
            ImageFormat::Bmp,
            ImageFormat::Pnm,
        ] {
            let mut out = Cursor::new(Vec::new());
            if image.write_to(&mut out, format).is_ok() {
                files.push((format!("{format:?} {:?}", image.color()), out.into_inner()));
            }
        }
    }
    for (magic, samples) in [("P2", &color[..color.len() / 3]), ("P3", &color)] {
        let mut text = format!("{magic}\n{width} {height}\n255\n");
        for sample in samples {
            write!(text, "{sample} ").unwrap();
        }
        files.push((magic.to_owned(), text.into_bytes()));
    }
    files
}

fn tiff<C: ColorType>(
    name: &str,
    samples: &[C::Inner],
    compression: tiff::encoder::Compression,
) -> File
where
    [C::Inner]: TiffValue,
{
    let (width, height) = SIZE;
    let mut out = Cursor::new(Vec::new());
    let encoder = TiffEncoder::new(&mut out).unwrap();
    let mut encoder = encoder.with_compression(compression);
    encoder.write_image::<C>(width, height, samples).unwrap();
    (format!("TIFF {name}"), out.into_inner())
}

fn tiffs() -> Vec<File> {
    use tiff::encoder::Compression::{Lzw, Packbits, Uncompressed};
    let (width, height) = SIZE;
    let grey = levels(width * height);
    let color = levels(3 * width * height);
    let floats: Vec<f32> = grey.iter().map(|&word| f32::from(word)).collect();
    let doubles: Vec<f64> = grey.iter().map(|&word| f64::from(word)).collect();
    let each = |compression| {
        [
            tiff::<Gray16>("u16", &grey, compression),
            tiff::<RGB8>("rgb8", &octets(&color), compression),
            tiff::<RGB16>("rgb16", &color, compression),
            tiff::<Gray32Float>("f32", &floats, compression),
            tiff::<Gray64Float>("f64", &doubles, compression),
        ]
    };
    [Uncompressed, Lzw, Packbits]
        .into_iter()
        .flat_map(each)
        .collect()
}

fn fits_files() -> Vec<File> {
    let (width, height) = SIZE;
    let stored = levels(width * height);
    let stored: Vec<u8> = stored.iter().flat_map(|word| word.to_be_bytes()).collect();
    let kinds = [
        (8, "", 1),
        (16, "", 1),
        (16, "BZERO   = 32768", 1),
        (16, "BLANK   = 7", 1),
        (16, "BSCALE  = 2", 1),
        (32, "", 1),
        (64, "", 1),
        (-32, "", 1),
        (-64, "", 1),
        (8, "", 3),
        (16, "", 3),
        (-32, "", 3),
        (-64, "", 3),
    ];
    let file = |(bitpix, more, planes)| {
        let name = format!("FITS {bitpix} {more} {planes}");
        (name, fits(bitpix, [width, height, planes], more, &stored))
    };
    kinds.into_iter().map(file).collect()
}

/// Both kinds of compressed file.
fn compressed((name, bytes): &File) -> [File; 2] {
    let mut gzip = GzEncoder::new(Vec::new(), Compression::fast());
    gzip.write_all(bytes).unwrap();
    let mut bzip2 = BzEncoder::new(Vec::new(), bzip2::Compression::fast());
    bzip2.write_all(bytes).unwrap();
    [
        (format!("{name}, gzip"), gzip.finish().unwrap()),
        (format!("{name}, bzip2"), bzip2.finish().unwrap()),
    ]
}

/// A FITS file whose data are `stored`, over and over.
fn fits(bitpix: i32, [width, height, planes]: [u32; 3], more: &str, stored: &[u8]) -> Vec<u8> {
    let cards = [
        "SIMPLE  = T".to_owned(),
        format!("BITPIX  = {bitpix}"),
        format!("NAXIS   = {}", if planes > 1 { 3 } else { 2 }),
        format!("NAXIS1  = {width}"),
        format!("NAXIS2  = {height}"),
        format!("NAXIS3  = {planes}"),
        more.to_owned(),
        "END".to_owned(),
    ];
    let mut file: Vec<u8> = cards
        .iter()
        .flat_map(|card| format!("{card:<80}").into_bytes())
        .collect();
    file.resize(2880, b' ');
    let length = (width * height * planes) as usize * bitpix.unsigned_abs() as usize / 8;
    file.extend(stored.iter().cycle().take(length));
    file.resize(file.len().next_multiple_of(2880), 0);
    file
}

/// Whether the file is read within `limit` bytes, and the most that was held.
fn read_within(file: &[u8], limit: u64) -> (bool, u64) {
    let mut buffers = Buffers::new();
    buffers.set_memory(MemoryLimit::of_bytes(limit));
    let mut is_read = false;
    let held = allocation_counter::measure(|| {
        is_read = match frame::read_stream(file, None, &mut buffers) {
            Ok(_) => true,
            Err(FrameError::TooMuchMemory { .. } | FrameError::OutOfMemory { .. }) => false,
            Err(error) => panic!("{error}"),
        };
    });
    (is_read, held.bytes_max)
}

#[test]
fn reading_holds_no_more_than_it_may() {
    let fixtures = ["formats", "tiles"].map(|directory| {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/fixtures/").to_owned() + directory;
        fs::read_dir(path)
            .unwrap()
            .map(|entry| entry.unwrap().path())
    });
    let stored = fixtures.into_iter().flatten().filter_map(|path| {
        let bytes = fs::read(&path).unwrap();
        frame::decode(&bytes)
            .is_ok()
            .then(|| (path.display().to_string(), bytes))
    });
    let mut failures = Vec::new();
    let mut files = [rasters(), tiffs(), fits_files()].concat();
    files.extend(files.clone().iter().step_by(3).flat_map(compressed));
    files.extend(stored);
    assert!(files.len() > 40);
    for (name, file) in &files {
        let (mut least, mut most) = (0, 200_000_000);
        assert!(read_within(file, most).0, "{name}");
        while most - least > 1000 {
            let limit = least.midpoint(most);
            let (is_read, held) = read_within(file, limit);
            if held > limit + DECODER_BYTES {
                failures.push(format!(
                    "{name}: {held} bytes within {limit}, read: {is_read}"
                ));
                break;
            }
            if is_read { most = limit } else { least = limit }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
