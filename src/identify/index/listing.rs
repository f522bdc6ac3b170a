//! Lists the triangles of one size class.
//!
//! stars → for each cell of the sky, the brightest stars around it → their triangles
//!
//! A triangle is listed for the cell that holds the middle of its longest side, so that none is
//! listed twice; it is listed if its stars are among the brightest around that cell. Whatever the
//! width of a field, the brightest stars in it then form triangles of the class that fits it.
//!
//! The inner loops use plain numbers: they run some ten million times, also in programs that are
//! built without optimization.

use super::table::{FAINTEST_V_MAG, MAX_STARS, SizeClass, Triangle};
use super::triangle::TriangleShape;
use crate::base::interrupt::{Interrupt, Interrupted};
use crate::base::units::RAD_PER_DEG;
use crate::catalog::Star;
use crate::catalog::sky_cells::{SkyCells, Zone};
use crate::catalog::sky_grid::chord_of;
use arrayvec::ArrayVec;
use libm::log;
use rayon::prelude::*;

/// Longest sides, as angles, of the smallest and the largest triangles listed: what fields 1.5° to
/// 60° wide hold.
const MIN_DEG: f64 = 0.4;
const MAX_DEG: f64 = 45.0;
/// Width of the narrowest field over the smallest longest side listed: narrower fields hold too few
/// of the triangles.
pub const FIELD_TO_SMALLEST: f64 = 3.75;
/// Smaller classes are added as long as a cell has on average this many stars around it, down to
/// 0.2°: what fields from 0.75° hold.
const STARS_AROUND_NARROW_CELL: f64 = 8.0;
const NARROW_CLASSES_MAX: i32 = 2;
/// The longest sides in one class differ by no more than this factor.
const CLASS_FACTOR: f64 = std::f64::consts::SQRT_2;
/// Height of a cell over the class's smallest longest side.
const CELL_HEIGHT: f64 = 0.5;
/// Stars are taken from a cone around a cell's centre: its radius over the class's largest longest
/// side.
const CELL_RADIUS: f64 = 0.75;
/// How many of the brightest stars around a cell make triangles, for classes whose smallest longest
/// side is below the angle in degrees. Wide fields can afford more: there are few of them.
const STARS_PER_CELL: [(f64, usize); 4] =
    [(0.9, 6), (3.0, 7), (8.0, 9), (90.0, MAX_STARS_PER_CELL)];
const MAX_STARS_PER_CELL: usize = 12;

/// A cell with stars around it.
struct Around {
    cell: usize,
    /// Unit vector to its centre.
    centre: [f64; 3],
    /// The brightest stars around it, brightest first.
    stars: ArrayVec<u32, MAX_STARS_PER_CELL>,
}

/// A star of the catalog in the form that listing needs.
#[derive(Debug, Clone, Copy)]
pub struct ListedStar {
    /// Unit vector.
    direction: [f64; 3],
    ra_rad: f64,
    v_mag: f32,
}

impl ListedStar {
    /// The `stars` that may be corners.
    pub fn all(stars: &[Star]) -> Vec<Self> {
        let listed = |star: &Star| Self {
            direction: (*star.direction.as_vector()).into(),
            ra_rad: star.direction.to_ra_dec().0,
            v_mag: star.v_mag,
        };
        let stars = &stars[..stars.len().min(MAX_STARS)];
        stars.par_iter().map(listed).collect()
    }
}

/// Smallest and largest longest side of each class, in radians, for a catalog of `stars` stars.
pub fn class_limits_rad(stars: usize) -> Vec<[f64; 2]> {
    let octaves = libm::log(MAX_DEG / MIN_DEG) / libm::log(CLASS_FACTOR);
    let count = octaves.ceil() as i32;
    let limits = |class: i32| {
        let low_rad = MIN_DEG * RAD_PER_DEG * CLASS_FACTOR.powi(class);
        [low_rad, low_rad * CLASS_FACTOR]
    };
    let is_dense = |class: &i32| {
        // The share of the sphere around a cell.
        let radius_rad = limits(*class)[1] * CELL_RADIUS;
        stars as f64 * radius_rad * radius_rad / 4.0 >= STARS_AROUND_NARROW_CELL
    };
    let narrowest = (-NARROW_CLASSES_MAX..0).find(is_dense).unwrap_or(0);
    (narrowest..count).map(limits).collect()
}

/// Smallest and largest longest side of each class, in radians, of the triangles that fields of these widths
/// hold, the narrowest and the widest.
pub fn classes_of_fields_rad([narrowest_rad, widest_rad]: [f64; 2]) -> Vec<[f64; 2]> {
    /// The diagonal of a field over its width is less.
    const DIAGONAL: f64 = 1.5;
    let smallest_rad = narrowest_rad / FIELD_TO_SMALLEST;
    let largest_rad = (widest_rad * DIAGONAL).min(MAX_DEG * RAD_PER_DEG);
    let lows = std::iter::successors(Some(smallest_rad), |low_rad| Some(low_rad * CLASS_FACTOR));
    let lows = lows.take_while(|low_rad| *low_rad < largest_rad);
    lows.map(|low_rad| [low_rad, low_rad * CLASS_FACTOR])
        .collect()
}

