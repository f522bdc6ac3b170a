//! FITS: images of any BITPIX in the primary header-data unit or an extension, one plane or three of colour.
//!
//! Levels are BZERO + BSCALE × what is stored. Integers that BZERO 32768 (or its like for 8 and 32 bits) makes
//! unsigned are exact, and saturated at their largest; other scaled integers have a step of BSCALE and no saturation.
//! BLANK and NaN are pixels without a value. Images compressed tile by tile (ZIMAGE) have to be unpacked first.
//!
//! This is a reader of our own: of the crates under a permissive licence, `fitsrs` 0.4.1 and `fitsio-pure` 0.25.0 both
//! panic on some damaged headers, and the first hands out what is there of a truncated image without a word.
//!
//! Reference: FITS Standard 4.0 (2018), sections 3 to 5 and 7.1.

mod cards;
mod header;
mod keywords;
mod write;

pub use cards::FitsHeader;
pub use write::{FitsSamples, FitsWriteError, write_fits};

use super::levels::{Samples, frame_from_floats, frame_from_integers, interleaved};
use super::{Frame, FrameError, FrameFormat, check_size};
use header::Header;
use std::num::NonZeroUsize;

const BLOCK_BYTES: usize = 2880;

/// Decodes one image of a FITS file: `page`, counted from 1, else the first.
/// # Errors
/// As [`super::decode_page`].
pub(super) fn decode(bytes: &[u8], page: Option<NonZeroUsize>) -> Result<Frame, FrameError> {
    let mut pages = 0;
    let mut units = Units {
        bytes,
        next: 0,
        end: 0,
    };
    let mut tables = 0;
    // Keywords of the whole file stand in the first header.
    let mut primary = None;
    while let Some(unit) = units.next()? {
        let wanted = page.map_or(0, |page| page.get() - 1 - pages);
        if wanted < unit.pages() {
            let image = Image::new(&unit, page.map(|_| wanted))?;
            let headers = [Some(&unit.header), primary.as_ref()];
            let metadata = keywords::metadata(headers.into_iter().flatten());
            return Ok(image.frame(bytes)?.with_metadata(metadata));
        }
        pages += unit.pages();
        tables += usize::from(unit.is_table());
        primary.get_or_insert(unit.header);
    }
    match page {
        Some(page) if pages > 0 => Err(FrameError::NoSuchPage { page, pages }),
        _ => Err(FrameError::Unsupported {
            format: FrameFormat::Fits,
            found: format!(
                "no image in it, and {tables} table{}",
                if tables == 1 { "" } else { "s" }
            ),
            expected: "an image of two axes in the primary header-data unit or an extension",
        }),
    }
}

fn malformed(detail: String) -> FrameError {
    let format = FrameFormat::Fits;
    FrameError::Malformed { format, detail }
}

fn truncated(found_bytes: usize, detail: String) -> FrameError {
    FrameError::Truncated {
        format: FrameFormat::Fits,
        found_bytes,
        detail,
    }
}

/// The header-data units of a file, one after the other.
struct Units<'a> {
    bytes: &'a [u8],
    /// Where the next one begins.
    next: usize,
    /// Where the data of the last one end; there may be padding behind them.
    end: usize,
}

impl<'a> Units<'a> {
    fn next(&mut self) -> Result<Option<Unit<'a>>, FrameError> {
        if self.end > self.bytes.len() {
            let detail = format!("the data before the next header end at byte {}", self.end);
            return Err(truncated(self.bytes.len(), detail));
        }
        let at = self.next;
        let rest = self.bytes.get(at..).unwrap_or_default();
        // Whatever follows the last extension and is none itself has no meaning.
        if at > 0 && !rest.starts_with(b"XTENSION") {
            return Ok(None);
        }
        let (header, data) = Header::parse(self.bytes, at)?;
        let unit = Unit::new(header, data)?;
        let end = unit
            .data_bytes()
            .and_then(|length| data.checked_add(length));
        self.end = end.unwrap_or(usize::MAX);
        // Headers begin with a block, and so do data.
        let next = self.end.checked_next_multiple_of(BLOCK_BYTES);
        self.next = next.unwrap_or(usize::MAX);
        Ok(Some(unit))
    }
}

/// The numbers that pixels are stored as.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stored {
    U8,
    I16,
    I32,
    I64,
    F32,
    F64,
}

impl Stored {
    fn of(header: &Header) -> Result<Self, FrameError> {
        const EXPECTED: &str = "8, 16, 32, 64, -32 or -64";
        Ok(match header.required("BITPIX", EXPECTED)? {
            8 => Self::U8,
            16 => Self::I16,
            32 => Self::I32,
            64 => Self::I64,
            -32 => Self::F32,
            -64 => Self::F64,
            _ => return Err(header.bad("BITPIX", EXPECTED)),
        })
    }

