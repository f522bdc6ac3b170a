//! Gathers the pixels of the filtered frame that may lie above the threshold, one row of cells at a
//! time.
//!
//! The noise of the filtered frame is not known everywhere until all rows of cells are filtered. So
//! pixels are gathered down to a lower cut first, and compared with the threshold later.

use crate::detect::filter::FilteredBand;
use crate::detect::pixels::{
    BLOCK_PX, ReachedBlock, find_reaching, highest_in_columns, local_maxima,
};
use std::ops::Range;

/// The values to the left, to the right, above and below a pixel.
pub(super) type Adjacent = [f32; 4];

/// The pixels of a row of cells that may lie above the threshold.
#[derive(Debug, Clone, Default)]
pub(crate) struct Candidates {
    /// Spans with all pixels of the filtered frame at or above their cuts, in reading order.
    spans: Vec<CandidateSpan>,
    /// The pixels of the spans, one after the other.
    values: Vec<f32>,
    /// The values next to each local maximum, in reading order.
    adjacent: Vec<Option<Adjacent>>,
    /// How many pixels are at or above their cuts.
    count: usize,
    /// The cut for each block of columns, in units of the background noise.
    cuts: Vec<f32>,
    /// The blocks of the current row that reach the cut.
    blocks: Vec<ReachedBlock>,
}

/// The pixels of a block of columns from the first to the last candidate.
#[derive(Debug, Clone, Copy)]
struct CandidateSpan {
    /// Column of the first pixel.
    x: u32,
    /// Row.
    y: u32,
    /// Number of pixels.
    length: u32,
    /// The local maxima among the candidates: one bit for each pixel, the lowest for the first.
    maxima: u64,
}

/// A span of pixels, some of them candidates.
#[derive(Debug, Clone, Copy)]
pub(super) struct PixelSpan<'a> {
    /// Column of the first pixel.
    pub x: u32,
    /// Row.
    pub y: u32,
    /// The pixels: at most [`BLOCK_PX`].
    pub values: &'a [f32],
    /// The local maxima among the candidates: one bit for each pixel, the lowest for the first.
    pub maxima: u64,
    /// The values next to each of them.
    pub adjacent: &'a [Option<Adjacent>],
}

impl Candidates {
    /// Gathers the pixels of `rows` of `band` at or above the cut of their block of columns; ends
    /// after the row in which they become more than `most`. Raises the `maxima` of the blocks that
    /// hold any, row by row, if these are given.
    ///
    /// The band holds one more row on either side, where the frame has it.
    pub fn gather(
        &mut self,
        band: &FilteredBand,
        rows: Range<usize>,
        cuts: &[f32],
        most: usize,
        maxima: Option<&mut [f32]>,
    ) {
        self.spans.clear();
        self.values.clear();
        self.adjacent.clear();
        self.count = 0;
        self.cuts.clear();
        self.cuts.extend_from_slice(cuts);
        let mut maxima = maxima.map(|maxima| maxima.chunks_mut(cuts.len().max(1)));
        for y in rows {
            let maxima = maxima.as_mut().and_then(Iterator::next);
            if self.count > most {
                break;
            }
            let around = [y.checked_sub(1), Some(y), Some(y + 1)].map(|y| band.row(y?));
            self.gather_row(around, y, maxima);
        }
    }

    /// Gathers the candidates in row `y`, given between the rows above and below.
    fn gather_row(&mut self, rows: [Option<&[f32]>; 3], y: usize, mut maxima: Option<&mut [f32]>) {
        let Some(row) = rows[1] else { return };
        find_reaching(row, &self.cuts, &mut self.blocks);
        for &ReachedBlock { block, bits } in &self.blocks {
            let first = block * BLOCK_PX;
            let skipped = bits.trailing_zeros();
            let span =
                first + skipped as usize..first + (u64::BITS - bits.leading_zeros()) as usize;
            let maxima_in_block = bits & local_maxima(rows, first);
            self.spans.push(CandidateSpan {
                x: span.start as u32,
                y: y as u32,
                length: span.len() as u32,
                maxima: maxima_in_block >> skipped,
            });
            let tops = ReachedBlock {
                block,
                bits: maxima_in_block,
            }
            .columns();
            self.adjacent.extend(tops.map(|x| adjacent_values(rows, x)));
            self.count += bits.count_ones() as usize;
            if let Some(maxima) = &mut maxima {
                maxima[block] = highest_in_columns(maxima[block], &row[span.clone()]);
            }
            self.values.extend_from_slice(&row[span]);
        }
    }

    /// The spans that hold candidates, in reading order.
    pub(super) fn spans(&self) -> impl Iterator<Item = PixelSpan<'_>> {
        let (mut values, mut adjacent) = (self.values.as_slice(), self.adjacent.as_slice());
        self.spans.iter().map(move |span| {
            let (of_span, rest) = values.split_at(span.length as usize);
            values = rest;
            let (tops, rest) = adjacent.split_at(span.maxima.count_ones() as usize);
            adjacent = rest;
            PixelSpan {
                x: span.x,
                y: span.y,
                values: of_span,
                maxima: span.maxima,
                adjacent: tops,
            }
        })
    }

    /// How many were gathered.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether all pixels at or above the `lowest` of each block were gathered.
    pub fn reach_down_to(&self, lowest: &[f32]) -> bool {
        let mut cuts = self.cuts.iter().zip(lowest);
        cuts.all(|(cut, lowest)| cut <= lowest)
    }
}

/// The values next to a pixel of the middle row; `None` at the border.
fn adjacent_values([above, row, below]: [Option<&[f32]>; 3], x: usize) -> Option<Adjacent> {
    let [left, _, right] = *row?.get(x.checked_sub(1)?..)?.first_chunk()?;
    Some([left, right, above?[x], below?[x]])
}
