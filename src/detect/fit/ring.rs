//! The pixels around the window of a fit, and surfaces through them.

use super::sums::sum_of;
use super::window::Window;
use crate::base::least_squares::LinearFit;
use crate::detect::pixels::View;
use crate::detect::psf::{GROUP_PX, MAX_WINDOW_PX, PixelGroup, each, each_of, plus, times};
use arrayvec::ArrayVec;
use multiversion::multiversion;
use nalgebra::SVector;

/// Breadth of the ring of pixels around a window that tells its background, in pixels.
const RING_PX: usize = 5;
/// Side of the largest ring, in pixels.
pub(super) const MAX_SIDE_PX: usize = MAX_WINDOW_PX + 2 * RING_PX;
/// Most pixels.
pub(super) const MAX_PIXELS: usize = MAX_SIDE_PX * MAX_SIDE_PX;

/// The pixels of a ring that have a value: too many to be copied.
#[derive(Debug, Default)]
pub(super) struct Ring {
    /// From the middle of the window.
    columns: ArrayVec<f32, MAX_PIXELS>,
    rows: ArrayVec<f32, MAX_PIXELS>,
    /// In ADU.
    values: ArrayVec<f32, MAX_PIXELS>,
}

impl Ring {
    /// Takes the pixels around a window.
    pub fn gather(&mut self, view: &View<'_>, window: &Window) {
        let around = |first: usize, count: usize, side: usize| {
            first.saturating_sub(RING_PX)..(first + count + RING_PX).min(side)
        };
        let columns = around(window.x0, window.width, view.width);
        let [middle_x, middle_y] = window.middle();
        let from_middle =
            |at: usize, first: usize, middle: f64| (at as f64 - first as f64 - middle) as f32;
        let [mut offsets, mut buffer] = [[0.0f32; MAX_SIDE_PX]; 2];
        for (offset, x) in offsets.iter_mut().zip(columns.clone()) {
            *offset = from_middle(x, window.x0, middle_x);
        }
        for y in around(window.y0, window.height, view.height) {
            let row = from_middle(y, window.y0, middle_y);
            let is_beside = (window.y0..window.y0 + window.height).contains(&y);
            let left = columns.start..if is_beside { window.x0 } else { columns.end };
            let inside = if is_beside { window.width } else { 0 };
            let right = (left.end + inside).min(columns.end)..columns.end;
            for part in [left, right] {
                let values = &mut buffer[..part.len()];
                view.row(y).span(part.clone()).copy_to(values);
                if values.iter().all(|value| value.is_finite()) {
                    let columns = &offsets[part.start - columns.start..][..part.len()];
                    self.columns.extend(columns.iter().copied());
                    self.rows.extend(std::iter::repeat_n(row, part.len()));
                    self.values.extend(values.iter().copied());
                    continue;
                }
                for (x, &value) in part.zip(&*values) {
                    if value.is_finite() {
                        self.columns.push(offsets[x - columns.start]);
                        self.rows.push(row);
                        self.values.push(value);
                    }
                }
            }
        }
    }

    /// Their values, in ADU.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// Column and row of each, from the middle of the window, and its value in ADU.
    pub fn pixels(&self) -> impl Iterator<Item = ([f32; 2], f32)> {
        let places = self.columns.iter().zip(&self.rows);
        let pixels = places.zip(&self.values);
        pixels.map(|((column, row), value)| ([*column, *row], *value))
    }

    /// A distance from the middle of the window that no pixel exceeds.
    pub fn reach_px(&self) -> f64 {
        let farthest = |along: &[f32]| along.iter().fold(0.0f32, |most, at| most.max(at.abs()));
        f64::from(libm::hypotf(farthest(&self.columns), farthest(&self.rows)))
    }

    /// Keeps those at some places.
    pub fn retain(&mut self, is_kept: impl Fn([f32; 2]) -> bool) {
        let mut kept = 0;
        for at in 0..self.values.len() {
            if is_kept([self.columns[at], self.rows[at]]) {
                for part in [&mut self.columns, &mut self.rows, &mut self.values] {
                    part[kept] = part[at];
                }
                kept += 1;
            }
        }
        for part in [&mut self.columns, &mut self.rows, &mut self.values] {
            part.truncate(kept);
        }
    }

    /// How the values, clipped to a range, increase from column to column and from row to row, in ADU.
    pub fn clipped_slope(&self, range: [f64; 2]) -> Option<[f64; 2]> {
        let near = NearSurface {
            range: range.map(|limit| limit as f32),
            surface: [(0.5 * (range[0] + range[1])) as f32, 0.0, 0.0],
            most: f32::INFINITY,
        };
        let plane = sums_near(self, &near).equations().solve()?;
        Some([plane[1], plane[2]])
    }

