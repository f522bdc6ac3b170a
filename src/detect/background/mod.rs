//! Background and noise of a frame: view of the pixels -> [`Mesh`].
//!
//! 1. The frame is divided into cells (`CellGrid`), which threads share row by row
//!    ([`CellRows`]).
//! 2. Each cell gets a mean and a standard deviation that ignore stars ([`CellMeasurer`]).
//! 3. Gaps are filled, outliers replaced, the noise smoothed.
//! 4. Between the cells' centres both are interpolated.

mod cell_rows;
mod cells;
mod clipping;
mod frame_background;
mod grid;
mod medians;
mod mesh;
mod mesh_config;
mod smoothing;

pub(crate) use cell_rows::CellRows;
pub(crate) use cells::CellMeasurer;
pub(crate) use frame_background::{FrameBackground, median, rounding_sigma_adu, sigma_floor};
pub(crate) use mesh::{Mesh, Piece};
pub(crate) use mesh_config::MeshConfig;
