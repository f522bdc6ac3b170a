//! The image as the detector gave it, and the files that hold one.
//!
//! file or bytes → [`Frame`]: grey levels as `f32` at the file's full depth, row-major, (0, 0) the
//! centre of the first stored pixel, no flip.
//!
//! 1. The kind of file is told from its first bytes, never from its name.
//! 2. The size in the header is checked against [`MAX_PIXELS`] before anything is allocated.
//! 3. Colour becomes luminance with the weights of ITU-R BT.601 ([`LUMINANCE_WEIGHTS`]): they undo
//!    JPEG's own colour transform, so that a colour JPEG gives back the luma that it stores.
//! 4. A colour pixel is saturated where any of its channels is; it then takes the full scale as its
//!    value, since its luminance is not known.
//!
//! Caveats: transparency is ignored; JPEG's gamma is not undone, so fluxes from JPEG are not linear.

mod raster;
mod tiff;

use std::path::{Path, PathBuf};

/// The most pixels that a frame may have; beyond it, reading refuses before it allocates.
pub const MAX_PIXELS: usize = 200_000_000;

/// The shortest side that a frame may have, in pixels: no star can be told from its background on less.
pub const MIN_SIDE_PX: usize = 3;

/// The parts of red, green and blue in luminance: ITU-R BT.601, as in JPEG.
pub const LUMINANCE_WEIGHTS: [f32; 3] = [0.299, 0.587, 0.114];

/// The largest unit of levels looked for where a file holds fewer bits than its words: 2¹².
const MAX_STEP: u32 = 1 << 12;

/// One image of light intensities.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Row-major, `height * width`, in the file's own units (ADU); colour has become luminance.
    /// NaN marks a pixel without a value.
    pub pixels: Vec<f32>,
    /// The difference between neighbouring levels that the file can express (1 for integers, 0 for floats), in ADU.
    pub step_adu: f32,
    /// The level from which on a pixel is saturated, in ADU, where the format has one.
    pub saturation_adu: Option<f32>,
}

impl Frame {
    /// A frame from `pixels`, row-major, `height * width`, in ADU, without quantisation or saturation.
    ///
    /// Pixels may be NaN (no value); infinities become NaN.
    /// # Errors
    /// [`FrameError::WrongLength`], [`FrameError::TooSmall`], [`FrameError::TooLarge`] where the sizes do
    /// not fit, [`FrameError::NoValues`] where no pixel has a value.
    pub fn new(width: usize, height: usize, mut pixels: Vec<f32>) -> Result<Self, FrameError> {
        check_size(width, height)?;
        if pixels.len() != width * height {
            return Err(FrameError::WrongLength {
                expected: width * height,
                found: pixels.len(),
            });
        }
        let mut any_value = false;
        for pixel in &mut pixels {
            if pixel.is_infinite() {
                *pixel = f32::NAN;
            }
            any_value |= !pixel.is_nan();
        }
        if !any_value {
            return Err(FrameError::NoValues);
        }
        Ok(Self {
            width,
            height,
            pixels,
            step_adu: 0.0,
            saturation_adu: None,
        })
    }

    /// The same frame with the format's level difference and full scale, in ADU.
    #[must_use]
    pub fn with_levels(mut self, step_adu: f32, saturation_adu: Option<f32>) -> Self {
        self.step_adu = step_adu;
        self.saturation_adu = saturation_adu;
        self
    }
}

/// The kinds of file that can be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrameFormat {
    /// Tagged Image File Format, also BigTIFF.
    Tiff,
    /// Portable Network Graphics.
    Png,
    /// JPEG (JFIF or Exif).
    Jpeg,
}

impl std::fmt::Display for FrameFormat {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Tiff => "TIFF",
            Self::Png => "PNG",
            Self::Jpeg => "JPEG",
        })
    }
}

