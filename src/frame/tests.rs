use super::read_budget::ReadBudget;
use super::reader::read_limited;
use super::*;
use crate::base::interrupt::Interrupt;
use proptest::prelude::*;
use std::io::{Cursor, Read, Write};
use std::num::NonZeroUsize;

fn tiff_of<C: ::tiff::encoder::colortype::ColorType>(
    width: u32,
    height: u32,
    data: &[C::Inner],
) -> Vec<u8>
where
    [C::Inner]: ::tiff::encoder::TiffValue,
{
    let mut out = Cursor::new(Vec::new());
    let mut encoder = ::tiff::encoder::TiffEncoder::new(&mut out).unwrap();
    encoder.write_image::<C>(width, height, data).unwrap();
    out.into_inner()
}

fn encoded_by_image(image: &::image::DynamicImage, format: ::image::ImageFormat) -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    image.write_to(&mut out, format).unwrap();
    out.into_inner()
}

#[test]
fn a_16_bit_tiff_keeps_its_full_depth_and_order() {
    use ::tiff::encoder::colortype::Gray16;
    let data: Vec<u16> = (0..12).map(|i| 1000 * i + 1).collect();
    let frame = decode(&tiff_of::<Gray16>(4, 3, &data)).unwrap();
    assert_eq!((frame.width, frame.height), (4, 3));
    assert_eq!(frame.pixels.value(5), 5001.0);
    assert_eq!(frame.step_adu, 1.0);
    assert_eq!(frame.saturation_adu, Some(65535.0));
}

#[test]
fn twelve_bits_stored_in_sixteen_are_recognized_by_their_levels() {
    use ::tiff::encoder::colortype::Gray16;
    let data: Vec<u16> = (0..12).map(|i| 16 * (i + 3)).collect();
    let frame = decode(&tiff_of::<Gray16>(4, 3, &data)).unwrap();
    assert_eq!(frame.step_adu, 16.0);
    assert_eq!(frame.saturation_adu, Some(65520.0));
}

#[test]
fn color_becomes_luminance_and_one_full_channel_saturates_a_pixel() {
    use ::tiff::encoder::colortype::RGB8;
    let mut data = vec![10u8; 27];
    data[..3].copy_from_slice(&[100, 50, 20]);
    data[3..6].copy_from_slice(&[255, 50, 20]);
    let frame = decode(&tiff_of::<RGB8>(3, 3, &data)).unwrap();
    assert!((frame.pixels.value(0) - (29.9 + 29.35 + 2.28)).abs() < 1e-4);
    assert_eq!(frame.pixels.value(1), 255.0);
    assert_eq!(frame.pixels.value(2), 10.0);
}

#[test]
fn red_and_blue_are_those_of_the_file_that_was_read_last() {
    use ::tiff::encoder::colortype::{Gray8, RGB8, RGB32Float};
    let mut buffers = Buffers::new();
    let levels: Vec<u8> = (0..27).collect();
    let floats: Vec<f32> = levels.iter().map(|&level| level.into()).collect();
    for file in [
        tiff_of::<RGB8>(3, 3, &levels),
        tiff_of::<RGB32Float>(3, 3, &floats),
    ] {
        let frame = read_stream(file.as_slice(), None, &mut buffers).unwrap();
        let [red, blue] = buffers.red_and_blue(&frame).unwrap();
        assert_eq!((red.at(1, 0), blue.at(1, 0)), (3.0, 5.0));
        assert_eq!((red.at(2, 2), blue.at(2, 2)), (24.0, 26.0));
    }
    let grey = tiff_of::<Gray8>(3, 3, &levels[..9]);
    let frame = read_stream(grey.as_slice(), None, &mut buffers).unwrap();
    assert_eq!(buffers.red_and_blue(&frame), None);
}

