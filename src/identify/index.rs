//! Every triangle of bright stars that a camera is likely to see, by size and shape.
//!
//! catalogue → for each size class, cells over the whole sky → the brightest stars around each cell →
//! their triangles → sorted by shape, class by class
//!
//! A triangle belongs to the size class that holds its longest side, and there to the one cell that
//! holds the middle of that side, so that none is listed twice; it is listed if its stars are among the
//! brightest around that cell. Whatever the width of a field, the brightest stars in it then form
//! triangles of the class that fits it.
//!
//! # Reference
//! Triangle matching by two ratios: Groth 1986, AJ 91, 1244; patterns at all scales over cells of the
//! sky: Lang et al. 2010, AJ 139, 1782.

use super::cache::{CacheError, IndexFile};
use super::table::{SizeClass, Triangle};
use super::triangle::TriangleShape;
use crate::base::coords::{Icrs, UnitVector};
use crate::base::units::RAD_PER_DEG;
use crate::sky::catalog::Star;
use crate::sky::catalog::sky_grid::{GridStar, SkyGrid};
use nalgebra::Vector3;
use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::{Mutex, OnceLock, PoisonError};

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

/// All triangles, smallest class first.
#[derive(Debug)]
pub struct TriangleIndex {
    /// The size classes, in ascending order and without gaps.
    pub classes: Vec<SizeClass>,
    /// Where chunks are read from when they are first needed; not where they are all here.
    file: Option<IndexFile>,
    /// Classes made anew since a chunk of them could not be read.
    remade: Vec<OnceLock<SizeClass>>,
    troubles: Mutex<Vec<CacheError>>,
}

/// What triangles are made from: the stars, brightest first, and the same by place.
#[derive(Debug, Clone, Copy)]
pub struct Source<'a> {
    /// The stars.
    pub stars: &'a [Star],
    /// The same by place.
    pub grid: &'a SkyGrid,
}

impl TriangleIndex {
    /// Lists the triangles of `source`; `progress` is called with the share done.
    pub fn build(source: Source, progress: &(dyn Fn(f64) + Sync)) -> Self {
        let limits = class_limits_rad(source.stars.len());
        let classes = limits
            .iter()
            .enumerate()
            .map(|(done, &limits_rad)| {
                let class = build_class(source, limits_rad);
                progress((done + 1) as f64 / limits.len() as f64);
                class
            })
            .collect();
        Self::new(classes, None)
    }

    /// The index of `classes`, whose chunks are in `file` where they are not here.
    pub fn new(classes: Vec<SizeClass>, file: Option<IndexFile>) -> Self {
        Self {
            remade: classes.iter().map(|_| OnceLock::new()).collect(),
            classes,
            file,
            troubles: Mutex::default(),
        }
    }

    /// Number of triangles.
    pub fn len(&self) -> usize {
        self.classes.iter().map(SizeClass::len).sum()
    }

    /// Whether there is no triangle at all.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Calls `visit` with the corners of every triangle of a class whose ratios lie within `tolerance` of `ratios`. `source` is
    /// what the index was made from.
    #[inline]
    pub fn for_each_similar(
        &self,
        source: Source,
        (class, ratios, tolerance): (usize, [f64; 2], f64),
        visit: impl FnMut(&[u32; 3]),
    ) {
        let chunk = |chunk| self.chunk(source, class, chunk);
        self.classes[class].for_each_similar(ratios, tolerance, chunk, visit);
    }

    /// The triangles of a chunk.
    pub fn chunk(&self, source: Source, class: usize, chunk: usize) -> &[Triangle] {
        self.classes[class].chunks[chunk].get_or_init(|| {
            self.read(class, chunk)
                .unwrap_or_else(|| self.remade(source, class, chunk))
        })
    }

    fn read(&self, class: usize, chunk: usize) -> Option<Box<[Triangle]>> {
        let range = self.classes[class].range(chunk);
        match self.file.as_ref()?.chunk(class, chunk, range) {
            Ok(triangles) => Some(triangles),
            Err(trouble) => {
                self.troubles().push(trouble);
                None
            }
        }
    }

