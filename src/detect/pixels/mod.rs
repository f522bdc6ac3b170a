//! The pixels of a frame: views of its rows, blocks of columns, sums and minima.

mod aligned;
mod blocks;
mod local_maxima;
mod reduce;
mod samples;
mod view;

pub(crate) use aligned::{AlignedBuffer, LINE};
pub(crate) use blocks::{
    BLOCK_PX, BlockMaxima, PixelLevel, ReachedBlock, bits_of, find_reaching, packed,
};
pub(crate) use local_maxima::{Widened, local_maxima, with_widened};
pub(crate) use reduce::{
    highest_in_columns, largest_magnitude_in_row, lower, lowest_in_row, pairwise_sum,
};
pub(crate) use samples::Samples;
pub(crate) use view::{PixelRows, View};