#[test]
fn nan_pixels_of_a_float_tiff_stay_nan() {
    use ::tiff::encoder::colortype::Gray32Float;
    let mut data = vec![1.5f32; 9];
    data[4] = f32::NAN;
    let frame = decode(&tiff_of::<Gray32Float>(3, 3, &data)).unwrap();
    assert!(frame.pixels.value(4).is_nan());
    assert_eq!(frame.saturation_adu, None);
    let all_nan = tiff_of::<Gray32Float>(3, 3, &[f32::NAN; 9]);
    assert!(matches!(decode(&all_nan), Err(FrameError::NoValues)));
}

#[test]
fn png_and_jpeg_are_read_in_grey_and_color() {
    use ::image::{DynamicImage, ImageBuffer, ImageFormat, Luma, Rgba};
    let grey16 = DynamicImage::ImageLuma16(ImageBuffer::from_fn(5, 4, |x, _| {
        Luma([1000 * x as u16 + 7])
    }));
    let frame = decode(&encoded_by_image(&grey16, ImageFormat::Png)).unwrap();
    assert_eq!(frame.pixels.value(3), 3007.0);
    let rgba = DynamicImage::ImageRgba8(ImageBuffer::from_fn(5, 4, |x, _| {
        Rgba([x as u8, 20, 30, 9])
    }));
    let frame = decode(&encoded_by_image(&rgba, ImageFormat::Png)).unwrap();
    assert!((frame.pixels.value(2) - (2.0 * 0.299 + 11.74 + 3.42)).abs() < 1e-4);
    let grey8 = DynamicImage::ImageLuma8(ImageBuffer::from_pixel(16, 8, Luma([40])));
    let frame = decode(&encoded_by_image(&grey8, ImageFormat::Jpeg)).unwrap();
    assert_eq!(
        (frame.width, frame.height, frame.pixels.value(17)),
        (16, 8, 40.0)
    );
}

#[test]
fn an_unknown_format_reports_what_was_found_and_expected() {
    let text = decode(b"hello, world").unwrap_err().to_string();
    assert!(
        text.contains("\"hello, w\"") && text.contains("TIFF"),
        "{text}"
    );
    assert!(matches!(decode(b""), Err(FrameError::Empty)));
    let missing = read("/nonexistent/a.tif").unwrap_err().to_string();
    assert!(
        missing.starts_with("/nonexistent/a.tif: cannot be read"),
        "{missing}"
    );
}

#[test]
fn a_truncated_file_of_any_kind_is_an_error() {
    use ::tiff::encoder::colortype::Gray16;
    let data: Vec<u16> = (0..64 * 64).collect();
    let tiff = tiff_of::<Gray16>(64, 64, &data);
    // The encoder writes the directory last; without it nothing can be read.
    assert!(decode(&tiff[..tiff.len() / 2]).is_err());
    let grey = ::image::DynamicImage::ImageLuma8(::image::ImageBuffer::from_fn(64, 64, |x, y| {
        ::image::Luma([(x * 7 + y * 13) as u8])
    }));
    for format in [::image::ImageFormat::Png, ::image::ImageFormat::Jpeg] {
        let bytes = encoded_by_image(&grey, format);
        let error = decode(&bytes[..bytes.len() * 2 / 3]).unwrap_err();
        assert!(
            matches!(error, FrameError::Truncated { .. }),
            "{format:?}: {error}"
        );
    }
}

