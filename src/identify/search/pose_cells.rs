//! In which cell of each grid is a pose? For several poses at once.
//!
//! A triangle of stars in the camera and the same triangle in the sky → optical axis and x axis of
//! the camera in the sky (TRIAD) → cells of these, of the scale and of parity.

use super::aligned::InCamera;
use crate::catalog::sky_grid::chord_of;
use crate::identify::priors::SkyRegion;
use multiversion::multiversion;

/// Size of a cell: of the optical axis in units of the field's width, …
const AXIS_STEP: f64 = 0.06;
/// … of the direction of the x axis in radians, …
const ROLL_STEP: f32 = 0.09;
/// … and of the logarithm of the focal length.
const SCALE_STEP: f32 = 0.05;
/// Number of grids, and their shifts, in cells.
pub const GRIDS: usize = 2;
const SHIFTS: [f32; GRIDS] = [0.0, 0.5];

/// Levels of the scale start at a focal length of this logarithm, in pixels, below any.
const LEVELS_FROM: f32 = -10.0;
/// Coordinates of cells are counted from this number, so that none is negative.
const CELLS_FROM: f32 = 65536.0;
/// The pose of a triangle may be outside the region that a hint allows by this part of a cell, and the
/// true one inside.
const NEAR_SLACK: f64 = 1.0;

/// Number of poses at once.
pub const LANES: usize = 8;

/// A number of each of several poses.
pub type Lanes<T> = [T; LANES];

/// Three coordinates of several poses.
type LaneVector = [Lanes<f32>; 3];

/// How an observed triangle lies in the camera.
#[derive(Debug, Clone, Copy)]
pub struct CameraAxes {
    /// Optical axis and x axis in the frame of the triangle, not mirrored and mirrored. Not a number
    /// where the triangle has none.
    axes: [[f32; 6]; 2],
    triple: f32,
}

impl CameraAxes {
    /// Those of a triangle.
    pub fn new(in_camera: Option<&InCamera>) -> Self {
        let Some(InCamera { frames, triple }) = in_camera else {
            return Self {
                axes: [[f32::NAN; 6]; 2],
                triple: 0.0,
            };
        };
        Self {
            axes: frames.map(|frame| {
                std::array::from_fn(|i| frame[(if i < 3 { 2 } else { 0 }, i % 3)] as f32)
            }),
            triple: *triple as f32,
        }
    }
}

/// Triangles in the camera, and the same in the sky.
#[derive(Debug, Default)]
pub struct Alignments {
    /// Corner by corner, coordinate by coordinate.
    sky: [LaneVector; 3],
    axes: [[Lanes<f32>; 6]; 2],
    triple: Lanes<f32>,
    ln_focal: Lanes<f32>,
}

impl Alignments {
    /// Sets one of them: the unit vectors in the sky, and the logarithm of the focal length in pixels.
    #[inline]
    pub fn set(&mut self, lane: usize, sky: [[f32; 3]; 3], camera: &CameraAxes, ln_focal: f32) {
        for (lanes, vector) in self.sky.iter_mut().zip(sky) {
            for (lanes, coordinate) in lanes.iter_mut().zip(vector) {
                lanes[lane] = coordinate;
            }
        }
        for (lanes, axes) in self.axes.iter_mut().zip(&camera.axes) {
            for (lanes, coordinate) in lanes.iter_mut().zip(axes) {
                lanes[lane] = *coordinate;
            }
        }
        self.triple[lane] = camera.triple;
        self.ln_focal[lane] = ln_focal;
    }
}

/// Camera poses.
#[derive(Debug, Default)]
struct Poses {
    /// Optical axis.
    axis: LaneVector,
    /// The x axis.
    side: LaneVector,
    mirrored: Lanes<u32>,
}

/// Cells of poses.
#[derive(Debug, Default)]
pub struct PoseCells {
    /// Their number in each grid.
    pub cells: [Lanes<u32>; GRIDS],
    /// Whether hints allow the poses.
    pub allowed: Lanes<bool>,
}

/// Cells of one level of the scale.
#[derive(Debug, Clone, Copy)]
struct ScaleLevel {
    /// Cells of the optical axis in a unit vector's coordinate of 1.
    axis_cells: f32,
    /// Largest chord, squared, of the optical axis from the middle of the region that a hint allows.
    max_chord_sq: f32,
}

/// The grids of cells.
#[derive(Debug, Default)]
pub struct PoseGrids {
    near: [f32; 3],
    levels: [Vec<ScaleLevel>; GRIDS],
    first_level: [i32; GRIDS],
}

