//! The pixels of a frame: views of its rows, blocks of columns, sums and minima.

mod aligned;
mod blocks;
mod reduce;
mod samples;
mod view;

pub(crate) use aligned::{Aligned, LINE};
pub(crate) use blocks::{BLOCK_PX, BlockMaxima, ReachedBlock, find_reaching};
pub(crate) use reduce::{largest_magnitude_in_row, lower, lowest_in_row, pairwise_sum};
pub(crate) use samples::Samples;
pub(crate) use view::{PixelRows, View};
