//! The triangles of a size class, sorted by shape.
//!
//! The plane of the two ratios is cut into cells, in rows and columns. Triangles are stored cell by
//! cell and row by row, so a search for a shape reads a few contiguous ranges. The cells of a row
//! are grouped in chunks, which are loaded when they are first needed.

use std::ops::RangeInclusive;
use std::sync::OnceLock;

/// Rows divide the middle side's ratio from [`MIN_MIDDLE_RATIO`] to 1, columns the shortest
/// side's from 0 to 1.
const ROWS: usize = 128;
const COLUMNS: usize = 256;
/// A chunk is this many neighboring cells of a row.
const CELLS_PER_CHUNK: usize = 32;
/// Cells of a class.
pub const CELLS: usize = ROWS * COLUMNS;
/// Chunks of a class.
pub const CHUNKS: usize = CELLS / CELLS_PER_CHUNK;
/// The middle side is at least half of the longest.
const MIN_MIDDLE_RATIO: f64 = 0.5;
/// Ratios are stored in steps of this: a hundredth of the smallest tolerance.
const RATIO_STEP: f64 = 1.0 / 65536.0;

/// Bits in which a corner is stored, and so many stars, the brightest, may be corners.
const CORNER_BITS: u32 = 21;
pub const MAX_STARS: usize = 1 << CORNER_BITS;
/// Bytes of a triangle, in memory and in a file.
pub const TRIANGLE_BYTES: usize = 16;

/// Brightest magnitude that is stored, and the step of magnitudes.
const BRIGHTEST_V_MAG: f32 = -2.0;
const MAG_STEP: f32 = 1.0 / 16.0;
/// Faintest magnitude that is stored.
pub const FAINTEST_V_MAG: f32 = BRIGHTEST_V_MAG + 255.0 * MAG_STEP;
/// A size class is divided in this many sizes.
const SIZES: f64 = 256.0;

/// One triangle, with all that decides whether it is like an observed one: a search looks at
/// hundreds of thousands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Triangle {
    /// Corners A, B, C, in [`CORNER_BITS`] each, A first.
    corners: u64,
    /// Middle and shortest side over the longest, in [`RATIO_STEP`].
    pub ratios: [u16; 2],
    /// Where in its class the logarithm of its longest side is, see [`SizeClass::ln_longest`].
    pub size: u8,
    /// V magnitudes of the corners, in [`MAG_STEP`] from [`BRIGHTEST_V_MAG`].
    pub mags: [u8; 3],
}

impl Triangle {
    /// The triangle with these corners and ratios, whose longest side is `share` of the way from
    /// the smallest to the largest of its class. Ratios, size and magnitudes are rounded.
    pub fn new(corners: [u32; 3], ratios: [f64; 2], share: f64, v_mags: [f32; 3]) -> Self {
        Self {
            corners: corners
                .iter()
                .fold(0, |all, &corner| all << CORNER_BITS | u64::from(corner)),
            ratios: [steps(ratios[0]), steps(ratios[1])],
            size: (share * SIZES) as u8,
            mags: v_mags.map(|v_mag| ((v_mag - BRIGHTEST_V_MAG) / MAG_STEP).round() as u8),
        }
    }

    /// Corners A, B, C, as indices into the catalogue's stars.
    #[inline]
    pub fn corners(&self) -> [u32; 3] {
        [2 * CORNER_BITS, CORNER_BITS, 0]
            .map(|shift| (self.corners >> shift) as u32 % MAX_STARS as u32)
    }

    /// The triangle as it is in a file: corners, ratios, size, magnitudes, little-endian.
    pub fn to_bytes(self) -> [u8; TRIANGLE_BYTES] {
        let ([m0, m1], [s0, s1]) = (self.ratios[0].to_le_bytes(), self.ratios[1].to_le_bytes());
        let [a_mag, b_mag, c_mag] = self.mags;
        let like = u64::from_le_bytes([m0, m1, s0, s1, self.size, a_mag, b_mag, c_mag]);
        (u128::from(like) << 64 | u128::from(self.corners)).to_le_bytes()
    }