impl PoseGrids {
    /// Sets them for poses of a frame of this width whose focal lengths are in a range (both in
    /// pixels) and whose optical axis is in a region.
    pub fn set(&mut self, width_px: f64, focal_px: [f64; 2], near: Option<SkyRegion>) {
        self.near = near.map_or([0.0; 3], |near| {
            let v = near.centre.as_vector();
            [v.x, v.y, v.z].map(|x| x as f32)
        });
        for (grid, shift) in SHIFTS.into_iter().enumerate() {
            let [first, last] = focal_px.map(|focal_px| level(libm::log(focal_px) as f32, shift));
            self.first_level[grid] = first - 1;
            let levels = &mut self.levels[grid];
            levels.clear();
            levels.extend((first - 1..=last + 1).map(|level| {
                let middle = (level as f32 + 0.5 - shift) * SCALE_STEP + LEVELS_FROM;
                let step_rad = AXIS_STEP * libm::atan(width_px / libm::exp(f64::from(middle)));
                let max_chord = near.map_or(f64::INFINITY, |near| {
                    chord_of(near.radius_rad + NEAR_SLACK * step_rad)
                });
                ScaleLevel {
                    axis_cells: (1.0 / step_rad) as f32,
                    max_chord_sq: (max_chord * max_chord) as f32,
                }
            }));
        }
    }

    /// The cells of the poses in which triangles are aligned.
    pub fn cells(&self, alignments: &Alignments, cells: &mut PoseCells) {
        let mut poses = Poses::default();
        align(alignments, &mut poses);
        cells.allowed = [true; LANES];
        for (grid, shift) in SHIFTS.into_iter().enumerate() {
            let levels = &self.levels[grid];
            let mut hash = [0; LANES];
            let mut axis_cells = [0.0; LANES];
            let mut max_chord_sq = [0.0; LANES];
            for lane in 0..LANES {
                let level = level(alignments.ln_focal[lane], shift);
                let of_level = (level - self.first_level[grid]).max(0) as usize;
                let of_level = levels[of_level.min(levels.len() - 1)];
                hash[lane] = (level as u32) << 1 | poses.mirrored[lane];
                axis_cells[lane] = of_level.axis_cells;
                max_chord_sq[lane] = of_level.max_chord_sq;
            }
            restrict(&poses, &self.near, &max_chord_sq, &mut cells.allowed);
            number(&poses, &axis_cells, shift, &mut hash);
            cells.cells[grid] = hash;
        }
    }
}

/// The level of a focal length, given its logarithm.
#[inline]
fn level(ln_focal: f32, shift: f32) -> i32 {
    ((ln_focal - LEVELS_FROM) * (1.0 / SCALE_STEP) + shift) as i32
}

/// The poses in which triangles are the same in the camera and in the sky.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn align(alignments: &Alignments, poses: &mut Poses) {
    let Alignments {
        sky, axes, triple, ..
    } = alignments;
    let [a, b, c] = sky;
    for i in 0..LANES {
        let [ax, ay, az] = [a[0][i], a[1][i], a[2][i]];
        let [bx, by, bz] = [b[0][i], b[1][i], b[2][i]];
        let cross = [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx];
        let sum = [ax + bx, ay + by, az + bz];
        let in_sky = cross[0] * c[0][i] + cross[1] * c[1][i] + cross[2] * c[2][i];
        let is_mirrored = in_sky * triple[i] < 0.0;
        let unit = |v: [f32; 3]| {
            let scale = 1.0 / (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
            v.map(|x| x * scale)
        };
        let first = unit(sum);
        let third = unit(cross);
        let second = [
            third[1] * first[2] - third[2] * first[1],
            third[2] * first[0] - third[0] * first[2],
            third[0] * first[1] - third[1] * first[0],
        ];
        let part = |k: usize| {
            if is_mirrored {
                axes[1][k][i]
            } else {
                axes[0][k][i]
            }
        };
        for k in 0..3 {
            poses.axis[k][i] = first[k] * part(0) + second[k] * part(1) + third[k] * part(2);
            poses.side[k][i] = first[k] * part(3) + second[k] * part(4) + third[k] * part(5);
        }
        poses.mirrored[i] = u32::from(is_mirrored);
    }
}

/// Excludes poses whose optical axis is too far from `near`, or is not a number.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn restrict(poses: &Poses, near: &[f32; 3], max_chord_sq: &Lanes<f32>, allowed: &mut Lanes<bool>) {
    for i in 0..LANES {
        let off = [0, 1, 2].map(|k: usize| poses.axis[k][i] - near[k]);
        let chord_sq = off[0] * off[0] + off[1] * off[1] + off[2] * off[2];
        allowed[i] &= chord_sq <= max_chord_sq[i];
    }
}

/// Mixes the coordinates of poses, in cells, into `hash`.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn number(poses: &Poses, axis_cells: &Lanes<f32>, shift: f32, hash: &mut Lanes<u32>) {
    for i in 0..LANES {
        let mut mixed = hash[i];
        for k in 0..6 {
            let cells = if k < 3 {
                poses.axis[k][i] * axis_cells[i]
            } else {
                poses.side[k - 3][i] * (1.0 / ROLL_STEP)
            };
            let number = (cells + (CELLS_FROM + shift)) as i32;
            mixed = (mixed ^ number as u32).wrapping_mul(0x9E37_79B1);
            mixed ^= mixed >> 15;
        }
        hash[i] = mixed;
    }
}
