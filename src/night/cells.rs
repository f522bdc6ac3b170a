//! The sky at each place of a frame, on the grid that all frames of a night share.

use crate::base::format::to_decimals;
use crate::photometry::sky_map::{Place, SkyCell, SkyMap, horizon_places};
use serde::{Deserialize, Serialize};

/// The sky in the cells of [`horizon_places`], in their order; `null` where nothing is known.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct NightCells {
    /// Brightness: V magnitude of a square arcsecond.
    pub mag_arcsec2: Vec<Option<f32>>,
    /// Extinction beyond that of clear air, in magnitudes.
    pub extinction_mag: Vec<Option<f32>>,
    /// Probability that this is below 0.2 mag.
    pub clear: Vec<Option<f32>>,
}

impl NightCells {
    /// Those of a sky that is divided by altitude and azimuth, else `None`.
    pub(super) fn of(sky: &SkyMap) -> Option<Self> {
        const DECIMALS: i32 = 2;
        let places = horizon_places();
        let mut cells = sky.cells.iter().peekable();
        let mut found = Self::default();
        // Both are in the same order.
        for place in &places {
            let cell = cells.next_if(|cell| cell.place == *place);
            let value = |of: fn(&SkyCell) -> Option<f64>| {
                let value = cell.and_then(of)?;
                Some(to_decimals(value, DECIMALS) as f32)
            };
            found
                .mag_arcsec2
                .push(value(|cell| Some(cell.light?.mag_arcsec2.value)));
            found
                .extinction_mag
                .push(value(|cell| Some(cell.extinction_mag?.value)));
            found.clear.push(value(|cell| cell.clear));
        }
        (sky.cells.len() > 1 && cells.peek().is_none()).then_some(found)
    }
}

/// Altitude and azimuth of the middle of each cell, in degrees.
pub(super) fn middles_deg() -> Vec<[f64; 2]> {
    let middle = |range: [f64; 2]| 0.5 * (range[0] + range[1]);
    let of = |place: &Place| match *place {
        Place::Horizon {
            altitude_deg,
            azimuth_deg,
        } => [middle(altitude_deg), middle(azimuth_deg)],
        Place::Frame { .. } => [f64::NAN; 2],
    };
    horizon_places().iter().map(of).collect()
}
