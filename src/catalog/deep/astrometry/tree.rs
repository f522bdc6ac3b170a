//! The tree of stars in an index file: which of its rows may lie in a cone?
//!
//! Only the splits of the tree are kept in memory: some hundred kilobytes. The rows of a leaf are neighbors
//! in the file.
//!
//! # Reference
//! The comments in the headers of the files; Lang 2009, Principled Detection-by-Classification from Big
//! Data (thesis, University of Toronto), chapter 3.

use crate::base::file_ranges::FileRanges;
use crate::base::fits_tables::{Cards, FitsTable, Rows};
use crate::catalog::deep::error::Damage;
use nalgebra::Vector3;
use std::ops::Range;

/// Dimensions of the tree: unit vectors.
const DIMENSIONS: usize = 3;
/// Tables.
pub const HEADER: &str = "kdtree_header_stars";
pub const DATA: &str = "kdtree_data_stars";
/// The low bits of a split, which hold its dimension.
const DIMENSION_BITS: u32 = 0b11;

/// The order of the bytes of a number in the tables of the tree.
#[derive(Debug, Clone, Copy)]
enum ByteOrder {
    Little,
    Big,
}

impl ByteOrder {
    /// That of the machine that wrote the file: `ENDIAN` has the bytes of 0x01020304.
    fn of(cards: &Cards) -> Result<Self, Damage> {
        match cards.text("ENDIAN") {
            Some("04:03:02:01") => Ok(Self::Little),
            Some("01:02:03:04") => Ok(Self::Big),
            found => Err(Damage::Invalid(format!("ENDIAN = {found:?}"))),
        }
    }

    fn u32(self, bytes: [u8; 4]) -> u32 {
        match self {
            Self::Little => u32::from_le_bytes(bytes),
            Self::Big => u32::from_be_bytes(bytes),
        }
    }

    fn f32(self, bytes: [u8; 4]) -> f32 {
        f32::from_bits(self.u32(bytes))
    }

    fn f64(self, bytes: [u8; 8]) -> f64 {
        match self {
            Self::Little => f64::from_le_bytes(bytes),
            Self::Big => f64::from_be_bytes(bytes),
        }
    }
}

/// How the tree holds coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Coordinates {
    /// Whole numbers, in steps from −1.
    Steps,
    Single,
    Double,
}

/// The tree of stars in an index file.
#[derive(Debug)]
pub struct StarTree {
    order: ByteOrder,
    coordinates: Coordinates,
    /// The least coordinate and the steps in one unit, along each axis.
    least: [f64; DIMENSIONS],
    steps_per_unit: f64,
    /// For each node that has two below it, the first at 0: its split. Empty where none are stored: then all
    /// rows are read.
    splits: Vec<u32>,
    /// For each leaf, the row after its last.
    ends: Vec<u64>,
    /// The coordinates of each star.
    data: Rows,
}

impl StarTree {
    /// The tree in the tables of a file.
    pub fn read(file: &FileRanges, tables: &[FitsTable]) -> Result<Self, Damage> {
        let take = |name: &str| tables.iter().find(|table| table.is_called(name));
        let missing = |name: &str| Damage::Invalid(format!("without the table {name}"));
        let header = take(HEADER).ok_or_else(|| missing(HEADER))?;
        let data = take(DATA).ok_or_else(|| missing(DATA))?.rows;
        let cards = &header.cards;
        let order = ByteOrder::of(cards)?;
        if cards.number("KDT_NDIM") != Some(DIMENSIONS) {
            return Err(Damage::Invalid(
                "a tree without three dimensions".to_owned(),
            ));
        }
        if take("kdtree_perm_stars").is_some() {
            return Err(Damage::Unsupported("a permuted tree".to_owned()));
        }
        let coordinates = match cards.text("KDT_DATA") {
            Some("u32") => Coordinates::Steps,
            Some("float") => Coordinates::Single,
            Some("double") => Coordinates::Double,
            found => {
                let found = found.unwrap_or("none");
                return Err(Damage::Unsupported(format!("coordinates of type {found}")));
            }
        };
        let (least, steps_per_unit) = match (coordinates, take("kdtree_range_stars")) {
            (Coordinates::Steps, None) => return Err(missing("kdtree_range_stars")),
            (Coordinates::Steps, Some(range)) => scale_of(&range.rows.read_all(file)?, order)?,
            _ => ([0.0; DIMENSIONS], 1.0),
        };
        let splits = take("kdtree_split_stars").filter(|_| coordinates == Coordinates::Steps);
        let splits = match splits {
            Some(splits) => numbers(&splits.rows.read_all(file)?, order),
            None => Vec::new(),
        };
        let leaves = splits.len() + 1;
        let ends = match take("kdtree_lr_stars").filter(|_| leaves > 1) {
            Some(last) => {
                let last = numbers(&last.rows.read_all(file)?, order);
                last.iter().map(|last| u64::from(*last) + 1).collect()
            }
            None => linear_ends(data.count, leaves as u64),
        };
        let tree = Self {
            order,
            coordinates,
            least,
            steps_per_unit,
            splits,
            ends,
            data,
        };
        tree.check()?;
        Ok(tree)
    }

