//! Background and noise of a frame: view of the pixels -> [`Mesh`].
//!
//! 1. The frame is divided into cells (`CellGrid`), which threads share row by row
//!    ([`CellRows`]).
//! 2. Each cell gets a mean and a standard deviation that ignore stars ([`CellMeasurer`]).
//! 3. Gaps are filled, outliers replaced, the noise smoothed.
//! 4. Between the cells' centres both are interpolated.
//!
//! Cells in which the noise is cut off at the frame's lowest value are measured by themselves
//! ([`CutOff`]), before step 3.

mod cell_rows;
mod cells;
mod censored_noise;
mod clipping;
mod cut_off;
mod frame_background;
mod grid;
mod medians;
mod mesh;
mod mesh_config;
mod smoothing;

pub(crate) use cell_rows::CellRows;
pub(crate) use cells::{CellMeasurer, SlopePixels, measure_slopes};
pub(crate) use censored_noise::{CensoredNoise, MAX_DEPTH};
pub(crate) use clipping::DIFFERENCE_PX;
pub(crate) use cut_off::{CutOff, REACH_SIGMA};
pub(crate) use frame_background::{FrameBackground, median, rounding_sigma_adu, sigma_floor};
pub(crate) use grid::CellGrid;
pub(crate) use mesh::{Mesh, Piece};
pub(crate) use mesh_config::MeshConfig;
