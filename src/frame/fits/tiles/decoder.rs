//! Decodes single tiles of an image.

use super::error::TileError;
use super::grid::Tile;
use super::gzip;
use super::method::{Method, Values};
use super::quantize::{Dither, Quantized};
use super::table::{TileColumn, TileTable};
use crate::frame::FrameError;
use crate::frame::fits::error::{malformed, unsupported};
use crate::frame::fits::unit::{FitsUnit, StoredType};
use crate::frame::read_budget::{PIXELS_BETWEEN_CHECKS, ReadBudget};

/// All that the tiles of one image have in common.
pub(super) struct Decoder<'a> {
    table: TileTable<'a>,
    stored: StoredType,
    method: Method,
    compressed: TileColumn,
    /// For tiles that are compressed without loss beside others that are quantized.
    gzip: Option<TileColumn>,
    uncompressed: Option<TileColumn>,
    /// `None` for whole numbers and for floats that are stored as such.
    quantization: Option<Quantization>,
}

/// Where the parameters of quantized tiles are.
struct Quantization {
    scale: TileParameter<f64>,
    zero: TileParameter<f64>,
    blank: Option<TileParameter<i64>>,
    dither: Dither,
}

/// Where a parameter is: in a column, or the same for all tiles.
#[derive(Clone, Copy)]
enum TileParameter<T> {
    Column(TileColumn),
    All(T),
}

impl<'a> Decoder<'a> {
    pub fn new(unit: &FitsUnit, table: TileTable<'a>) -> Result<Self, FrameError> {
        let header = &unit.header;
        let method = Method::parse(header, unit.stored)?;
        let quantization = if unit.stored.is_float() {
            Quantization::parse(unit, &table)?
        } else {
            None
        };
        if unit.stored.is_float() && quantization.is_none() && !method.keeps_bytes() {
            let found = "floats in tiles without ZSCALE, compressed as whole numbers".to_owned();
            return Err(unsupported(
                found,
                "ZSCALE, or GZIP_1, GZIP_2 or NOCOMPRESS",
            ));
        }
        if table.column("NULL_PIXEL_MASK").is_some() {
            let found = "a mask of pixels without a value (NULL_PIXEL_MASK)".to_owned();
            return Err(unsupported(found, "ZBLANK, BLANK or NaN"));
        }
        let heap_column = |name| table.column(name).filter(|column| column.is_descriptor());
        let compressed = heap_column("COMPRESSED_DATA").ok_or_else(|| {
            let detail = "an image compressed tile by tile, expected a column COMPRESSED_DATA";
            malformed(detail.to_owned())
        })?;
        let uncompressed = heap_column("UNCOMPRESSED_DATA");
        let bytes = unit.stored.bytes();
        if uncompressed.is_some_and(|column| column.element_bytes() != Some(bytes)) {
            let found = "a column UNCOMPRESSED_DATA of another type than the image".to_owned();
            return Err(unsupported(found, "the type in ZBITPIX"));
        }
        Ok(Self {
            stored: unit.stored,
            method,
            compressed,
            gzip: heap_column("GZIP_COMPRESSED_DATA"),
            uncompressed,
            quantization,
            table,
        })
    }

    /// Size of the data of the tile in `row`, which must be in the file; no data are no error here.
    pub fn data_bytes(&self, row: usize) -> Result<usize, TileError> {
        let columns = [Some(self.compressed), self.gzip, self.uncompressed];
        let columns = columns.into_iter().flatten();
        columns
            .map(|column| Ok(self.table.data(column, row)?.len()))
            .sum()
    }

    /// Whether tiles with so many bytes of data can have data of their own.
    pub fn check_shared(&self, data_bytes: usize) -> Result<(), TileError> {
        let heap = self.table.heap_bytes();
        if data_bytes > heap {
            return Err(TileError::Shared { heap });
        }
        Ok(())
    }

    /// Most memory that decoding a tile takes for each of its pixels.
    pub fn bytes_per_pixel(&self) -> usize {
        self.method.bytes_per_pixel(self.stored.bytes())
    }

    /// The pixels of `tile` as an image that is not compressed has them: big-endian, of ZBITPIX.
    pub fn pixels(&self, tile: &Tile, budget: &ReadBudget) -> Result<Vec<u8>, TileError> {
        let count = tile.pixels();
        let width = self.stored.bytes();
        let data = |column: Option<TileColumn>| match column {
            Some(column) => self.table.data(column, tile.row),
            None => Ok(&[][..]),
        };
        let compressed = data(Some(self.compressed))?;
        if !compressed.is_empty() {
            return self.decompressed(compressed, tile, budget);
        }
        let packed = data(self.gzip)?;
        if !packed.is_empty() {
            return exactly(gzip::inflate(packed, count, width, budget)?, count, width);
        }
        let plain = data(self.uncompressed)?;
        if plain.is_empty() {
            return Err(TileError::Empty);
        }
        exactly(plain.to_vec(), count, width)
    }

    /// Whether pixels are whole numbers of at most 32 bits.
    fn has_short_integers(&self) -> bool {
        matches!(
            self.stored,
            StoredType::U8 | StoredType::I16 | StoredType::I32
        )
    }

