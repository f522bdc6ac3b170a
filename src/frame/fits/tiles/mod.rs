//! Images compressed tile by tile (ZIMAGE), as `fpack` writes them.
//!
//! A header-data unit with a table → the pixels of its image as if they were not compressed:
//! big-endian, of type ZBITPIX, row by row.
//!
//! 1. The axes and ZTILEn say which pixels a tile has ([`grid`]); each row of the table is a tile,
//!    its data are in the heap behind the table ([`table`]).
//! 2. All data of the tiles must be in the file, and those of no two the same, before memory is
//!    allocated.
//! 3. The compression gives whole numbers or bytes ([`method`]); a tile never decodes to more than
//!    its pixels.
//! 4. Quantized floats are made of the numbers ([`quantize`]). Tiles that could not be quantized are
//!    floats, compressed with gzip or not at all.
//!
//! # Reference
//! FITS Standard 4.0 (2018), sect. 10.

mod decoder;
mod error;
mod grid;
mod gzip;
mod hcompress;
mod method;
mod plio;
mod quantize;
mod rice;
mod table;

use super::error::{malformed, truncated};
use super::unit::FitsUnit;
use crate::frame::read_budget::ReadBudget;
use crate::frame::{FrameError, MAX_PIXELS};
use decoder::Decoder;
use error::TileError;
use grid::TileGrid;
use std::ops::Range;
use table::TileTable;

/// Most pixels in a tile: three planes of the largest frame.
const MAX_TILE_PIXELS: usize = 3 * MAX_PIXELS;

/// Most tiles of one image: those of 16 x 16 pixels in the largest frame. `fpack` makes a tile of
/// each row.
const MAX_TILES: usize = 1_000_000;

/// The stored values of these pixels of the compressed image `unit`, big-endian. The pixels are
/// counted along the first axis first; the axes are not empty.
/// # Errors
/// [`FrameError::Malformed`] with the number of the tile, counted from 1, and
/// [`FrameError::Truncated`], [`FrameError::Unsupported`].
pub(super) fn unpack(
    unit: &FitsUnit,
    bytes: &[u8],
    pixels: Range<usize>,
    budget: &ReadBudget,
) -> Result<Vec<u8>, FrameError> {
    let grid = TileGrid::new(&unit.axes, &unit.header)?;
    let too_large = || malformed(format!("found tiles of more than {MAX_TILE_PIXELS} pixels"));
    let tiles = grid.tiles().ok_or_else(too_large)?;
    let largest = grid.tile_pixels();
    if largest.is_none_or(|pixels| pixels > MAX_TILE_PIXELS) {
        return Err(too_large());
    }
    let decoder = Decoder::new(unit, TileTable::new(unit, bytes, tiles)?)?;
    let rows = touching(&grid, tiles, &pixels, budget)?;
    let mut data_bytes = 0;
    for &row in &rows {
        budget.check_time()?;
        data_bytes += decoder.data_bytes(row).map_err(|error| match error {
            TileError::OutsideHeap { .. } if unit.end() > bytes.len() => {
                truncated(bytes.len(), of_tile(row, &error))
            }
            _ => malformed(of_tile(row, &error)),
        })?;
        decoder
            .check_shared(data_bytes)
            .map_err(|error| malformed(of_tile(row, &error)))?;
    }
    let width = unit.stored.bytes();
    let tile_bytes = largest
        .unwrap_or(0)
        .saturating_mul(decoder.bytes_per_pixel());
    budget.hold(tile_bytes as u64)?;
    let mut image = vec![0; pixels.len() * width];
    for &row in &rows {
        budget.check_time()?;
        let tile = grid.tile(row);
        let decoded = decoder.pixels(&tile, budget);
        let decoded = decoded.map_err(|error| budget.why(malformed(of_tile(row, &error))))?;
        let lines = decoded.chunks_exact(tile.lengths[0] * width);
        for (place, line) in grid.rows(&tile).zip(lines) {
            // Tiles may have pixels of other planes too.
            if pixels.contains(&place) {
                let start = (place - pixels.start) * width;
                image[start..start + line.len()].copy_from_slice(line);
            }
        }
    }
    budget.release(tile_bytes as u64);
    Ok(image)
}

/// The rows of the tiles that may have some of these pixels.
fn touching(
    grid: &TileGrid,
    tiles: usize,
    pixels: &Range<usize>,
    budget: &ReadBudget,
) -> Result<Vec<usize>, FrameError> {
    let mut rows = Vec::new();
    for row in 0..tiles {
        budget.check_time()?;
        if grid.may_touch(&grid.tile(row), pixels) {
            rows.push(row);
        }
        if rows.len() > MAX_TILES {
            let detail = format!("found more than {MAX_TILES} tiles in an image, expected fewer");
            return Err(malformed(detail));
        }
    }
    Ok(rows)
}

/// What is wrong with the tile in `row`, counted from 0.
fn of_tile(row: usize, error: &TileError) -> String {
    format!("tile {}: {error}", row + 1)
}

#[cfg(test)]
mod tests;
