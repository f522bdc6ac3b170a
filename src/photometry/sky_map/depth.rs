//! How faint stars go in a cell, by its noise and its threshold.

use super::brightness::{CellLevel, Levels};
use super::clear_sky::ClearSky;
use crate::photometry::instrumental_mag;
use crate::photometry::zero_point::REFERENCE_BV_MAG;

/// How faint stars go in a cell, by its noise.
#[derive(Debug, Clone, Copy)]
pub(super) struct Depth {
    /// V magnitude of a star in clear air whose flux is the noise of a pixel.
    pub noise_vmag: f64,
    /// V magnitude of a star in clear air at the threshold.
    pub threshold_vmag: f64,
}

/// The depth of each cell; `None` where it shows no sky.
pub(super) fn depths(levels: &Levels, clear_sky: &ClearSky) -> Vec<Option<Depth>> {
    let depth = |cell: &CellLevel| {
        let zero_point =
            clear_sky.zero_point_at(cell.airmass, cell.off_centre_sq, Some(REFERENCE_BV_MAG));
        let vmag_of = |flux_adu: f64| zero_point + instrumental_mag(flux_adu / levels.exposure_s);
        (cell.noise_adu > 0.0 && zero_point.is_finite()).then(|| Depth {
            noise_vmag: vmag_of(cell.noise_adu),
            threshold_vmag: vmag_of(cell.limit_adu),
        })
    };
    levels.cells.iter().map(depth).collect()
}
