//! The largest regions of a frame that may be stars, each with its brightest peak.

use crate::detect::candidates::{Peak, Region};
use crate::detect::fit::FrameMaps;
use arrayvec::ArrayVec;

/// More regions tell no more.
pub(super) const MAX: usize = 24;

/// A region and its brightest peak.
#[derive(Debug, Clone, Copy)]
pub(super) struct LargeRegion<'a> {
    pub region: &'a Region,
    pub peak: &'a Peak,
}

/// The largest regions, of `peaks` that come brightest first. Where a star is saturated its charge may
/// run along a column; hot pixels are no light.
pub(super) fn largest_regions<'a>(
    maps: &FrameMaps<'_>,
    peaks: &'a [Peak],
    regions: &'a [Region],
) -> ArrayVec<LargeRegion<'a>, MAX> {
    let mut largest: ArrayVec<LargeRegion<'a>, MAX> = ArrayVec::new();
    for peak in peaks.iter().filter(|peak| !peak.saturated) {
        let region = &regions[peak.region];
        let rank = largest.partition_point(|other| other.region.area_px >= region.area_px);
        let is_taken = |other: &LargeRegion<'_>| other.peak.region == peak.region;
        if rank == MAX
            || largest.iter().any(is_taken)
            || maps.contrast_at(peak).is_sharper_than_any_spot()
        {
            continue;
        }
        if largest.is_full() {
            largest.pop();
        }
        largest.insert(rank, LargeRegion { region, peak });
    }
    largest
}