/// Lists the class whose longest sides are within `limits_rad`. `stars` are all stars of
/// the catalog, brightest first.
///
/// # Errors
/// [`Interrupted`] when `interrupt` is due.
pub fn list_class(
    stars: &[ListedStar],
    limits_rad: [f64; 2],
    interrupt: &Interrupt,
) -> Result<SizeClass, Interrupted> {
    let (class, cells) = Class::new(stars, limits_rad);
    let triangles = stars_by_zone(stars, &cells)
        .into_par_iter()
        .enumerate()
        .map(|(zone, near)| {
            interrupt.check()?;
            Ok(class.triangles_of(&cells.zone(zone), &near))
        })
        .collect::<Result<Vec<_>, Interrupted>>()?;
    let limits = [class.low, class.high];
    Ok(SizeClass::new(limits, &triangles.concat()))
}

/// How much fainter the magnitudes of triangles are than those that are stored, so that those of the faintest
/// stars fit.
pub fn fainter_mag(faintest_v_mag: Option<f32>) -> f32 {
    faintest_v_mag.map_or(0.0, |v_mag| (v_mag - FAINTEST_V_MAG).max(0.0))
}

fn stars_per_cell(low_rad: f64) -> usize {
    let low_deg = low_rad / RAD_PER_DEG;
    let class = STARS_PER_CELL.iter().find(|(limit, _)| low_deg < *limit);
    class.expect("classes end below 90 degrees").1
}

/// For each zone, the stars that may be in the cones around its cells, brightest first.
fn stars_by_zone(stars: &[ListedStar], cells: &SkyCells) -> Vec<Vec<u32>> {
    let mut by_zone = vec![Vec::new(); cells.zones];
    for (number, star) in stars.iter().enumerate() {
        for zone in &mut by_zone[cells.zones_near(&star.direction)] {
            zone.push(number as u32);
        }
    }
    by_zone
}

/// The stars, and what decides which of their triangles are listed.
struct Class<'a> {
    stars: &'a [ListedStar],
    stars_per_cell: usize,
    /// Square of the chord of the radius of a cone.
    chord_sq: f64,
    /// Smallest and largest longest side, as chords.
    low: f64,
    high: f64,
    /// Logarithm of their ratio.
    ln_range: f64,
    /// See [`SizeClass::fainter_mag`].
    fainter_mag: f32,
}

impl<'a> Class<'a> {
    fn new(stars: &'a [ListedStar], [low_rad, high_rad]: [f64; 2]) -> (Self, SkyCells) {
        let radius_rad = high_rad * CELL_RADIUS;
        let class = Self {
            stars,
            stars_per_cell: stars_per_cell(low_rad),
            chord_sq: chord_of(radius_rad).powi(2),
            low: chord_of(low_rad),
            high: chord_of(high_rad),
            ln_range: log(chord_of(high_rad) / chord_of(low_rad)),
            fainter_mag: fainter_mag(stars.last().map(|star| star.v_mag)),
        };
        (class, SkyCells::new(low_rad * CELL_HEIGHT, radius_rad))
    }

    /// The triangles of the cells of a zone, cell by cell. `near` are the stars that may be in the
    /// cones around them, brightest first.
    fn triangles_of(&self, zone: &Zone, near: &[u32]) -> Vec<Triangle> {
        let mut triangles = Vec::new();
        for around in self.brightest_around(zone, near) {
            let first = triangles.len();
            self.list_cell(zone, &around, &mut triangles);
            // By the faintest star, then the next: independent of how they were found.
            triangles[first..].sort_unstable_by_key(|triangle| {
                let mut corners = triangle.corners();
                corners.sort_unstable_by(|a, b| b.cmp(a));
                corners
            });
        }
        triangles
    }

    /// The cells of a zone that have stars in the cone around them, with the brightest of these.
    fn brightest_around(&self, zone: &Zone, near: &[u32]) -> Vec<Around> {
        // For each cell its place among those with stars, from 1.
        let mut places = vec![0u32; if near.is_empty() { 0 } else { zone.cells }];
        let mut found: Vec<Around> = Vec::new();
        let mut not_full = zone.cells;
        for &number in near {
            let star = &self.stars[number as usize];
            let direction = in_single_precision(&star.direction);
            for cell in zone.cells_near(&star.direction, star.ra_rad) {
                let cell = cell % zone.cells;
                if places[cell] == 0 {
                    found.push(Around {
                        cell,
                        centre: zone.centre(cell),
                        stars: ArrayVec::new(),
                    });
                    places[cell] = found.len() as u32;
                }
                let around = &mut found[places[cell] as usize - 1];
                if around.stars.len() < self.stars_per_cell
                    && distance_sq(&direction, &around.centre) <= self.chord_sq
                {
                    around.stars.push(number);
                    not_full -= usize::from(around.stars.len() == self.stars_per_cell);
                }
            }
            if not_full == 0 {
                break;
            }
        }
        found.sort_unstable_by_key(|around| around.cell);
        found
    }

