//! Streaks of satellites and aircraft: long regions with many peaks, and chains of faint dashes.
//! Each is reduced to one peak.

use super::disjoint_sets::{self, join, root_of};
use super::peak::Peak;
use super::region::Region;

/// A chain of peaks of which each is close to another, and all are close to a straight line.
struct DashedStreak;

impl DashedStreak {
    /// Minimum number of dashes: fewer may be in line by chance.
    const MIN_DASHES: u32 = 5;
    /// Maximum distance between dashes, in spot widths,
    const MAX_GAP_SIGMA: f32 = 4.0;
    /// plus this, in pixels.
    const MAX_GAP_PX: f32 = 5.0;
    /// Maximum standard deviation across the line, in spot widths.
    const MAX_BREADTH_SIGMA: f64 = 1.2;
    /// Minimum standard deviation along the line, over that across it.
    const MIN_ELONGATION: f64 = 8.0;
}

/// Buffers of the search for streaks.
#[derive(Debug, Clone, Default)]
pub(super) struct Streaks {
    /// Whether a peak of each region was kept for its streak.
    is_represented: Vec<bool>,
    /// Indices of the peaks.
    order: Vec<u32>,
    /// Their columns and rows while they are in the order of the rows.
    places: Vec<[f32; 2]>,
    /// Disjoint sets of peaks that are close to each other.
    parents: Vec<u32>,
    /// Number of peaks in each set, at its representative.
    sizes: Vec<u32>,
}

impl Streaks {
    /// Keeps only the strongest peak of each region that is a streak; peaks come strongest first.
    pub fn reduce_regions(
        &mut self,
        peaks: &mut Vec<Peak>,
        regions: &[Region],
        spot_width_px: f32,
    ) {
        self.is_represented.clear();
        self.is_represented.resize(regions.len(), false);
        peaks.retain(|peak| {
            let is_represented = &mut self.is_represented[peak.region];
            !is_streak(&regions[peak.region], spot_width_px)
                || !std::mem::replace(is_represented, true)
        });
    }

    /// Joins the dashes of faint streaks: a chain of peaks in a straight line becomes one region,
    /// added to `regions`, with one peak.
    pub fn join_dashes(
        &mut self,
        peaks: &mut Vec<Peak>,
        regions: &mut Vec<Region>,
        spot_width_px: f32,
    ) {
        let max_gap_px = DashedStreak::MAX_GAP_SIGMA * spot_width_px + DashedStreak::MAX_GAP_PX;
        self.link_peaks(peaks, max_gap_px);
        for chain in self
            .order
            .chunk_by(|&a, &b| self.parents[a as usize] == self.parents[b as usize])
        {
            let mut streak = line_through(chain, peaks);
            streak.area_px = chain
                .iter()
                .map(|&i| regions[peaks[i as usize].region].area_px)
                .sum();
            let is_straight =
                streak.minor_px < DashedStreak::MAX_BREADTH_SIGMA * f64::from(spot_width_px);
            if !is_straight || streak.major_px < DashedStreak::MIN_ELONGATION * streak.minor_px {
                continue;
            }
            streak.peaks = 1;
            // The first peak is the strongest.
            peaks[chain[0] as usize].region = regions.len();
            for &other in &chain[1..] {
                // Marked for removal.
                peaks[other as usize].snr = f32::NAN;
            }
            regions.push(streak);
        }
        peaks.retain(|p| !p.snr.is_nan());
    }

    /// Finds chains of at least [`DashedStreak::MIN_DASHES`] peaks, each within `max_gap_px` of
    /// another: in `order` chain by chain, indices ascending, and in `parents` the chain of each.
    fn link_peaks(&mut self, peaks: &[Peak], max_gap_px: f32) {
        let Self {
            order,
            places,
            parents,
            sizes,
            ..
        } = self;
        order.clear();
        order.extend(0..peaks.len() as u32);
        order.sort_unstable_by_key(|&i| (peaks[i as usize].y, i));
        disjoint_sets::reset(parents, peaks.len());
        places.clear();
        places.extend(order.iter().map(|&i| {
            let peak = &peaks[i as usize];
            [peak.x as f32, peak.y as f32]
        }));
        for (rank, (&index, [x, y])) in order.iter().zip(&*places).enumerate() {
            let later = order[rank + 1..].iter().zip(&places[rank + 1..]);
            for (&other, [other_x, other_y]) in later {
                let (dx, dy) = (other_x - x, other_y - y);
                if dy > max_gap_px {
                    break;
                }
                if dx * dx + dy * dy <= max_gap_px * max_gap_px {
                    join(parents, index, other);
                }
            }
        }
        sizes.clear();
        sizes.resize(peaks.len(), 0);
        for index in 0..peaks.len() as u32 {
            let root = root_of(parents, index);
            parents[index as usize] = root;
            sizes[root as usize] += 1;
        }
        order.retain(|&i| sizes[parents[i as usize] as usize] >= DashedStreak::MIN_DASHES);
        order.sort_unstable_by_key(|&i| (parents[i as usize], i));
    }
}

/// Whether the region is one long streak with many peaks, and not a few stars in a row.
fn is_streak(region: &Region, spot_width_px: f32) -> bool {
    const MIN_PEAKS: usize = 4;
    /// Minimum ratio of the principal axes.
    const MIN_ELONGATION: f64 = 4.0;
    /// Minimum standard deviation along the longer axis, in spot widths.
    const MIN_LENGTH_SIGMA: f32 = 5.0;
    region.peaks >= MIN_PEAKS
        && region.major_px > MIN_ELONGATION * region.minor_px
        && region.major_px > f64::from(MIN_LENGTH_SIGMA * spot_width_px)
}

/// Centre and principal axes of some peaks, all with the same weight.
fn line_through(chain: &[u32], peaks: &[Peak]) -> Region {
    let members = chain.iter().map(|&i| &peaks[i as usize]);
    Region::of_points(members.map(|p| (p.x as f64, p.y as f64, 1.0)))
}
