//! How does a TIFF file store an image? Known before anything is decoded.

use super::directory::{TagNumbers, TiffDirectory, malformed};
use crate::base::size::Size;
use crate::frame::error::FrameError;
use crate::frame::format::FrameFormat;
use crate::frame::image::check_size;
use crate::frame::read_budget::FLOATS_BYTES_PER_PIXEL;

/// Tags of TIFF 6.0, by their names there.
pub(super) mod tag {
    pub const NEW_SUBFILE_TYPE: u16 = 254;
    pub const IMAGE_WIDTH: u16 = 256;
    pub const IMAGE_LENGTH: u16 = 257;
    pub const BITS_PER_SAMPLE: u16 = 258;
    pub const COMPRESSION: u16 = 259;
    pub const PHOTOMETRIC: u16 = 262;
    pub const FILL_ORDER: u16 = 266;
    pub const STRIP_OFFSETS: u16 = 273;
    pub const ORIENTATION: u16 = 274;
    pub const SAMPLES_PER_PIXEL: u16 = 277;
    pub const ROWS_PER_STRIP: u16 = 278;
    pub const STRIP_BYTE_COUNTS: u16 = 279;
    pub const PLANAR_CONFIGURATION: u16 = 284;
    pub const PREDICTOR: u16 = 317;
    pub const TILE_WIDTH: u16 = 322;
    pub const TILE_LENGTH: u16 = 323;
    pub const TILE_OFFSETS: u16 = 324;
    pub const TILE_BYTE_COUNTS: u16 = 325;
    pub const SUB_IFDS: u16 = 330;
    pub const SAMPLE_FORMAT: u16 = 339;
    pub const JPEG_TABLES: u16 = 347;
}

const DEPTHS: &str = "unsigned integers of 1 to 32 or 64 bits, signed ones of 8, 16, 32 or 64, or floats of 16, 32 or 64, \
                      the same for all channels";
const COLORS: &str = "gray or RGB, with or without alpha, or YCbCr in JPEG";
const COMPRESSIONS: &str =
    "none, LZW, deflate, PackBits, JPEG (1 or 3 samples of 8 bits) or CCITT group 4 (1 bit)";
const PREDICTORS: &str =
    "none, differences of 8, 16, 32 or 64 bits, or differences of floats, in LZW or deflate";

/// How an image is stored.
pub(super) struct Layout<'a> {
    pub width: usize,
    pub height: usize,
    pub depth: SampleType,
    /// Channels that are read: 1 grey, 3 colors.
    pub channels: usize,
    /// Samples of a pixel in one chunk: all of them, or one where each channel has a plane.
    pub chunk_samples: usize,
    pub color: Color,
    pub compression: Compression,
    pub predictor: Predictor,
    /// Whether the bits of each byte are stored in reverse.
    pub is_bit_reversed: bool,
    /// Columns and rows of a strip or a tile.
    pub chunk_size: Size,
    /// Place and length of each chunk; a length may be absent.
    places: TagNumbers<'a>,
    lengths: TagNumbers<'a>,
    /// Tables that all chunks in JPEG share.
    pub jpeg_tables: Option<&'a [u8]>,
}

/// The numbers that are stored.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) struct SampleType {
    pub bits: u32,
    pub format: SampleFormat,
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum SampleFormat {
    Unsigned,
    Signed,
    Float,
}

