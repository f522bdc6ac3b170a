//! Limits on the size of frames and files.

/// Maximum number of pixels in a frame. Larger frames are refused before memory is allocated.
pub const MAX_PIXELS: usize = 200_000_000;

/// Minimum width and height of a frame, in pixels. On less, no star can be separated from the
/// background.
pub const MIN_SIDE_PX: usize = 3;

/// Most images of a file of which all are read.
pub const MAX_PAGES: usize = 10_000;

/// Maximum size of a file: the largest frame in three colors of 64 bits, and some headers.
pub(super) const MAX_FILE_BYTES: u64 = MAX_PIXELS as u64 * 24 + (1 << 24);

/// Number of bytes read to recognize a frame. Gzip may store a long file name before its data.
pub(super) const HEAD_BYTES: u64 = 4096;
