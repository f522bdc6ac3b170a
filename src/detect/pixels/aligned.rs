//! Buffers that begin at a cache line: a vector across two lines takes two loads.

use std::ops::{Deref, DerefMut};

/// Bytes in a cache line.
const LINE_BYTES: usize = 64;
/// Values in a cache line.
pub(crate) const LINE: usize = LINE_BYTES / size_of::<f32>();

/// A buffer that begins at a cache line.
#[derive(Debug, Clone, Default)]
pub(crate) struct AlignedBuffer {
    buffer: Vec<f32>,
    start: usize,
}

impl AlignedBuffer {
    /// Grows to at least `length` values; the values so far are kept.
    pub fn grow(&mut self, length: usize) {
        if self.len() >= length {
            return;
        }
        let mut grown = vec![0.0f32; length + LINE];
        let start = grown.as_ptr().align_offset(LINE_BYTES).min(LINE);
        grown[start..start + self.len()].copy_from_slice(self);
        (self.buffer, self.start) = (grown, start);
    }
}

impl Deref for AlignedBuffer {
    type Target = [f32];

    fn deref(&self) -> &[f32] {
        &self.buffer[self.start..]
    }
}

impl DerefMut for AlignedBuffer {
    fn deref_mut(&mut self) -> &mut [f32] {
        &mut self.buffer[self.start..]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_kept_as_the_buffer_grows() {
        let mut buffer = AlignedBuffer::default();
        for length in [3, 100, 100, 5000] {
            buffer.grow(length);
            assert!(buffer.len() >= length);
            assert_eq!(buffer.as_ptr().align_offset(LINE_BYTES), 0);
            buffer[length - 1] = length as f32;
        }
        assert_eq!([buffer[2], buffer[99], buffer[4999]], [3.0, 100.0, 5000.0]);
        assert_eq!(buffer[50], 0.0);
    }
}
