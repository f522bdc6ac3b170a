//! Which catalogue stars are near a direction, down to a limiting magnitude?
//!
//! Stars, brightest first → [`SkyGrid`] → the stars within a radius.
//!
//! The cube around the unit sphere is divided into cubic cells, and the stars of each cell are
//! stored together, brightest first, so a search stops at its limiting magnitude. This needs no
//! trigonometry and has no special cases at the poles. Wide and shallow searches scan the brightest
//! stars of the whole sky instead.

use super::{Star, StarIndex};
use crate::base::coords::{Icrs, UnitVector};
use nalgebra::Vector3;
use rayon::prelude::*;
use std::f64::consts::PI;
use std::ops::RangeInclusive;

/// A star of the grid: small, because searches are limited by memory access.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GridStar {
    /// The ICRS unit vector (single precision: 0.01 arcsec).
    pub direction: [f32; 3],
    /// V magnitude.
    pub v_mag: f32,
    /// The star in the catalogue.
    pub index: StarIndex,
}

impl GridStar {
    pub(super) fn new(index: usize, star: &Star) -> Self {
        let v = star.direction.as_vector();
        Self {
            direction: [v.x as f32, v.y as f32, v.z as f32],
            v_mag: star.v_mag,
            index: StarIndex::new(index),
        }
    }

    /// The unit vector, in single precision.
    #[inline]
    pub fn vector(&self) -> Vector3<f64> {
        let [x, y, z] = self.direction;
        Vector3::new(f64::from(x), f64::from(y), f64::from(z))
    }

    /// Whether the star is within a chord of the unit vector `centre`, given the chord squared.
    #[inline]
    pub fn is_within(&self, centre: &Vector3<f64>, chord_sq: f64) -> bool {
        let offset = self.vector() - centre;
        // Most stars are rejected by the first test alone.
        offset.x * offset.x <= chord_sq && offset.norm_squared() <= chord_sq
    }
}

/// The stars of a catalogue, by position.
#[derive(Debug, Clone)]
pub struct SkyGrid {
    /// The stars of cell `c` are `by_cell[cell_starts[c]..cell_starts[c + 1]]`.
    cell_starts: Vec<u32>,
    by_cell: Vec<GridStar>,
    /// In the order of the catalogue.
    by_brightness: Vec<GridStar>,
}

/// Cells along an edge of the cube: on the sphere they are 1.8° wide and hold 16 stars of SKY2000.
const CELLS: usize = 64;
const CELL_SIZE: f64 = 2.0 / CELLS as f64;

/// The chord of an angle, which is clamped to half a turn.
#[inline]
pub fn chord_of(angle_rad: f64) -> f64 {
    2.0 * libm::sin(angle_rad.clamp(0.0, PI) / 2.0)
}

fn cell_along(coordinate: f64) -> usize {
    (((coordinate + 1.0) / CELL_SIZE).max(0.0) as usize).min(CELLS - 1)
}

fn cells_along(centre: f64, radius: f64) -> RangeInclusive<usize> {
    cell_along(centre - radius)..=cell_along(centre + radius)
}

impl SkyGrid {
    /// Sorts `stars`, which must be ordered brightest first, into cells.
    pub fn new(stars: &[Star]) -> Self {
        let packed = |(index, star)| GridStar::new(index, star);
        let by_brightness: Vec<GridStar> = stars.par_iter().enumerate().map(packed).collect();
        // A counting sort is stable: the stars of a cell stay ordered brightest first.
        let cell_of = |star: &GridStar| Self::cell_of(star) as u32;
        let cells: Vec<u32> = by_brightness.par_iter().map(cell_of).collect();
        let mut cell_starts = vec![0u32; CELLS.pow(3) + 1];
        for &cell in &cells {
            cell_starts[cell as usize + 1] += 1;
        }
        for cell in 1..cell_starts.len() {
            cell_starts[cell] += cell_starts[cell - 1];
        }
        let mut by_cell = by_brightness.clone();
        for (star, &cell) in by_brightness.iter().zip(&cells) {
            let next = &mut cell_starts[cell as usize];
            by_cell[*next as usize] = *star;
            *next += 1;
        }
        // Each start is now that of the next cell.
        cell_starts.rotate_right(1);
        cell_starts[0] = 0;
        Self {
            cell_starts,
            by_cell,
            by_brightness,
        }
    }

    fn cell_of(star: &GridStar) -> usize {
        let [x, y, z] = star.direction.map(|c| cell_along(f64::from(c)));
        (x * CELLS + y) * CELLS + z
    }

    /// The star at an index of the catalogue.
    #[inline]
    pub fn star(&self, index: u32) -> &GridStar {
        &self.by_brightness[index as usize]
    }

    /// Calls `visit` for every star within `radius_rad` of `centre` that is not fainter than
    /// `faintest_v_mag`, in a deterministic order.
    #[inline]
    pub fn for_each_within(
        &self,
        centre: &UnitVector<Icrs>,
        radius_rad: f64,
        faintest_v_mag: f32,
        visit: impl FnMut(&GridStar),
    ) {
        self.for_each_within_chord(centre, chord_of(radius_rad), faintest_v_mag, visit);
    }

