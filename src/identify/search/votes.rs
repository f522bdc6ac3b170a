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

use super::pose_cells::{Alignments, CameraAxes, GRIDS, LANES, PoseCells, PoseGrids};
use super::queries::Similar;
use crate::identify::index::PackedVectors;
use crate::identify::priors::SkyRegion;

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
    /// The first query of the observed triangle: its number.
    triangle: u32,
    /// The catalogue triangle.
    pub similar: Similar,
    /// The cell in each grid.
    cells: [u32; GRIDS],
}

impl Vote {
    /// The number of the query that found the catalogue triangle.
    pub fn query(&self) -> usize {
        (self.triangle + self.similar.query) as usize
    }
}

/// A cell's number and a vote for it.
#[derive(Debug, Clone, Copy, Default)]
struct CellVote {
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
    grids: PoseGrids,
    alignments: Alignments,
    cells: PoseCells,
    votes: Vec<Vote>,
    /// Of each grid, sorted by cell, then in the order of the votes.
    entries: [Vec<CellVote>; GRIDS],
    spare: Vec<CellVote>,
    leaders: Vec<Leader>,
}

impl Votes {
    /// Begins with no votes, for poses of a frame of this width whose focal lengths are in a range
    /// (both in pixels) and whose optical axis is in a region.
    pub fn begin(&mut self, width_px: f64, focal_px: [f64; 2], near: Option<SkyRegion>) {
        self.votes.clear();
        self.leaders.clear();
        self.grids.set(width_px, focal_px, near);
    }

    /// The votes of an observed triangle for the poses in which it is one of the `similar` catalogue
    /// triangles. Each of its queries, the first of which is `triangle`, has it as it is in the camera.
    /// Votes of one triangle come one after the other.
    pub fn add_all(
        &mut self,
        in_camera: &[CameraAxes],
        similar: &[Similar],
        triangle: u32,
        stars: &PackedVectors,
    ) {
        // Only fetches, so that many fetches overlap.
        let corners = similar.iter().flat_map(|similar| similar.corners);
        let fetched = corners.fold(0, |all, corner| all ^ stars.packed(corner));
        std::hint::black_box(fetched);
        let Self {
            grids,
            alignments,
            cells,
            votes,
            ..
        } = self;
        for similar in similar.chunks(LANES) {
            for (lane, similar) in similar.iter().enumerate() {
                let sky = similar.corners.map(|corner| stars.get(corner));
                let in_camera = &in_camera[similar.query as usize];
                alignments.set(lane, sky, in_camera, similar.ln_focal);
            }
            grids.cells(alignments, cells);
            let allowed = similar.iter().enumerate();
            let allowed = allowed.filter(|(lane, _)| cells.allowed[*lane]);
            votes.extend(allowed.map(|(lane, similar)| Vote {
                triangle,
                similar: *similar,
                cells: cells.cells.map(|cells| cells[lane]),
            }));
        }
    }

    /// Number of votes.
    pub fn len(&self) -> usize {
        self.votes.len()
    }

