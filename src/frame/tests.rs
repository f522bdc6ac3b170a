use super::*;
use proptest::prelude::*;
use std::io::Cursor;

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

fn encoded_by_image(image: &image::DynamicImage, format: image::ImageFormat) -> Vec<u8> {
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
    assert_eq!(frame.pixels[5], 5001.0);
    assert_eq!(frame.step_adu, 1.0);
    assert_eq!(frame.saturation_adu, Some(65535.0));
}

#[test]
fn twelve_bits_stored_in_sixteen_are_told_from_their_levels() {
    use ::tiff::encoder::colortype::Gray16;
    let data: Vec<u16> = (0..12).map(|i| 16 * (i + 3)).collect();
    let frame = decode(&tiff_of::<Gray16>(4, 3, &data)).unwrap();
    assert_eq!(frame.step_adu, 16.0);
    assert_eq!(frame.saturation_adu, Some(65520.0));
}

#[test]
fn colour_becomes_luminance_and_one_full_channel_saturates_a_pixel() {
    use ::tiff::encoder::colortype::RGB8;
    let mut data = vec![10u8; 27];
    data[..3].copy_from_slice(&[100, 50, 20]);
    data[3..6].copy_from_slice(&[255, 50, 20]);
    let frame = decode(&tiff_of::<RGB8>(3, 3, &data)).unwrap();
    assert!((frame.pixels[0] - (29.9 + 29.35 + 2.28)).abs() < 1e-4);
    assert_eq!(frame.pixels[1], 255.0);
    assert_eq!(frame.pixels[2], 10.0);
}

#[test]
fn nan_pixels_of_a_float_tiff_stay_nan() {
    use ::tiff::encoder::colortype::Gray32Float;
    let mut data = vec![1.5f32; 9];
    data[4] = f32::NAN;
    let frame = decode(&tiff_of::<Gray32Float>(3, 3, &data)).unwrap();
    assert!(frame.pixels[4].is_nan());
    assert_eq!(frame.saturation_adu, None);
    let all_nan = tiff_of::<Gray32Float>(3, 3, &[f32::NAN; 9]);
    assert!(matches!(decode(&all_nan), Err(FrameError::NoValues)));
}

#[test]
fn png_and_jpeg_are_read_in_grey_and_colour() {
    use image::{DynamicImage, ImageBuffer, ImageFormat, Luma, Rgba};
    let grey16 = DynamicImage::ImageLuma16(ImageBuffer::from_fn(5, 4, |x, _| {
        Luma([1000 * x as u16 + 7])
    }));
    let frame = decode(&encoded_by_image(&grey16, ImageFormat::Png)).unwrap();
    assert_eq!(frame.pixels[3], 3007.0);
    let rgba = DynamicImage::ImageRgba8(ImageBuffer::from_fn(5, 4, |x, _| {
        Rgba([x as u8, 20, 30, 9])
    }));
    let frame = decode(&encoded_by_image(&rgba, ImageFormat::Png)).unwrap();
    assert!((frame.pixels[2] - (2.0 * 0.299 + 11.74 + 3.42)).abs() < 1e-4);
    let grey8 = DynamicImage::ImageLuma8(ImageBuffer::from_pixel(16, 8, Luma([40])));
    let frame = decode(&encoded_by_image(&grey8, ImageFormat::Jpeg)).unwrap();
    assert_eq!((frame.width, frame.height, frame.pixels[17]), (16, 8, 40.0));
}

#[test]
fn what_is_no_image_says_what_was_found_and_expected() {
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
    let grey = image::DynamicImage::ImageLuma8(image::ImageBuffer::from_fn(64, 64, |x, y| {
        image::Luma([(x * 7 + y * 13) as u8])
    }));
    for format in [image::ImageFormat::Png, image::ImageFormat::Jpeg] {
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
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn arbitrary_bytes_never_panic(kind in 0usize..7, tail in proptest::collection::vec(any::<u8>(), 0..400)) {
        let heads: [&[u8]; 7] = [b"II*\0\x08\0\0\0", b"MM\0*\0\0\0\x08", b"II+\0", b"\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR", b"\xff\xd8\xff\xe0", b"\xff\xd8\xff\xc0\0\x0b\x08", b""];
        let mut bytes = heads[kind].to_vec();
        bytes.extend(tail);
        let _ = decode(&bytes);
    }

    #[test]
    fn damaged_files_never_panic(position in 0usize..700, value: u8, kind in 0usize..3) {
        use image::{DynamicImage, ImageBuffer, ImageFormat, Luma};
        let grey = DynamicImage::ImageLuma8(ImageBuffer::from_fn(24, 16, |x, y| Luma([(x * y) as u8])));
        let data: Vec<u8> = (0..24 * 16).map(|i| i as u8).collect();
        let mut bytes = match kind {
            0 => tiff_of::<::tiff::encoder::colortype::Gray8>(24, 16, &data),
            1 => encoded_by_image(&grey, ImageFormat::Png),
            _ => encoded_by_image(&grey, ImageFormat::Jpeg),
        };
        let position = position % bytes.len();
        bytes[position] = value;
        let _ = decode(&bytes);
    }
}
