//! The stars as cell_stars of the sky in which they are.

use super::brightness::SkyLevels;
use super::clear_sky::ClearSky;
use super::grid::SkyCellGrid;
use super::stars::SkyStar;
use crate::base::coords::{Icrs, UnitVector};
use crate::photometry::completeness::CountedStar;
use crate::photometry::{IdentifiedFrame, instrumental_mag};

/// What is known of the sky before clouds.
pub(super) struct CloudInputs<'a> {
    /// The cells.
    pub grid: &'a SkyCellGrid<'a>,
    /// The stars.
    pub stars: &'a [SkyStar],
    /// The air without clouds.
    pub clear_sky: &'a ClearSky,
    /// How faint stars go in each cell.
    pub depths: &'a [Option<f64>],
    /// The frame.
    pub frame: &'a IdentifiedFrame<'a>,
    /// Where the Moon is, where the date is known.
    pub moon: Option<UnitVector<Icrs>>,
    /// Light and threshold of the cells.
    pub levels: &'a SkyLevels,
    /// Probability that a star has a detection by chance.
    pub chance: f64,
    /// Whether the clear sky is that of another frame.
    pub is_usual: bool,
}

/// A star as a cell_star of clouds.
pub(super) struct CellStar<'a> {
    /// The star.
    pub star: &'a SkyStar,
    /// Its cell.
    pub cell: usize,
    /// Its magnitude in clear air over that of the threshold at its place.
    pub relative_mag: f64,
}

impl CellStar<'_> {
    /// The star with a magnitude, as one that counts in a completeness.
    pub(super) fn counted(&self, v_mag: f64) -> CountedStar {
        CountedStar {
            v_mag,
            detected: self.star.is_detected,
        }
    }
}

impl CloudInputs<'_> {
    /// V magnitude of a star in clear air at the frame's centre and at the typical threshold: for these the
    /// limit is predicted. `None` where nothing was searched.
    pub(super) fn typical_depth_vmag(&self) -> Option<f64> {
        let limit_adu = self.frame.detections.flux_limits.typical()?;
        let limit_mag = instrumental_mag(limit_adu / self.levels.exposure_s);
        Some(self.clear_sky.v_mag(self.center_airmass(), 0.0, limit_mag))
    }

    /// Airmass of the frame's centre, where the horizon is known.
    pub(super) fn center_airmass(&self) -> Option<f64> {
        let center = self.grid.direction_of(&self.grid.camera().centre())?;
        self.frame.identification.places.airmass(&center)
    }

    /// The stars in cells whose depth is known.
    pub(super) fn star_counts(&self) -> Vec<CellStar<'_>> {
        let cell_star = |star| self.star_count(star);
        self.stars.iter().filter_map(cell_star).collect()
    }

    fn star_count<'s>(&self, star: &'s SkyStar) -> Option<CellStar<'s>> {
        let cell = self.grid.cell_of(&star.pixel, &star.direction)?;
        let limit_adu = self.frame.flux_limit_adu(&star.pixel)?;
        let limit_mag = instrumental_mag(limit_adu / self.levels.exposure_s);
        Some(CellStar {
            star,
            cell,
            relative_mag: -self.clear_sky.dimmer_mag(star, limit_mag) - star.brighter_mag,
        })
    }
}
