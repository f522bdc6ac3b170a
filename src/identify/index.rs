//! Every triangle of bright stars that a camera is likely to see, by size and shape.
//!
//! catalogue → for each size class, cells over the whole sky → the brightest stars around each cell →
//! their triangles → one k-d tree over the shapes of each class
//!
//! A triangle belongs to the size class that holds its longest side, and there to the one cell that
//! holds the middle of that side, so that none is listed twice; it is listed if its stars are among the
//! brightest around that cell. Whatever the width of a field, the brightest stars in it then form
//! triangles of the class that fits it.
//!
//! # Reference
//! Triangle matching by two ratios: Groth 1986, AJ 91, 1244; patterns at all scales over cells of the
//! sky: Lang et al. 2010, AJ 139, 1782.

use super::triangle::TriangleShape;
use crate::catalog::Star;
use crate::catalog::sky_grid::{GridStar, SkyGrid};
use crate::coords::UnitVector;
use crate::units::RAD_PER_DEG;
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use nalgebra::Vector3;
use rayon::prelude::*;
use rkyv::{Archive, Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Longest sides, as angles, of the smallest and the largest triangles listed: what fields 1.5° to 60° wide hold.
const SMALLEST_DEG: f64 = 0.4;
const LARGEST_DEG: f64 = 45.0;
/// Classes below the smallest are listed for as long as so many stars lie around a cell on average, and down to
/// 0.2°: what fields from 0.75° hold.
const STARS_AROUND_NARROW_CELL: f64 = 8.0;
const NARROW_CLASSES_MAX: i32 = 2;
/// The longest sides in one class differ by no more than this factor.
const CLASS_FACTOR: f64 = std::f64::consts::SQRT_2;
/// Cells are so much of the class's smallest longest side in height.
const CELL_HEIGHT: f64 = 0.5;
/// Stars are taken from so much of the class's largest longest side around a cell's centre.
const CELL_RADIUS: f64 = 0.75;

/// The triangles whose longest sides are alike, and the k-d tree over their shapes.
#[derive(Archive, Serialize, Deserialize)]
pub struct SizeClass {
    /// Smallest longest side, as a chord.
    pub low: f64,
    /// Largest longest side, as a chord.
    pub high: f64,
    /// Corners A, B, C of each triangle, as indices into the catalogue's stars.
    pub corners: Vec<[u32; 3]>,
    tree: ImmutableKdTree<f32, 2>,
}

impl SizeClass {
    /// Calls `visit` with the number of every triangle whose ratios lie within `tolerance` of `ratios`.
    #[inline]
    pub fn for_each_similar(
        &self,
        ratios: [f64; 2],
        tolerance: f64,
        mut visit: impl FnMut(&[u32; 3]),
    ) {
        self.tree
            .query(&ratios.map(|r| r as f32))
            .within::<SquaredEuclidean<f32>>((tolerance * tolerance) as f32)
            .unsorted()
            .visit(|found| visit(&self.corners[found.item as usize]));
    }
}

/// All triangles, smallest class first.
#[derive(Archive, Serialize, Deserialize)]
pub struct TriangleIndex {
    /// The size classes, in ascending order and without gaps.
    pub classes: Vec<SizeClass>,
}

impl TriangleIndex {
    /// Lists the triangles of `stars`, which stand brightest first; `progress` is called with the share done.
    pub fn build(stars: &[Star], grid: &SkyGrid, progress: &(dyn Fn(f64) + Sync)) -> Self {
        let limits = class_limits_rad(stars.len());
        let classes = limits
            .iter()
            .enumerate()
            .map(|(done, &(low_rad, high_rad))| {
                let class = build_class(stars, grid, low_rad, high_rad);
                progress((done + 1) as f64 / limits.len() as f64);
                class
            })
            .collect();
        Self { classes }
    }

    /// Number of triangles.
    pub fn len(&self) -> usize {
        self.classes.iter().map(|class| class.corners.len()).sum()
    }

    /// Whether there is no triangle at all.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

fn chord(angle_rad: f64) -> f64 {
    2.0 * (angle_rad / 2.0).sin()
}

/// Smallest and largest longest side of each class, in radians, for a catalogue of so many stars.
fn class_limits_rad(stars: usize) -> Vec<(f64, f64)> {
    let octaves = (LARGEST_DEG / SMALLEST_DEG).ln() / CLASS_FACTOR.ln();
    let count = octaves.ceil() as i32;
    let limits = |class: i32| {
        let low_rad = SMALLEST_DEG * RAD_PER_DEG * CLASS_FACTOR.powi(class);
        (low_rad, low_rad * CLASS_FACTOR)
    };
    let is_dense = |class: &i32| {
        // The share of the sphere around a cell.
        let radius_rad = limits(*class).1 * CELL_RADIUS;
        stars as f64 * radius_rad * radius_rad / 4.0 >= STARS_AROUND_NARROW_CELL
    };
    let narrowest = (-NARROW_CLASSES_MAX..0).find(is_dense).unwrap_or(0);
    (narrowest..count).map(limits).collect()
}

/// How many of the brightest stars around a cell make triangles, by the smallest longest side of the class in
/// degrees. Wide fields can afford more: there are few of them.
const STARS_PER_CELL: [(f64, usize); 4] = [(0.9, 6), (3.0, 7), (8.0, 9), (90.0, 12)];

fn stars_per_cell(low_rad: f64) -> usize {
    let low_deg = low_rad / RAD_PER_DEG;
    let class = STARS_PER_CELL.iter().find(|(limit, _)| low_deg < *limit);
    class.expect("classes end below 90 degrees").1
}

fn build_class(stars: &[Star], grid: &SkyGrid, low_rad: f64, high_rad: f64) -> SizeClass {
    let zone_height_rad = low_rad * CELL_HEIGHT;
    let zones = (PI / zone_height_rad).ceil() as usize;
    let cells = Cells {
        zone_height_rad: PI / zones as f64,
    };
    let wanted = stars_per_cell(low_rad);
    let (low, high) = (chord(low_rad), chord(high_rad));
    let radius_rad = high_rad * CELL_RADIUS;
    let triangles: Vec<([f32; 2], [u32; 3])> = (0..zones)
        .into_par_iter()
        .flat_map_iter(|zone| {
            let mut found = Vec::new();
            let mut around: Vec<GridStar> = Vec::new();
            for cell in 0..cells.in_zone(zone) {
                around.clear();
                let centre = cells.centre(zone, cell);
                collect_brightest(grid, &centre, radius_rad, wanted, &mut around);
                for_each_triangle(stars, &around, |shape, corners, middle| {
                    if (low..high).contains(&shape.longest) && cells.cell_of(middle) == (zone, cell)
                    {
                        found.push((shape.ratios.map(|r| r as f32), corners));
                    }
                });
            }
            found
        })
        .collect();
    let points: Vec<[f32; 2]> = triangles.iter().map(|t| t.0).collect();
    SizeClass {
        low,
        high,
        corners: triangles.into_iter().map(|t| t.1).collect(),
        tree: ImmutableKdTree::new_from_slice(&points).expect("finite points, fewer than 2^32"),
    }
}

/// The `wanted` brightest stars around `centre`, brightest first. Looks among bright stars first and goes deeper until it has enough.
fn collect_brightest(
    grid: &SkyGrid,
    centre: &UnitVector<crate::coords::Icrs>,
    radius_rad: f64,
    wanted: usize,
    found: &mut Vec<GridStar>,
) {
    // The density of stars brighter than V is about 10^(0.47 V − 3.9) a square degree.
    let area_sq_deg = PI * (radius_rad / RAD_PER_DEG).powi(2);
    let mut limit = ((2.0 * wanted as f64 / area_sq_deg).log10() + 3.9) / 0.47;
    loop {
        found.clear();
        grid.for_each_within(centre, radius_rad, limit as f32, |star| found.push(*star));
        if found.len() >= wanted || limit > 15.0 {
            break;
        }
        limit += 1.0;
    }
    found.sort_unstable_by_key(|star| star.catalog);
    found.truncate(wanted);
}

fn for_each_triangle(
    stars: &[Star],
    around: &[GridStar],
    mut visit: impl FnMut(&TriangleShape, [u32; 3], Vector3<f64>),
) {
    let direction = |s: &GridStar| stars[s.catalog as usize].direction.as_vector();
    for (i, first) in around.iter().enumerate() {
        for (j, second) in around[..i].iter().enumerate() {
            for third in &around[..j] {
                let trio = [first, second, third];
                let vectors = trio.map(direction);
                if let Some(shape) = TriangleShape::new(vectors) {
                    let corners = shape.order.map(|k| trio[k].catalog);
                    let middle = vectors[shape.order[0]] + vectors[shape.order[1]];
                    visit(&shape, corners, middle);
                }
            }
        }
    }
}

/// A partition of the sky into cells of about equal size: zones of declination, cut in right ascension.
struct Cells {
    zone_height_rad: f64,
}

impl Cells {
    fn zone_middle_rad(&self, zone: usize) -> f64 {
        (zone as f64 + 0.5) * self.zone_height_rad - FRAC_PI_2
    }

    fn in_zone(&self, zone: usize) -> usize {
        let around = TAU * self.zone_middle_rad(zone).cos() / self.zone_height_rad;
        around.round().max(1.0) as usize
    }

    fn centre(&self, zone: usize, cell: usize) -> UnitVector<crate::coords::Icrs> {
        let ra_rad = (cell as f64 + 0.5) / self.in_zone(zone) as f64 * TAU;
        UnitVector::from_ra_dec(ra_rad, self.zone_middle_rad(zone))
    }

    /// The cell that holds the direction of `vector`, which need not be of unit length.
    fn cell_of(&self, vector: Vector3<f64>) -> (usize, usize) {
        let (ra_rad, dec_rad) = UnitVector::from_vector(vector).to_ra_dec();
        let zones = (PI / self.zone_height_rad).round() as usize;
        let zone = ((dec_rad + FRAC_PI_2) / self.zone_height_rad) as usize;
        let zone = zone.min(zones - 1);
        let cells = self.in_zone(zone);
        (
            zone,
            ((ra_rad / TAU * cells as f64) as usize).min(cells - 1),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalog::Catalog;
    use std::collections::HashSet;

    #[test]
    fn a_search_finds_what_going_through_all_triangles_finds() {
        let stars = &Catalog::built_in().stars()[..3000];
        let index = TriangleIndex::build(stars, &SkyGrid::new(stars), &|_| ());
        let tolerance = 0.01;
        let mut compared = 0;
        for class in &index.classes {
            for wanted in [[0.7, 0.5], [0.9, 0.35], [0.6, 0.55]] {
                let mut found = HashSet::new();
                class.for_each_similar(wanted, tolerance, |corners| {
                    assert!(found.insert(*corners), "listed twice");
                });
                let expected: HashSet<[u32; 3]> = class
                    .corners
                    .iter()
                    .filter(|corners| {
                        let ratios = shape_of(stars, corners).ratios.map(|r| r as f32);
                        let off = [0, 1].map(|i| ratios[i] - wanted[i] as f32);
                        off[0] * off[0] + off[1] * off[1] <= (tolerance * tolerance) as f32
                    })
                    .copied()
                    .collect();
                compared += expected.len();
                assert_eq!(found, expected);
            }
        }
        assert!(compared > 100, "{compared}");
    }

    #[test]
    fn a_dense_catalogue_has_narrower_classes() {
        let smallest_deg = |stars: usize| class_limits_rad(stars)[0].0 / RAD_PER_DEG;
        assert_eq!(smallest_deg(0), SMALLEST_DEG);
        assert_eq!(
            smallest_deg(Catalog::built_in().stars().len()),
            SMALLEST_DEG
        );
        assert!((smallest_deg(2_557_501) - 0.2).abs() < 1e-9);
        let limits = class_limits_rad(2_557_501);
        let adjoin = |pair: &[(f64, f64)]| (pair[0].1 / pair[1].0 - 1.0).abs() < 1e-12;
        assert!(limits.windows(2).all(adjoin));
    }

    fn shape_of(stars: &[Star], corners: &[u32; 3]) -> TriangleShape {
        let vectors = corners.map(|c| stars[c as usize].direction.as_vector());
        let shape = TriangleShape::new(vectors).unwrap();
        assert_eq!(shape.order, [0, 1, 2], "corners are listed as A, B, C");
        shape
    }

    #[test]
    fn the_brightest_stars_of_a_field_make_listed_triangles() {
        let stars = &Catalog::built_in().stars()[..9000];
        let index = TriangleIndex::build(stars, &SkyGrid::new(stars), &|_| ());
        let listed: HashSet<[u32; 3]> = index
            .classes
            .iter()
            .flat_map(|class| class.corners.iter().copied())
            .collect();
        let grid = SkyGrid::new(stars);
        for (ra_rad, dec_rad) in [(0.3, 0.2), (2.0, -1.2), (4.0, 1.5), (5.5, -0.5)] {
            let mut field = Vec::new();
            let centre = UnitVector::from_ra_dec(ra_rad, dec_rad);
            collect_brightest(&grid, &centre, 0.15, 6, &mut field);
            let mut triangles = 0;
            for_each_triangle(stars, &field, |_, corners, _| {
                triangles += usize::from(listed.contains(&corners));
            });
            assert!(triangles >= 3, "{triangles} at {ra_rad}, {dec_rad}");
        }
    }
}