#[test]
fn absurd_and_tiny_sizes_are_refused() {
    assert!(matches!(
        check_size(1 << 20, 1 << 20),
        Err(FrameError::TooLarge { .. })
    ));
    assert!(matches!(
        check_size(usize::MAX, 4),
        Err(FrameError::TooLarge { .. })
    ));
    use ::tiff::encoder::colortype::Gray8;
    assert!(matches!(
        decode(&tiff_of::<Gray8>(1, 1, &[7])),
        Err(FrameError::TooSmall {
            width: 1,
            height: 1
        })
    ));
    assert!(matches!(
        Frame::new(4, 4, vec![0.0; 15]),
        Err(FrameError::WrongLength {
            expected: 16,
            found: 15
        })
    ));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn arbitrary_bytes_never_panic(kind in 0usize..7, tail in proptest::collection::vec(any::<u8>(), 0..400)) {
        let heads: [&[u8]; 7] = [b"II*\0\x08\0\0\0", b"MM\0*\0\0\0\x08", b"II+\0", b"\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR", b"\xff\xd8\xff\xe0", b"\xff\xd8\xff\xc0\0\x0b\x08", b""];
        let mut bytes = heads[kind].to_vec();
        bytes.extend(tail);
        let _ = decode(&bytes);
    }

    #[test]
    fn damaged_files_never_panic(
        kind in 0..SAMPLES,
        changes in proptest::collection::vec((any::<u16>(), any::<u8>()), 0..6),
        early in any::<bool>(),
        length in any::<u16>(),
        page in 0_usize..4,
    ) {
        let mut bytes = sample(kind);
        let all = bytes.len();
        for (at, value) in changes {
            // Most damage matters in the headers, which are small.
            let range = if early { all.min(200) } else { all };
            bytes[usize::from(at) % range] = value;
        }
        if length % 3 == 0 {
            bytes.truncate(usize::from(length) % all);
        }
        let _ = decode_page(&bytes, NonZeroUsize::new(page));
    }
}

/// Number of kinds of files that [`sample`] makes.
const SAMPLES: usize = 19;

/// A small valid file of one of many kinds.
fn sample(kind: usize) -> Vec<u8> {
    use ::image::{DynamicImage, ImageBuffer, ImageFormat, Luma, Rgb};
    use ::tiff::encoder::colortype::{Gray16, Gray32Float, GrayI16, RGB8};
    use ::tiff::encoder::{Compression, TiffEncoder};
    let bytes: Vec<u8> = (0..24 * 16).map(|i| i as u8).collect();
    let words: Vec<u16> = (0..24 * 16).map(|i| i * 150).collect();
    let grey = || DynamicImage::ImageLuma8(ImageBuffer::from_raw(24, 16, bytes.clone()).unwrap());
    let grey16: ImageBuffer<Luma<u16>, _> = ImageBuffer::from_raw(24, 16, words.clone()).unwrap();
    let color = DynamicImage::ImageRgb8(ImageBuffer::from_fn(24, 16, |x, y| {
        Rgb([x as u8, y as u8, 7])
    }));
    let compressed = |compression| {
        let mut out = Cursor::new(Vec::new());
        let encoder = TiffEncoder::new(&mut out).unwrap();
        let mut encoder = encoder.with_compression(compression);
        encoder.write_image::<Gray16>(24, 16, &words).unwrap();
        encoder.write_image::<Gray16>(24, 16, &words).unwrap();
        out.into_inner()
    };
    let fits = |bitpix: i32, data: Vec<u8>| {
        let cards = [
            "SIMPLE  = T".to_owned(),
            format!("BITPIX  = {bitpix}"),
            "NAXIS   = 2".to_owned(),
            "NAXIS1  = 24".to_owned(),
            "NAXIS2  = 16".to_owned(),
            "END".to_owned(),
        ];
        let mut fits: Vec<u8> = cards
            .iter()
            .flat_map(|card| format!("{card:<80}").into_bytes())
            .collect();
        fits.resize(2880, b' ');
        fits.extend(data);
        fits
    };
    match kind {
        0 => tiff_of::<::tiff::encoder::colortype::Gray8>(24, 16, &bytes),
        1 => compressed(Compression::Uncompressed),
        2 => compressed(Compression::Lzw),
        3 => compressed(Compression::Deflate(Default::default())),
        4 => compressed(Compression::Packbits),
        5 => tiff_of::<Gray32Float>(24, 16, &[1.5; 24 * 16]),
        6 => tiff_of::<GrayI16>(24, 16, &[-5; 24 * 16]),
        7 => tiff_of::<RGB8>(8, 16, &bytes),
        8 => encoded_by_image(&grey(), ImageFormat::Png),
        9 => encoded_by_image(&grey16.into(), ImageFormat::Png),
        10 => encoded_by_image(&grey(), ImageFormat::Jpeg),
        11 => encoded_by_image(&color, ImageFormat::Jpeg),
        12 => encoded_by_image(&grey(), ImageFormat::Bmp),
        13 => encoded_by_image(&color, ImageFormat::Bmp),
        14 => encoded_by_image(&grey(), ImageFormat::Pnm),
        15 => b"P2\n# a remark\n3 3\n4095\n0 1 2 3 4 5 6 7 4095\n".to_vec(),
        16 => [b"P6 8 16 255\n", &bytes[..]].concat(),
        17 => fits(8, bytes),
        _ => zipped(&fits(-32, [0x3f_u8, 0x80, 0, 0].repeat(24 * 16))),
    }
}