    /// The triangle of which [`to_bytes`](Self::to_bytes) are these.
    #[inline]
    pub fn from_bytes(bytes: [u8; TRIANGLE_BYTES]) -> Self {
        let whole = u128::from_le_bytes(bytes);
        let [m0, m1, s0, s1, size, mags @ ..] = ((whole >> 64) as u64).to_le_bytes();
        Self {
            corners: whole as u64,
            ratios: [[m0, m1], [s0, s1]].map(u16::from_le_bytes),
            size,
            mags,
        }
    }

    /// V magnitudes of the corners.
    #[inline]
    pub fn v_mags(&self) -> [f32; 3] {
        let [a, b, c] = self.mags;
        let v_mag = |mag| BRIGHTEST_V_MAG + MAG_STEP * f32::from(mag);
        [v_mag(a), v_mag(b), v_mag(c)]
    }

    fn cell(&self) -> usize {
        let [middle, shortest] = self.ratios;
        row_of(ratio(middle)) * COLUMNS + column_of(ratio(shortest))
    }
}

fn steps(ratio: f64) -> u16 {
    (ratio / RATIO_STEP).round() as u16
}

fn ratio(steps: u16) -> f64 {
    f64::from(steps) * RATIO_STEP
}

fn row_of(middle: f64) -> usize {
    let share = (middle - MIN_MIDDLE_RATIO) / (1.0 - MIN_MIDDLE_RATIO);
    ((share.max(0.0) * ROWS as f64) as usize).min(ROWS - 1)
}

fn column_of(shortest: f64) -> usize {
    ((shortest.max(0.0) * COLUMNS as f64) as usize).min(COLUMNS - 1)
}

/// Triangles whose longest sides lie between two limits.
#[derive(Debug)]
pub struct SizeClass {
    /// Smallest longest side, as a chord.
    pub low: f64,
    /// Largest longest side, as a chord.
    pub high: f64,
    /// V magnitudes of the corners less those that are stored: those of deep catalogues would not fit.
    pub fainter_mag: f32,
    /// Logarithm of `low`, and from one size to the next.
    ln_low: f64,
    ln_step: f64,
    /// `cell_starts[c]..cell_starts[c + 1]` are the triangles of cell `c`; row by row.
    pub cell_starts: Vec<u32>,
    /// The triangles of each chunk, once it is loaded.
    pub chunks: Vec<OnceLock<Box<[Triangle]>>>,
}

impl SizeClass {
    /// The class of `triangles`, whose longest sides are from `low` to `high` as chords. Triangles
    /// of the same cell keep their order.
    pub fn new([low, high]: [f64; 2], triangles: &[Triangle]) -> Self {
        let mut cell_starts = vec![0u32; CELLS + 1];
        for triangle in triangles {
            cell_starts[triangle.cell() + 1] += 1;
        }
        for cell in 1..cell_starts.len() {
            cell_starts[cell] += cell_starts[cell - 1];
        }
        // A stable counting sort.
        let mut next = cell_starts.clone();
        let mut sorted = triangles.to_vec();
        for triangle in triangles {
            let position = &mut next[triangle.cell()];
            sorted[*position as usize] = *triangle;
            *position += 1;
        }
        let class = Self::not_loaded([low, high], cell_starts);
        for (chunk, slot) in class.chunks.iter().enumerate() {
            let range = class.range(chunk);
            let _ = slot.set(sorted[range.start as usize..range.end as usize].into());
        }
        class
    }

    /// A class without its chunks.
    pub fn not_loaded([low, high]: [f64; 2], cell_starts: Vec<u32>) -> Self {
        Self {
            low,
            high,
            fainter_mag: 0.0,
            ln_low: libm::log(low),
            ln_step: libm::log(high / low) / SIZES,
            cell_starts,
            chunks: (0..CHUNKS).map(|_| OnceLock::new()).collect(),
        }
    }