    /// The same, given the chord of the radius.
    #[inline]
    pub fn for_each_within_chord(
        &self,
        centre: &UnitVector<Icrs>,
        chord: f64,
        faintest_v_mag: f32,
        mut visit: impl FnMut(&GridStar),
    ) {
        let cone = Cone {
            centre: centre.as_vector(),
            chord,
            faintest_v_mag,
        };
        if chord < CELL_SIZE {
            // So few cells that those off the sphere need not be skipped.
            for x in cells_along(cone.centre.x, chord) {
                for y in cells_along(cone.centre.y, chord) {
                    self.visit_column(&cone, [x, y], cells_along(cone.centre.z, chord), &mut visit);
                }
            }
        } else {
            self.for_each_in_wide_cone(&cone, &mut visit);
        }
    }

    /// Whether a star with a V magnitude in `magnitudes` is within `chord` of `centre`; fast for
    /// short chords.
    #[inline]
    pub fn is_any_within(
        &self,
        centre: &UnitVector<Icrs>,
        chord: f64,
        magnitudes: RangeInclusive<f32>,
    ) -> bool {
        let cone = Cone {
            centre: centre.as_vector(),
            chord,
            faintest_v_mag: *magnitudes.end(),
        };
        let is_wanted = |star: &GridStar| {
            star.v_mag >= *magnitudes.start() && star.is_within(cone.centre, chord * chord)
        };
        let bright_enough = |star: &&GridStar| star.v_mag <= cone.faintest_v_mag;
        let z_cells = cells_along(cone.centre.z, chord);
        for x in cells_along(cone.centre.x, chord) {
            for y in cells_along(cone.centre.y, chord) {
                for z in z_cells.clone() {
                    let stars = self.in_cell((x * CELLS + y) * CELLS + z);
                    if stars.iter().take_while(bright_enough).any(is_wanted) {
                        return true;
                    }
                }
            }
        }
        false
    }

    /// The stars of a cell, brightest first.
    #[inline]
    fn in_cell(&self, cell: usize) -> &[GridStar] {
        &self.by_cell[self.cell_starts[cell] as usize..self.cell_starts[cell + 1] as usize]
    }

    fn for_each_in_wide_cone(&self, cone: &Cone, visit: &mut impl FnMut(&GridStar)) {
        /// The cost of visiting a cell, in stars of a linear scan.
        const STARS_PER_CELL_VISIT: f64 = 4.0;
        let bright_enough = self
            .by_brightness
            .partition_point(|s| s.v_mag <= cone.faintest_v_mag);
        let cells = PI * (cone.chord / CELL_SIZE + 1.0).powi(2);
        if (bright_enough as f64) < STARS_PER_CELL_VISIT * cells {
            self.by_brightness[..bright_enough]
                .iter()
                .filter(|star| star.is_within(cone.centre, cone.chord * cone.chord))
                .for_each(visit);
            return;
        }
        for x in cells_along(cone.centre.x, cone.chord) {
            for y in cells_along(cone.centre.y, cone.chord) {
                for z in sphere_crossings(x, y) {
                    let wanted = cells_along(cone.centre.z, cone.chord);
                    let first = *z.start().max(wanted.start());
                    let last = *z.end().min(wanted.end());
                    self.visit_column(cone, [x, y], first..=last, visit);
                }
            }
        }
    }

    #[inline]
    fn visit_column(
        &self,
        cone: &Cone,
        [x, y]: [usize; 2],
        z: RangeInclusive<usize>,
        visit: &mut impl FnMut(&GridStar),
    ) {
        for z in z {
            let cell = (x * CELLS + y) * CELLS + z;
            for star in self.in_cell(cell) {
                if star.v_mag > cone.faintest_v_mag {
                    break;
                }
                if star.is_within(cone.centre, cone.chord * cone.chord) {
                    visit(star);
                }
            }
        }
    }
}

struct Cone<'a> {
    centre: &'a Vector3<f64>,
    chord: f64,
    faintest_v_mag: f32,
}