fn zipped(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

#[test]
fn every_sample_is_valid() {
    for kind in 0..SAMPLES {
        let read = decode(&sample(kind));
        assert!(read.is_ok(), "{kind}: {}", read.unwrap_err());
    }
}

#[test]
fn plain_and_binary_grey_maps_keep_the_levels_of_their_own_depth() {
    let levels: Vec<u16> = (0..4096).collect();
    let text: Vec<String> = levels.iter().map(u16::to_string).collect();
    let plain = format!("P2 64 64 4095\n{}", text.join(" ")).into_bytes();
    let words: Vec<u8> = levels.iter().flat_map(|v| v.to_be_bytes()).collect();
    let binary = [b"P5 64 64 4095\n", &words[..]].concat();
    for bytes in [plain, binary] {
        let frame = decode(&bytes).unwrap();
        let expected: Vec<f32> = levels.iter().map(|v| f32::from(*v)).collect();
        assert_eq!(frame.values(), expected);
        assert_eq!((frame.step_adu, frame.saturation_adu), (1.0, Some(4095.0)));
    }
    let bits = decode(b"P1 3 3 1 0 1 0 1 0 1 0 1\n").unwrap();
    assert_eq!(bits.values()[..3], [0.0, 1.0, 0.0], "1 is black");
    // Without a TUPLTYPE, the decoder would read such levels as bytes.
    let untyped = b"P7\nWIDTH 3\nHEIGHT 3\nDEPTH 1\nMAXVAL 65535\nENDHDR\n012345678012345678";
    assert!(matches!(
        decode(untyped),
        Err(FrameError::Unsupported { .. })
    ));
}

#[test]
fn tiffs_of_any_integer_and_float_are_read() {
    use ::tiff::encoder::colortype::*;
    let read = |bytes: Vec<u8>| {
        let frame = decode(&bytes).unwrap();
        (frame.pixels.value(4), frame.step_adu, frame.saturation_adu)
    };
    let mut values = [1_i8; 9];
    values[4] = -7;
    assert_eq!(
        read(tiff_of::<GrayI8>(3, 3, &values)),
        (-7.0, 1.0, Some(127.0))
    );
    let words = values.map(i16::from);
    assert_eq!(
        read(tiff_of::<GrayI16>(3, 3, &words)),
        (-7.0, 1.0, Some(32767.0))
    );
    let longs = values.map(i32::from);
    assert_eq!(
        read(tiff_of::<GrayI32>(3, 3, &longs)),
        (-7.0, 1.0, Some(2147483648.0))
    );
    let unsigned = values.map(|v| u32::from(v.unsigned_abs()));
    assert_eq!(
        read(tiff_of::<Gray32>(3, 3, &unsigned)),
        (7.0, 1.0, Some(4294967296.0))
    );
    assert_eq!(
        read(tiff_of::<Gray64>(3, 3, &unsigned.map(u64::from))),
        (7.0, 1.0, None)
    );
    assert_eq!(
        read(tiff_of::<Gray64Float>(3, 3, &values.map(f64::from))),
        (-7.0, 0.0, None)
    );
    assert_eq!(
        read(tiff_of::<RGB32Float>(
            3,
            3,
            &[[3.0_f32; 27], [2.0; 27]].concat()[..27]
        )),
        (3.0, 0.0, None)
    );
}

/// Builds a TIFF that the encoder cannot write: little-endian, one strip per plane.
fn tiff_by_hand(tags: &[(u16, u32)], planes: &[&[u8]]) -> Vec<u8> {
    let entries = tags.len() + 2;
    let after = 8 + 2 + 12 * entries as u32 + 4;
    let count = planes.len() as u32;
    let data = after + 8 * count;
    let mut places = vec![data];
    planes
        .iter()
        .for_each(|plane| places.push(places[places.len() - 1] + plane.len() as u32));
    let lengths: Vec<u32> = planes.iter().map(|plane| plane.len() as u32).collect();
    let offset_or = |at: u32, only: u32| if count == 1 { only } else { at };
    let mut all: Vec<(u16, u32, u32)> = tags.iter().map(|&(tag, value)| (tag, 1, value)).collect();
    all.push((273, count, offset_or(after, data)));
    all.push((279, count, offset_or(after + 4 * count, lengths[0])));
    all.sort_unstable();
    let mut bytes = b"II*\0\x08\0\0\0".to_vec();
    bytes.extend((entries as u16).to_le_bytes());
    for (tag, count, value) in all {
        bytes.extend(tag.to_le_bytes());
        // Offsets are LONG, other values SHORT.
        let kind: u16 = if [273, 279].contains(&tag) { 4 } else { 3 };
        bytes.extend(kind.to_le_bytes());
        bytes.extend(count.to_le_bytes());
        bytes.extend(value.to_le_bytes());
    }
    bytes.extend([0; 4]);
    for number in places[..planes.len()].iter().chain(&lengths) {
        bytes.extend(number.to_le_bytes());
    }
    planes.iter().for_each(|plane| bytes.extend(*plane));
    bytes
}

#[test]
fn tiffs_of_few_bits_white_as_zero_and_planes_apart_are_read() {
    const SIZE: [(u16, u32); 2] = [(256, 5), (257, 3)];
    let tags = |more: &[(u16, u32)]| [&SIZE, more].concat();
    // Each row of five samples begins at a byte.
    let bits = tiff_by_hand(&tags(&[(258, 1), (262, 1)]), &[&[0b1010_1000, 0, 0xff]]);
    let frame = decode(&bits).unwrap();
    assert_eq!(frame.values()[..6], [1.0, 0.0, 1.0, 0.0, 1.0, 0.0]);
    assert_eq!((frame.step_adu, frame.saturation_adu), (1.0, Some(1.0)));
    let nibbles = tiff_by_hand(
        &tags(&[(258, 4), (262, 1)]),
        &[&[0x12, 0x34, 0x50, 0x67, 0x89, 0xa0, 0xbc, 0xde, 0xf0]],
    );
    let expected: Vec<f32> = (1..16).map(|v| v as f32).collect();
    assert_eq!(decode(&nibbles).unwrap().values(), expected);
    let white_is_zero = tiff_by_hand(&tags(&[(258, 8), (262, 0)]), &[&[250; 15]]);
    assert_eq!(decode(&white_is_zero).unwrap().pixels.value(0), 5.0);
    let planes = tiff_by_hand(
        &tags(&[(258, 8), (262, 2), (277, 3), (284, 2)]),
        &[&[100; 15], &[50; 15], &[20; 15]],
    );
    let luminance = decode(&planes).unwrap().pixels.value(14);
    assert!(
        (luminance - (29.9 + 29.35 + 2.28)).abs() < 1e-4,
        "{luminance}"
    );
    let grey_and_alpha = tiff_by_hand(
        &tags(&[(258, 8), (262, 1), (277, 2), (338, 2)]),
        &[&[7, 255].repeat(15)],
    );
    assert_eq!(*decode(&grey_and_alpha).unwrap().values(), [7.0; 15]);
}

#[test]
fn pages_of_a_tiff_are_counted_from_1() {
    use ::tiff::encoder::colortype::Gray8;
    let mut out = Cursor::new(Vec::new());
    let mut encoder = ::tiff::encoder::TiffEncoder::new_big(&mut out).unwrap();
    for level in 1..=3 {
        encoder.write_image::<Gray8>(3, 3, &[level; 9]).unwrap();
    }
    let bytes = out.into_inner();
    let page = |number| decode_page(&bytes, NonZeroUsize::new(number));
    assert_eq!(page(0).unwrap().pixels.value(0), 1.0);
    assert_eq!(
        [1, 2, 3].map(|n| page(n).unwrap().pixels.value(0)),
        [1.0, 2.0, 3.0]
    );
    assert_eq!(
        page(5).unwrap_err().to_string(),
        "no page 5: found 3 pages, expected at least 5"
    );
    let png = sample(8);
    let error = decode_page(&png, NonZeroUsize::new(2)).unwrap_err();
    assert_eq!(
        error.to_string(),
        "no page 2: found 1 page, expected at least 2"
    );
}

#[test]
fn gzip_is_unpacked_once_and_must_be_whole() {
    let packed = zipped(&sample(1));
    assert_eq!(decode(&packed).unwrap(), decode(&sample(1)).unwrap());
    let error = decode(&packed[..packed.len() - 9]).unwrap_err();
    assert!(error.to_string().starts_with("truncated gzip: "), "{error}");
    let error = decode(&zipped(&packed)).unwrap_err().to_string();
    assert!(
        error.starts_with("not an image: found the bytes 1f 8b") && error.contains("inside gzip"),
        "{error}"
    );
    assert!(matches!(decode(&zipped(b"")), Err(FrameError::Empty)));
}

#[test]
fn bzip2_is_unpacked_once_and_must_be_whole() {
    use std::io::Read;
    let squeezed = |bytes: &[u8]| {
        let mut packed = Vec::new();
        let mut encoder = bzip2::read::BzEncoder::new(bytes, bzip2::Compression::best());
        encoder.read_to_end(&mut packed).unwrap();
        packed
    };
    let packed = squeezed(&sample(1));
    assert_eq!(decode(&packed).unwrap(), decode(&sample(1)).unwrap());
    let error = decode(&packed[..packed.len() - 9]).unwrap_err();
    assert!(
        error.to_string().starts_with("truncated bzip2: "),
        "{error}"
    );
    let error = decode(&squeezed(&zipped(&sample(1))))
        .unwrap_err()
        .to_string();
    assert!(error.contains("inside bzip2"), "{error}");
    let mut damaged = packed.clone();
    damaged[packed.len() / 2] ^= 0x55;
    let error = decode(&damaged).unwrap_err().to_string();
    assert!(error.contains("bzip2"), "{error}");
}

#[test]
fn infinities_have_no_value_and_alone_make_no_frame() {
    use ::tiff::encoder::colortype::Gray32Float;
    let mut data = [1.5_f32; 9];
    data[..2].copy_from_slice(&[f32::INFINITY, f32::NEG_INFINITY]);
    let frame = decode(&tiff_of::<Gray32Float>(3, 3, &data)).unwrap();
    assert!(frame.pixels.value(0).is_nan() && frame.pixels.value(1).is_nan());
    let error = decode(&tiff_of::<Gray32Float>(3, 3, &[f32::INFINITY; 9])).unwrap_err();
    assert!(matches!(error, FrameError::NoValues), "{error}");
}

#[test]
fn an_endless_stream_is_refused_if_no_image_or_too_long() {
    let zeros = read_stream(std::io::repeat(0), None, &mut Buffers::new()).unwrap_err();
    assert!(matches!(zeros, FrameError::UnknownFormat { .. }), "{zeros}");
    let nothing = read_stream(std::io::empty(), None, &mut Buffers::new()).unwrap_err();
    assert!(matches!(nothing, FrameError::Empty), "{nothing}");
    let endless = || (&b"P5 3 3 255\n"[..]).chain(std::io::repeat(7));
    let budget = || ReadBudget::new(MemoryLimit::of_bytes(30_000), Interrupt::default());
    let error = read_limited(endless(), 0, &budget(), &mut Vec::new()).unwrap_err();
    assert!(matches!(error, FrameError::OutOfMemory { .. }), "{error}");
    for length in [20, 4096, 5000, 10_000] {
        let mut bytes = Vec::new();
        read_limited(endless().take(length), 99, &budget(), &mut bytes).unwrap();
        assert_eq!(bytes.len() as u64, length);
    }
}

#[test]
fn contiguous_and_scattered_words_are_read_alike() {
    const TAGS: [(u16, u32); 5] = [(256, 5), (257, 3), (258, 16), (262, 1), (278, 1)];
    let levels: [u16; 15] = std::array::from_fn(|i| 4000 * i as u16 + 1);
    let expected: Vec<f32> = levels.map(f32::from).into();
    let bytes: Vec<u8> = levels
        .iter()
        .flat_map(|level| level.to_le_bytes())
        .collect();
    let strips: Vec<&[u8]> = bytes.chunks(10).collect();
    let whole = tiff_by_hand(&TAGS, &strips);
    assert_eq!(decode(&whole).unwrap().values(), expected);
    assert_eq!(decode(&whole).unwrap().saturation_adu, Some(65535.0));
    // Swaps the last two strips, in the file and in the table.
    let mut pieces = tiff_by_hand(&TAGS, &[strips[0], strips[2], strips[1]]);
    let table = pieces.len() - 30 - 24;
    let (left, right) = pieces[table + 4..table + 12].split_at_mut(4);
    left.swap_with_slice(right);
    assert_eq!(decode(&pieces).unwrap().values(), expected);
    // With white as 0, levels are inverted.
    let white_is_zero = TAGS.map(|(tag, value)| (tag, if tag == 262 { 0 } else { value }));
    let inverted = decode(&tiff_by_hand(&white_is_zero, &strips)).unwrap();
    assert_eq!(inverted.pixels.value(1), 65535.0 - expected[1]);
    assert!(decode(&whole[..whole.len() - 1]).is_err(), "cut short");
}

#[test]
fn words_of_either_byte_order_are_read_alike() {
    let levels: [u16; 9] = std::array::from_fn(|i| 300 * i as u16 + 7);
    let mut bytes = b"MM\0*\0\0\0\x08\0\x06".to_vec();
    for (tag, value) in [
        (256u16, 3u16),
        (257, 3),
        (258, 16),
        (262, 1),
        (273, 86),
        (279, 18),
    ] {
        bytes.extend(
            [tag, 3, 0, 1, value, 0]
                .iter()
                .flat_map(|word| word.to_be_bytes()),
        );
    }
    bytes.extend([0; 4]);
    assert_eq!(bytes.len(), 86);
    bytes.extend(levels.iter().flat_map(|level| level.to_be_bytes()));
    assert_eq!(*decode(&bytes).unwrap().values(), levels.map(f32::from));
}

#[test]
fn blocks_have_the_mean_of_their_pixels_that_have_a_value() {
    let pixels: Vec<f32> = (0..7 * 5).map(|i| i as f32).collect();
    let mut frame = Frame::new(7, 5, pixels).unwrap();
    let binned = frame.binned(2);
    assert_eq!((binned.width, binned.height), (3, 2));
    assert_eq!(
        binned.pixels.values().collect::<Vec<_>>(),
        [4.0, 6.0, 8.0, 18.0, 20.0, 22.0]
    );
    frame.values_mut()[0] = f32::NAN;
    assert_eq!(frame.binned(2).pixels.value(0), (1.0 + 7.0 + 8.0) / 3.0);
    for index in [1, 7, 8] {
        frame.values_mut()[index] = f32::NAN;
    }
    assert!(frame.binned(2).pixels.value(0).is_nan());
}
