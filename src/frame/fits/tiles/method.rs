//! How the tiles of an image are compressed, and the whole numbers or bytes in one of them.

use super::error::TileError;
use super::grid::Tile;
use super::hcompress::Hcompress;
use super::rice::{Rice, RiceWidth};
use super::{gzip, plio};
use crate::frame::FrameError;
use crate::frame::fits::error::{malformed, unsupported};
use crate::frame::fits::header::UnitHeader;
use crate::frame::fits::unit::StoredType;
use crate::frame::read_budget::ReadBudget;

/// A compression (ZCMPTYPE) and its parameters (ZNAMEn, ZVALn).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Method {
    Rice(Rice),
    Gzip {
        is_shuffled: bool,
    },
    Hcompress(Hcompress),
    /// `offset` is taken from each number: CFITSIO adds it to unsigned 16-bit pixels.
    Plio {
        offset: i32,
    },
    None,
}

/// The pixels of a tile as its compression has them.
pub(super) enum Values {
    Numbers(Vec<i32>),
    /// Big-endian, all of the same width.
    Bytes(Vec<u8>),
}

impl Method {
    /// The compression of the image with this header, whose pixels are `stored`.
    pub fn parse(header: &UnitHeader, stored: StoredType) -> Result<Self, FrameError> {
        const EXPECTED: &str =
            "GZIP_1, GZIP_2 or NOCOMPRESS, or RICE_1, HCOMPRESS_1 or PLIO_1 of at most 32 bits";
        let Some(name) = header.text("ZCMPTYPE") else {
            let detail =
                "an image compressed tile by tile has no ZCMPTYPE, expected RICE_1 or such";
            return Err(malformed(detail.to_owned()));
        };
        let is_long = stored == StoredType::I64;
        Ok(match name.as_ref() {
            "RICE_1" | "RICE_ONE" if !is_long => Self::Rice(rice(header)?),
            "GZIP_1" => Self::Gzip { is_shuffled: false },
            "GZIP_2" => Self::Gzip { is_shuffled: true },
            "HCOMPRESS_1" if !is_long => Self::Hcompress(Hcompress {
                smooth: parameter(header, "SMOOTH")?.is_some_and(|smooth| smooth != 0.0),
                is_wide: !matches!(stored, StoredType::U8 | StoredType::I16),
            }),
            "PLIO_1" if !is_long => {
                const HALF: i32 = 1 << 15;
                let is_unsigned =
                    stored == StoredType::I16 && header.number_or("BZERO", 0.0)? == f64::from(HALF);
                Self::Plio {
                    offset: if is_unsigned { HALF } else { 0 },
                }
            }
            "NOCOMPRESS" => Self::None,
            _ => {
                let bits = stored.bytes() * 8;
                let found = format!("tiles of {bits} bits compressed with {name} (ZCMPTYPE)");
                return Err(unsupported(found, EXPECTED));
            }
        })
    }

    /// Whether it gives back bytes, as floats that are not quantized need.
    pub fn keeps_bytes(self) -> bool {
        matches!(self, Self::Gzip { .. } | Self::None)
    }

    /// Most memory that decoding takes for each pixel of a tile, which becomes `width` bytes.
    pub fn bytes_per_pixel(self, width: usize) -> usize {
        const NUMBER: usize = size_of::<i32>();
        match self {
            Self::Rice(_) | Self::Plio { .. } => NUMBER + width,
            // Words of 64 bits while numbers are made of them.
            Self::Hcompress(_) => (2 * NUMBER + NUMBER).max(NUMBER + width),
            // Inflated bytes in a vector that grows by doubling, in their order; then as above.
            Self::Gzip { .. } | Self::None => 3 * width.max(NUMBER),
        }
    }

    /// Decodes the data of `tile`, whose pixels have at most `max_width` bytes.
    pub fn decode(
        self,
        data: &[u8],
        tile: &Tile,
        max_width: usize,
        budget: &ReadBudget,
    ) -> Result<Values, TileError> {
        let count = tile.pixels();
        Ok(match self {
            Self::Rice(rice) => Values::Numbers(rice.decode(data, count, budget)?),
            Self::Plio { offset } => {
                let mut numbers = plio::decode(data, count, budget)?;
                for number in &mut numbers {
                    *number = number.wrapping_sub(offset);
                }
                Values::Numbers(numbers)
            }
            Self::Hcompress(hcompress) => {
                let size = tile.size().ok_or_else(|| {
                    let detail = "found more than two axes, expected two for HCOMPRESS";
                    TileError::Corrupt(detail.to_owned())
                })?;
                Values::Numbers(hcompress.decode(data, size)?)
            }
            Self::Gzip { is_shuffled: false } => {
                Values::Bytes(gzip::inflate(data, count, max_width, budget)?)
            }
            Self::Gzip { is_shuffled: true } => Values::Bytes(gzip::unshuffle(
                &gzip::inflate(data, count, max_width, budget)?,
                count,
            )),
            Self::None if data.len() > count * max_width => {
                return Err(TileError::Long { pixels: count });
            }
            Self::None => Values::Bytes(data.to_vec()),
        })
    }
}

impl Values {
    /// The whole numbers of `count` pixels.
    pub fn numbers(self, count: usize) -> Result<Vec<i32>, TileError> {
        let bytes = match self {
            Self::Numbers(numbers) => return Ok(numbers),
            Self::Bytes(bytes) => bytes,
        };
        let width = bytes.len().checked_div(count);
        let is_whole = bytes.len().is_multiple_of(count);
        Ok(match width.filter(|_| is_whole) {
            Some(1) => bytes.iter().map(|byte| (*byte).into()).collect(),
            Some(2) => bytes
                .as_chunks()
                .0
                .iter()
                .map(|b| i16::from_be_bytes(*b).into())
                .collect(),
            Some(4) => bytes
                .as_chunks()
                .0
                .iter()
                .map(|b| i32::from_be_bytes(*b))
                .collect(),
            _ => return Err(TileError::Short { pixels: count }),
        })
    }
}

/// The parameters of RICE_1.
fn rice(header: &UnitHeader) -> Result<Rice, FrameError> {
    /// The standard has 16 and 32.
    const MAX_BLOCK: f64 = 65536.0;
    // The defaults are the standard's.
    let block = parameter(header, "BLOCKSIZE")?.unwrap_or(32.0);
    let bytes = parameter(header, "BYTEPIX")?.unwrap_or(4.0);
    let width = RiceWidth::from_byte_count(bytes as i64).ok_or_else(|| {
        let found = format!("{bytes} bytes a pixel (BYTEPIX) in tiles compressed with RICE_1");
        unsupported(found, "1, 2 or 4")
    })?;
    if !(1.0..=MAX_BLOCK).contains(&block) {
        let detail =
            format!("found blocks of {block} pixels (BLOCKSIZE), expected 1 to {MAX_BLOCK}");
        return Err(malformed(detail));
    }
    let block = block as usize;
    Ok(Rice { block, width })
}

/// The parameter `name` of the compression.
fn parameter(header: &UnitHeader, name: &str) -> Result<Option<f64>, FrameError> {
    /// As many as the standard's compressions have, and some.
    const MAX_PARAMETERS: usize = 20;
    for number in 1..=MAX_PARAMETERS {
        match header.text(&format!("ZNAME{number}")) {
            Some(found) if found.eq_ignore_ascii_case(name) => {
                return header.finite(&format!("ZVAL{number}"));
            }
            Some(_) => {}
            None => break,
        }
    }
    Ok(None)
}
