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
        witnesses: &[CellStar],
        clear_sky: &ClearSky,
        chance: f64,
    ) -> Option<Self> {
        /// Largest share of bright stars that is lost under a clear sky: doubles, wrong magnitudes.
        const MAX_LOST: f64 = 0.05;
        /// Stars near which another one is dimmed by more than these standard deviations are behind clouds.
        const DIMMED_SIGMAS: f64 = 3.0;
        let is_dimmed = |witness: &&CellStar| {
            let dimmed_by = clear_sky.dimmed_by(witness.star);
            dimmed_by.is_some_and(|dimmed_by| dimmed_by.value > DIMMED_SIGMAS * dimmed_by.sigma)
        };
        let cells = 1 + witnesses.iter().map(|witness| witness.cell).max()?;
        let mut dimmed = vec![[0usize; 2]; cells];
        for witness in witnesses
            .iter()
            .filter(|witness| witness.star.measured.is_some())
        {
            dimmed[witness.cell][0] += 1;
            dimmed[witness.cell][1] += usize::from(is_dimmed(&witness));
        }
        let is_clear = |witness: &&CellStar| {
            let [all, dimmed] = dimmed[witness.cell];
            all > 0 && 4 * dimmed <= all
        };
        let counted: Vec<CountedStar> = witnesses
            .iter()
            .filter(is_clear)
            .map(|witness| witness.counted(witness.relative_mag))
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