    /// Counts the votes: the cells with most observed triangles lead.
    pub fn count(&mut self) {
        self.leaders.clear();
        for grid in 0..GRIDS {
            let mut entries = std::mem::take(&mut self.entries[grid]);
            entries.clear();
            let votes = self.votes.iter().zip(0..);
            entries.extend(votes.map(|(vote, number)| CellVote {
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

    fn add_leaders(&mut self, grid: usize, entries: &[CellVote]) {
        let mut first = 0;
        for cell in entries.chunk_by(|a, b| a.cell == b.cell) {
            let count = cell.len();
            if count >= MIN_TRIANGLES as usize {
                let triangle = |entry: &CellVote| self.votes[entry.vote as usize].triangle;
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

    /// A vote for a cell that leads, by its number: of each cell the middle one, the first and the
    /// last.
    pub fn leading(&self, number: usize) -> Option<Vote> {
        let leader = self.leaders.get(number / 3)?;
        let place = [leader.count / 2, 0, leader.count - 1][number % 3];
        let entry = self.entries[leader.grid][leader.first + place];
        Some(self.votes[entry.vote as usize])
    }
}

/// Sorts by cell and keeps the order within a cell: a radix sort.
fn sort_by_cell(entries: &mut Vec<CellVote>, spare: &mut Vec<CellVote>) {
    spare.clear();
    spare.resize(entries.len(), CellVote::default());
    for shift in (0..u32::BITS).step_by(DIGIT_BITS as usize) {
        let digit = |entry: &CellVote| (entry.cell >> shift) as usize % DIGITS;
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
    use crate::identify::search::aligned::InCamera;
    use nalgebra::Vector3;
    use proptest::prelude::*;

    const WIDTH_PX: f64 = 1000.0;

    /// The cells of the pose with these angles, in radians: optical axis and position angle.
    fn cells(votes: &Votes, [ra, dec, roll]: [f64; 3], focal_px: f64) -> Option<[u32; GRIDS]> {
        let boresight = UnitVector::from_ra_dec(ra, dec);
        let rotation = Rotation::<Icrs, Camera>::looking_at(&boresight, roll);
        let camera = [[0.1, 0.2], [-0.2, 0.1], [0.3, -0.1]]
            .map(|[x, y]| Vector3::new(x, y, 1.0).normalize());
        let sky = camera.map(|v| rotation.matrix().transpose() * v);
        let axes = CameraAxes::new(InCamera::new(&camera).as_ref());
        let mut alignments = Alignments::default();
        let sky = sky.map(|v| [v.x, v.y, v.z].map(|x| x as f32));
        alignments.set(0, sky, &axes, focal_px.ln() as f32);
        let mut cells = PoseCells::default();
        votes.grids.cells(&alignments, &mut cells);
        cells.allowed[0].then(|| cells.cells.map(|cells| cells[0]))
    }

    /// Adds a vote of `triangle` for a pose.
    fn add(votes: &mut Votes, triangle: u32, angles_rad: [f64; 3], focal_px: f64) {
        let cells = cells(votes, angles_rad, focal_px).unwrap();
        let similar = Similar {
            query: 0,
            corners: [triangle; 3],
            zero_point_mag: 0.0,
            ln_focal: focal_px.ln() as f32,
        };
        votes.votes.push(Vote {
            triangle,
            similar,
            cells,
        });
    }

    proptest! {
        #[test]
        fn the_pose_of_several_triangles_leads(
            ra in 0.0..6.2_f64, dec in -1.5..1.5_f64, roll in -3.0..3.0_f64, focal in 500.0..5000.0_f64,
            others in prop::collection::vec((0.0..6.2_f64, -1.5..1.5_f64, -3.0..3.0_f64), 0..200),
        ) {
            let mut votes = Votes::default();
            votes.begin(WIDTH_PX, [400.0, 6000.0], None);
            let boresight = UnitVector::from_ra_dec(ra, dec);
            for (triangle, &(other_ra, other_dec, roll)) in (0..).zip(&others) {
                // Another in the same cell would be right to vote for it.
                if UnitVector::<Icrs>::from_ra_dec(other_ra, other_dec).angle_to(&boresight) < 0.25 {
                    continue;
                }
                add(&mut votes, triangle, [other_ra, other_dec, roll], focal);
            }
            // Within a quarter of a cell of each other: together in a cell of one grid in most cases,
            // if not in all coordinates.
            for triangle in 1000..1006_u32 {
                let off = 0.01 * f64::from(triangle % 2) * (WIDTH_PX / focal).atan();
                // Each votes twice: that counts once.
                for _ in 0..2 {
                    add(&mut votes, triangle, [ra, dec + off, roll], focal * (1.0 + 0.1 * off));
                }
            }
            votes.count();
            let leading = (0..3).map(|number| votes.leading(number));
            prop_assert!(leading.flatten().filter(|vote| vote.triangle >= 1000).count() == 3);
            prop_assert!(votes.leaders[0].triangles <= 6);
        }

        #[test]
        fn only_poses_that_a_hint_allows_are_voted_for(
            ra in 0.0..6.2_f64, dec in -1.5..1.5_f64, roll in -3.0..3.0_f64,
        ) {
            let centre = UnitVector::from_ra_dec(2.0, 0.5);
            let near = SkyRegion { centre, radius_rad: 0.4 };
            let mut votes = Votes::default();
            votes.begin(WIDTH_PX, [400.0, 6000.0], Some(near));
            let apart_rad = UnitVector::from_ra_dec(ra, dec).angle_to(&centre);
            let cells = cells(&votes, [ra, dec, roll], 1000.0);
            // A cell is 0.06 of the field.
            prop_assert!(cells.is_some() || apart_rad > 0.4);
            prop_assert!(cells.is_none() || apart_rad < 0.4 + 0.1);
        }

        #[test]
        fn entries_are_sorted_as_a_stable_sort_does(
            cells in prop::collection::vec(prop_oneof![0..20_u32, any::<u32>()], 0..300),
        ) {
            let entries = cells.into_iter().zip(0..).map(|(cell, vote)| CellVote { cell, vote });
            let mut sorted: Vec<CellVote> = entries.collect();
            let mut expected = sorted.clone();
            expected.sort_by_key(|entry| entry.cell);
            sort_by_cell(&mut sorted, &mut Vec::new());
            let plain = |entries: &[CellVote]| -> Vec<_> {
                entries.iter().map(|entry| (entry.cell, entry.vote)).collect()
            };
            prop_assert_eq!(plain(&sorted), plain(&expected));
        }
    }
}
