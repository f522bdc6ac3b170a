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

/// A small disc on the sky, as the cells that it touches.
#[derive(Debug, Clone, Copy)]
pub struct Disc {
    chord: f64,
    /// First and last row, counted over all faces, and column.
    rows: [u16; 2],
    columns: [u16; 2],
}

impl Disc {
    /// The disc within `chord` of the unit vector `centre`; `None` where it is too large, or on the
    /// edge of a face.
    #[inline]
    pub fn of(centre: &Vector3<f64>, chord: f64) -> Option<Self> {
        let Place { face, u, v } = Place::of(centre);
        let outermost = u.abs().max(v.abs());
        // How much u and v change at most with the direction: by the gradient of the projection.
        let gradient_sq = (1.0 + outermost * outermost) * (1.0 + u * u + v * v);
        let reach = MARGIN * chord * gradient_sq.sqrt();
        if chord > LONGEST_CHORD || outermost + reach >= 1.0 {
            return None;
        }
        let row = |u: f64| (face * CELLS + cell_along(u)) as u16;
        let column = |v: f64| cell_along(v) as u16;
        Some(Self {
            chord,
            rows: [row(u - reach), row(u + reach)],
            columns: [column(v - reach), column(v + reach)],
        })
    }

    /// The first cell that it touches.
    #[inline]
    pub fn first_cell(&self) -> usize {
        self.rows[0] as usize * CELLS + self.columns[0] as usize
    }
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

    /// Whether a cell may hold a star of a magnitude or a brighter one.
    #[inline]
    pub fn may_hold(&self, cell: usize, faintest_v_mag: f32) -> bool {
        self.brightest[cell] <= step_of(faintest_v_mag)
    }

    /// The stars of a cell: the first, and the end.
    #[inline]
    pub fn range(&self, cell: usize) -> (u32, u32) {
        (self.starts[cell], self.starts[cell + 1])
    }

    /// V magnitude of a star of the grid.
    #[inline]
    pub fn v_mag(&self, star: u32) -> f32 {
        self.stars[star as usize].v_mag
    }

    /// As [`SkyGrid::is_any_within`](super::sky_grid::SkyGrid::is_any_within); `centre` is that of the
    /// disc.
    #[inline]
    pub fn is_any_within(
        &self,
        disc: &Disc,
        centre: &Vector3<f64>,
        magnitudes: &RangeInclusive<f32>,
    ) -> bool {
        let [first, last] = disc.columns;
        (disc.rows[0]..=disc.rows[1]).any(|row| {
            let row = row as usize * CELLS;
            (row + first as usize..=row + last as usize).any(|cell| {
                self.may_hold(cell, *magnitudes.end())
                    && self.is_any_in(cell, centre, disc.chord, magnitudes)
            })
        })
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
            let Some(disc) = Disc::of(centre.as_vector(), chord) else {
                continue;
            };
            let answer = faces.is_any_within(&disc, centre.as_vector(), &magnitudes);
            assert_eq!(answer, sky.is_any_within(&centre, chord, magnitudes));
            asked += 1;
            found += usize::from(answer);
        }
        assert!(asked > 150_000, "{asked}");
        assert!(found > 10_000, "{found}");
    }
}
