//! The density of the observed stars that are no catalogue stars, by brightness and place.
//!
//! Noise is spread evenly. Foliage, reflections, clouds and edges put many detections into few
//! places, so the density at a place is that of its surroundings on the scale where they are
//! densest.

use crate::identify::field::StarField;
use crate::identify::grid::FrameGrid;

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
    area_px2: f64,
    /// The stars as bright as each one: from the first to that after the last.
    alike: Vec<(u32, u32)>,
    scales: [ScaleSurroundings; CELLS.len()],
    /// The probability of each star that it is unrelated, and the sums of all before each one: of
    /// those that are not saturated, and of those that are.
    weights: Vec<f64>,
    sums: Vec<[f64; 2]>,
    is_saturated: Vec<bool>,
    /// Density around each star over the frame's mean, at least 1.
    crowding: Vec<f64>,
    /// Per square pixel and magnitude, of each observed star; at the end 1, for none.
    densities: Vec<f64>,
}

/// The surroundings of the observed stars on one scale.
#[derive(Debug, Default)]
struct ScaleSurroundings {
    /// The cell of each star, and the area of its surroundings in square pixels.
    places: Vec<(u32, f64)>,
    /// Weights in the cells: 0 while they are not used.
    cells: Vec<f64>,
}

impl Unrelated {
    /// Density at the place and brightness of each observed star, without itself, per square pixel
    /// and magnitude; at the end 1, for none.
    pub fn densities(&self) -> &[f64] {
        &self.densities
    }

    /// Starts with a new field. With `by_place`, the crowding can be measured.
    pub fn start(&mut self, field: &StarField, by_place: bool) {
        self.area_px2 = field.width_px * field.height_px;
        self.crowding.clear();
        self.crowding.resize(field.stars.len(), 1.0);
        self.find_alike(field);
        self.is_saturated.clear();
        let saturated = field.stars.iter().map(|star| star.is_saturated);
        self.is_saturated.extend(saturated);
        if by_place {
            for (scale, cells) in self.scales.iter_mut().zip(CELLS) {
                scale.start(field, &FrameGrid::new(field, cells));
            }
        }
    }

    /// Finds the stars as bright as each one.
    fn find_alike(&mut self, field: &StarField) {
        let stars = &field.stars;
        let (mut from, mut to) = (0, 0);
        self.alike.clear();
        self.alike.extend(stars.iter().map(|star| {
            while stars[from].mag < star.mag - HALF_RANGE_MAG {
                from += 1;
            }
            while to < stars.len() && stars[to].mag <= star.mag + HALF_RANGE_MAG {
                to += 1;
            }
            (from as u32, to as u32)
        }));
    }

    /// Measures how crowded the surroundings of each observed star are, by the probability of each
    /// that it is a catalogue star.
    pub fn measure_crowding(&mut self, field: &StarField, has_name: &[f64]) {
        self.weigh(has_name);
        let sum: f64 = self.weights.iter().sum();
        let mean = (sum + PRIOR_DETECTIONS) / self.area_px2;
        self.crowding.clear();
        self.crowding.resize(self.weights.len(), 1.0);
        for (scale, cells) in self.scales.iter_mut().zip(CELLS) {
            let grid = FrameGrid::new(field, cells);
            scale.raise(&mut self.crowding, &grid, &self.weights, mean);
        }
    }

    /// Measures the density at the brightness of each observed star, and in its surroundings, as
    /// crowded as they are. A saturated star is at least as bright as it was measured: its rivals are
    /// saturated, too.
    pub fn measure(&mut self, has_name: &[f64]) {
        self.weigh(has_name);
        self.sums.clear();
        let mut sums = [0.0; 2];
        self.sums.push(sums);
        let weights = self.weights.iter().zip(&self.is_saturated);
        self.sums.extend(weights.map(|(weight, is_saturated)| {
            sums[usize::from(*is_saturated)] += weight;
            sums
        }));
        let stars = self.alike.iter().zip(&self.weights).zip(&self.crowding);
        self.densities.clear();
        let densities = stars.zip(&self.is_saturated).map(|(star, is_saturated)| {
            let ((&(from, to), weight), crowding) = star;
            let before = |end: u32| self.sums[end as usize][usize::from(*is_saturated)];
            let alike = before(to) - before(from) - weight;
            let per_mag = (alike.max(0.0) + PRIOR_DETECTIONS) / (2.0 * HALF_RANGE_MAG);
            per_mag / self.area_px2 * crowding
        });
        self.densities.extend(densities);
        self.densities.push(1.0);
    }

    /// The probability of each observed star that it is unrelated to the catalogue.
    fn weigh(&mut self, has_name: &[f64]) {
        self.weights.clear();
        let weights = has_name
            .iter()
            .map(|has_name| (1.0 - has_name).clamp(0.0, 1.0));
        self.weights.extend(weights);
    }
}

impl ScaleSurroundings {
    fn start(&mut self, field: &StarField, grid: &FrameGrid) {
        self.cells.clear();
        self.cells.resize(grid.cells(), 0.0);
        self.places.clear();
        self.places.extend(field.stars.iter().map(|star| {
            let (x, y) = (star.position.x, star.position.y);
            (grid.cell_of(x, y) as u32, grid.area_around_px2(x, y))
        }));
    }

    /// Raises the crowding where the surroundings are denser than the frame's `mean`.
    fn raise(&mut self, crowding: &mut [f64], grid: &FrameGrid, weights: &[f64], mean: f64) {
        for ((cell, _), weight) in self.places.iter().zip(weights) {
            self.cells[*cell as usize] += weight;
        }
        for ((&(cell, area_px2), weight), crowding) in self.places.iter().zip(weights).zip(crowding)
        {
            let others = grid.sum_around(cell as usize, &self.cells) - weight - LONE_DETECTIONS;
            *crowding = crowding.max(others / area_px2 / mean);
        }
        for (cell, _) in &self.places {
            self.cells[*cell as usize] = 0.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Stars of one magnitude.
    fn field(places: &[(f64, f64)]) -> StarField {
        let mut field = StarField::of_places([1200.0, 900.0], places);
        field.stars.iter_mut().for_each(|star| star.mag = 0.0);
        field
    }

    /// The density at each star, where none has a name.
    fn densities(places: &[(f64, f64)]) -> Vec<f64> {
        let field = field(places);
        let mut found = Unrelated::default();
        let has_name = vec![0.0; places.len()];
        found.start(&field, true);
        found.measure_crowding(&field, &has_name);
        found.measure(&has_name);
        found.densities()[..places.len()].to_vec()
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
