//! The density of the observed stars that are no catalogue stars, by brightness and place.
//!
//! Noise is spread evenly. Foliage, reflections, clouds and edges put many detections into few
//! places, so the density at a place is that of its surroundings on the scale where they are
//! densest.

use crate::identify::field::StarField;
use crate::identify::grid::Grid;

/// Half the width of the range of magnitudes that counts as the same brightness.
const HALF_RANGE_MAG: f64 = 0.5;
/// Detections that are no star which each such range has in addition to those found: none found
/// does not mean that there can be none.
const PRIOR_DETECTIONS: f64 = 1.0;
/// Cells along the frame's longer side, scale by scale.
const CELLS: [usize; 3] = [12, 36, 108];
/// Detections in the surroundings that do not make them dense.
const LONE_DETECTIONS: f64 = 1.0;

/// The density of unrelated detections. Its buffers are reused.
#[derive(Debug, Default)]
pub struct Unrelated {
    /// Sums of the weights of all stars before each one.
    sums: Vec<f64>,
    /// Weights in the cells of one scale.
    cells: Vec<f64>,
    /// Density around each star over the frame's mean, at least 1.
    crowding: Vec<f64>,
    /// Per square pixel and magnitude, of each observed star.
    densities: Vec<f64>,
}

impl Unrelated {
    /// Density at the place and brightness of an observed star, without itself, per square pixel
    /// and magnitude.
    pub fn density(&self, observed: usize) -> f64 {
        self.densities[observed]
    }

    /// Nothing is known of the places of `stars` observed stars.
    pub fn start(&mut self, stars: usize) {
        self.crowding.clear();
        self.crowding.resize(stars, 1.0);
    }

    /// Measures how crowded the surroundings of each observed star are, by the probability of each
    /// that it is a catalogue star.
    pub fn measure_crowding(&mut self, field: &StarField, has_name: &[f64]) {
        let area_px2 = field.width_px * field.height_px;
        let sum: f64 = has_name.iter().map(weight).sum();
        let mean = (sum + PRIOR_DETECTIONS) / area_px2;
        self.crowding.clear();
        self.crowding.resize(field.stars.len(), 1.0);
        for cells in CELLS {
            self.add_scale(field, has_name, (cells, mean));
        }
    }

    /// Measures the density at the brightness of each observed star, and in its surroundings, as
    /// crowded as they are.
    pub fn measure(&mut self, field: &StarField, has_name: &[f64]) {
        let count = field.stars.len();
        self.sums.clear();
        self.sums.push(0.0);
        let mut sum = 0.0;
        for has_name in has_name {
            sum += weight(has_name);
            self.sums.push(sum);
        }
        self.densities.clear();
        let area_px2 = field.width_px * field.height_px;
        let (mut from, mut to) = (0, 0);
        for (index, star) in field.stars.iter().enumerate() {
            while field.stars[from].mag < star.mag - HALF_RANGE_MAG {
                from += 1;
            }
            while to < count && field.stars[to].mag <= star.mag + HALF_RANGE_MAG {
                to += 1;
            }
            let alike = self.sums[to] - self.sums[from] - weight(&has_name[index]);
            let per_mag = (alike.max(0.0) + PRIOR_DETECTIONS) / (2.0 * HALF_RANGE_MAG);
            self.densities
                .push(per_mag / area_px2 * self.crowding[index]);
        }
    }

    /// Raises the crowding where the surroundings on one scale are denser than the frame's `mean`.
    fn add_scale(&mut self, field: &StarField, has_name: &[f64], (cells, mean): (usize, f64)) {
        let grid = Grid::new(field, cells);
        self.cells.clear();
        self.cells.resize(grid.cells(), 0.0);
        let stars = || field.stars.iter().zip(has_name);
        for (star, has_name) in stars() {
            self.cells[grid.cell_of(star.position.x, star.position.y)] += weight(has_name);
        }
        for ((star, has_name), crowding) in stars().zip(&mut self.crowding) {
            let (sum, cells) = grid.around(star.position.x, star.position.y, &self.cells);
            let others = sum - weight(has_name) - LONE_DETECTIONS;
            *crowding = crowding.max(others / (cells as f64 * grid.cell_px.powi(2)) / mean);
        }
    }
}

/// Probability that an observed star is unrelated to the catalogue.
fn weight(has_name: &f64) -> f64 {
    (1.0 - has_name).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::coords::PixelPoint;
    use crate::identify::{ObservedStar, Photometry, SourceIndex};

    fn field(places: &[(f64, f64)]) -> StarField {
        let star = |(index, &(x, y)): (usize, &(f64, f64))| ObservedStar {
            source: SourceIndex::new(index),
            position: PixelPoint::new(x, y),
            sigma_px: 0.1,
            mag: 0.0,
            is_saturated: false,
        };
        StarField {
            width_px: 1200.0,
            height_px: 900.0,
            photometry: Photometry::Instrumental,
            years_since_j2000: 0.0,
            spot_sigma_px: None,
            stars: places.iter().enumerate().map(star).collect(),
        }
    }

    /// The density at each star, where none has a name.
    fn densities(places: &[(f64, f64)]) -> Vec<f64> {
        let field = field(places);
        let mut found = Unrelated::default();
        let has_name = vec![0.0; places.len()];
        found.measure_crowding(&field, &has_name);
        found.measure(&field, &has_name);
        found.densities
    }

    #[test]
    fn specks_in_one_place_are_denser_than_a_star_far_from_them() {
        let specks = (0..6).map(|i| (300.0 + 5.0 * f64::from(i), 300.0));
        let places: Vec<_> = specks.chain([(1000.0, 700.0)]).collect();
        let found = densities(&places);
        assert!(found[0] > 50.0 * found[6], "{found:?}");
    }

    #[test]
    fn detections_spread_evenly_have_their_mean_density() {
        let places: Vec<_> = (0..30)
            .flat_map(|i| {
                (0..20).map(move |j| (40.0 * f64::from(i) + 20.0, 45.0 * f64::from(j) + 22.0))
            })
            .collect();
        let mean = places.len() as f64 / (1200.0 * 900.0);
        let found = densities(&places);
        let average = found.iter().sum::<f64>() / found.len() as f64 / mean;
        assert!((0.9..2.0).contains(&average), "{average}");
    }
}
