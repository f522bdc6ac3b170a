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

use super::queries::Similar;
use crate::identify::priors::SkyRegion;
use crate::sky::catalog::sky_grid::SkyGrid;
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::PI;

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

/// Levels of the scale start at a focal length of this logarithm, in pixels, below any.
const LEVELS_FROM: f64 = -10.0;
/// Coordinates of cells are counted from this number, so that none is negative.
const CELLS_FROM: f64 = 1e6;
/// The pose of a triangle may be outside the region that a hint allows by this part of a cell, and the
/// true one inside.
const NEAR_SLACK: f64 = 1.0;

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

/// An observed triangle beside those of the catalogue: an orthonormal frame of it in the camera, not
/// mirrored and mirrored.
#[derive(Debug, Clone, Copy)]
pub struct InCamera {
    frames: [Matrix3<f64>; 2],
    triple: f64,
}

/// A frame of a triangle in the camera and the same in the sky: where the camera points (TRIAD).
pub struct Aligned<'a> {
    /// Whether the x axis is reversed.
    pub mirrored: bool,
    /// The frame in the camera.
    pub of_camera: &'a Matrix3<f64>,
    /// The frame in the sky.
    pub of_sky: Matrix3<f64>,
}

impl InCamera {
    /// The triangle of these unit vectors.
    pub fn new(vectors: &[Vector3<f64>; 3]) -> Option<Self> {
        let mirrored = vectors.map(|v| Vector3::new(-v.x, v.y, v.z));
        Some(Self {
            frames: [frame_of(vectors)?, frame_of(&mirrored)?],
            triple: triple(vectors),
        })
    }

    /// The triangle aligned with that of the catalogue whose stars have these unit vectors.
    #[inline]
    pub fn aligned(&self, sky: &[Vector3<f64>; 3]) -> Option<Aligned<'_>> {
        let mirrored = self.triple * triple(sky) < 0.0;
        Some(Aligned {
            mirrored,
            of_camera: &self.frames[usize::from(mirrored)],
            of_sky: frame_of(sky)?,
        })
    }
}

/// An orthonormal frame of a triangle: the middle of AB, and the normal to AB.
fn frame_of([a, b, _]: &[Vector3<f64>; 3]) -> Option<Matrix3<f64>> {
    let first = (a + b).try_normalize(1e-12)?;
    let third = a.cross(b).try_normalize(1e-15)?;
    Some(Matrix3::from_columns(&[first, third.cross(&first), third]))
}

