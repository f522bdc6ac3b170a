//! Writes a frame as a TIFF file with Exif attributes.

use crate::frame::image::Frame;
use std::io::{self, Seek, Write};
use tiff::encoder::{Compression, DeflateLevel, Predictor, Rational, TiffEncoder, colortype};
use tiff::tags::Tag;
use tiff::{TiffError, TiffResult};

/// How pixels are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum TiffSamples {
    /// Whole levels from 0 to 255.
    Unsigned8,
    /// Whole levels from 0 to 65535.
    Unsigned16,
    /// Floats of 32 bits.
    Float32,
}

/// How to write a TIFF file.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub struct TiffOptions<'a> {
    /// How pixels are stored.
    pub samples: TiffSamples,
    /// Whether to compress them, with deflate and horizontal differencing.
    pub compressed: bool,
    /// Text for the attribute `ImageDescription`. Characters outside ASCII become question marks.
    pub description: &'a str,
}

impl TiffOptions<'_> {
    /// Pixels of this kind, uncompressed, without a description.
    pub const fn new(samples: TiffSamples) -> Self {
        Self {
            samples,
            compressed: false,
            description: "",
        }
    }
}

/// Writes the pixels of `frame`, and of its metadata the date, exposure, focal length and pixel
/// size. A level outside the range of the samples is clipped; a fraction is rounded.
///
/// # Errors
/// Those of `writer`, and of files that would have more than 4 GB.
pub fn write_tiff(
    writer: impl Write + Seek,
    frame: &Frame,
    options: &TiffOptions,
) -> io::Result<()> {
    encode(writer, frame, options).map_err(|error| match error {
        TiffError::IoError(error) => error,
        error => io::Error::other(error),
    })
}

fn encode(writer: impl Write + Seek, frame: &Frame, options: &TiffOptions) -> TiffResult<()> {
    let mut encoder = TiffEncoder::new(writer)?;
    if options.compressed {
        encoder = encoder.with_compression(Compression::Deflate(DeflateLevel::Best));
        if options.samples != TiffSamples::Float32 {
            encoder = encoder.with_predictor(Predictor::Horizontal);
        }
    }
    let exif = write_exif(&mut encoder, frame)?;
    let whole = |pixel: &f32| pixel.round();
    match options.samples {
        TiffSamples::Unsigned8 => {
            let levels: Vec<u8> = frame.values().iter().map(|p| whole(p) as u8).collect();
            write_image::<colortype::Gray8, _, _>(encoder, frame, options, exif, &levels)
        }
        TiffSamples::Unsigned16 => {
            let levels: Vec<u16> = frame.values().iter().map(|p| whole(p) as u16).collect();
            write_image::<colortype::Gray16, _, _>(encoder, frame, options, exif, &levels)
        }
        TiffSamples::Float32 => write_image::<colortype::Gray32Float, _, _>(
            encoder,
            frame,
            options,
            exif,
            &frame.values(),
        ),
    }
}

/// Writes the Exif attributes and returns their offset in the file.
fn write_exif<W: Write + Seek>(encoder: &mut TiffEncoder<W>, frame: &Frame) -> TiffResult<u32> {
    const EXPOSURE_TIME: u16 = 0x829A;
    const DATE_TIME_ORIGINAL: u16 = 0x9003;
    const OFFSET_TIME_ORIGINAL: u16 = 0x9011;
    const FOCAL_LENGTH: u16 = 0x920A;
    const FOCAL_PLANE_X_RESOLUTION: u16 = 0xA20E;
    const FOCAL_PLANE_Y_RESOLUTION: u16 = 0xA20F;
    const FOCAL_PLANE_RESOLUTION_UNIT: u16 = 0xA210;
    const MILLIMETRE: u16 = 4;
    const UM_PER_MM: f64 = 1000.0;
    let metadata = &frame.metadata;
    let mut exif = encoder.extra_directory()?;
    let mut number = |tag: u16, value: f64| exif.write_tag(Tag::Unknown(tag), rational(value));
    if let Some(exposure_s) = metadata.exposure_s {
        number(EXPOSURE_TIME, exposure_s)?;
    }
    if let Some(focal_length_mm) = metadata.focal_length_mm {
        number(FOCAL_LENGTH, focal_length_mm)?;
    }
    if let Some(pixel_size_um) = metadata.pixel_size_um {
        let per_mm = UM_PER_MM / pixel_size_um;
        number(FOCAL_PLANE_X_RESOLUTION, per_mm)?;
        number(FOCAL_PLANE_Y_RESOLUTION, per_mm)?;
        exif.write_tag(Tag::Unknown(FOCAL_PLANE_RESOLUTION_UNIT), MILLIMETRE)?;
    }
    if let Some(date) = metadata.date {
        // Exif has whole seconds, and colons in the date, too.
        let iso = date.to_iso();
        let (day, rest) = iso.split_once('T').unwrap_or((&iso, "00:00:00"));
        let time = rest.get(..8).unwrap_or(rest);
        let text = format!("{} {time}", day.replace('-', ":"));
        exif.write_tag(Tag::Unknown(DATE_TIME_ORIGINAL), text.as_str())?;
        exif.write_tag(Tag::Unknown(OFFSET_TIME_ORIGINAL), "+00:00")?;
    }
    Ok(exif.finish_with_offsets()?.offset)
}

