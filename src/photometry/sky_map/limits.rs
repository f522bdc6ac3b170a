//! How faint stars go at each place, and how faint they should go: by the threshold there, and the limit of
//! the whole frame by the camera's description, or without one that of the clear parts of the frame.

use super::clouds::CellClouds;
use super::witnesses::{Sky, Witness};
use crate::base::statistics::Estimate;
use crate::photometry::completeness::{self, CountedStar};

/// The limits of a cell.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct CellLimits {
    /// The limit without clouds.
    pub expected_vmag: Option<f64>,
    /// The limit of the stars around it.
    pub measured_vmag: Option<Estimate>,
}

/// The limit of a whole frame by the camera's description.
#[doc(hidden)]
#[derive(Debug, Clone, Copy)]
pub struct StatedLimit {
    /// V magnitude.
    pub v_mag: f64,
    /// What the air that it is stated for takes from light of the frame's centre, in magnitudes.
    pub extinction_mag: f64,
}

impl StatedLimit {
    /// V magnitude of the limit in the air of a frame, as its stars show it.
    fn in_air_of(&self, sky: &Sky) -> f64 {
        sky.center_airmass().map_or(self.v_mag, |airmass| {
            let extinction_mag = sky.clear_sky.extinction_mag.value * airmass;
            self.v_mag + self.extinction_mag - extinction_mag
        })
    }
}

/// The limits of each cell.
pub(super) fn limits(
    sky: &Sky,
    witnesses: &[Witness],
    clouds: &[CellClouds],
    stated: Option<&StatedLimit>,
) -> Vec<CellLimits> {
    /// Stars of a limit.
    const MIN_STARS: usize = 20;
    let is_clear = |cell: usize| clouds[cell].clear.is_some_and(|clear| clear > 0.5);
    let counted = |witness: &Witness, v_mag: f64| CountedStar {
        v_mag,
        detected: witness.star.is_detected,
    };
    let relative: Vec<CountedStar> = witnesses
        .iter()
        .filter(|witness| is_clear(witness.cell))
        .map(|witness| counted(witness, witness.relative_mag))
        .collect();
    let own = completeness::measure(&relative, sky.chance).limit.ok();
    let by_model = stated
        .zip(sky.typical_depth_vmag())
        .map(|(stated, typical)| stated.in_air_of(sky) - typical);
    let over_depth = by_model.or(own.map(|own| own.v_mag));
    let of_cell = |cell: usize| {
        let Some(depth_vmag) = sky.depths[cell] else {
            return CellLimits::default();
        };
        let near: Vec<CountedStar> = witnesses
            .iter()
            .filter(|witness| sky.grid.weight(cell, &witness.star.direction).is_some())
            .map(|witness| counted(witness, witness.star.v_mag))
            .collect();
        let measured = (near.len() >= MIN_STARS)
            .then(|| completeness::measure(&near, sky.chance).limit.ok())
            .flatten();
        CellLimits {
            expected_vmag: over_depth.map(|over| over + depth_vmag),
            measured_vmag: measured.map(|limit| Estimate {
                value: limit.v_mag,
                sigma: limit.sigma_mag,
            }),
        }
    };
    (0..clouds.len()).map(of_cell).collect()
}
