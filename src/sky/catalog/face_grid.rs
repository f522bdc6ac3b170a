//! Is there a star close to a direction? Millions of such questions.
//!
//! Stars, brightest first → [`FaceGrid`] → whether one of them is within a short distance.
//!
//! The six faces of the cube around the sphere are divided into square cells, smaller than those of
//! [`SkyGrid`](super::sky_grid::SkyGrid). A byte for each cell says how bright its brightest star
//! is. All of these bytes fit in a processor's cache, and mostly they are the answer.

use super::Star;
use super::sky_grid::GridStar;
use nalgebra::Vector3;
use std::ops::RangeInclusive;

/// Cells along the edge of a face: in its middle they are 0.45° wide. Of SKY2000, every second one
/// has a star.
const CELLS: usize = 256;
/// Magnitude of the byte 0, and steps per magnitude.
const FIRST_V_MAG: f32 = -2.0;
const STEPS_PER_MAG: f32 = 8.0;
/// The byte of a cell without a star.
const NO_STAR: u8 = u8::MAX;
/// Margin on the reach of a disc in a face, for its curvature and for rounding.
const MARGIN: f64 = 1.1;
/// Discs with longer chords are curved too much for this margin.
const LONGEST_CHORD: f64 = 0.01;

/// The stars of a catalogue in small cells.
#[derive(Debug)]
pub struct FaceGrid {
    /// The brightest star of each cell.
    brightest: Vec<u8>,
    /// The stars of cell `c` are `stars[starts[c]..starts[c + 1]]`, brightest first.
    starts: Vec<u32>,
    stars: Vec<FaceStar>,
}

/// A star of the grid, as [`GridStar`] has it.
#[derive(Debug, Clone, Copy)]
struct FaceStar {
    direction: [f32; 3],
    v_mag: f32,
}

/// A direction's place: its face, and the coordinates in it, in [−1, 1].
struct Place {
    face: usize,
    u: f64,
    v: f64,
}

impl Place {
    fn of(d: &Vector3<f64>) -> Self {
        let [x, y, z] = [d.x.abs(), d.y.abs(), d.z.abs()];
        let (axis, [along, p, q]) = if x >= y && x >= z {
            (0, [d.x, d.y, d.z])
        } else if y >= z {
            (1, [d.y, d.z, d.x])
        } else {
            (2, [d.z, d.x, d.y])
        };
        let scale = 1.0 / along.abs();
        Self {
            face: 2 * axis + usize::from(along < 0.0),
            u: p * scale,
            v: q * scale,
        }
    }

    fn cell(&self) -> usize {
        (self.face * CELLS + cell_along(self.u)) * CELLS + cell_along(self.v)
    }
}

fn cell_along(coordinate: f64) -> usize {
    (((coordinate + 1.0) * (0.5 * CELLS as f64)).max(0.0) as usize).min(CELLS - 1)
}

/// The step of a magnitude: that of a fainter one is not smaller.
fn step_of(v_mag: f32) -> u8 {
    let steps = (v_mag - FIRST_V_MAG) * STEPS_PER_MAG;
    steps.clamp(0.0, f32::from(NO_STAR - 1)) as u8
}

impl FaceGrid {
    /// Sorts `stars`, which must be ordered brightest first, into cells.
    pub fn new(stars: &[Star]) -> Self {
        let packed = stars.iter().enumerate().map(|(index, star)| {
            let GridStar {
                direction, v_mag, ..
            } = GridStar::new(index, star);
            FaceStar { direction, v_mag }
        });
        let packed: Vec<FaceStar> = packed.collect();
        let cell_of = |star: &FaceStar| Place::of(&star.vector()).cell() as u32;
        let cells: Vec<u32> = packed.iter().map(cell_of).collect();
        let mut brightest = vec![NO_STAR; 6 * CELLS * CELLS];
        let mut starts = vec![0u32; brightest.len() + 1];
        for &cell in &cells {
            starts[cell as usize + 1] += 1;
        }
        for cell in 1..starts.len() {
            starts[cell] += starts[cell - 1];
        }
        // A stable counting sort.
        let mut next = starts.clone();
        let mut sorted = packed.clone();
        for (star, &cell) in packed.iter().zip(&cells) {
            let position = &mut next[cell as usize];
            sorted[*position as usize] = *star;
            *position += 1;
            let brightest = &mut brightest[cell as usize];
            *brightest = step_of(star.v_mag).min(*brightest);
        }
        Self {
            brightest,
            starts,
            stars: sorted,
        }
    }

