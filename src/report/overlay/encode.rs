//! Pictures as files.

use crate::frame::OVERLAY_TEXT;
use image::RgbImage;
use image::codecs::jpeg::JpegEncoder;
use std::io;

/// Quality of pictures as JPEG counts it.
const JPEG_QUALITY: u8 = 85;

/// The picture as PNG, fast rather than small, with the mark of overlays.
pub(super) fn png(picture: &RgbImage) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let (width, height) = picture.dimensions();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    // Filters do not help with noise; equal grey levels compress without them.
    encoder.set_filter(png::Filter::NoFilter);
    encoder.set_deflate_compression(png::DeflateCompression::Level(1));
    let (keyword, text) = OVERLAY_TEXT;
    encoder.add_text_chunk(keyword.to_owned(), text.to_owned())?;
    encoder.write_header()?.write_image_data(picture)?;
    Ok(bytes)
}

/// The picture as JPEG.
pub(in crate::report) fn jpeg(picture: &RgbImage) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let encoder = JpegEncoder::new_with_quality(&mut bytes, JPEG_QUALITY);
    picture
        .write_with_encoder(encoder)
        .map_err(io::Error::other)?;
    Ok(bytes)
}

/// The picture as JPEG, with the mark of overlays as a comment.
pub(super) fn marked_jpeg(picture: &RgbImage) -> io::Result<Vec<u8>> {
    /// Start of the picture, after which comments may be.
    const START: usize = 2;
    const COMMENT: [u8; 2] = [0xff, 0xfe];
    let (_, text) = OVERLAY_TEXT;
    let length = u16::try_from(text.len() + 2).map_err(io::Error::other)?;
    let mut bytes = jpeg(picture)?;
    let comment = [&COMMENT[..], &length.to_be_bytes(), text.as_bytes()].concat();
    bytes.splice(START..START, comment);
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::is_overlay;

    #[test]
    fn files_are_pictures_and_marked() {
        let picture = RgbImage::from_fn(30, 20, |x, y| image::Rgb([x as u8, y as u8, 90]));
        for bytes in [png(&picture).unwrap(), marked_jpeg(&picture).unwrap()] {
            assert!(is_overlay(&bytes));
            let read = image::load_from_memory(&bytes).unwrap().into_rgb8();
            assert_eq!(read.dimensions(), (30, 20));
        }
        assert!(!is_overlay(&jpeg(&picture).unwrap()));
    }
}