    /// Logarithm of the longest side, as a chord, of the triangles of a size.
    #[inline]
    pub fn ln_longest(&self, size: u8) -> f64 {
        self.ln_low + (f64::from(size) + 0.5) * self.ln_step
    }

    /// Whether its cells follow one another.
    pub fn is_ordered(&self) -> bool {
        self.cell_starts.first() == Some(&0) && self.cell_starts.is_sorted()
    }

    /// Number of triangles.
    pub fn len(&self) -> usize {
        self.cell_starts.last().map_or(0, |end| *end as usize)
    }

    /// The range of the class's triangles that is a chunk.
    pub fn range(&self, chunk: usize) -> std::ops::Range<u32> {
        let [from, to] = [chunk, chunk + 1].map(|chunk| self.cell_starts[chunk * CELLS_PER_CHUNK]);
        from..to
    }

    /// Where the triangles of a shape are.
    pub fn places(&self, shape: &WantedShape) -> impl Iterator<Item = TriangleRange> {
        let [middle, shortest] = shape.ratios;
        let columns = span(column_of, shortest, shape.tolerance);
        span(row_of, middle, shape.tolerance).flat_map(move |row| {
            let [first, last] = [columns.start(), columns.end()].map(|c| row * COLUMNS + c);
            let chunks = first / CELLS_PER_CHUNK..=last / CELLS_PER_CHUNK;
            chunks.filter_map(move |chunk| {
                let cells = chunk * CELLS_PER_CHUNK..(chunk + 1) * CELLS_PER_CHUNK;
                let before = self.cell_starts[cells.start];
                let from = self.cell_starts[first.max(cells.start)] - before;
                let to = self.cell_starts[cells.end.min(last + 1)] - before;
                let place = TriangleRange {
                    chunk: chunk as u32,
                    from,
                    to,
                };
                (from < to).then_some(place)
            })
        })
    }
}

/// A part of a chunk of a class: triangles `from..to`.
#[derive(Debug, Clone, Copy)]
pub struct TriangleRange {
    /// The chunk.
    pub chunk: u32,
    from: u32,
    to: u32,
}

impl TriangleRange {
    /// The triangles there. A damaged chunk may have fewer than its table says.
    #[inline]
    pub fn triangles<'a>(&self, chunk: &'a [Triangle]) -> &'a [Triangle] {
        let range = self.from as usize..self.to as usize;
        chunk.get(range).unwrap_or_default()
    }
}

/// A shape, and how exactly triangles are to have it.
#[derive(Debug, Clone, Copy)]
pub struct WantedShape {
    /// Middle and shortest side over the longest.
    pub ratios: [f64; 2],
    /// Largest distance from them in their plane.
    pub tolerance: f64,
}

impl WantedShape {
    /// Whether a triangle has it, as far as ratios are stored.
    pub fn test(&self) -> impl Fn(&Triangle) -> bool + use<> {
        let [middle, shortest] = self.ratios.map(|ratio| (ratio / RATIO_STEP) as f32);
        let within = self.tolerance / RATIO_STEP;
        let within_sq = (within * within) as f32;
        move |triangle| {
            let [of_middle, of_shortest] = triangle.ratios;
            let off = [
                f32::from(of_middle) - middle,
                f32::from(of_shortest) - shortest,
            ];
            off[0] * off[0] + off[1] * off[1] <= within_sq
        }
    }
}

/// The rows or columns within `tolerance` of `centre`, and a step more since ratios are rounded.
fn span(of: fn(f64) -> usize, centre: f64, tolerance: f64) -> RangeInclusive<usize> {
    let reach = tolerance + RATIO_STEP;
    of(centre - reach)..=of(centre + reach)
}