    fn check(&self) -> Result<(), Damage> {
        let bytes = match self.coordinates {
            Coordinates::Steps | Coordinates::Single => 4,
            Coordinates::Double => 8,
        };
        let leaves = self.splits.len() + 1;
        let is_whole = self.data.bytes == DIMENSIONS * bytes
            && leaves.is_power_of_two()
            && self.ends.len() == leaves
            && self.ends.is_sorted()
            && self.ends.last() == Some(&self.data.count);
        let contradiction = || Damage::Invalid("its tree and its rows do not fit".to_owned());
        is_whole.then_some(()).ok_or_else(contradiction)
    }

    /// The rows of the leaves that may have stars within a chord of a unit vector.
    pub fn rows_in_cone(&self, centre: &Vector3<f64>, chord: f64) -> Vec<Range<u64>> {
        let mut found = Vec::new();
        self.descend(0, centre, chord, &mut found);
        found
    }

    /// Adds the rows below a node to `found`, except those beyond its splits.
    fn descend(&self, node: usize, centre: &Vector3<f64>, chord: f64, found: &mut Vec<Range<u64>>) {
        let Some(split) = self.splits.get(node) else {
            let leaf = node - self.splits.len();
            let start = leaf.checked_sub(1).map_or(0, |before| self.ends[before]);
            let rows = start..self.ends[leaf];
            match found.last_mut() {
                Some(last) if last.end == rows.start => last.end = rows.end,
                _ if rows.is_empty() => {}
                _ => found.push(rows),
            }
            return;
        };
        let axis = ((split & DIMENSION_BITS) as usize).min(DIMENSIONS - 1);
        // The bits of the dimension are not those of the place.
        let slack = f64::from(DIMENSION_BITS + 1) / self.steps_per_unit;
        let place = self.least[axis] + f64::from(split & !DIMENSION_BITS) / self.steps_per_unit;
        if centre[axis] - chord <= place + slack {
            self.descend(2 * node + 1, centre, chord, found);
        }
        if centre[axis] + chord >= place - slack {
            self.descend(2 * node + 2, centre, chord, found);
        }
    }

    /// The vectors of the stars in `rows`.
    pub fn vectors(
        &self,
        file: &FileRanges,
        rows: Range<u64>,
    ) -> Result<impl Iterator<Item = Vector3<f64>>, Damage> {
        let bytes = self.data.read(file, rows)?;
        let width = self.data.bytes / DIMENSIONS;
        let count = bytes.len() / self.data.bytes;
        Ok((0..count).map(move |row| {
            let coordinate = |axis: usize| {
                let from = (row * DIMENSIONS + axis) * width;
                self.coordinate(&bytes[from..from + width], axis)
            };
            Vector3::new(coordinate(0), coordinate(1), coordinate(2))
        }))
    }

    fn coordinate(&self, cell: &[u8], axis: usize) -> f64 {
        match *cell {
            [a, b, c, d] if self.coordinates == Coordinates::Steps => {
                let steps = self.order.u32([a, b, c, d]);
                self.least[axis] + f64::from(steps) / self.steps_per_unit
            }
            [a, b, c, d] => f64::from(self.order.f32([a, b, c, d])),
            [a, b, c, d, e, f, g, h] => self.order.f64([a, b, c, d, e, f, g, h]),
            _ => f64::NAN,
        }
    }
}

/// The whole numbers in a table.
fn numbers(bytes: &[u8], order: ByteOrder) -> Vec<u32> {
    let (numbers, _) = bytes.as_chunks::<4>();
    numbers.iter().map(|number| order.u32(*number)).collect()
}

/// The least coordinates, and the steps in one unit: the table has the least, the largest, and the scale.
fn scale_of(bytes: &[u8], order: ByteOrder) -> Result<([f64; DIMENSIONS], f64), Damage> {
    let (values, _) = bytes.as_chunks::<8>();
    let values: Vec<f64> = values.iter().map(|value| order.f64(*value)).collect();
    match values[..] {
        [x, y, z, _, _, _, scale] if scale > 0.0 && values.iter().all(|v| v.is_finite()) => {
            Ok(([x, y, z], scale))
        }
        _ => Err(Damage::Invalid("its range of coordinates".to_owned())),
    }
}

/// The row after the last of each leaf, where every leaf has as many rows.
fn linear_ends(rows: u64, leaves: u64) -> Vec<u64> {
    let end = |leaf: u64| (u128::from(rows) * u128::from(leaf) / u128::from(leaves)) as u64;
    (1..=leaves).map(end).collect()
}
