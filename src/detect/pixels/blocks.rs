//! Blocks of columns of a row. Most hold no bright pixel, and are skipped as a whole.

use crate::base::size::Size;
use multiversion::multiversion;

/// Width of a block, in pixels.
pub(crate) const BLOCK_PX: usize = 64;

/// The maximum of a block without candidates.
const NO_CANDIDATE: f32 = f32::MIN;

/// The maxima of those blocks of a frame that hold candidates.
#[derive(Debug, Clone, Default)]
pub(crate) struct BlockMaxima {
    /// Blocks in a row.
    pub per_row: usize,
    /// Row by row; [`NO_CANDIDATE`] for the other blocks.
    pub values: Vec<f32>,
}

impl BlockMaxima {
    /// Makes room for a frame of this size.
    pub fn prepare(&mut self, size: Size) {
        self.per_row = size.width.div_ceil(BLOCK_PX);
        self.values.clear();
        self.values.resize(self.per_row * size.height, NO_CANDIDATE);
    }

    /// The maxima of the blocks in row `y`.
    pub fn row(&self, y: usize) -> &[f32] {
        &self.values[y * self.per_row..(y + 1) * self.per_row]
    }
}

/// A block of a row in which pixels reach a threshold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ReachedBlock {
    /// Number of the block in its row.
    pub block: usize,
    /// One bit for each column, the lowest for the first.
    pub bits: u64,
}

impl ReachedBlock {
    /// The columns of the row whose pixels reach the threshold.
    pub fn columns(&self) -> impl Iterator<Item = usize> + use<> {
        let Self { block, mut bits } = *self;
        std::iter::from_fn(move || {
            let column = block * BLOCK_PX + bits.trailing_zeros() as usize;
            (bits != 0).then(|| {
                bits &= bits - 1;
                column
            })
        })
    }
}

/// A value of a pixel that can be compared with a threshold.
pub(crate) trait PixelLevel: Copy + PartialOrd {
    /// No value is lower.
    const LOWEST: Self;
    /// Whether a pixel can be without a value.
    const MAY_BE_NAN: bool;
    /// The least value that reaches the threshold; `None` if no value does.
    fn reaching(threshold: f32) -> Option<Self>;
}

/// The least whole number from `threshold` on; `None` for NaN.
#[inline(always)]
fn whole_from(threshold: f32) -> Option<u32> {
    let below = threshold as u32;
    let above = u32::from((below as f32) < threshold);
    (!threshold.is_nan()).then(|| below.saturating_add(above))
}

impl PixelLevel for u8 {
    const LOWEST: Self = 0;
    const MAY_BE_NAN: bool = false;

    #[inline(always)]
    fn reaching(threshold: f32) -> Option<Self> {
        whole_from(threshold).and_then(|level| Self::try_from(level).ok())
    }
}

impl PixelLevel for u16 {
    const LOWEST: Self = 0;
    const MAY_BE_NAN: bool = false;

    #[inline(always)]
    fn reaching(threshold: f32) -> Option<Self> {
        whole_from(threshold).and_then(|level| Self::try_from(level).ok())
    }
}

impl PixelLevel for f32 {
    const LOWEST: Self = f32::NEG_INFINITY;
    const MAY_BE_NAN: bool = true;

    #[inline(always)]
    fn reaching(threshold: f32) -> Option<Self> {
        Some(threshold)
    }
}

/// Finds the blocks of `row` with pixels of at least the threshold of their block; NaN is below
/// any.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
pub(crate) fn find_reaching<T: PixelLevel>(
    row: &[T],
    thresholds: &[f32],
    found: &mut Vec<ReachedBlock>,
) {
    found.clear();
    let (blocks, rest) = row.as_chunks::<BLOCK_PX>();
    for (block, (values, &threshold)) in blocks.iter().zip(thresholds).enumerate() {
        let Some(threshold) = T::reaching(threshold) else {
            continue;
        };
        if values.iter().fold(false, |any, &v| any | (v >= threshold)) {
            let bits = bits_of(values, threshold);
            found.push(ReachedBlock { block, bits });
        }
    }
    let threshold = thresholds.get(blocks.len()).copied();
    if let Some(threshold) = threshold.and_then(T::reaching) {
        let bits = bits_of(rest, threshold);
        if bits != 0 {
            let block = blocks.len();
            found.push(ReachedBlock { block, bits });
        }
    }
}

/// A bit for each of at most 64 values, set from the threshold on.
#[inline(always)]
pub(crate) fn bits_of<T: Copy + PartialOrd>(values: &[T], threshold: T) -> u64 {
    let mut reaches = [0u8; BLOCK_PX];
    for (reaches, &value) in reaches.iter_mut().zip(values) {
        *reaches = u8::from(value >= threshold);
    }
    packed(&reaches)
}

/// The lowest bits of 64 bytes, of which the other bits are 0.
#[inline(always)]
pub(crate) fn packed(bytes: &[u8; BLOCK_PX]) -> u64 {
    /// Moves the lowest bit of byte i to bit i of the highest byte.
    const TO_HIGHEST: u64 = 0x0102_0408_1020_4080;
    let (eights, _) = bytes.as_chunks::<8>();
    let bits = eights.iter().enumerate().map(|(i, eight)| {
        let bits = u64::from_le_bytes(*eight).wrapping_mul(TO_HIGHEST) >> 56;
        bits << (8 * i)
    });
    bits.fold(0, |all, bits| all | bits)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_are_found_with_the_columns_that_reach_their_threshold() {
        let mut row = vec![0.0; 2 * BLOCK_PX + 10];
        let high = [0, 63, 64 + 20, 128 + 9];
        for x in high {
            row[x] = 5.0;
        }
        (row[3], row[100]) = (f32::NAN, 4.0);
        let mut found = Vec::new();
        find_reaching(row.as_slice(), &[5.0; 3], &mut found);
        let columns: Vec<usize> = found.iter().flat_map(ReachedBlock::columns).collect();
        assert_eq!(columns, high);
        assert_eq!(found.iter().map(|f| f.block).collect::<Vec<_>>(), [0, 1, 2]);
        find_reaching(row.as_slice(), &[6.0, 3.0, f32::NAN], &mut found);
        let columns: Vec<usize> = found.iter().flat_map(ReachedBlock::columns).collect();
        assert_eq!(columns, [64 + 20, 100]);
    }
}
