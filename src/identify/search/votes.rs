//! Votes for poses: true triangles agree on one, false ones scatter.
//!
//! poses → cells of optical axis, direction of the x axis, scale and parity → the cells that most
//! observed triangles voted for
//!
//! There are two grids of cells, shifted by half a cell: a pose near the border of a cell of one
//! grid is inside a cell of the other.
//!
//! # Reference
//! Ballard 1981, Pattern Recognition 13, 111: the generalized Hough transform.

use super::confirmation::Pose;

/// Size of a cell: of the optical axis in units of the field's width, …
const AXIS_STEP: f64 = 0.06;
/// … of the direction of the x axis in radians, …
const ROLL_STEP: f64 = 0.09;
/// … and of the logarithm of the focal length.
const SCALE_STEP: f64 = 0.05;
/// Shifts of the grids, in cells.
const SHIFTS: [f64; GRIDS] = [0.0, 0.5];
const GRIDS: usize = 2;
/// Fewer triangles in a cell agree by chance everywhere.
const MIN_TRIANGLES: u32 = 3;
/// Cells that are looked at.
const MAX_LEADERS: usize = 100;
/// Bits of a cell's number by which votes are sorted in each pass.
const DIGIT_BITS: u32 = 11;
const DIGITS: usize = 1 << DIGIT_BITS;

/// A vote for the pose that an observed triangle has if it is one of the catalogue.
#[derive(Debug, Clone, Copy)]
pub struct Vote {
    /// The observed triangle, by its number.
    triangle: u32,
    /// The query that found the catalogue triangle.
    pub query: u32,
    /// The stars of the catalogue triangle.
    pub corners: [u32; 3],
    /// The cell in each grid.
    cells: [u32; GRIDS],
}

/// A cell's number and a vote for it.
#[derive(Debug, Clone, Copy, Default)]
struct Entry {
    cell: u32,
    vote: u32,
}

/// A cell with many votes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Leader {
    /// Observed triangles that voted for it.
    triangles: u32,
    grid: usize,
    /// Its votes among the sorted entries.
    first: usize,
    count: usize,
}

/// Collects votes. Its buffers are reused.
#[derive(Debug, Default)]
pub struct Votes {
    votes: Vec<Vote>,
    /// Of each grid, sorted by cell, then in the order of the votes.
    entries: [Vec<Entry>; GRIDS],
    spare: Vec<Entry>,
    leaders: Vec<Leader>,
}

impl Votes {
    /// Removes all votes.
    pub fn clear(&mut self) {
        self.votes.clear();
        self.leaders.clear();
    }

    /// Adds a vote for `pose` in a frame of this width. Votes of one triangle come one after the
    /// other.
    pub fn add(
        &mut self,
        pose: &Pose,
        width_px: f64,
        triangle: u32,
        query: u32,
        corners: [u32; 3],
    ) {
        self.votes.push(Vote {
            triangle,
            query,
            corners,
            cells: SHIFTS.map(|shift| cell_of(pose, width_px, shift)),
        });
    }

    /// Counts the votes: the cells with most triangles lead.
    pub fn count(&mut self) {
        self.leaders.clear();
        for grid in 0..GRIDS {
            let mut entries = std::mem::take(&mut self.entries[grid]);
            entries.clear();
            let votes = self.votes.iter().zip(0..);
            entries.extend(votes.map(|(vote, number)| Entry {
                cell: vote.cells[grid],
                vote: number,
            }));
            sort_by_cell(&mut entries, &mut self.spare);
            self.add_leaders(grid, &entries);
            self.entries[grid] = entries;
        }
        // The order is that of the votes where numbers are equal.
        self.leaders.sort_unstable_by_key(|leader| {
            (
                std::cmp::Reverse(leader.triangles),
                leader.grid,
                leader.first,
            )
        });
        self.leaders.truncate(MAX_LEADERS);
    }

    fn add_leaders(&mut self, grid: usize, entries: &[Entry]) {
        let mut first = 0;
        for cell in entries.chunk_by(|a, b| a.cell == b.cell) {
            let count = cell.len();
            if count >= MIN_TRIANGLES as usize {
                let triangle = |entry: &Entry| self.votes[entry.vote as usize].triangle;
                let others = cell
                    .windows(2)
                    .filter(|pair| triangle(&pair[0]) != triangle(&pair[1]));
                let triangles = 1 + others.count() as u32;
                if triangles >= MIN_TRIANGLES {
                    self.leaders.push(Leader {
                        triangles,
                        grid,
                        first,
                        count,
                    });
                }
            }
            first += count;
        }
    }

    /// Number of cells that lead.
    pub fn leaders(&self) -> usize {
        self.leaders.len()
    }