    /// Lists the triangles of the stars `around` a cell that belong to that cell.
    fn list_cell(&self, zone: &Zone, around: &Around, out: &mut Vec<Triangle>) {
        let (cell, around) = (around.cell, &around.stars[..]);
        // Nearly: the root decides.
        let least_sq = self.low * self.low * (1.0 - 1e-9);
        let most_sq = self.high * self.high * (1.0 + 1e-9);
        for i in 1..around.len() {
            for j in 0..i {
                let side = [around[i], around[j]];
                let [p, q] = [self.direction(side[0]), self.direction(side[1])];
                let length_sq = distance_sq(p, q);
                if length_sq < least_sq || length_sq > most_sq {
                    continue;
                }
                let middle = [p[0] + q[0], p[1] + q[1], p[2] + q[2]];
                if zone.may_hold(&middle) {
                    let first = out.len();
                    self.list_with_longest_side(side, around, out);
                    if out.len() > first && zone.cell_of(&middle) != Some(cell) {
                        out.truncate(first);
                    }
                }
            }
        }
    }

    /// Lists the triangles of two stars and a third of `around` whose longest side joins the two.
    fn list_with_longest_side(&self, side: [u32; 2], around: &[u32], out: &mut Vec<Triangle>) {
        let [p, q] = [self.direction(side[0]), self.direction(side[1])];
        let longest_sq = distance_sq(p, q);
        for &third in around {
            if third == side[0] || third == side[1] {
                continue;
            }
            let direction = self.direction(third);
            let opposite = [
                distance_sq(q, direction),
                distance_sq(p, direction),
                longest_sq,
            ];
            if opposite[0] >= longest_sq || opposite[1] >= longest_sq {
                continue;
            }
            if let Some(shape) = TriangleShape::of_sides(opposite)
                && shape.longest >= self.low
                && shape.longest < self.high
            {
                let points = [side[0], side[1], third];
                let corners = shape.order.map(|corner| points[corner]);
                let share = log(shape.longest / self.low) / self.ln_range;
                let v_mags =
                    corners.map(|corner| self.stars[corner as usize].v_mag - self.fainter_mag);
                out.push(Triangle::new(corners, shape.ratios, share, v_mags));
            }
        }
    }

    fn direction(&self, star: u32) -> &[f64; 3] {
        &self.stars[star as usize].direction
    }
}

/// The direction as the catalog's grid keeps it.
fn in_single_precision(direction: &[f64; 3]) -> [f64; 3] {
    let [x, y, z] = *direction;
    [
        f64::from(x as f32),
        f64::from(y as f32),
        f64::from(z as f32),
    ]
}

fn distance_sq(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    let [x, y, z] = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    x * x + y * y + z * z
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalog::Catalog;

    #[test]
    fn a_dense_catalogue_has_narrower_classes() {
        let smallest_deg = |stars: usize| class_limits_rad(stars)[0][0] / RAD_PER_DEG;
        assert_eq!(smallest_deg(0), MIN_DEG);
        assert_eq!(smallest_deg(Catalog::built_in().stars().len()), MIN_DEG);
        assert!((smallest_deg(2_557_501) - 0.2).abs() < 1e-9);
        let limits = class_limits_rad(2_557_501);
        let adjoin = |pair: &[[f64; 2]]| (pair[0][1] / pair[1][0] - 1.0).abs() < 1e-12;
        assert!(limits.windows(2).all(adjoin));
    }

    /// The brightest stars around the centre of a cell, from all stars.
    fn brightest_around(class: &Class, centre: &[f64; 3]) -> Vec<u32> {
        let is_near = |&number: &u32| {
            let direction = in_single_precision(&class.stars[number as usize].direction);
            distance_sq(&direction, centre) <= class.chord_sq
        };
        let numbers = 0..class.stars.len() as u32;
        numbers.filter(is_near).take(class.stars_per_cell).collect()
    }

    #[test]
    fn the_stars_around_a_cell_are_those_that_a_search_through_all_stars_finds() {
        let stars = ListedStar::all(&Catalog::built_in().stars()[..2000]);
        for limits_deg in [[2.0, 2.8], [9.0, 13.0], [36.0, 51.0]] {
            let limits_rad = limits_deg.map(|limit_deg| limit_deg * RAD_PER_DEG);
            let (class, cells) = Class::new(&stars, limits_rad);
            let by_zone = stars_by_zone(&stars, &cells);
            for number in [0, 1, cells.zones / 3, cells.zones / 2, cells.zones - 1] {
                let zone = cells.zone(number);
                let found = class.brightest_around(&zone, &by_zone[number]);
                let mut found = found.into_iter().peekable();
                for cell in 0..zone.cells {
                    let around = found.next_if(|around| around.cell == cell);
                    let stars = around.map(|around| around.stars).unwrap_or_default();
                    let expected = brightest_around(&class, &zone.centre(cell));
                    assert_eq!(stars[..], expected);
                }
                assert!(found.next().is_none());
            }
        }
    }
}