fn write_image<C, W, T>(
    mut encoder: TiffEncoder<W>,
    frame: &Frame,
    options: &TiffOptions,
    exif: u32,
    pixels: &[T],
) -> TiffResult<()>
where
    C: colortype::ColorType<Inner = T>,
    W: Write + Seek,
    [T]: tiff::encoder::TiffValue,
{
    let side = |pixels: usize| u32::try_from(pixels).map_err(TiffError::from);
    let mut image = encoder.new_image::<C>(side(frame.width)?, side(frame.height)?)?;
    let directory = image.encoder();
    if !options.description.is_empty() {
        let is_text = |c: char| if c.is_ascii() && c != '\0' { c } else { '?' };
        let ascii: String = options.description.chars().map(is_text).collect();
        directory.write_tag(Tag::ImageDescription, ascii.as_str())?;
    }
    directory.write_tag(Tag::Software, "starpipe")?;
    directory.write_tag(Tag::ExifDirectory, exif)?;
    image.write_data(pixels)
}

/// The fraction nearest to a number above 0.
fn rational(value: f64) -> Rational {
    const MAX: f64 = 4e9;
    let mut d = 1u32;
    while value * f64::from(d) < MAX / 10.0 && d < 1_000_000_000 {
        d *= 10;
    }
    Rational {
        n: (value * f64::from(d)).round() as u32,
        d,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::{FrameMetadata, decode};
    use std::io::Cursor;

    fn frame() -> Frame<'static> {
        let pixels = (0..12).map(|i| (i * 20) as f32).collect();
        let metadata = FrameMetadata {
            date: "2024-03-05T21:30:15Z".parse().ok(),
            exposure_s: Some(0.04),
            pixel_size_um: Some(5.5),
            focal_length_mm: Some(16.25),
            ..FrameMetadata::default()
        };
        Frame::new(4, 3, pixels).unwrap().with_metadata(metadata)
    }

    #[test]
    fn what_is_written_is_read_back() {
        let frame = frame();
        for samples in [
            TiffSamples::Unsigned8,
            TiffSamples::Unsigned16,
            TiffSamples::Float32,
        ] {
            for compressed in [false, true] {
                let mut file = Cursor::new(Vec::new());
                let options = TiffOptions {
                    samples,
                    compressed,
                    // TIFF's text is ASCII.
                    description: "two\nlines of 12° each",
                };
                write_tiff(&mut file, &frame, &options).unwrap();
                let back = decode(file.get_ref()).unwrap();
                assert_eq!(back.pixels, frame.pixels);
                let (found, wanted) = (&back.metadata, &frame.metadata);
                assert_eq!(
                    (found.exposure_s, found.date),
                    (wanted.exposure_s, wanted.date)
                );
                assert_eq!(found.focal_length_mm, wanted.focal_length_mm);
                assert!((found.pixel_size_um.unwrap() - 5.5).abs() < 1e-6);
                assert!(found.ignored.is_empty(), "{:?}", found.ignored);
            }
        }
    }

    #[test]
    fn a_level_that_does_not_fit_becomes_the_nearest() {
        let levels = vec![-3.0, 300.0, 70_000.0, 12.6, 0.0, 1.0, 2.0, 3.0, 4.0];
        let frame = Frame::new(3, 3, levels).unwrap();
        let mut file = Cursor::new(Vec::new());
        let options = TiffOptions {
            samples: TiffSamples::Unsigned16,
            compressed: false,
            description: "",
        };
        write_tiff(&mut file, &frame, &options).unwrap();
        let back = decode(file.get_ref()).unwrap();
        assert_eq!(back.values()[..4], [0.0, 300.0, 65535.0, 13.0]);
    }

    #[test]
    fn ratios_are_near_and_fit_into_32_bits() {
        for value in [1e-6, 0.04, 1.0, 181.818_181, 5e4, 1e6] {
            let Rational { n, d } = rational(value);
            let found = f64::from(n) / f64::from(d);
            assert!((found / value - 1.0).abs() < 1e-3, "{value}: {found}");
        }
    }
}
