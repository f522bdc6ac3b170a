//! Which catalogue stars lie near a direction, brightest first.
//!
//! The sky is cut into zones of declination and these into cells of about the same size; the stars of a
//! cell stand together, brightest first, so that a search to a limiting magnitude stops early.

use super::Star;
use crate::coords::{Icrs, UnitVector};
use nalgebra::Vector3;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// One star as the grid keeps it: packed, since most of a search is waiting for memory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GridStar {
    /// Components of the ICRS unit vector (single precision: 0.01 arcsec).
    pub direction: [f32; 3],
    /// V magnitude.
    pub v_mag: f32,
    /// Index into the catalogue's stars.
    pub catalog: u32,
}

impl GridStar {
    const NOWHERE: Self = Self {
        direction: [0.0; 3],
        v_mag: 0.0,
        catalog: 0,
    };

    fn new(index: usize, star: &Star) -> Self {
        let v = star.direction.as_vector();
        Self {
            direction: [v.x as f32, v.y as f32, v.z as f32],
            v_mag: star.v_mag,
            catalog: index as u32,
        }
    }

    /// Squared length of the chord to the unit vector `direction`.
    #[inline]
    pub fn chord_sq(&self, direction: &Vector3<f64>) -> f64 {
        let dx = f64::from(self.direction[0]) - direction.x;
        let dy = f64::from(self.direction[1]) - direction.y;
        let dz = f64::from(self.direction[2]) - direction.z;
        dx * dx + dy * dy + dz * dz
    }
}

/// The catalogue's stars by place.
#[derive(Debug, Clone)]
pub struct SkyGrid {
    zones: Vec<Zone>,
    /// `cell_starts[c]..cell_starts[c + 1]` are the stars of cell `c`.
    cell_starts: Vec<u32>,
    stars: Vec<GridStar>,
    /// The brightest stars of all, brightest first: wide and shallow searches go through these.
    brightest: Vec<GridStar>,
    zone_height_rad: f64,
}

#[derive(Debug, Clone, Copy)]
struct Zone {
    first_cell: u32,
    cell_count: u32,
}

/// Height of a zone: about three catalogue stars a cell.
const ZONES: usize = 256;
/// How many stars [`SkyGrid::brightest`] holds.
const BRIGHTEST: usize = 16_384;
/// Going to a cell costs about as much as looking at so many stars in a row.
const STARS_PER_CELL_VISIT: f64 = 4.0;

impl SkyGrid {
    /// Sorts `stars`, which stand brightest first, into cells.
    pub fn new(stars: &[Star]) -> Self {
        let zone_height_rad = PI / ZONES as f64;
        let mut zones = Vec::with_capacity(ZONES);
        let mut cells = 0;
        for zone in 0..ZONES {
            let low = zone as f64 * zone_height_rad - FRAC_PI_2;
            let widest = if low < 0.0 && low + zone_height_rad > 0.0 {
                1.0
            } else {
                low.cos().max((low + zone_height_rad).cos())
            };
            let cell_count = (TAU * widest / zone_height_rad).ceil().max(1.0) as u32;
            zones.push(Zone {
                first_cell: cells,
                cell_count,
            });
            cells += cell_count;
        }
        let mut grid = Self {
            zones,
            cell_starts: vec![0; cells as usize + 1],
            stars: Vec::new(),
            brightest: stars[..stars.len().min(BRIGHTEST)]
                .iter()
                .enumerate()
                .map(|(index, star)| GridStar::new(index, star))
                .collect(),
            zone_height_rad,
        };
        grid.fill(stars);
        grid
    }

    /// A counting sort by cell; stable, so that a cell's stars stay brightest first.
    fn fill(&mut self, stars: &[Star]) {
        let cells: Vec<u32> = stars.iter().map(|s| self.cell_of(&s.direction)).collect();
        for &cell in &cells {
            self.cell_starts[cell as usize + 1] += 1;
        }
        for cell in 1..self.cell_starts.len() {
            self.cell_starts[cell] += self.cell_starts[cell - 1];
        }
        let mut next = self.cell_starts.clone();
        self.stars = vec![GridStar::NOWHERE; stars.len()];
        for (index, (star, &cell)) in stars.iter().zip(&cells).enumerate() {
            self.stars[next[cell as usize] as usize] = GridStar::new(index, star);
            next[cell as usize] += 1;
        }
    }

    fn cell_of(&self, direction: &UnitVector<Icrs>) -> u32 {
        let (ra_rad, dec_rad) = direction.to_ra_dec();
        let zone = self.zones[self.zone_at(dec_rad)];
        let cell = (ra_rad / TAU * f64::from(zone.cell_count)) as u32;
        zone.first_cell + cell.min(zone.cell_count - 1)
    }

    fn zone_at(&self, dec_rad: f64) -> usize {
        let zone = (dec_rad + FRAC_PI_2) / self.zone_height_rad;
        (zone.max(0.0) as usize).min(self.zones.len() - 1)
    }