    /// The surface of the first `N` of the terms 1, x, y, x², xy and y² through pixels without stars, from the
    /// middle of the window, and their variance about it. `None` where they are too few.
    pub fn surface<const N: usize>(&self) -> Option<(SVector<f64, N>, f64)> {
        /// Rounds of clipping: the first surfaces are of the stars, too.
        const ROUNDS: usize = 6;
        /// Pixels so many standard deviations off the surface of the round before are not its own.
        const CLIP_SIGMAS: f64 = 2.5;
        /// Share of the pixels that is left at least.
        const MIN_FRACTION: f64 = 0.4;
        /// Another round would take the same pixels where the variance changes by a smaller part.
        const SETTLED: f64 = 1e-5;
        let least = (MIN_FRACTION * self.values.len() as f64).max(N as f64 + 1.0);
        let mut surface = SVector::<f64, N>::zeros();
        surface[0] = f64::from(*self.values.first()?);
        let mut near = NearSurface::all();
        let mut before = (0.0, 0.0);
        for _ in 0..ROUNDS {
            near.surface = std::array::from_fn(|i| surface[i] as f32);
            let sums = sums_near(self, &near);
            if sums.used < least {
                return None;
            }
            let equations = sums.equations();
            let change = equations.solve()?;
            // From the surface that the pixels are compared with, in single precision.
            surface = SVector::from(near.surface.map(f64::from)) + change;
            let misfit = sums.squares - change.dot(&equations.vector);
            let variance = (misfit / (sums.used - N as f64)).max(0.0);
            near.most = (CLIP_SIGMAS * CLIP_SIGMAS * variance) as f32;
            let is_settled =
                before.0 == sums.used && (before.1 - variance).abs() <= SETTLED * variance;
            before = (sums.used, variance);
            if is_settled {
                break;
            }
        }
        Some((surface, before.1))
    }
}

/// Which pixels are added, and what of them.
struct NearSurface<const N: usize> {
    /// Values are clipped to these, in ADU.
    range: [f32; 2],
    /// What they are above this surface is added.
    surface: [f32; N],
    /// Pixels with a larger square of that are left out.
    most: f32,
}

impl<const N: usize> NearSurface<N> {
    /// All pixels.
    fn all() -> Self {
        Self {
            range: [f32::NEG_INFINITY, f32::INFINITY],
            surface: [0.0; N],
            most: f32::INFINITY,
        }
    }
}

/// Sums over pixels for a surface of `N` terms.
struct SurfaceSums<const N: usize> {
    /// Lower triangle.
    matrix: [[f64; N]; N],
    vector: [f64; N],
    squares: f64,
    used: f64,
}

impl<const N: usize> SurfaceSums<N> {
    fn equations(&self) -> LinearFit<N> {
        let mut fit = LinearFit::new();
        for i in 0..N {
            fit.vector[i] = self.vector[i];
            for j in 0..N {
                fit.matrix[(i, j)] = self.matrix[i.max(j)][i.min(j)];
            }
        }
        fit
    }
}

/// Sums over the pixels near a surface.
#[allow(
    clippy::needless_range_loop,
    reason = "triangles of known lengths, which become vectors"
)]
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn sums_near<const N: usize>(ring: &Ring, near: &NearSurface<N>) -> SurfaceSums<N> {
    let mut matrix = [[[0.0f32; GROUP_PX]; N]; N];
    let mut vector = [[0.0f32; GROUP_PX]; N];
    let [mut squares, mut used] = [[0.0f32; GROUP_PX]; 2];
    let [low, high] = near.range;
    for start in (0..ring.values.len()).step_by(GROUP_PX) {
        let x = group_from(&ring.columns[start..], 0.0);
        let y = group_from(&ring.rows[start..], 0.0);
        let values = group_from(&ring.values[start..], f32::NAN);
        let terms = [
            [1.0; GROUP_PX],
            x,
            y,
            times(&x, &x),
            times(&x, &y),
            times(&y, &y),
        ];
        // No `clamp`, which has a branch.
        let values = each(&values, |value| if value < low { low } else { value });
        let mut off = each(&values, |value| if value > high { high } else { value });
        for (term, factor) in terms.iter().zip(near.surface) {
            off = each_of(&off, term, |off, term| off - factor * term);
        }
        // False where there is no pixel.
        let is_near = |off: f32| off * off <= near.most;
        let kept = each(&off, |off| if is_near(off) { 1.0 } else { 0.0 });
        let off = each(&off, |off| if is_near(off) { off } else { 0.0 });
        squares = plus(&squares, &times(&off, &off));
        used = plus(&used, &kept);
        for i in 0..N {
            vector[i] = plus(&vector[i], &times(&terms[i], &off));
            let term = times(&terms[i], &kept);
            for j in 0..i + 1 {
                matrix[i][j] = plus(&matrix[i][j], &times(&term, &terms[j]));
            }
        }
    }
    let mut sums = SurfaceSums {
        matrix: [[0.0; N]; N],
        vector: [0.0; N],
        squares: sum_of(squares),
        used: sum_of(used),
    };
    for i in 0..N {
        sums.vector[i] = sum_of(vector[i]);
        for j in 0..i + 1 {
            sums.matrix[i][j] = sum_of(matrix[i][j]);
        }
    }
    sums
}

/// The first values, filled up.
#[inline(always)]
fn group_from(values: &[f32], filling: f32) -> PixelGroup {
    match values.first_chunk::<GROUP_PX>() {
        Some(group) => *group,
        None => {
            let mut group = [filling; GROUP_PX];
            for (to, value) in group.iter_mut().zip(values) {
                *to = *value;
            }
            group
        }
    }
}