    fn decompressed(
        &self,
        data: &[u8],
        tile: &Tile,
        budget: &ReadBudget,
    ) -> Result<Vec<u8>, TileError> {
        /// Writers may store narrow numbers in words of four bytes.
        const WORD_BYTES: usize = 4;
        let (count, width) = (tile.pixels(), self.stored.bytes());
        let max_width = match self.quantization {
            Some(_) => WORD_BYTES,
            None => width.max(WORD_BYTES),
        };
        let values = self.method.decode(data, tile, max_width, budget)?;
        if let Some(quantization) = &self.quantization {
            let numbers = values.numbers(count)?;
            let quantized = quantization.of_tile(&self.table, tile.row);
            let floats = quantized.floats(&numbers, tile.row);
            return match self.stored {
                StoredType::F64 => bytes_of(count, floats.map(f64::to_be_bytes), budget),
                _ => {
                    let floats = floats.map(|float| (float as f32).to_be_bytes());
                    bytes_of(count, floats, budget)
                }
            };
        }
        match values {
            Values::Bytes(bytes) if bytes.len() == count * width => Ok(bytes),
            Values::Bytes(bytes) if !self.has_short_integers() => exactly(bytes, count, width),
            values => {
                let numbers = values.numbers(count)?.into_iter();
                match self.stored {
                    // Lossy compression may go beyond the type.
                    StoredType::U8 => {
                        bytes_of(count, numbers.map(|n| [n.clamp(0, 0xff) as u8]), budget)
                    }
                    StoredType::I16 => {
                        let word = |n: i32| n.clamp(i16::MIN.into(), i16::MAX.into()) as i16;
                        bytes_of(count, numbers.map(|n| word(n).to_be_bytes()), budget)
                    }
                    _ => bytes_of(count, numbers.map(i32::to_be_bytes), budget),
                }
            }
        }
    }
}

/// The bytes of `count` values, one after the other.
fn bytes_of<const N: usize>(
    count: usize,
    mut values: impl Iterator<Item = [u8; N]>,
    budget: &ReadBudget,
) -> Result<Vec<u8>, TileError> {
    // Faster than to collect a flat map.
    let mut bytes = vec![0; count * N];
    for places in bytes.as_chunks_mut().0.chunks_mut(PIXELS_BETWEEN_CHECKS) {
        budget.check_interrupt()?;
        let pairs = places.iter_mut().zip(values.by_ref());
        pairs.for_each(|(place, value)| *place = value);
    }
    Ok(bytes)
}

/// The bytes, if they are those of `count` pixels.
fn exactly(bytes: Vec<u8>, count: usize, width: usize) -> Result<Vec<u8>, TileError> {
    match bytes.len() {
        length if length < count * width => Err(TileError::Short { pixels: count }),
        length if length > count * width => Err(TileError::Long { pixels: count }),
        _ => Ok(bytes),
    }
}

impl Quantization {
    /// How the floats of the image were quantized; `None` if they were not.
    fn parse(unit: &FitsUnit, table: &TileTable) -> Result<Option<Self>, FrameError> {
        let header = &unit.header;
        let source = |name| -> Result<Option<TileParameter<f64>>, FrameError> {
            match table.column(name) {
                Some(column) => Ok(Some(TileParameter::Column(column))),
                None => Ok(header.finite(name)?.map(TileParameter::All)),
            }
        };
        let method = header.text("ZQUANTIZ");
        let seed = || header.optional("ZDITHER0", "an integer");
        let dither = match method.as_deref() {
            Some("NONE") => return Ok(None),
            None | Some("NO_DITHER") => Dither::None,
            Some(name @ ("SUBTRACTIVE_DITHER_1" | "SUBTRACTIVE_DITHER_2")) => Dither::Subtractive {
                seed: seed()?.unwrap_or(1),
                keeps_zero: name == "SUBTRACTIVE_DITHER_2",
            },
            Some(_) => {
                const EXPECTED: &str =
                    "NONE, NO_DITHER, SUBTRACTIVE_DITHER_1 or SUBTRACTIVE_DITHER_2";
                return Err(header.invalid("ZQUANTIZ", EXPECTED));
            }
        };
        let Some(scale) = source("ZSCALE")? else {
            return Ok(None);
        };
        let blank = match table.column("ZBLANK") {
            Some(column) => Some(TileParameter::Column(column)),
            None => unit.blank().map(TileParameter::All),
        };
        Ok(Some(Self {
            scale,
            zero: source("ZZERO")?.unwrap_or(TileParameter::All(0.0)),
            blank,
            dither,
        }))
    }

    fn of_tile(&self, table: &TileTable, row: usize) -> Quantized {
        let number = |source: TileParameter<f64>| match source {
            TileParameter::Column(column) => table.number(column, row).unwrap_or(f64::NAN),
            TileParameter::All(number) => number,
        };
        Quantized {
            scale: number(self.scale),
            zero: number(self.zero),
            blank: self.blank.and_then(|source| match source {
                TileParameter::Column(column) => table.whole_number(column, row),
                TileParameter::All(blank) => Some(blank),
            }),
            dither: self.dither,
        }
    }
}