/// What the samples mean.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Color {
    WhiteIsZero,
    BlackIsZero,
    Rgb,
    YCbCr,
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Compression {
    None,
    Group4,
    Lzw,
    Jpeg,
    Deflate,
    PackBits,
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Predictor {
    None,
    Differences,
    Floats,
}

/// A strip or a tile, of one plane or of all channels.
pub(super) struct Chunk {
    pub plane: usize,
    /// Its first column and row in the image.
    pub left: usize,
    pub top: usize,
    /// Its columns and rows inside the image.
    pub columns: usize,
    pub rows: usize,
    /// Its place in the file, and its length if that is known.
    pub place: u64,
    pub length: Option<u64>,
}

impl<'a> Layout<'a> {
    /// The layout that a directory describes.
    /// # Errors
    /// [`FrameError::Unsupported`], [`FrameError::Malformed`], [`FrameError::TooLarge`],
    /// [`FrameError::TooSmall`], [`FrameError::Truncated`].
    pub fn parse(directory: &TiffDirectory<'a>) -> Result<Self, FrameError> {
        let Size { width, height } = stated_size(directory)?;
        check_size(width, height)?;
        let samples = directory.first(tag::SAMPLES_PER_PIXEL, 1)? as usize;
        let depth = SampleType::of(directory)?;
        let color = Color::parse(directory)?;
        let channels = color.channels(samples)?;
        let compression = Compression::parse(directory, depth, color)?;
        if color == Color::WhiteIsZero && depth.format == SampleFormat::Signed {
            let found = "signed integers with WhiteIsZero".to_owned();
            return Err(unsupported(found, COLORS));
        }
        let predictor = Predictor::parse(directory, depth, compression)?;
        let is_planar = match directory.first(tag::PLANAR_CONFIGURATION, 1)? {
            1 => false,
            2 => samples > 1,
            other => {
                return Err(malformed(format!(
                    "PlanarConfiguration {other}, expected 1 or 2"
                )));
            }
        };
        let chunk_samples = if is_planar { 1 } else { samples };
        if compression == Compression::Jpeg && !matches!(chunk_samples, 1 | 3) {
            let found = format!("JPEG of {chunk_samples} samples of a pixel");
            return Err(unsupported(found, COMPRESSIONS));
        }
        let mut layout = Self {
            width,
            height,
            depth,
            channels,
            chunk_samples,
            color,
            compression,
            predictor,
            // JPEG has an order of its own.
            is_bit_reversed: compression != Compression::Jpeg
                && directory.first(tag::FILL_ORDER, 1)? == 2,
            chunk_size: Size::new(width, height),
            places: TagNumbers::default(),
            lengths: TagNumbers::default(),
            jpeg_tables: directory.bytes_of(tag::JPEG_TABLES)?,
        };
        layout.read_chunk_table(directory)?;
        Ok(layout)
    }

    fn read_chunk_table(&mut self, directory: &TiffDirectory<'a>) -> Result<(), FrameError> {
        let side = |tag: u16, default: usize, name: &str| -> Result<usize, FrameError> {
            match directory.first(tag, default as u64)? {
                0 => Err(malformed(format!("{name} is 0 (tag {tag})"))),
                side => Ok(usize::try_from(side).unwrap_or(usize::MAX)),
            }
        };
        let (places, lengths, name) = if directory.has(tag::TILE_OFFSETS) {
            self.chunk_size = Size::new(
                side(tag::TILE_WIDTH, 0, "TileWidth")?,
                side(tag::TILE_LENGTH, 0, "TileLength")?,
            );
            (tag::TILE_OFFSETS, tag::TILE_BYTE_COUNTS, "tiles")
        } else {
            let rows = side(tag::ROWS_PER_STRIP, self.height, "RowsPerStrip")?;
            self.chunk_size.height = rows.min(self.height);
            (tag::STRIP_OFFSETS, tag::STRIP_BYTE_COUNTS, "strips")
        };
        self.places = directory.numbers(places)?;
        self.lengths = directory.numbers(lengths)?;
        let (found, expected) = (self.places.len(), self.chunk_count());
        if found < expected {
            return Err(malformed(format!("{found} {name}, expected {expected}")));
        }
        Ok(())
    }

    fn is_planar(&self) -> bool {
        self.chunk_samples == 1 && self.channels > 1
    }

    fn chunks_across(&self) -> usize {
        self.width.div_ceil(self.chunk_size.width)
    }

    fn chunks_per_plane(&self) -> usize {
        self.chunks_across() * self.height.div_ceil(self.chunk_size.height)
    }

    fn chunk_count(&self) -> usize {
        let planes = if self.is_planar() { self.channels } else { 1 };
        planes * self.chunks_per_plane()
    }

    /// All chunks that are read.
    pub fn chunks(&self) -> impl Iterator<Item = Chunk> {
        let (per_plane, across) = (self.chunks_per_plane(), self.chunks_across());
        let places = self.places.iter().take(self.chunk_count()).enumerate();
        places.map(move |(index, place)| {
            let length = self.lengths.get(index);
            let (plane, index) = (index / per_plane, index % per_plane);
            let left = index % across * self.chunk_size.width;
            let top = index / across * self.chunk_size.height;
            Chunk {
                plane,
                left,
                top,
                columns: self.chunk_size.width.min(self.width - left),
                rows: self.chunk_size.height.min(self.height - top),
                place,
                length,
            }
        })
    }

    /// Bytes of a row of a chunk: each begins at a byte.
    pub fn row_bytes(&self) -> usize {
        let samples = self.chunk_size.width.saturating_mul(self.chunk_samples);
        let bits = samples.saturating_mul(self.depth.bits as usize);
        bits.div_ceil(8)
    }

    /// Where 16-bit grey levels lie in the file, if they are contiguous, uncompressed, and 0 is
    /// black.
    pub fn plain_words(&self) -> Option<(u64, u64)> {
        const WORDS: SampleType = SampleType {
            bits: 16,
            format: SampleFormat::Unsigned,
        };
        let is_plain = self.depth == WORDS
            && self.color == Color::BlackIsZero
            && self.chunk_samples == 1
            && self.compression == Compression::None
            && !self.is_bit_reversed
            && self.chunk_size.width == self.width;
        if !is_plain {
            return None;
        }
        let row_bytes = self.row_bytes() as u64;
        let mut chunks = self.chunks();
        let start = self.places.get(0)?;
        let end = chunks.try_fold(start, |end, chunk| {
            let is_next = chunk.place == end;
            is_next.then(|| end.checked_add(chunk.rows as u64 * row_bytes))?
        })?;
        Some((start, end - start))
    }

    /// Memory for the samples, one decompressed chunk and the frame, for each pixel.
    pub fn bytes_per_pixel(&self) -> usize {
        let sample_bytes = match self.depth.bits {
            0..=8 => 1,
            9..=16 => 2,
            17..=32 => 4,
            // They are copied to floats.
            _ => 8 + size_of::<f32>(),
        };
        let rows = self.chunk_size.height.min(self.height);
        let chunk_bytes = match self.compression {
            Compression::None if !self.is_bit_reversed => 0,
            _ => self.row_bytes().saturating_mul(rows),
        };
        let per_pixel = chunk_bytes.div_ceil(self.width * self.height);
        let samples = self.channels * sample_bytes + size_of::<f32>();
        let is_whole = self.depth.format == SampleFormat::Unsigned && self.depth.bits <= 16;
        per_pixel.saturating_add(match self.channels {
            1 | 2 if is_whole => samples,
            _ => samples.max(FLOATS_BYTES_PER_PIXEL),
        })
    }
}

/// The size that a directory states.
pub(super) fn stated_size(directory: &TiffDirectory) -> Result<Size, FrameError> {
    let side = |tag: u16, name: &str| -> Result<usize, FrameError> {
        if !directory.has(tag) {
            return Err(malformed(format!("no {name} (tag {tag})")));
        }
        Ok(usize::try_from(directory.first(tag, 0)?).unwrap_or(usize::MAX))
    };
    Ok(Size::new(
        side(tag::IMAGE_WIDTH, "ImageWidth")?,
        side(tag::IMAGE_LENGTH, "ImageLength")?,
    ))
}

impl SampleType {
    /// The largest level of whole numbers.
    pub fn full_scale(self) -> u64 {
        u64::MAX >> (u64::BITS - self.bits)
    }

    fn of(directory: &TiffDirectory) -> Result<Self, FrameError> {
        /// Depths of channels that a message lists.
        const MAX_LISTED: usize = 5;
        let all_bits = directory.numbers(tag::BITS_PER_SAMPLE)?;
        let all_formats = directory.numbers(tag::SAMPLE_FORMAT)?;
        let bits = all_bits.get(0).unwrap_or(1);
        let format = all_formats.get(0).unwrap_or(1);
        if all_bits.iter().any(|other| other != bits) {
            let listed = all_bits.iter().take(MAX_LISTED);
            let listed: Vec<String> = listed.map(|bits| bits.to_string()).collect();
            let found = format!("samples of {} bits", listed.join(", "));
            return Err(unsupported(found, DEPTHS));
        }
        if all_formats.iter().any(|other| other != format) {
            return Err(unsupported("samples of several types".to_owned(), DEPTHS));
        }
        let (format, kind) = match format {
            // 4 is "undefined", which libtiff reads as unsigned.
            1 | 4 => (SampleFormat::Unsigned, "unsigned integers"),
            2 => (SampleFormat::Signed, "signed integers"),
            3 => (SampleFormat::Float, "floats"),
            other => {
                let found = format!("samples of type {other} (SampleFormat)");
                return Err(unsupported(found, DEPTHS));
            }
        };
        let is_read = match format {
            SampleFormat::Unsigned => matches!(bits, 1..=32 | 64),
            SampleFormat::Signed => matches!(bits, 8 | 16 | 32 | 64),
            SampleFormat::Float => matches!(bits, 16 | 32 | 64),
        };
        if !is_read {
            return Err(unsupported(format!("{kind} of {bits} bits"), DEPTHS));
        }
        Ok(Self {
            bits: bits as u32,
            format,
        })
    }
}

impl Color {
    fn parse(directory: &TiffDirectory) -> Result<Self, FrameError> {
        if !directory.has(tag::PHOTOMETRIC) {
            let detail = format!("no PhotometricInterpretation (tag {})", tag::PHOTOMETRIC);
            return Err(malformed(detail));
        }
        let found = match directory.first(tag::PHOTOMETRIC, 0)? {
            0 => return Ok(Self::WhiteIsZero),
            1 => return Ok(Self::BlackIsZero),
            2 => return Ok(Self::Rgb),
            6 => return Ok(Self::YCbCr),
            3 => "a color palette".to_owned(),
            4 => "a transparency mask".to_owned(),
            5 => "CMYK colors".to_owned(),
            8..=10 => "CIE L*a*b* colors".to_owned(),
            32803 => "a raw color mosaic (CFA)".to_owned(),
            34892 => "raw colors (LinearRaw)".to_owned(),
            other => format!("PhotometricInterpretation {other}"),
        };
        Err(unsupported(found, COLORS))
    }

    /// Channels that are read of so many samples of a pixel.
    fn channels(self, samples: usize) -> Result<usize, FrameError> {
        match (self, samples) {
            (Self::WhiteIsZero | Self::BlackIsZero, 1 | 2) => Ok(1),
            (Self::Rgb, 3..) | (Self::YCbCr, 3) => Ok(3),
            (Self::Rgb | Self::YCbCr, _) => {
                Err(malformed(format!("{samples} samples of a color pixel")))
            }
            _ => Err(unsupported(
                format!("{samples} samples of a gray pixel"),
                COLORS,
            )),
        }
    }
}

impl Compression {
    fn parse(
        directory: &TiffDirectory,
        depth: SampleType,
        color: Color,
    ) -> Result<Self, FrameError> {
        let code = directory.first(tag::COMPRESSION, 1)?;
        let found = match code {
            1 => Self::None,
            4 if depth.bits == 1 => Self::Group4,
            5 => Self::Lzw,
            7 if depth.bits == 8 => Self::Jpeg,
            8 | 32946 => Self::Deflate,
            32773 => Self::PackBits,
            _ => {
                let found = match code {
                    2 | 3 => "CCITT compression (group 3)".to_owned(),
                    4 => format!("CCITT compression of {} bits", depth.bits),
                    6 => "old-style JPEG (compression 6)".to_owned(),
                    7 => format!("JPEG of {} bits", depth.bits),
                    34712 => "JPEG 2000 compression".to_owned(),
                    34925 => "LZMA compression".to_owned(),
                    50000 => "Zstandard compression".to_owned(),
                    50001 => "WebP compression".to_owned(),
                    other => format!("compression {other}"),
                };
                return Err(unsupported(found, COMPRESSIONS));
            }
        };
        if color == Color::YCbCr && found != Self::Jpeg {
            return Err(unsupported("YCbCr that is not in JPEG".to_owned(), COLORS));
        }
        Ok(found)
    }
}

impl Predictor {
    fn parse(
        directory: &TiffDirectory,
        depth: SampleType,
        compression: Compression,
    ) -> Result<Self, FrameError> {
        // The tag belongs to these compressions.
        if !matches!(compression, Compression::Lzw | Compression::Deflate) {
            return Ok(Self::None);
        }
        let is_whole = matches!(depth.bits, 8 | 16 | 32 | 64);
        match directory.first(tag::PREDICTOR, 1)? {
            1 => Ok(Self::None),
            2 if is_whole => Ok(Self::Differences),
            3 if is_whole && depth.bits > 8 => Ok(Self::Floats),
            other => {
                let found = format!("predictor {other} with {} bits", depth.bits);
                Err(unsupported(found, PREDICTORS))
            }
        }
    }
}

fn unsupported(found: String, expected: &'static str) -> FrameError {
    FrameError::Unsupported {
        format: FrameFormat::Tiff,
        found,
        expected,
    }
}