/// The triple product of three vectors.
fn triple([a, b, c]: &[Vector3<f64>; 3]) -> f64 {
    a.cross(b).dot(c)
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

/// Cells of one level of the scale.
#[derive(Debug, Clone, Copy)]
struct Level {
    /// Cells of the optical axis in a unit vector's coordinate of 1.
    axis_cells: f64,
    /// Least cosine of the optical axis to the middle of the region that a hint allows.
    min_cos: f64,
}

/// Collects votes. Its buffers are reused.
#[derive(Debug, Default)]
pub struct Votes {
    near: Option<SkyRegion>,
    levels: [Vec<Level>; GRIDS],
    first_level: [i32; GRIDS],
    votes: Vec<Vote>,
    /// Of each grid, sorted by cell, then in the order of the votes.
    entries: [Vec<Entry>; GRIDS],
    spare: Vec<Entry>,
    leaders: Vec<Leader>,
}

impl Votes {
    /// Begins with no votes, for poses of a frame of this width whose focal lengths are in a range
    /// (both in pixels) and whose optical axis is in a region.
    pub fn begin(&mut self, width_px: f64, focal_px: [f64; 2], near: Option<SkyRegion>) {
        self.votes.clear();
        self.leaders.clear();
        self.near = near;
        for (grid, shift) in SHIFTS.into_iter().enumerate() {
            let level_of = |focal_px: f64| level(focal_px.ln(), grid);
            let [first, last] = focal_px.map(level_of);
            self.first_level[grid] = first - 1;
            let levels = &mut self.levels[grid];
            levels.clear();
            levels.extend((first - 1..=last + 1).map(|level| {
                let middle = (f64::from(level) + 0.5 - shift) * SCALE_STEP + LEVELS_FROM;
                let step_rad = AXIS_STEP * (width_px / middle.exp()).atan();
                let min_cos = near.map_or(-1.0, |near| {
                    (near.radius_rad + NEAR_SLACK * step_rad).min(PI).cos()
                });
                Level {
                    axis_cells: 1.0 / step_rad,
                    min_cos,
                }
            }));
        }
    }

    /// The votes of an observed triangle for the poses in which it is one of the `similar` catalogue
    /// triangles. Each of its queries, the first of which is `triangle`, has it as it is in the camera.
    /// Votes of one triangle come one after the other.
    pub fn add_all(
        &mut self,
        in_camera: &[Option<InCamera>],
        similar: &[Similar],
        triangle: u32,
        stars: &SkyGrid,
    ) {
        // Only fetches, so that many fetches overlap.
        let corners = similar.iter().flat_map(|similar| similar.corners);
        let fetched = corners.fold(0.0, |sum, corner| sum + stars.star(corner).v_mag);
        std::hint::black_box(fetched);
        for similar in similar {
            let [a, b, c] = similar.corners;
            let sky = [
                stars.star(a).vector(),
                stars.star(b).vector(),
                stars.star(c).vector(),
            ];
            let in_camera = &in_camera[similar.query as usize];
            let aligned = in_camera
                .as_ref()
                .and_then(|in_camera| in_camera.aligned(&sky));
            let Some(Aligned {
                mirrored,
                of_camera,
                of_sky,
            }) = aligned
            else {
                continue;
            };
            // The rows of the rotation from the sky to the camera.
            let axis = of_sky * of_camera.row(2).transpose();
            let side = of_sky * of_camera.row(0).transpose();
            let ln_focal = f64::from(similar.ln_focal);
            if let Some(cells) = self.cells(&axis, &side, ln_focal, mirrored) {
                let similar = *similar;
                self.votes.push(Vote {
                    triangle,
                    similar,
                    cells,
                });
            }
        }
    }

    /// The cells of a pose; `None` where a hint excludes it.
    #[inline]
    fn cells(
        &self,
        axis: &Vector3<f64>,
        side: &Vector3<f64>,
        ln_focal: f64,
        mirrored: bool,
    ) -> Option<[u32; GRIDS]> {
        let mut cells = [0; GRIDS];
        for (grid, cell) in cells.iter_mut().enumerate() {
            let level = level(ln_focal, grid);
            let of_level = level - self.first_level[grid];
            let levels = &self.levels[grid];
            let Level {
                axis_cells,
                min_cos,
            } = levels[(of_level.max(0) as usize).min(levels.len() - 1)];
            if let Some(near) = &self.near
                && near.centre.as_vector().dot(axis) < min_cos
            {
                return None;
            }
            let mut hash = (level as u64) << 1 | u64::from(mirrored);
            let mut mix = |coordinate: f64| {
                let number = (coordinate + (CELLS_FROM + SHIFTS[grid])) as u64;
                hash = (hash ^ number).wrapping_mul(0x9E37_79B9_7F4A_7C15);
                hash ^= hash >> 29;
            };
            axis.iter().for_each(|x| mix(x * axis_cells));
            side.iter().for_each(|x| mix(x * (1.0 / ROLL_STEP)));
            *cell = (hash >> 32) as u32;
        }
        Some(cells)
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

    /// A vote for a cell that leads, by its number: of each cell the middle one, the first and the
    /// last.
    pub fn leading(&self, number: usize) -> Option<Vote> {
        let leader = self.leaders.get(number / 3)?;
        let place = [leader.count / 2, 0, leader.count - 1][number % 3];
        let entry = self.entries[leader.grid][leader.first + place];
        Some(self.votes[entry.vote as usize])
    }
}

/// The level of a focal length, given its logarithm.
#[inline]
fn level(ln_focal: f64, grid: usize) -> i32 {
    ((ln_focal - LEVELS_FROM) * (1.0 / SCALE_STEP) + SHIFTS[grid]) as i32
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

    /// Adds a vote of `triangle` for a pose.
    fn add(votes: &mut Votes, triangle: u32, [ra_rad, dec_rad, roll_rad]: [f64; 3], focal_px: f64) {
        let boresight = UnitVector::from_ra_dec(ra_rad, dec_rad);
        let rotation = Rotation::<Icrs, Camera>::looking_at(&boresight, roll_rad);
        let [axis, side] = [2, 0].map(|row| rotation.matrix().row(row).transpose());
        let cells = votes.cells(&axis, &side, focal_px.ln(), false).unwrap();
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
            let boresight = UnitVector::from_ra_dec(ra, dec);
            let rotation = Rotation::<Icrs, Camera>::looking_at(&boresight, roll);
            let [axis, side] = [2, 0].map(|row| rotation.matrix().row(row).transpose());
            let apart_rad = boresight.angle_to(&centre);
            let cells = votes.cells(&axis, &side, 1000_f64.ln(), false);
            // A cell is 0.06 of the field.
            prop_assert!(cells.is_some() || apart_rad > 0.4);
            prop_assert!(cells.is_none() || apart_rad < 0.4 + 0.1);
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
