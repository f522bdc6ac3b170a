//! How faint stars go at each place, and how faint they should go: by the threshold there, and the limit of
//! the centre by the camera's description, or without one that of the clear parts of the frame.

use super::clouds::CellClouds;
use super::star_counts::{CellStar, CloudInputs};
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

/// The limit at the centre of a frame with the threshold that is typical of it, by the camera's description.
#[derive(Debug, Clone, Copy)]
pub struct StatedLimit {
    /// V magnitude.
    pub v_mag: f64,
    /// What the air that it is stated for takes from light of the frame's centre, in magnitudes.
    pub extinction_mag: f64,
}

impl StatedLimit {
    /// V magnitude of the limit in the air of a frame, as its stars show it.
    fn in_air_of(&self, sky: &CloudInputs) -> f64 {
        sky.center_airmass().map_or(self.v_mag, |airmass| {
            let extinction_mag = sky.clear_sky.extinction_mag.value * airmass;
            self.v_mag + self.extinction_mag - extinction_mag
        })
    }
}

/// The limits of each cell.
pub(super) fn limits(
    sky: &CloudInputs,
    cell_stars: &[CellStar],
    clouds: &[CellClouds],
    stated: Option<&StatedLimit>,
) -> Vec<CellLimits> {
    let is_clear = |cell: usize| clouds[cell].clear.is_some_and(|clear| clear > 0.5);
    let relative: Vec<CountedStar> = cell_stars
        .iter()
        .filter(|cell_star| is_clear(cell_star.cell))
        .map(|cell_star| cell_star.counted(cell_star.relative_mag))
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
        let over = over_depth.and_then(|expected| {
            let alike = |other: usize| is_clear(other) == is_clear(cell);
            measured_over_depth(sky, (cell_stars, clouds), cell, expected, alike)
        });
        CellLimits {
            expected_vmag: over_depth.map(|over| over + depth_vmag),
            measured_vmag: over.map(|over| Estimate {
                value: over.value + depth_vmag,
                ..over
            }),
        }
    };
    (0..clouds.len()).map(of_cell).collect()
}

/// The limit of the stars around a cell, over the threshold; `expected` is that of a clear sky. Stars that are
/// not near are those of cells that are `alike`: clear, or behind clouds. Each counts as it would behind the
/// clouds of the cell. `None` where the sky has too few stars, or clouds hide them, or no star tells of the clouds.
fn measured_over_depth(
    sky: &CloudInputs,
    (cell_stars, clouds): (&[CellStar], &[CellClouds]),
    cell: usize,
    expected: f64,
    alike: impl Fn(usize) -> bool,
) -> Option<Estimate> {
    /// How much further stars are taken from, where few are near.
    const REACHES: [f64; 3] = [1.0, 2.0, 4.0];
    /// Stars above the expected limit. A choice by those that are found would prefer cells in which chance
    /// shows more.
    const MIN_BRIGHT: usize = 12;
    /// Error for each doubling of the reach and each airmass, in magnitudes: what thresholds do not tell of stars
    /// elsewhere. By clear frames of scripts/all_sky.py.
    const ELSEWHERE_MAG: f64 = 0.05;
    /// Largest standard error.
    const MAX_SIGMA_MAG: f64 = 0.5;
    // Elsewhere stars tell nothing of the clouds here.
    let here = clouds[cell].extinction_mag?;
    let near = |reach: f64| -> Vec<CountedStar> {
        let near = cell_stars.iter().filter(|cell_star| {
            let is_near = sky.grid.is_near(cell, &cell_star.star.direction, reach);
            is_near && (reach == 1.0 || alike(cell_star.cell))
        });
        let moved = |cell_star: &CellStar| {
            let there = clouds[cell_star.cell].extinction_mag;
            let more_mag = there.map_or(0.0, |there| there.value - here.value);
            cell_star.counted(cell_star.relative_mag + more_mag)
        };
        near.map(moved).collect()
    };
    let is_enough = |stars: &[CountedStar]| {
        let bright = stars.iter().filter(|star| star.v_mag < expected);
        bright.count() >= MIN_BRIGHT
    };
    let mut reaches = REACHES
        .into_iter()
        .map(|reach| (libm::log2(reach), near(reach)));
    let (doublings, stars) = reaches.find(|(_, stars)| is_enough(stars))?;
    let limit = completeness::measure(&stars, sky.chance).limit.ok()?;
    let airmass = sky.levels.cells[cell].airmass.unwrap_or(1.0);
    let elsewhere_mag = ELSEWHERE_MAG * airmass * doublings;
    let sigma = libm::hypot(libm::hypot(limit.sigma_mag, here.sigma), elsewhere_mag);
    (sigma < MAX_SIGMA_MAG).then_some(Estimate {
        value: limit.v_mag,
        sigma,
    })
}
