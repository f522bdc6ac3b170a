//! How a mesh is measured.

/// What is sampled for a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Sampled {
    /// Pixels of a frame. Their noise is measured on differences between pixels two columns apart,
    /// which gradients do not widen.
    Pixels,
    /// Pixels of a filtered frame, whose background is about 0 and whose noise is about 1.
    Filtered,
}

/// How a mesh is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct MeshConfig {
    /// Wanted side of a cell, in pixels.
    pub cell_px: usize,
    /// What is sampled.
    pub sampled: Sampled,
    /// Least noise of a cell.
    pub sigma_floor: f32,
    /// Of large cells, every this many rows of pixels are sampled.
    pub row_stride: usize,
}

/// Rows from one that is sampled to the next.
const ROW_STRIDE: usize = 4;
/// The same where a rough background will do: that of a cell is known to a sixteenth of the noise.
const SPARSE_ROW_STRIDE: usize = 16;

impl MeshConfig {
    /// The mesh of a frame.
    pub const fn of_pixels(cell_px: usize, sigma_floor: f32) -> Self {
        Self {
            cell_px,
            sampled: Sampled::Pixels,
            sigma_floor,
            row_stride: ROW_STRIDE,
        }
    }

    /// The same from a quarter of the pixels.
    pub const fn sparse(self) -> Self {
        Self {
            row_stride: SPARSE_ROW_STRIDE,
            ..self
        }
    }

    /// The mesh of a filtered frame.
    pub const fn of_filtered(cell_px: usize, sigma_floor: f32) -> Self {
        Self {
            cell_px,
            sampled: Sampled::Filtered,
            sigma_floor,
            row_stride: ROW_STRIDE,
        }
    }
}