    fn bytes(self) -> usize {
        match self {
            Self::U8 => 1,
            Self::I16 => 2,
            Self::I32 | Self::F32 => 4,
            Self::I64 | Self::F64 => 8,
        }
    }

    fn is_float(self) -> bool {
        matches!(self, Self::F32 | Self::F64)
    }
}

/// One header-data unit.
struct Unit<'a> {
    header: Header<'a>,
    /// Where the data begin.
    data: usize,
    stored: Stored,
    /// NAXIS1, NAXIS2, …
    axes: Vec<usize>,
}

impl<'a> Unit<'a> {
    fn new(header: Header<'a>, data: usize) -> Result<Self, FrameError> {
        const MAX_AXES: i64 = 999;
        let stored = Stored::of(&header)?;
        let expected = "a number of axes from 0 to 999";
        let count = header.required("NAXIS", expected)?;
        if !(0..=MAX_AXES).contains(&count) {
            return Err(header.bad("NAXIS", expected));
        }
        let axis = |number: i64| {
            let keyword = format!("NAXIS{number}");
            let expected = "a length of 0 or more";
            let length = header.required(&keyword, expected)?;
            usize::try_from(length).map_err(|_| header.bad(&keyword, expected))
        };
        let axes = (1..=count).map(axis).collect::<Result<_, _>>()?;
        Ok(Self {
            header,
            data,
            stored,
            axes,
        })
    }

    /// The bytes of its data without padding; none where no file can have so many.
    fn data_bytes(&self) -> Option<usize> {
        let count = |keyword: &str, otherwise: usize| {
            let found = self.header.optional(keyword, "a count").ok().flatten();
            found
                .and_then(|n| usize::try_from(n).ok())
                .unwrap_or(otherwise)
        };
        if self.axes.is_empty() {
            return Some(0);
        }
        product(&self.axes)?
            .checked_add(count("PCOUNT", 0))?
            .checked_mul(count("GCOUNT", 1))?
            .checked_mul(self.stored.bytes())
    }

    fn is_table(&self) -> bool {
        let kind = self.header.text("XTENSION");
        !self.is_compressed_image() && kind.is_some_and(|kind| kind.ends_with("TABLE"))
    }

    /// An image that was compressed tile by tile hides in a table.
    fn is_compressed_image(&self) -> bool {
        self.header.is_true("ZIMAGE")
    }

    /// Planes that lie behind each other.
    fn planes(&self) -> usize {
        product(self.axes.get(2..).unwrap_or_default()).unwrap_or(usize::MAX)
    }

    fn is_colour(&self) -> bool {
        self.axes.get(2) == Some(&3) && self.planes() == 3
    }

    /// The images in it: none, one, or as many as a cube has planes.
    fn pages(&self) -> usize {
        if self.is_compressed_image() {
            return 1;
        }
        let kind = self.header.text("XTENSION");
        let is_image = kind.is_none_or(|kind| kind == "IMAGE");
        match self.axes[..] {
            [width, height, ..] if is_image && width > 0 && height > 0 => {
                if self.is_colour() {
                    1
                } else {
                    self.planes()
                }
            }
            _ => 0,
        }
    }
}

fn product(lengths: &[usize]) -> Option<usize> {
    lengths.iter().try_fold(1, |n: usize, &l| n.checked_mul(l))
}

/// One image in a file.
struct Image {
    width: usize,
    height: usize,
    /// 1, or 3 planes of colour.
    channels: usize,
    /// Where it begins.
    at: usize,
    stored: Stored,
    scale: f64,
    zero: f64,
    /// The stored integer that stands for no value; floats have NaN for that.
    blank: Option<i64>,
}

impl Image {
    /// The image `plane` of `unit`, of which only a cube has more than one.
    fn new(unit: &Unit, plane: Option<usize>) -> Result<Self, FrameError> {
        let unsupported = |found, expected| FrameError::Unsupported {
            format: FrameFormat::Fits,
            found,
            expected,
        };
        if unit.is_compressed_image() {
            let found = "an image compressed tile by tile (ZIMAGE)".to_owned();
            let expected = "one that is not: unpack it with funpack first";
            return Err(unsupported(found, expected));
        }
        if plane.is_none() && unit.pages() > 1 {
            let found = format!("a cube of {} planes", unit.planes());
            let expected = "one plane, three of colour, or a page that says which";
            return Err(unsupported(found, expected));
        }
        let (width, height) = (unit.axes[0], unit.axes[1]);
        check_size(width, height)?;
        let scale = unit.header.factor("BSCALE", 1.0)?;
        if scale == 0.0 {
            return Err(unit.header.bad("BSCALE", "a number other than 0"));
        }
        let before = (width * height * unit.stored.bytes())
            .checked_mul(plane.unwrap_or(0))
            .and_then(|before| before.checked_add(unit.data));
        Ok(Self {
            width,
            height,
            channels: if unit.is_colour() { 3 } else { 1 },
            at: before.unwrap_or(usize::MAX),
            stored: unit.stored,
            scale,
            zero: unit.header.factor("BZERO", 0.0)?,
            blank: if unit.stored.is_float() {
                None
            } else {
                unit.header.optional("BLANK", "an integer")?
            },
        })
    }

