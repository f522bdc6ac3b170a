//! The spots of all peaks as far as they are known, and those around each peak.

use crate::base::coords::PixelPoint;
use crate::base::neighbors::PointGrid;
use crate::detect::candidates::Peak;
use crate::detect::fit::{FrameMaps, MAX_SPOTS, SpotEstimate, SpotGroup};

/// The spots of all peaks, as far as they are known.
#[derive(Debug, Clone, Default)]
pub(super) struct KnownSpots {
    places: PointGrid,
    /// Peaks within this distance of each other are neighbors.
    reach_px: f64,
    /// The neighbors of the current peak, strongest first.
    neighbors: Vec<u32>,
    /// The spot of each peak: fitted once it was measured, before that the initial guess.
    pub(super) spots: Vec<SpotEstimate>,
    /// Whether the spot is reliable: the initial guess of a saturated one is not.
    is_known: Vec<bool>,
    /// Indices of the peaks without others within reach.
    pub(super) isolated: Vec<u32>,
    /// Indices of the peaks with others within reach.
    pub(super) crowded: Vec<u32>,
    /// The spots beyond the window of the current peak, see [`PeakSurroundings::beyond`].
    beyond: Vec<SpotEstimate>,
}

impl KnownSpots {
    /// Begins with the initial guesses of all peaks, of which those within `reach_px` of each other
    /// are crowded.
    pub(super) fn begin(&mut self, peaks: &[Peak], maps: &FrameMaps<'_>, reach_px: f64) {
        self.places.fill(peaks.len(), peaks.iter().map(place_of));
        self.reach_px = reach_px.max(1.0);
        self.spots.clear();
        self.spots
            .extend(peaks.iter().map(|p| maps.initial_guess(p)));
        self.is_known.clear();
        self.is_known.extend(peaks.iter().map(|p| !p.saturated));
        self.isolated.clear();
        self.crowded.clear();
        for index in 0..peaks.len() {
            self.find_neighbors(peaks, index);
            if self.neighbors.is_empty() {
                self.isolated.push(index as u32);
            } else {
                self.crowded.push(index as u32);
            }
        }
    }

    fn find_neighbors(&mut self, peaks: &[Peak], index: usize) {
        let neighbors = &mut self.neighbors;
        neighbors.clear();
        let place = place_of(&peaks[index]);
        self.places.for_each_within(&place, self.reach_px, |near| {
            if near.index != index {
                neighbors.push(near.index as u32);
            }
        });
        neighbors.sort_unstable();
    }

    /// Sets the fitted spot of a peak.
    pub(super) fn set(&mut self, index: usize, spot: SpotEstimate) {
        self.spots[index] = spot;
        self.is_known[index] = true;
    }

    /// Peak `index` with the spots around it; those closer than `touching_px` touch.
    pub(super) fn around<'a>(
        &'a mut self,
        index: usize,
        peaks: &'a [Peak],
        touching_px: f64,
    ) -> PeakSurroundings<'a> {
        self.find_neighbors(peaks, index);
        let mut start = SpotGroup::from_iter([self.spots[index]]);
        self.beyond.clear();
        for other in self.neighbors.iter().map(|&found| found as usize) {
            let (a, b) = (&peaks[index], &peaks[other]);
            let (dx, dy) = (a.x as f64 - b.x as f64, a.y as f64 - b.y as f64);
            let is_touching = dx * dx + dy * dy < touching_px * touching_px;
            if is_touching && start.len() < MAX_SPOTS {
                start.push(self.spots[other]);
            } else if self.is_known[other] {
                self.beyond.push(self.spots[other]);
            }
        }
        PeakSurroundings {
            peaks,
            index,
            near: &self.neighbors,
            start,
            beyond: &self.beyond,
        }
    }
}

fn place_of(peak: &Peak) -> PixelPoint {
    PixelPoint::new(peak.x as f64, peak.y as f64)
}

/// A peak and the spots around it.
pub(super) struct PeakSurroundings<'a> {
    /// All peaks.
    pub peaks: &'a [Peak],
    /// Index of the peak.
    pub index: usize,
    /// Indices of the peaks within reach.
    pub near: &'a [u32],
    /// Its own spot, and those that touch it: they are fitted together.
    pub start: SpotGroup,
    /// The others within reach: their light is subtracted from the window.
    pub beyond: &'a [SpotEstimate],
}

impl PeakSurroundings<'_> {
    /// The peak.
    pub fn peak(&self) -> &Peak {
        &self.peaks[self.index]
    }

    /// Whether another peak is within `reach_px` of a spot, and closer to it than this peak.
    pub fn has_other_at(&self, spot: SpotEstimate, reach_px: f64) -> bool {
        let distance = |peak: &Peak| libm::hypot(peak.x as f64 - spot.x, peak.y as f64 - spot.y);
        let nearest_px = distance(self.peak()).min(reach_px);
        let mut others = self.near.iter().map(|&other| &self.peaks[other as usize]);
        others.any(|other| distance(other) < nearest_px)
    }
}
