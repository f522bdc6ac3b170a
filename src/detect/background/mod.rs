//! Step 1: background and noise of the frame on a mesh of cells.

mod medians;
mod mesh;
mod strips;

pub(crate) use medians::sum_of;
pub(crate) use mesh::{CellScratch, Mesh, MeshConfig, Piece};
pub(crate) use strips::{Strips, on_each};
