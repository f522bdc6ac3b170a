//! The completeness of a clear sky.

use super::clear_sky::ClearSky;
use super::star_counts::CellStar;
use crate::photometry::completeness::{self, CountedStar, Limit};

/// The magnitude at which half of the stars are detected, over that of the threshold: about 0.
pub(super) struct RelativeLimit(Limit);

impl RelativeLimit {
    /// That of the stars that are not dimmed, as far as is known: clouds are not in it where most of the
    /// sky is clear.
    ///
    /// Clouds hide whole stars, too: a larger share of lost ones than is usual is theirs.
    pub(super) fn of_clear_sky(
        cell_stars: &[CellStar],
        clear_sky: &ClearSky,
        chance: f64,
    ) -> Option<Self> {
        /// Largest share of bright stars that is lost under a clear sky: doubles, wrong magnitudes.
        const MAX_LOST: f64 = 0.05;
        /// Stars near which another one is dimmed by more than these standard deviations are behind clouds.
        const DIMMED_SIGMAS: f64 = 3.0;
        let is_dimmed = |cell_star: &&CellStar| {
            let dimmed_by = clear_sky.dimmed_by(cell_star.star);
            dimmed_by.is_some_and(|dimmed_by| dimmed_by.value > DIMMED_SIGMAS * dimmed_by.sigma)
        };
        let cells = 1 + cell_stars.iter().map(|cell_star| cell_star.cell).max()?;
        let mut dimmed = vec![[0usize; 2]; cells];
        for cell_star in cell_stars
            .iter()
            .filter(|cell_star| cell_star.star.measured.is_some())
        {
            dimmed[cell_star.cell][0] += 1;
            dimmed[cell_star.cell][1] += usize::from(is_dimmed(&cell_star));
        }
        let is_clear = |cell_star: &&CellStar| {
            let [all, dimmed] = dimmed[cell_star.cell];
            all > 0 && 4 * dimmed <= all
        };
        let counted: Vec<CountedStar> = cell_stars
            .iter()
            .filter(is_clear)
            .map(|cell_star| cell_star.counted(cell_star.relative_mag))
            .collect();
        let limit = completeness::measure(&counted, chance).limit.ok()?;
        Some(Self(Limit {
            lost: limit.lost.min(MAX_LOST),
            ..limit
        }))
    }

    /// That of most frames: half of the stars at the threshold are above it by their noise.
    pub(super) fn usual() -> Self {
        Self(Limit {
            v_mag: 0.0,
            sigma_mag: 0.1,
            width_mag: 0.25,
            lost: 0.02,
        })
    }

    /// The probability that a star is detected.
    pub(super) fn probability(&self, relative_mag: f64) -> f64 {
        let Self(limit) = self;
        limit.probability(relative_mag)
    }
}