/// Why a frame could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FrameError {
    /// Something is wrong with a file.
    #[error("{}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: Box<FrameError>,
    },
    /// The file cannot be opened or read.
    #[error("cannot be read: {0}")]
    Io(#[from] std::io::Error),
    /// There are no bytes.
    #[error("empty: found 0 bytes, expected an image (TIFF, PNG or JPEG)")]
    Empty,
    /// The first bytes are of no known image format.
    #[error("not an image: found {found} at byte 0, expected TIFF, PNG or JPEG")]
    UnknownFormat {
        /// The first bytes, as text where they are text.
        found: String,
    },
    /// The data end before the image does.
    #[error("truncated {format}: found {found_bytes} bytes, expected more ({detail})")]
    Truncated {
        /// The kind of file.
        format: FrameFormat,
        /// The bytes there are.
        found_bytes: usize,
        /// What was being read.
        detail: String,
    },
    /// The data break the format's rules.
    #[error("damaged {format}: {detail}")]
    Malformed {
        /// The kind of file.
        format: FrameFormat,
        /// What was found, and where.
        detail: String,
    },
    /// A valid file of a kind that is not supported.
    #[error("unsupported {format}: found {found}, expected {expected}")]
    Unsupported {
        /// The kind of file.
        format: FrameFormat,
        /// What the file holds.
        found: String,
        /// What is supported.
        expected: &'static str,
    },
    /// More pixels than [`MAX_PIXELS`].
    #[error("too large: found {width} x {height} pixels, expected at most {MAX_PIXELS} in all")]
    TooLarge {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// A side shorter than [`MIN_SIDE_PX`].
    #[error(
        "too small: found {width} x {height} pixels, expected at least {MIN_SIDE_PX} on each side"
    )]
    TooSmall {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// The number of pixels is not width times height.
    #[error("found {found} pixels, expected {expected} (width times height)")]
    WrongLength {
        /// Width times height.
        expected: usize,
        /// The pixels there are.
        found: usize,
    },
    /// No pixel has a value.
    #[error("no pixel has a value: found only NaN, expected numbers")]
    NoValues,
}

/// Reads the image in the file `path`, whatever its name ends in.
/// # Errors
/// [`FrameError::File`] with the path, around what is wrong.
pub fn read(path: impl AsRef<Path>) -> Result<Frame, FrameError> {
    let path = path.as_ref();
    let in_file = |source: FrameError| FrameError::File {
        path: path.to_path_buf(),
        source: Box::new(source),
    };
    let bytes = std::fs::read(path).map_err(|e| in_file(e.into()))?;
    decode(&bytes).map_err(in_file)
}

/// Decodes the image in `bytes`; the format is told from the first of them.
/// # Errors
/// [`FrameError`], never [`FrameError::File`].
pub fn decode(bytes: &[u8]) -> Result<Frame, FrameError> {
    if bytes.is_empty() {
        return Err(FrameError::Empty);
    }
    match format_of(bytes) {
        Some(FrameFormat::Tiff) => tiff::decode(bytes),
        Some(FrameFormat::Png) => raster::decode_png(bytes),
        Some(FrameFormat::Jpeg) => raster::decode_jpeg(bytes),
        None => Err(FrameError::UnknownFormat {
            found: first_bytes(bytes),
        }),
    }
}

/// The format whose signature `bytes` begin with.
fn format_of(bytes: &[u8]) -> Option<FrameFormat> {
    const SIGNATURES: [(&[u8], FrameFormat); 6] = [
        (b"II*\0", FrameFormat::Tiff),
        (b"MM\0*", FrameFormat::Tiff),
        (b"II+\0", FrameFormat::Tiff),
        (b"MM\0+", FrameFormat::Tiff),
        (b"\x89PNG\r\n\x1a\n", FrameFormat::Png),
        (b"\xff\xd8\xff", FrameFormat::Jpeg),
    ];
    SIGNATURES
        .iter()
        .find(|(signature, _)| bytes.starts_with(signature))
        .map(|&(_, format)| format)
}