    fn frame(&self, bytes: &[u8]) -> Result<Frame, FrameError> {
        let length = self.width * self.height * self.channels * self.stored.bytes();
        let end = self.at.saturating_add(length);
        let data = bytes.get(self.at..end).ok_or_else(|| {
            let Self { width, height, .. } = self;
            let detail = format!("the image of {width} x {height} pixels ends at byte {end}");
            truncated(bytes.len(), detail)
        })?;
        if self.scale == 1.0 && !self.stored.is_float() {
            const HALF_8: f64 = (1_u8 << 7) as f64;
            const HALF_16: f64 = (1_u16 << 15) as f64;
            const HALF_32: f64 = (1_u32 << 31) as f64;
            // Signed numbers become unsigned ones, and the other way round, by their highest bit.
            match (self.stored, self.zero) {
                (Stored::U8, 0.0) => return self.integers(data, |[b]| b, u8::MAX),
                (Stored::U8, zero) if zero == -HALF_8 => {
                    return self.integers(data, |[b]| (b ^ 1 << 7) as i8, i8::MAX);
                }
                (Stored::I16, 0.0) => return self.integers(data, i16::from_be_bytes, i16::MAX),
                (Stored::I16, HALF_16) => {
                    return self.integers(data, |b| u16::from_be_bytes(b) ^ 1 << 15, u16::MAX);
                }
                (Stored::I32, 0.0) => return self.integers(data, i32::from_be_bytes, i32::MAX),
                (Stored::I32, HALF_32) => {
                    return self.integers(data, |b| u32::from_be_bytes(b) ^ 1 << 31, u32::MAX);
                }
                _ => {}
            }
        }
        match self.stored {
            Stored::U8 => self.scaled(data, |[b]: [u8; 1]| i64::from(b)),
            Stored::I16 => self.scaled(data, |b| i64::from(i16::from_be_bytes(b))),
            Stored::I32 => self.scaled(data, |b| i64::from(i32::from_be_bytes(b))),
            Stored::I64 => self.scaled(data, i64::from_be_bytes),
            Stored::F32 => self.floats(data, |b| f64::from(f32::from_be_bytes(b))),
            Stored::F64 => self.floats(data, f64::from_be_bytes),
        }
    }

    /// Integers as they are, of which `full_scale` is the largest.
    fn integers<const N: usize, T: Copy + PartialEq + Into<i64>>(
        &self,
        data: &[u8],
        level: impl Fn([u8; N]) -> T,
        full_scale: T,
    ) -> Result<Frame, FrameError> {
        let values = self.by_pixel(data.as_chunks().0.iter().map(|b| level(*b)).collect());
        let samples = Samples {
            width: self.width,
            height: self.height,
            values: &values,
            channels: self.channels,
        };
        let frame = frame_from_integers(&samples, full_scale)?;
        let Some(blank) = self.blank else {
            return Ok(frame);
        };
        let blank = blank.saturating_add(self.zero as i64);
        let mut pixels = frame.pixels;
        for (pixel, levels) in pixels.iter_mut().zip(values.chunks_exact(self.channels)) {
            if levels.iter().any(|level| (*level).into() == blank) {
                *pixel = f32::NAN;
            }
        }
        Ok(Frame::new(self.width, self.height, pixels)?
            .with_levels(frame.step_adu, frame.saturation_adu))
    }

    /// Integers that are multiplied and shifted.
    fn scaled<const N: usize>(
        &self,
        data: &[u8],
        integer: impl Fn([u8; N]) -> i64,
    ) -> Result<Frame, FrameError> {
        let value = |bytes| match integer(bytes) {
            stored if Some(stored) == self.blank => f64::NAN,
            stored => stored as f64,
        };
        let frame = self.floats(data, value)?;
        Ok(frame.with_levels(self.scale.abs() as f32, None))
    }

    fn floats<const N: usize>(
        &self,
        data: &[u8],
        value: impl Fn([u8; N]) -> f64,
    ) -> Result<Frame, FrameError> {
        let level = |bytes: &[u8; N]| (self.zero + self.scale * value(*bytes)) as f32;
        let values = self.by_pixel(data.as_chunks().0.iter().map(level).collect());
        frame_from_floats((self.width, self.height), self.channels, values)
    }

    fn by_pixel<T: Copy>(&self, values: Vec<T>) -> Vec<T> {
        match self.channels {
            1 => values,
            channels => interleaved(&values, channels),
        }
    }
}

#[cfg(test)]
mod tests;