    /// Votes for the cell of this rank: the middle one, the first and the last.
    pub fn votes_for(&self, rank: usize) -> impl Iterator<Item = Vote> + use<> {
        let Leader {
            grid, first, count, ..
        } = self.leaders[rank];
        let of = |place: usize| self.votes[self.entries[grid][first + place].vote as usize];
        [of(count / 2), of(0), of(count - 1)].into_iter()
    }
}

/// The number of the cell of a pose, in a frame of this width.
fn cell_of(pose: &Pose, width_px: f64, shift: f64) -> u32 {
    let level = (pose.focal_px.ln() / SCALE_STEP + shift).floor();
    // The same for all poses of the level.
    let focal_px = ((level + 0.5 - shift) * SCALE_STEP).exp();
    let axis_step = AXIS_STEP * (width_px / focal_px).atan();
    let (axis, side) = (pose.sky_to_camera.row(2), pose.sky_to_camera.row(0));
    let mut hash = (level as i64 as u64) << 1 | u64::from(pose.mirrored);
    let mut mix = |coordinate: f64| {
        hash =
            (hash ^ (coordinate + shift).floor() as i64 as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        hash ^= hash >> 29;
    };
    axis.iter().for_each(|x| mix(x / axis_step));
    side.iter().for_each(|x| mix(x / ROLL_STEP));
    (hash >> 32) as u32
}

/// Sorts by cell and keeps the order within a cell: a radix sort.
fn sort_by_cell(entries: &mut Vec<Entry>, spare: &mut Vec<Entry>) {
    spare.clear();
    spare.resize(entries.len(), Entry::default());
    for shift in (0..u32::BITS).step_by(DIGIT_BITS as usize) {
        let digit = |entry: &Entry| (entry.cell >> shift) as usize % DIGITS;
        let mut starts = [0_u32; DIGITS];
        for entry in entries.iter() {
            starts[digit(entry)] += 1;
        }
        let mut end = 0;
        for start in &mut starts {
            let count = *start;
            *start = end;
            end += count;
        }
        for entry in entries.iter() {
            let place = &mut starts[digit(entry)];
            spare[*place as usize] = *entry;
            *place += 1;
        }
        std::mem::swap(entries, spare);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::coords::{Camera, Icrs, Rotation, UnitVector};
    use proptest::prelude::*;

    const WIDTH_PX: f64 = 1000.0;

    fn pose(ra_rad: f64, dec_rad: f64, roll_rad: f64, focal_px: f64) -> Pose {
        let boresight = UnitVector::from_ra_dec(ra_rad, dec_rad);
        let rotation = Rotation::<Icrs, Camera>::looking_at(&boresight, roll_rad);
        Pose {
            sky_to_camera: *rotation.matrix(),
            focal_px,
            mirrored: false,
        }
    }

    proptest! {
        #[test]
        fn the_pose_of_several_triangles_leads(
            ra in 0.0..6.2_f64, dec in -1.5..1.5_f64, roll in -3.0..3.0_f64, focal in 500.0..5000.0_f64,
            others in prop::collection::vec((0.0..6.2_f64, -1.5..1.5_f64, -3.0..3.0_f64), 0..200),
        ) {
            let mut votes = Votes::default();
            for (triangle, &(ra, dec, roll)) in (0..).zip(&others) {
                votes.add(&pose(ra, dec, roll, focal), WIDTH_PX, triangle, 0, [0; 3]);
            }
            // Within a quarter of a cell of each other: together in a cell of one grid in most cases,
            // if not in all coordinates.
            for triangle in 0..6_u32 {
                let off = 0.01 * f64::from(triangle % 2) * (WIDTH_PX / focal).atan();
                let near = pose(ra, dec + off, roll, focal * (1.0 + 0.1 * off));
                // Each votes twice: that counts once.
                for _ in 0..2 {
                    votes.add(&near, WIDTH_PX, 1000 + triangle, 1, [triangle; 3]);
                }
            }
            votes.count();
            prop_assert!(votes.leaders() > 0);
            prop_assert!(votes.votes_for(0).all(|vote| vote.query == 1));
            prop_assert!(votes.leaders[0].triangles <= 6);
        }

        #[test]
        fn entries_are_sorted_as_a_stable_sort_does(
            cells in prop::collection::vec(prop_oneof![0..20_u32, any::<u32>()], 0..300),
        ) {
            let entries = cells.into_iter().zip(0..).map(|(cell, vote)| Entry { cell, vote });
            let mut sorted: Vec<Entry> = entries.collect();
            let mut expected = sorted.clone();
            expected.sort_by_key(|entry| entry.cell);
            sort_by_cell(&mut sorted, &mut Vec::new());
            let plain = |entries: &[Entry]| -> Vec<_> {
                entries.iter().map(|entry| (entry.cell, entry.vote)).collect()
            };
            prop_assert_eq!(plain(&sorted), plain(&expected));
        }
    }
}