    /// As [`SkyGrid::is_any_within`](super::sky_grid::SkyGrid::is_any_within); `None` where the disc
    /// is too large, or on the edge of a face.
    #[inline]
    pub fn is_any_within(
        &self,
        centre: &Vector3<f64>,
        chord: f64,
        magnitudes: &RangeInclusive<f32>,
    ) -> Option<bool> {
        let Place { face, u, v } = Place::of(centre);
        // How much u and v change at most with the direction: by the gradient of the projection.
        let reach =
            MARGIN * chord * ((1.0 + u.abs().max(v.abs()).powi(2)) * (1.0 + u * u + v * v)).sqrt();
        if chord > LONGEST_CHORD || u.abs().max(v.abs()) + reach >= 1.0 {
            return None;
        }
        let faintest = step_of(*magnitudes.end());
        let rows = cell_along(u - reach)..=cell_along(u + reach);
        let (first, last) = (cell_along(v - reach), cell_along(v + reach));
        for row in rows {
            let row = (face * CELLS + row) * CELLS;
            for cell in row + first..=row + last {
                if self.brightest[cell] <= faintest
                    && self.is_any_in(cell, centre, chord, magnitudes)
                {
                    return Some(true);
                }
            }
        }
        Some(false)
    }

    fn is_any_in(
        &self,
        cell: usize,
        centre: &Vector3<f64>,
        chord: f64,
        magnitudes: &RangeInclusive<f32>,
    ) -> bool {
        let stars = &self.stars[self.starts[cell] as usize..self.starts[cell + 1] as usize];
        let bright_enough = |star: &&FaceStar| star.v_mag <= *magnitudes.end();
        stars.iter().take_while(bright_enough).any(|star| {
            star.v_mag >= *magnitudes.start()
                && (star.vector() - centre).norm_squared() <= chord * chord
        })
    }
}

impl FaceStar {
    #[inline]
    fn vector(&self) -> Vector3<f64> {
        Vector3::from(self.direction.map(f64::from))
    }
}

#[cfg(test)]
mod tests {
    use super::super::Catalog;
    use super::super::sky_grid::{SkyGrid, chord_of};
    use super::*;
    use crate::base::coords::UnitVector;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn it_answers_as_the_grid_of_the_sky() {
        let stars = Catalog::built_in().stars();
        let (faces, sky) = (FaceGrid::new(stars), SkyGrid::new(stars));
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let (mut asked, mut found) = (0, 0);
        for trial in 0..200_000 {
            // Everywhere, and just beside a star.
            let mut vector = Vector3::from_fn(|_, _| random.random_range(-1.0..1.0));
            let chord = chord_of(10f64.powf(random.random_range(-5.0..-1.9)));
            if trial % 2 == 0 {
                let star = &stars[random.random_range(0..stars.len())];
                vector = star.direction.as_vector() + vector.normalize() * chord;
            }
            let centre = UnitVector::from_vector(vector);
            let faint = random.random_range(1.0..12.0);
            let magnitudes = faint - 5.0..=faint;
            let Some(answer) = faces.is_any_within(centre.as_vector(), chord, &magnitudes) else {
                continue;
            };
            assert_eq!(answer, sky.is_any_within(&centre, chord, magnitudes));
            asked += 1;
            found += usize::from(answer);
        }
        assert!(asked > 150_000, "{asked}");
        assert!(found > 10_000, "{found}");
    }
}
