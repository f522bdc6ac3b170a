//! The colors of a picture, to draw it as it is: measurements use luminance alone.

use super::error::FrameError;
use super::format::FrameFormat;
use super::image::{Frame, check_size};
use super::limits::MAX_FILE_BYTES;
use super::read_budget::ReadBudget;
use super::reader::{Buffers, no_panic};
use crate::base::files;
use crate::base::size::Size;
use image::{DynamicImage, ImageReader};
use std::borrow::Cow;
use std::io::{Cursor, Read};
use std::path::Path;
use tiff::ColorType;
use tiff::decoder::{Decoder, DecodingResult};

/// The colors of a frame's pixels, in the order of its pixels.
#[derive(Debug, Clone, PartialEq)]
pub struct Colors {
    /// Red, green and blue, row-major; 65535 is full scale.
    pub(crate) pixels: Vec<[u16; 3]>,
    /// The step between two levels.
    pub(crate) step: f32,
}

impl Colors {
    /// The colors of the pixels of `frame`, in their order; 65535 is full scale. `None` where they are not
    /// as many.
    pub fn new(frame: &Frame, pixels: Vec<[u16; 3]>) -> Option<Self> {
        (pixels.len() == frame.size().pixels()).then(|| Self {
            step: f32::from(step_of(&pixels)),
            pixels,
        })
    }

    /// The colors in the file `path`, of which `frame` was read: of a PNG, JPEG, BMP, PNM or TIFF file with one
    /// color image. `None` where there are none, or where they cannot be read or held: `frame` was.
    pub fn read(path: &Path, frame: &Frame, buffers: &mut Buffers) -> Option<Self> {
        let mut bytes = Vec::new();
        let file = files::open(path).ok()?;
        file.take(MAX_FILE_BYTES).read_to_end(&mut bytes).ok()?;
        Self::decode(&bytes, frame, buffers)
    }

    /// [`Self::read`] for the content of a file.
    pub fn decode(bytes: &[u8], frame: &Frame, buffers: &mut Buffers) -> Option<Self> {
        let budget = buffers.budget(bytes.len()).ok()?;
        let (size, pixels) = no_panic(|| decode(bytes, &budget)).ok()??;
        if size != frame.stored_size() {
            return None;
        }
        let mut pixels = Cow::Owned(pixels);
        frame.metadata.orientation.turn(&mut pixels, size.width);
        Self::new(frame, pixels.into_owned())
    }
}

/// The colors in the rows of a file.
type Decoded = Option<(Size, Vec<[u16; 3]>)>;

fn decode(bytes: &[u8], budget: &ReadBudget) -> Result<Decoded, FrameError> {
    Ok(match FrameFormat::detect(bytes) {
        Some(FrameFormat::Png | FrameFormat::Jpeg | FrameFormat::Bmp | FrameFormat::Pnm) => {
            of_picture(bytes, budget)?
        }
        Some(FrameFormat::Tiff) => of_tiff(bytes, budget)?,
        _ => None,
    })
}

/// Refuses a picture that cannot be held twice, as it is decoded and as it is kept.
fn check(size: Size, budget: &ReadBudget) -> Result<(), FrameError> {
    check_size(size.width, size.height)?;
    budget.check_image(size, 2 * size_of::<[u16; 3]>())
}

fn of_picture(bytes: &[u8], budget: &ReadBudget) -> Result<Decoded, FrameError> {
    let reader = || ImageReader::new(Cursor::new(bytes)).with_guessed_format();
    let Some((width, height)) = reader().ok().and_then(|r| r.into_dimensions().ok()) else {
        return Ok(None);
    };
    let size = Size::new(width as usize, height as usize);
    check(size, budget)?;
    let Some(picture) = reader().ok().and_then(|r| r.decode().ok()) else {
        return Ok(None);
    };
    if !picture.color().has_color() {
        return Ok(None);
    }
    let pixels = match picture {
        DynamicImage::ImageRgb8(picture) => wide(picture.as_raw()),
        other => other.into_rgb16().as_raw().as_chunks().0.to_vec(),
    };
    Ok(Some((size, pixels)))
}