    fn remade(&self, source: Source, class: usize, chunk: usize) -> Box<[Triangle]> {
        let remade = self.remade[class].get_or_init(|| {
            let limits_rad = class_limits_rad(source.stars.len());
            build_class(source, limits_rad[class])
        });
        remade.chunks[chunk].get().cloned().unwrap_or_default()
    }

    /// What went wrong with reading since it was last asked; it was made good.
    pub fn take_troubles(&self) -> Vec<CacheError> {
        std::mem::take(&mut *self.troubles())
    }

    fn troubles(&self) -> std::sync::MutexGuard<'_, Vec<CacheError>> {
        self.troubles.lock().unwrap_or_else(PoisonError::into_inner)
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
const STARS_PER_CELL: [(f64, usize); 4] =
    [(0.9, 6), (3.0, 7), (8.0, 9), (90.0, MOST_STARS_PER_CELL)];

const MOST_STARS_PER_CELL: usize = 12;

fn stars_per_cell(low_rad: f64) -> usize {
    let low_deg = low_rad / RAD_PER_DEG;
    let class = STARS_PER_CELL.iter().find(|(limit, _)| low_deg < *limit);
    class.expect("classes end below 90 degrees").1
}

fn build_class(source: Source, (low_rad, high_rad): (f64, f64)) -> SizeClass {
    let Source { stars, grid } = source;
    let zone_height_rad = low_rad * CELL_HEIGHT;
    let zones = (PI / zone_height_rad).ceil() as usize;
    let cells = Cells {
        zone_height_rad: PI / zones as f64,
    };
    let wanted = stars_per_cell(low_rad);
    let limits = (chord(low_rad), chord(high_rad));
    let radius_rad = high_rad * CELL_RADIUS;
    let triangles: Vec<Triangle> = (0..zones)
        .into_par_iter()
        .flat_map_iter(|zone| {
            let mut found = Vec::new();
            let mut around: Vec<GridStar> = Vec::new();
            let heights = cells.nearly_within(zone);
            for cell in 0..cells.in_zone(zone) {
                around.clear();
                let centre = cells.centre(zone, cell);
                collect_brightest(grid, &centre, radius_rad, wanted, &mut around);
                for_each_triangle(stars, &around, limits, |shape, corners, middle| {
                    // Most are of another zone, which the sine of the declination tells without any trigonometry.
                    if heights.contains(&(middle.z / middle.norm()))
                        && cells.cell_of(middle) == (zone, cell)
                    {
                        found.push(Triangle::new(corners, shape.ratios));
                    }
                });
            }
            found
        })
        .collect();
    SizeClass::new(limits, &triangles)
}

/// The `wanted` brightest stars around `centre`, brightest first. Looks among bright stars first and goes deeper until it has enough.
fn collect_brightest(
    grid: &SkyGrid,
    centre: &UnitVector<Icrs>,
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

/// Calls `visit` with every triangle of `around` that has a shape and whose longest side is from `low` to below `high`: its shape,
/// corners, and the sum of the ends of that side.
fn for_each_triangle(
    stars: &[Star],
    around: &[GridStar],
    (low, high): (f64, f64),
    mut visit: impl FnMut(&TriangleShape, [u32; 3], Vector3<f64>),
) {
    let direction = |star: &GridStar| stars[star.catalog as usize].direction.as_vector();
    let mut sides = [[0.0; MOST_STARS_PER_CELL]; MOST_STARS_PER_CELL];
    for (i, first) in around.iter().enumerate() {
        for (j, second) in around[..i].iter().enumerate() {
            sides[i][j] = (direction(first) - direction(second)).norm_squared();
        }
    }
    // Nearly: the roots decide.
    let nearly = low * low * (1.0 - 1e-9)..high * high * (1.0 + 1e-9);
    for i in 0..around.len() {
        for j in 0..i {
            for k in 0..j {
                let opposite = [sides[j][k], sides[i][k], sides[i][j]];
                if !nearly.contains(&opposite[0].max(opposite[1]).max(opposite[2])) {
                    continue;
                }
                let shape = TriangleShape::of_sides(opposite);
                let Some(shape) = shape.filter(|s| (low..high).contains(&s.longest)) else {
                    continue;
                };
                let trio = [&around[i], &around[j], &around[k]];
                let corners = shape.order.map(|corner| trio[corner].catalog);
                let [a, b, _] = shape.order.map(|corner| direction(trio[corner]));
                visit(&shape, corners, a + b);
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

    /// The sines of the declinations in a zone, and of a hair more.
    fn nearly_within(&self, zone: usize) -> std::ops::Range<f64> {
        let low_rad = zone as f64 * self.zone_height_rad - FRAC_PI_2;
        // Beyond the pole the sine would fall again.
        let high_rad = (low_rad + self.zone_height_rad).min(FRAC_PI_2);
        low_rad.sin() - 1e-9..high_rad.sin() + 1e-9
    }

    fn in_zone(&self, zone: usize) -> usize {
        let around = TAU * self.zone_middle_rad(zone).cos() / self.zone_height_rad;
        around.round().max(1.0) as usize
    }

    fn centre(&self, zone: usize, cell: usize) -> UnitVector<Icrs> {
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
    use crate::sky::catalog::Catalog;
    use std::collections::HashSet;

    fn index_of(stars: &[Star]) -> (SkyGrid, TriangleIndex) {
        let grid = SkyGrid::new(stars);
        let index = TriangleIndex::build(Source { stars, grid: &grid }, &|_| ());
        (grid, index)
    }

    /// All triangles of a class.
    fn listed(class: &SizeClass) -> impl Iterator<Item = &Triangle> {
        class
            .chunks
            .iter()
            .flat_map(|chunk| chunk.get().unwrap().iter())
    }

    #[test]
    fn a_search_finds_what_going_through_all_triangles_finds() {
        let stars = &Catalog::built_in().stars()[..3000];
        let (grid, index) = index_of(stars);
        let source = Source { stars, grid: &grid };
        let mut compared = 0;
        for (number, class) in index.classes.iter().enumerate() {
            for (wanted, tolerance) in [
                ([0.7, 0.5], 0.01),
                ([0.9, 0.35], 0.03),
                ([0.6, 0.55], 0.01),
                ([0.98, 0.09], 0.02),
            ] {
                let mut found = HashSet::new();
                index.for_each_similar(source, (number, wanted, tolerance), |corners| {
                    assert!(found.insert(*corners), "listed twice");
                });
                let off = |corners: &[u32; 3]| {
                    let ratios = shape_of(stars, corners).ratios;
                    (ratios[0] - wanted[0]).hypot(ratios[1] - wanted[1])
                };
                // Ratios are rounded to 1/65536.
                assert!(found.iter().all(|corners| off(corners) < tolerance + 2e-5));
                for Triangle { corners, .. } in listed(class) {
                    assert!(found.contains(corners) || off(corners) > tolerance - 2e-5);
                }
                compared += found.len();
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
        let (grid, index) = index_of(stars);
        let listed: HashSet<[u32; 3]> = index
            .classes
            .iter()
            .flat_map(listed)
            .map(|triangle| triangle.corners)
            .collect();
        for (ra_rad, dec_rad) in [(0.3, 0.2), (2.0, -1.2), (4.0, 1.5), (5.5, -0.5)] {
            let mut field = Vec::new();
            let centre = UnitVector::from_ra_dec(ra_rad, dec_rad);
            collect_brightest(&grid, &centre, 0.15, 6, &mut field);
            let mut triangles = 0;
            for_each_triangle(stars, &field, (0.0, 2.0), |_, corners, _| {
                triangles += usize::from(listed.contains(&corners));
            });
            assert!(triangles >= 3, "{triangles} at {ra_rad}, {dec_rad}");
        }
    }
}
