//! The orientation that each format states, and how its picture is drawn.

use super::{Frame, Orientation, decode};
use exif::experimental::Writer;
use exif::{Field, In, Tag, Value};
use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use std::io::Cursor;

const WIDTH: u32 = 48;
const HEIGHT: u32 = 32;

/// Levels that differ from pixel to pixel, in steps that JPEG keeps apart.
fn levels() -> Vec<u8> {
    let level = |i: u32| (4 * (i % WIDTH) + i / WIDTH) as u8;
    (0..WIDTH * HEIGHT).map(level).collect()
}

/// Exif that states an orientation for the picture, or for its thumbnail.
fn exif(value: Value, image: In, is_little_endian: bool) -> Vec<u8> {
    let orientation = Field {
        tag: Tag::Orientation,
        ifd_num: image,
        value,
    };
    let make = Field {
        tag: Tag::Make,
        ifd_num: In::PRIMARY,
        value: Value::Ascii(vec![b"maker".to_vec()]),
    };
    let mut writer = Writer::new();
    writer.push_field(&make);
    writer.push_field(&orientation);
    let mut out = Cursor::new(Vec::new());
    writer.write(&mut out, is_little_endian).unwrap();
    out.into_inner()
}

fn jpeg(exif: Vec<u8>) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = JpegEncoder::new_with_quality(&mut bytes, 100);
    encoder.set_exif_metadata(exif).unwrap();
    let written = encoder.write_image(&levels(), WIDTH, HEIGHT, ExtendedColorType::L8);
    written.unwrap();
    bytes
}

fn png(exif: Vec<u8>, is_16_bit: bool) -> Vec<u8> {
    let (pixels, color) = if is_16_bit {
        let words = levels()
            .into_iter()
            .flat_map(|v| u16::from(v).to_ne_bytes());
        (words.collect(), ExtendedColorType::L16)
    } else {
        (levels(), ExtendedColorType::L8)
    };
    let mut bytes = Vec::new();
    let mut encoder = PngEncoder::new(&mut bytes);
    encoder.set_exif_metadata(exif).unwrap();
    encoder.write_image(&pixels, WIDTH, HEIGHT, color).unwrap();
    bytes
}

fn tiff(tag: u16) -> Vec<u8> {
    use tiff::encoder::TiffEncoder;
    use tiff::encoder::colortype::Gray8;
    let mut out = Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut out).unwrap();
    let mut image = encoder.new_image::<Gray8>(WIDTH, HEIGHT).unwrap();
    let written = image.encoder().write_tag(tiff::tags::Tag::Orientation, tag);
    written.unwrap();
    image.write_data(&levels()).unwrap();
    out.into_inner()
}

fn assert_near(found: &Frame, expected: &Frame, what: &str) {
    const JPEG_ERROR_ADU: f32 = 3.0;
    let size = |frame: &Frame| (frame.width, frame.height);
    assert_eq!(size(found), size(expected), "{what}");
    let (found, expected) = (found.values(), expected.values());
    let differences = found.iter().zip(&*expected).map(|(a, b)| (a - b).abs());
    let largest = differences.fold(0.0, f32::max);
    assert!(largest <= JPEG_ERROR_ADU, "{what}: {largest}");
}

#[test]
fn every_format_is_drawn_as_its_orientation_says() {
    for tag in 1..=8 {
        let mut expected = Frame::from_samples(WIDTH as usize, HEIGHT as usize, levels()).unwrap();
        expected.metadata.orientation = Orientation::of_tag(tag).unwrap();
        let expected = expected.drawn();
        for little in [false, true] {
            let exif = || exif(Value::Short(vec![tag as u16]), In::PRIMARY, little);
            assert_near(&decode(&jpeg(exif())).unwrap(), &expected, "JPEG");
            assert_near(&decode(&png(exif(), false)).unwrap(), &expected, "PNG");
            assert_near(
                &decode(&png(exif(), true)).unwrap(),
                &expected,
                "16-bit PNG",
            );
        }
        assert_near(&decode(&tiff(tag as u16)).unwrap(), &expected, "TIFF");
    }
}

#[test]
fn an_orientation_after_the_image_of_a_png_counts_too() {
    const CHUNK_BYTES: usize = 12;
    let data = exif(Value::Short(vec![6]), In::PRIMARY, true);
    let before = png(data.clone(), false);
    let start = memchr::memmem::find(&before, b"eXIf").unwrap() - 4;
    let chunk = start..start + CHUNK_BYTES + data.len();
    let mut after = before.clone();
    let chunk: Vec<u8> = after.drain(chunk).collect();
    let end = after.len() - CHUNK_BYTES;
    after.splice(end..end, chunk);
    assert_ne!(after, before);
    assert_eq!(decode(&after).unwrap(), decode(&before).unwrap());
}

#[test]
fn values_without_a_meaning_and_those_of_thumbnails_turn_nothing() {
    let upright = Frame::from_samples(WIDTH as usize, HEIGHT as usize, levels()).unwrap();
    for value in [0, 9, 400] {
        let exif = || exif(Value::Short(vec![value]), In::PRIMARY, true);
        assert_near(&decode(&jpeg(exif())).unwrap(), &upright, "JPEG");
        assert_near(&decode(&png(exif(), false)).unwrap(), &upright, "PNG");
        assert_near(&decode(&tiff(value)).unwrap(), &upright, "TIFF");
    }
    let text = exif(Value::Ascii(vec![b"6".to_vec()]), In::PRIMARY, true);
    assert_near(&decode(&jpeg(text)).unwrap(), &upright, "text");
    let thumbnail = exif(Value::Short(vec![6]), In::THUMBNAIL, true);
    assert_near(&decode(&jpeg(thumbnail)).unwrap(), &upright, "thumbnail");
}