fn of_tiff(bytes: &[u8], budget: &ReadBudget) -> Result<Decoded, FrameError> {
    let Ok(mut decoder) = Decoder::new(Cursor::new(bytes)) else {
        return Ok(None);
    };
    let (Ok((width, height)), Ok(ColorType::RGB(8 | 16))) =
        (decoder.dimensions(), decoder.colortype())
    else {
        return Ok(None);
    };
    let size = Size::new(width as usize, height as usize);
    check(size, budget)?;
    let pixels = match decoder.read_image() {
        Ok(DecodingResult::U8(levels)) => wide(&levels),
        Ok(DecodingResult::U16(levels)) => levels.as_chunks().0.to_vec(),
        _ => return Ok(None),
    };
    Ok((pixels.len() == size.pixels()).then_some((size, pixels)))
}

/// Levels of eight bits on the scale of sixteen.
const SCALE: u16 = u16::MAX / u8::MAX as u16;

/// The step between two levels: that of eight bits, or 1.
fn step_of(pixels: &[[u16; 3]]) -> u16 {
    let has_eight_bits = |level: &u16| level.is_multiple_of(SCALE);
    if pixels.iter().flatten().all(has_eight_bits) {
        SCALE
    } else {
        1
    }
}

/// Colors of eight bits on the scale of sixteen.
fn wide(levels: &[u8]) -> Vec<[u16; 3]> {
    let (pixels, _) = levels.as_chunks::<3>();
    let wide = |pixel: &[u8; 3]| pixel.map(|level| SCALE * u16::from(level));
    pixels.iter().map(wide).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{ImageFormat, RgbImage};
    use std::fs;
    use tiff::encoder::{TiffEncoder, colortype};
    use tiff::tags::Tag;

    const WIDTH: u32 = 12;
    const HEIGHT: u32 = 9;

    fn picture() -> RgbImage {
        RgbImage::from_fn(WIDTH, HEIGHT, |x, y| {
            image::Rgb([10 * x as u8, 20 * y as u8, 7])
        })
    }

    fn colors_of(bytes: &[u8]) -> Option<(Colors, Size)> {
        let file = tempfile::NamedTempFile::new().unwrap();
        fs::write(file.path(), bytes).unwrap();
        let frame = crate::frame::decode(bytes).unwrap();
        let colors = Colors::read(file.path(), &frame, &mut Buffers::new())?;
        Some((colors, frame.size()))
    }

    #[test]
    fn colors_are_those_of_the_file() {
        for format in [ImageFormat::Png, ImageFormat::Bmp, ImageFormat::Pnm] {
            let mut bytes = Cursor::new(Vec::new());
            picture().write_to(&mut bytes, format).unwrap();
            let (colors, _) = colors_of(&bytes.into_inner()).unwrap();
            assert_eq!(colors.pixels.len(), (WIDTH * HEIGHT) as usize);
            assert_eq!(
                colors.pixels[2 * WIDTH as usize + 3],
                [30, 40, 7].map(|v: u16| 257 * v)
            );
        }
    }

    #[test]
    fn the_colors_of_a_turned_tiff_lie_as_its_picture() {
        let mut bytes = Cursor::new(Vec::new());
        let mut encoder = TiffEncoder::new(&mut bytes).unwrap();
        let mut image = encoder
            .new_image::<colortype::RGB16>(WIDTH, HEIGHT)
            .unwrap();
        image.encoder().write_tag(Tag::Orientation, 6_u16).unwrap();
        let levels: Vec<u16> = picture().as_raw().iter().map(|&v| u16::from(v)).collect();
        image.write_data(&levels).unwrap();
        let (colors, size) = colors_of(&bytes.into_inner()).unwrap();
        assert_eq!(size, Size::new(HEIGHT as usize, WIDTH as usize));
        // The first row is the right side of the picture.
        assert_eq!(colors.pixels[HEIGHT as usize - 1], [0, 0, 7]);
        assert_eq!(colors.pixels[2 * HEIGHT as usize - 1], [10, 0, 7]);
    }

    #[test]
    fn a_grey_picture_has_none() {
        let mut bytes = Cursor::new(Vec::new());
        let grey = DynamicImage::ImageRgb8(picture()).to_luma8();
        grey.write_to(&mut bytes, ImageFormat::Png).unwrap();
        assert!(colors_of(&bytes.into_inner()).is_none());
    }
}