/// The cells of the column at (x, y) that the sphere crosses, below and above the equator, each
/// once.
fn sphere_crossings(x: usize, y: usize) -> impl Iterator<Item = RangeInclusive<usize>> {
    /// The largest distance of a star from the sphere, due to single precision.
    const OFF_SPHERE: f64 = 1e-6;
    let nearest_and_farthest = |cell: usize| {
        let low = cell as f64 * CELL_SIZE - 1.0;
        let high = low + CELL_SIZE;
        let nearest = if low < 0.0 && high > 0.0 {
            0.0
        } else {
            low.abs().min(high.abs())
        };
        (nearest, low.abs().max(high.abs()))
    };
    let ((x_near, x_far), (y_near, y_far)) = (nearest_and_farthest(x), nearest_and_farthest(y));
    let height = |x: f64, y: f64| 1.0 - x * x - y * y;
    let highest = (height(x_near, y_near) + OFF_SPHERE).max(0.0).sqrt() + OFF_SPHERE;
    let lowest = (height(x_far, y_far) - OFF_SPHERE).max(0.0).sqrt() - OFF_SPHERE;
    let above = cell_along(lowest)..=cell_along(highest);
    let below_end = cell_along(-lowest).min(above.start().wrapping_sub(1));
    let below = cell_along(-highest)..=below_end;
    let crossed = height(x_near, y_near) > -OFF_SPHERE;
    [below, above].into_iter().filter(move |_| crossed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalog::StarId;
    use kiddo::{ImmutableKdTree, SquaredEuclidean};
    use proptest::prelude::*;
    use std::f64::consts::{FRAC_PI_2, TAU};

    fn star(index: u32, ra_rad: f64, sin_dec: f64) -> Star {
        let direction = UnitVector::from_ra_dec(ra_rad, sin_dec.asin());
        Star::new(StarId::Skymap(index), direction, index as f32 * 0.001)
    }

    /// The same search with a k-d tree.
    struct Oracle {
        stars: Vec<GridStar>,
        tree: ImmutableKdTree<f64, 3>,
    }

    impl Oracle {
        fn new(stars: &[Star]) -> Self {
            let stars: Vec<_> = (0..).zip(stars).map(|(i, s)| GridStar::new(i, s)).collect();
            let points: Vec<[f64; 3]> = stars.iter().map(|s| s.vector().into()).collect();
            let tree = ImmutableKdTree::new_from_slice(&points).unwrap();
            Self { stars, tree }
        }

        fn within(&self, center: &UnitVector<Icrs>, radius_rad: f64, limit: f32) -> Vec<u32> {
            // The chord would shrink again beyond half a turn, which is the whole sky.
            let chord = 2.0 * (radius_rad.min(PI) / 2.0).sin();
            let near = self
                .tree
                .query(&(*center.as_vector()).into())
                .within::<SquaredEuclidean<f64>>(chord * chord)
                .unsorted()
                .execute();
            let mut found: Vec<u32> = near.into_iter().map(|n| n.item).collect();
            found.retain(|&i| self.stars[i as usize].v_mag <= limit);
            found.sort_unstable();
            found
        }
    }

    /// Whether the grid agrees on the existence of stars from half the limit to the limit.
    fn agrees_on_any(
        grid: &SkyGrid,
        expected: &[u32],
        (center, radius_rad, limit): (&UnitVector<Icrs>, f64, f32),
    ) -> bool {
        let magnitudes = limit / 2.0..=limit;
        let any = expected
            .iter()
            .any(|&i| magnitudes.contains(&grid.star(i).v_mag));
        grid.is_any_within(center, chord_of(radius_rad), magnitudes) == any
    }

    fn found(grid: &SkyGrid, centre: &UnitVector<Icrs>, radius_rad: f64, limit: f32) -> Vec<u32> {
        let mut found = Vec::new();
        grid.for_each_within(centre, radius_rad, limit, |s| {
            found.push(s.index.get() as u32)
        });
        found.sort_unstable();
        found
    }

    proptest! {
        #[test]
        fn a_cone_holds_what_a_k_d_tree_finds(
            positions in prop::collection::vec((0.0..TAU, -1.0..1.0f64), 1..500),
            ra_rad in 0.0..TAU, dec_rad in -FRAC_PI_2..FRAC_PI_2,
            radius_rad in prop_oneof![0.0..0.015f64, 0.0..0.3f64, 0.0..3.2f64],
            limit in 0.0..0.6f32,
        ) {
            let stars: Vec<Star> = positions
                .iter()
                .enumerate()
                .map(|(i, &(ra, sin_dec))| star(i as u32, ra, sin_dec))
                .collect();
            let centre = UnitVector::from_ra_dec(ra_rad, dec_rad);
            let grid = SkyGrid::new(&stars);
            let expected = Oracle::new(&stars).within(&centre, radius_rad, limit);
            prop_assert_eq!(&found(&grid, &centre, radius_rad, limit), &expected);
            prop_assert!(agrees_on_any(&grid, &expected, (&centre, radius_rad, limit)));
        }
    }

    #[test]
    fn cones_of_all_sizes_agree_with_a_k_d_tree_in_the_whole_catalogue() {
        let stars = crate::catalog::Catalog::built_in().stars();
        let (grid, oracle) = (SkyGrid::new(stars), Oracle::new(stars));
        for (i, radius_deg) in [0.1, 0.8, 1.0, 3.0, 12.0, 40.0].into_iter().enumerate() {
            for (ra_deg, dec_deg) in [
                (0.0, 0.0),
                (83.0, -5.0),
                (200.0, 89.9),
                (310.0, -90.0),
                (45.0, 35.3),
            ] {
                let centre =
                    UnitVector::from_ra_dec(f64::to_radians(ra_deg), f64::to_radians(dec_deg));
                let limit = 9.5 - i as f32 * 0.5;
                let radius_rad = f64::to_radians(radius_deg);
                let expected = oracle.within(&centre, radius_rad, limit);
                assert_eq!(found(&grid, &centre, radius_rad, limit), expected);
                assert!(agrees_on_any(
                    &grid,
                    &expected,
                    (&centre, radius_rad, limit)
                ));
            }
        }
    }
}
