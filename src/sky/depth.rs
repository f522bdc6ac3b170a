//! How faint stars go in clear air, by the detection threshold of their place.

use super::brightness::{CellLevel, SkyLevels};
use super::clear_sky::ClearSky;
use crate::photometry::instrumental_mag;

/// V magnitude of a star in clear air at the threshold, in each cell; `None` where it shows no sky.
pub(super) fn depths(levels: &SkyLevels, clear_sky: &ClearSky) -> Vec<Option<f64>> {
    let depth = |cell: &CellLevel| {
        let limit_mag = instrumental_mag(cell.limit_adu / levels.exposure_s);
        let depth_vmag = clear_sky.v_mag(cell.airmass, cell.off_axis_sq(), limit_mag);
        depth_vmag.is_finite().then_some(depth_vmag)
    };
    levels.cells.iter().map(depth).collect()
}
