//! A part of the sky, and the brightest stars of it, spread evenly.

use crate::base::coords::{Icrs, UnitVector};
use crate::base::units::RAD_PER_DEG;
use crate::catalog::sky_cells::SkyCells;
use crate::catalog::sky_grid::chord_of;
use crate::catalog::star::mmag;
use crate::catalog::{Star, StarId};
use nalgebra::Vector3;
use std::collections::{BinaryHeap, HashMap};
use std::f64::consts::PI;

/// Stars that each cell of the sky gives: few enough to be spread evenly, and enough to be chosen by brightness.
const STARS_PER_CELL: f64 = 12.0;

/// A circle on the sky, and how many of its stars are wanted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Region {
    /// Its centre.
    pub centre: UnitVector<Icrs>,
    /// Its radius, in radians; π is the whole sky.
    pub radius_rad: f64,
    /// The most stars in a square degree. They are the brightest of each cell of the sky that holds a dozen.
    pub per_sq_deg: f64,
}

impl Region {
    /// All stars.
    pub const WHOLE_SKY: Self = Self {
        centre: UnitVector::from_unit(Vector3::new(1.0, 0.0, 0.0)),
        radius_rad: PI,
        per_sq_deg: f64::INFINITY,
    };

    /// Its area.
    pub fn area_sq_deg(&self) -> f64 {
        let half = libm::sin(self.radius_rad.clamp(0.0, PI) / 2.0);
        4.0 * PI * half * half / (RAD_PER_DEG * RAD_PER_DEG)
    }

    /// The chord of its radius.
    pub fn chord(&self) -> f64 {
        chord_of(self.radius_rad)
    }

    /// Whether a direction lies in it.
    pub fn contains(&self, direction: &UnitVector<Icrs>) -> bool {
        let chord = self.chord();
        (direction.as_vector() - self.centre.as_vector()).norm_squared() <= chord * chord
    }
}

/// The order of brightness: V in thousandths, then the identifier.
type Rank = (i16, StarId);

/// A star by its rank: a heap of them has the faintest on top.
struct Ranked(Rank, Star);

impl PartialEq for Ranked {
    fn eq(&self, other: &Self) -> bool {
        self.0 == other.0
    }
}

impl Eq for Ranked {}

impl PartialOrd for Ranked {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Ranked {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.cmp(&other.0)
    }
}

/// Gathers the brightest stars of a region, in memory for no more than are wanted.
pub struct BrightestStars {
    region: Region,
    cells: SkyCells,
    by_cell: HashMap<(usize, usize), BinaryHeap<Ranked>>,
    per_cell: usize,
}

impl BrightestStars {
    /// None so far.
    pub fn new(region: Region) -> Self {
        /// Cells are no larger and no smaller.
        const HEIGHTS_DEG: [f64; 2] = [0.02, 20.0];
        let height_deg = (STARS_PER_CELL / region.per_sq_deg).sqrt();
        let height_deg = height_deg.clamp(HEIGHTS_DEG[0], HEIGHTS_DEG[1]);
        let per_cell = (region.per_sq_deg * height_deg * height_deg).round();
        Self {
            region,
            cells: SkyCells::new(height_deg * RAD_PER_DEG, 0.0),
            by_cell: HashMap::new(),
            per_cell: (per_cell as usize).max(1),
        }
    }

    /// Adds a star, if it lies in the region and is one of the brightest of its cell.
    pub fn add(&mut self, star: Star) {
        if !self.region.contains(&star.direction) {
            return;
        }
        let cell = self.cells.cell_of(&star.direction);
        let heap = self.by_cell.entry(cell).or_default();
        let ranked = Ranked((mmag(star.v_mag), star.id), star);
        if heap.len() < self.per_cell {
            heap.push(ranked);
        } else if let Some(mut faintest) = heap.peek_mut()
            && ranked < *faintest
        {
            *faintest = ranked;
        }
    }

    /// The stars, brightest first; of those with one identifier the brightest.
    pub fn into_stars(self) -> Vec<Star> {
        let heaps = self.by_cell.into_values();
        let mut stars: Vec<Ranked> = heaps.flat_map(BinaryHeap::into_vec).collect();
        stars.sort_unstable_by_key(|ranked| (ranked.0.1, ranked.0.0));
        stars.dedup_by_key(|ranked| ranked.0.1);
        stars.sort_unstable();
        stars.into_iter().map(|Ranked(_, star)| star).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalog::PlaceId;

    #[test]
    fn the_brightest_of_each_cell_are_kept() {
        let region = Region {
            centre: UnitVector::from_ra_dec(1.0, 0.5),
            radius_rad: 2.0 * RAD_PER_DEG,
            per_sq_deg: 50.0,
        };
        let mut brightest = BrightestStars::new(region);
        let mut inside = 0;
        for number in 0..40_000u32 {
            let spread = |share: f64| (share * f64::from(number)).fract() - 0.5;
            let ra_rad = 1.0 + 0.2 * spread(0.618_033_988_7);
            let dec_rad = 0.5 + 0.1 * spread(0.754_877_666_2);
            let direction = UnitVector::from_ra_dec(ra_rad, dec_rad);
            inside += u32::from(region.contains(&direction));
            let v_mag = (number % 977) as f32 * 0.01;
            let id = StarId::Place(PlaceId::of(&direction));
            brightest.add(Star::new(id, direction, v_mag));
        }
        assert!(inside > 8000, "{inside}");
        let stars = brightest.into_stars();
        let wanted = region.per_sq_deg * region.area_sq_deg();
        let share = stars.len() as f64 / wanted;
        assert!((0.8..1.3).contains(&share), "{share}");
        assert!(stars.windows(2).all(|pair| pair[0].v_mag <= pair[1].v_mag));
        // The brightest twelfth or so of all.
        assert!(stars[stars.len() / 2].v_mag < 0.6);
    }

    #[test]
    fn the_area_of_a_circle_is_that_of_a_cap() {
        let region = |radius_rad: f64| Region {
            centre: UnitVector::from_ra_dec(0.0, 0.0),
            radius_rad,
            per_sq_deg: 1.0,
        };
        assert!((region(PI).area_sq_deg() - 41_252.96).abs() < 0.01);
        assert!((region(RAD_PER_DEG).area_sq_deg() - PI).abs() < 1e-3);
    }
}
