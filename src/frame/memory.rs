//! A limit on the memory that a frame takes.

use super::error::FrameError;

/// How much memory a frame may take while it is read and solved. What a header asks for is checked
/// before it is allocated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MemoryLimit {
    bytes: u64,
}

impl MemoryLimit {
    /// The limit unless another is set: 1.5 GB.
    pub const DEFAULT: Self = Self {
        bytes: 1_500_000_000,
    };

    /// A limit of this many bytes.
    pub const fn of_bytes(bytes: u64) -> Self {
        Self { bytes }
    }

    /// The limit in bytes.
    pub const fn bytes(self) -> u64 {
        self.bytes
    }

    /// The largest content of a compressed file: its frame takes the rest.
    pub(super) const fn content_bytes(self) -> u64 {
        self.bytes / 4 * 3
    }

    /// Refuses an image whose decoder needs this many bytes for each pixel. The frame takes 4 more;
    /// detection keeps to what is left.
    pub(super) fn check(
        self,
        width: usize,
        height: usize,
        decoder_bytes_per_pixel: usize,
    ) -> Result<(), FrameError> {
        const FRAME_BYTES_PER_PIXEL: usize = size_of::<f32>();
        let per_pixel = (decoder_bytes_per_pixel + FRAME_BYTES_PER_PIXEL) as u64;
        let pixels = (width as u64).saturating_mul(height as u64);
        let needed_bytes = pixels.saturating_mul(per_pixel);
        if needed_bytes <= self.bytes {
            return Ok(());
        }
        Err(FrameError::TooMuchMemory {
            width,
            height,
            needed_bytes,
            limit_bytes: self.bytes,
        })
    }
}

impl Default for MemoryLimit {
    fn default() -> Self {
        Self::DEFAULT
    }
}