    /// Calls `visit` with every star within `radius_rad` of `centre` that is not fainter than
    /// `faintest_v_mag`, in an order that depends on nothing but the arguments.
    pub fn for_each_within(
        &self,
        centre: &UnitVector<Icrs>,
        radius_rad: f64,
        faintest_v_mag: f32,
        mut visit: impl FnMut(&GridStar),
    ) {
        let bright_enough = self
            .brightest
            .partition_point(|s| s.v_mag <= faintest_v_mag);
        let all_bright_enough =
            bright_enough < self.brightest.len() || self.brightest.len() == self.stars.len();
        let cells = (2.0 * radius_rad / self.zone_height_rad + 1.0).powi(2);
        if all_bright_enough && (bright_enough as f64) < STARS_PER_CELL_VISIT * cells {
            let chord_sq = chord_sq_of_angle(radius_rad);
            let within = |s: &&GridStar| s.chord_sq(centre.as_vector()) <= chord_sq;
            self.brightest[..bright_enough]
                .iter()
                .filter(within)
                .for_each(visit);
        } else {
            self.for_each_in_cells(centre, radius_rad, faintest_v_mag, &mut visit);
        }
    }

    fn for_each_in_cells(
        &self,
        centre: &UnitVector<Icrs>,
        radius_rad: f64,
        faintest_v_mag: f32,
        visit: &mut impl FnMut(&GridStar),
    ) {
        let (ra_rad, dec_rad) = centre.to_ra_dec();
        let chord_sq = chord_sq_of_angle(radius_rad);
        let centre = centre.as_vector();
        let half_width_rad = ra_half_width_rad(dec_rad, radius_rad);
        for zone in self.zone_at(dec_rad - radius_rad)..=self.zone_at(dec_rad + radius_rad) {
            let zone = self.zones[zone];
            let count = f64::from(zone.cell_count);
            let (first, cells) = if half_width_rad >= PI {
                (0, zone.cell_count)
            } else {
                let first = ((ra_rad - half_width_rad) / TAU * count).floor();
                let last = ((ra_rad + half_width_rad) / TAU * count).floor();
                let cells = ((last - first) as u32 + 1).min(zone.cell_count);
                (first.rem_euclid(count) as u32, cells)
            };
            for cell in first..first + cells {
                let cell = (zone.first_cell + cell % zone.cell_count) as usize;
                let range = self.cell_starts[cell] as usize..self.cell_starts[cell + 1] as usize;
                for star in &self.stars[range] {
                    if star.v_mag > faintest_v_mag {
                        break;
                    }
                    if star.chord_sq(centre) <= chord_sq {
                        visit(star);
                    }
                }
            }
        }
    }
}

/// Squared chord between two directions `angle_rad` apart (at most half a turn).
pub fn chord_sq_of_angle(angle_rad: f64) -> f64 {
    let chord = 2.0 * (angle_rad.clamp(0.0, PI) / 2.0).sin();
    chord * chord
}

/// The largest difference in right ascension between the centre of a cone at `dec_rad` and a point in it.
fn ra_half_width_rad(dec_rad: f64, radius_rad: f64) -> f64 {
    if dec_rad.abs() + radius_rad >= FRAC_PI_2 {
        return PI;
    }
    (radius_rad.sin() / dec_rad.cos()).clamp(-1.0, 1.0).asin()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalog::StarId;
    use proptest::prelude::*;

    fn star(index: u32, ra_rad: f64, sin_dec: f64) -> Star {
        Star::new(
            StarId(index),
            UnitVector::from_ra_dec(ra_rad, sin_dec.asin()),
            index as f32 * 0.01,
        )
    }

    proptest! {
        #[test]
        fn a_cone_holds_what_a_search_through_all_stars_finds(
            places in prop::collection::vec((0.0..TAU, -1.0..1.0f64), 1..200),
            ra_rad in 0.0..TAU, dec_rad in -FRAC_PI_2..FRAC_PI_2,
            radius_rad in 0.0..1.5f64, limit in 0.0..2.0f32,
        ) {
            let stars: Vec<Star> = places
                .iter()
                .enumerate()
                .map(|(i, &(ra, sin_dec))| star(i as u32, ra, sin_dec))
                .collect();
            let centre = UnitVector::from_ra_dec(ra_rad, dec_rad);
            let mut found = Vec::new();
            let grid = SkyGrid::new(&stars);
            grid.for_each_within(&centre, radius_rad, limit, |s| found.push(s.catalog));
            found.sort_unstable();
            let mut in_cells = Vec::new();
            let mut visit = |s: &GridStar| in_cells.push(s.catalog);
            grid.for_each_in_cells(&centre, radius_rad, limit, &mut visit);
            in_cells.sort_unstable();
            prop_assert_eq!(&found, &in_cells);
            let chord_sq = chord_sq_of_angle(radius_rad);
            let expected: Vec<u32> = (0..stars.len() as u32)
                .filter(|&i| {
                    let packed = GridStar::new(i as usize, &stars[i as usize]);
                    stars[i as usize].v_mag <= limit
                        && packed.chord_sq(centre.as_vector()) <= chord_sq
                })
                .collect();
            prop_assert_eq!(found, expected);
        }
    }
}