/// The first bytes for an error message: quoted where they are text, else in hexadecimal.
fn first_bytes(bytes: &[u8]) -> String {
    let head = &bytes[..bytes.len().min(8)];
    if head
        .iter()
        .all(|b| b.is_ascii_graphic() || b.is_ascii_whitespace())
    {
        return format!("the text {:?}", String::from_utf8_lossy(head));
    }
    let hex: Vec<String> = head.iter().map(|b| format!("{b:02x}")).collect();
    format!("the bytes {}", hex.join(" "))
}

/// Refuses sizes that are too small or too large, before anything is allocated.
fn check_size(width: usize, height: usize) -> Result<(), FrameError> {
    if width < MIN_SIDE_PX || height < MIN_SIDE_PX {
        return Err(FrameError::TooSmall { width, height });
    }
    match width.checked_mul(height) {
        Some(count) if count <= MAX_PIXELS => Ok(()),
        _ => Err(FrameError::TooLarge { width, height }),
    }
}

/// Samples of one frame as a reader decoded them.
struct Samples<'a, T> {
    width: usize,
    height: usize,
    /// Interleaved, `height * width * channels`.
    values: &'a [T],
    /// 1 grey, 2 grey and alpha, 3 colour, 4 colour and alpha.
    channels: usize,
    /// The largest level of the format, in ADU.
    full_scale: T,
}

/// The frame of integer samples: luminance, saturation, and the unit that the levels come in.
fn frame_from_integers<T: Copy + Into<u32>>(samples: &Samples<'_, T>) -> Result<Frame, FrameError> {
    let (width, height) = (samples.width, samples.height);
    check_size(width, height)?;
    let expected = width * height * samples.channels;
    let values = samples
        .values
        .get(..expected)
        .ok_or(FrameError::WrongLength {
            expected: width * height,
            found: samples.values.len() / samples.channels,
        })?;
    let full_scale: u32 = samples.full_scale.into();
    let full = full_scale as f32;
    let level = |v: T| -> f32 { v.into() as f32 };
    let pixels = match samples.channels {
        1 => values.iter().map(|&v| level(v)).collect(),
        2 => values.chunks_exact(2).map(|c| level(c[0])).collect(),
        channels => values
            .chunks_exact(channels)
            .map(|c| luminance([level(c[0]), level(c[1]), level(c[2])], full))
            .collect(),
    };
    let step = if samples.channels <= 2 {
        level_step(values, full_scale)
    } else {
        1
    };
    // Twelve bits in the upper part of sixteen saturate at 65520, not at 65535.
    let saturation = full_scale / step * step;
    Ok(Frame::new(width, height, pixels)?.with_levels(step as f32, Some(saturation as f32)))
}

/// The luminance of one pixel; `full` where a channel is saturated.
fn luminance(rgb: [f32; 3], full: f32) -> f32 {
    if rgb.iter().any(|&channel| channel >= full) {
        return full;
    }
    if rgb[0] == rgb[1] && rgb[1] == rgb[2] {
        return rgb[0];
    }
    rgb.iter().zip(LUMINANCE_WEIGHTS).map(|(c, w)| c * w).sum()
}

/// The largest power of two that divides all levels below full scale: 16 where twelve bits are stored in sixteen.
fn level_step<T: Copy + Into<u32>>(values: &[T], full_scale: u32) -> u32 {
    let mut bits = MAX_STEP;
    for &value in values {
        let value: u32 = value.into();
        if value < full_scale {
            bits |= value;
        }
        if bits & 1 == 1 {
            return 1;
        }
    }
    let step = 1 << bits.trailing_zeros();
    // All levels zero, or nothing but full scale: nothing can be told.
    if step >= MAX_STEP.min(full_scale) {
        1
    } else {
        step
    }
}

#[cfg(test)]
mod tests;
