//! The pixels of a frame: views of its rows, and blocks of columns.

mod aligned;
mod blocks;
mod view;

pub(crate) use aligned::{Aligned, LINE};
pub(crate) use blocks::{BLOCK_PX, BlockMaxima, Reached, find_reaching};
pub(crate) use view::{Rows, View};
