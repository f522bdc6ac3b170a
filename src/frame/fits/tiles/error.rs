//! What can be wrong with one tile.

use crate::base::interrupt::Interrupted;

/// Why the data of a tile cannot be decoded. The caller adds the tile's number.
#[derive(Debug, PartialEq, thiserror::Error)]
pub(super) enum TileError {
    /// Neither compressed nor uncompressed data.
    #[error("it has no data")]
    Empty,
    /// Its descriptor points outside the heap of the table.
    #[error("its data are at {start} to {end} of the heap, expected to end at {heap} or before")]
    OutsideHeap { start: u128, end: u128, heap: usize },
    /// Its descriptor has a negative number.
    #[error("found a length of {count} and an offset of {offset}, expected no negative number")]
    Negative { count: i64, offset: i64 },
    /// Tiles share data.
    #[error(
        "with it the tiles have more data than the heap of {heap} bytes, expected data of its own for each"
    )]
    Shared { heap: usize },
    /// The time is over.
    #[error(transparent)]
    Interrupted(#[from] Interrupted),
    /// The data end too early.
    #[error("its data end before its {pixels} pixels are complete")]
    Short { pixels: usize },
    /// The data go on after the last pixel.
    #[error("its data hold more than its {pixels} pixels")]
    Long { pixels: usize },
    /// The data decode to an image of another size.
    #[error("its data hold {width} x {height} pixels, expected {expected}")]
    OtherSize {
        width: usize,
        height: usize,
        expected: String,
    },
    /// The data are not what the compression writes.
    #[error("{0}")]
    Corrupt(String),
}
