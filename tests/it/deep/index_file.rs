//! Writes index files as those of astrometry.net, without quads.

use super::patch::DrawnStar;
use crate::common::fits_header;
use std::io::{Cursor, Seek, SeekFrom, Write};

/// Stars of a leaf of the tree, at most.
const LEAF: usize = 25;

/// What distinguishes the series.
#[derive(Clone, Copy)]
pub enum Series {
    /// 4100: BT and VT of Tycho.
    Tycho,
    /// 5200: G, BP and RP of Gaia.
    Gaia,
    /// 5200 LITE: ranks alone.
    Lite,
}

/// An index file with these stars; numbers are stored as on a machine of this byte order.
pub fn index_file(stars: &[DrawnStar], series: Series, big_endian: bool) -> Vec<u8> {
    let mut file = Cursor::new(Vec::new());
    write(&mut file, Tree::new(stars), series, big_endian);
    file.into_inner()
}

/// Writes an index file whose tree has `before` rows with y < 0, which are holes, and then these stars, of y > 0.
pub fn write_sparse(file: impl Write + Seek, stars: &[DrawnStar], before: u32, series: Series) {
    let (mut tree, order) = Tree::new(stars);
    tree.add_holes(before);
    write(file, (tree, order), series, false);
}

fn write(
    mut file: impl Write + Seek,
    (tree, order): (Tree, Vec<usize>),
    series: Series,
    big_endian: bool,
) {
    let primary = [
        "SIMPLE  =                    T",
        "BITPIX  =                    8",
        "NAXIS   =                    0",
        endian(big_endian),
        "AN_FILE = 'QUAD    '",
        "SCALE_U =     0.00087266462599",
        "HEALPIX =                   -1",
        "HPNSIDE =                    0",
    ];
    file.write_all(&fits_header(&cards(&primary))).unwrap();
    for table in tree.tables(&order, series, big_endian) {
        table.write(&mut file);
    }
}

struct Tree<'a> {
    stars: &'a [DrawnStar],
    splits: Vec<u32>,
    ends: Vec<u32>,
    /// Rows before the stars.
    before: u32,
}

/// A coordinate as it is stored.
fn steps(coordinate: f64) -> u32 {
    ((coordinate + 1.0) * SCALE).round() as u32
}

const SCALE: f64 = u32::MAX as f64 / 2.0;

impl<'a> Tree<'a> {
    /// The tree of some stars, and their order in it.
    fn new(stars: &'a [DrawnStar]) -> (Self, Vec<usize>) {
        let levels = (stars.len() as f64 / LEAF as f64).log2().ceil().max(1.0) as u32;
        let mut tree = Self {
            stars,
            splits: vec![0; (1 << levels) - 1],
            ends: vec![0; 1 << levels],
            before: 0,
        };
        let mut order: Vec<usize> = (0..stars.len()).collect();
        tree.divide(0, &mut order, 0);
        (tree, order)
    }

    fn divide(&mut self, node: usize, stars: &mut [usize], before: usize) {
        if node >= self.splits.len() {
            let leaf = node - self.splits.len();
            // The last row of the leaf; that of an empty one is the one before.
            self.ends[leaf] = (before + stars.len()).saturating_sub(1) as u32;
            return;
        }
        let at = |star: usize, axis: usize| self.stars[star].direction.as_vector()[axis];
        let spread = |axis: usize| {
            let all = stars.iter().map(|star| at(*star, axis));
            let (low, high) = all.fold((1.0f64, -1.0f64), |(l, h), v| (l.min(v), h.max(v)));
            high - low
        };
        let axis = (0..3)
            .max_by(|a, b| spread(*a).total_cmp(&spread(*b)))
            .unwrap();
        stars.sort_by(|a, b| at(*a, axis).total_cmp(&at(*b, axis)));
        let middle = stars.len() / 2;
        let place = stars.get(middle).map_or(0, |star| steps(at(*star, axis)));
        self.splits[node] = place & !3 | axis as u32;
        let (left, right) = stars.split_at_mut(middle);
        self.divide(2 * node + 1, left, before);
        self.divide(2 * node + 2, right, before + middle);
    }

    /// Adds another tree on the other side of y = 0, whose leaves have rows before the stars.
    fn add_holes(&mut self, before: u32) {
        const ALONG_Y: u32 = 1;
        let mut splits = vec![steps(0.0) & !3 | ALONG_Y];
        let (mut from, mut width) = (0, 1);
        while from < self.splits.len() {
            splits.extend(vec![0; width]);
            splits.extend(&self.splits[from..from + width]);
            from += width;
            width *= 2;
        }
        let leaves = self.ends.len() as u64;
        let end = |leaf: u64| (u64::from(before) * leaf / leaves) as u32 - 1;
        let ends = self.ends.iter().map(|end| before + end);
        self.ends = (1..=leaves).map(end).chain(ends).collect();
        self.splits = splits;
        self.before = before;
    }

    fn tables(&self, order: &[usize], series: Series, big_endian: bool) -> Vec<Table> {
        let u32_of = |number: u32| match big_endian {
            true => number.to_be_bytes(),
            false => number.to_le_bytes(),
        };
        let f64_of = |number: f64| match big_endian {
            true => number.to_be_bytes(),
            false => number.to_le_bytes(),
        };
        let stars: Vec<DrawnStar> = order.iter().map(|star| self.stars[*star]).collect();
        let endian = endian(big_endian);
        let trees = [
            "AN_FILE = 'SKDT    '",
            endian,
            "KDT_NDIM=                    3",
            "KDT_DATA= 'u32     '",
        ];
        let ends: Vec<u8> = self.ends.iter().flat_map(|end| u32_of(*end)).collect();
        let splits: Vec<u8> = self
            .splits
            .iter()
            .flat_map(|split| u32_of(*split))
            .collect();
        let range = [-1.0, -1.0, -1.0, 1.0, 1.0, 1.0, SCALE];
        let range: Vec<u8> = range.into_iter().flat_map(f64_of).collect();
        let vectors = stars
            .iter()
            .flat_map(|star| <[f64; 3]>::from(*star.direction.as_vector()));
        let vectors: Vec<u8> = vectors.flat_map(|value| u32_of(steps(value))).collect();
        vec![
            table("kdtree_header_stars", 0, vec![], &trees),
            table("kdtree_lr_stars", 4, ends, &[]),
            table("kdtree_split_stars", 4, splits, &[]),
            table("kdtree_range_stars", 8, range, &[]),
            table("kdtree_data_stars", 12, vectors, &[]).after(self.before),
            self.beside(order, &stars, series).after(self.before),
        ]
    }

    /// The table of brightness.
    fn beside(&self, order: &[usize], stars: &[DrawnStar], series: Series) -> Table {
        let tag = |columns: &[(&str, f64)]| {
            let mut cards = vec![
                "AN_FILE = 'TAGALONG'".to_owned(),
                format!("TFIELDS = {:20}", columns.len()),
            ];
            for (number, (name, _)) in columns.iter().enumerate() {
                cards.push(format!("TFORM{}  = '1E      '", number + 1));
                cards.push(format!("TTYPE{}  = '{name}'", number + 1));
            }
            let rows = stars.iter().flat_map(|star| {
                let magnitudes = columns.iter().map(|(_, less)| (star.v_mag - less) as f32);
                magnitudes.flat_map(f32::to_be_bytes)
            });
            Table {
                row_bytes: 4 * columns.len(),
                before: 0,
                data: rows.collect(),
                cards,
            }
        };
        match series {
            // B−V of 0.45.
            Series::Tycho => tag(&[("MAG_BT", -0.045 - 0.5 - 0.0027), ("MAG_VT", -0.045)]),
            // A star like the Sun: G − V is −0.152.
            Series::Gaia => tag(&[
                ("phot_g_mean_mag", 0.152),
                ("phot_bp_mean_mag", -0.18),
                ("phot_rp_mean_mag", 0.64),
            ]),
            Series::Lite => {
                // The stars are drawn brightest first.
                let rank = |star: &usize| (256 * star / self.stars.len()) as u8;
                let ranks = order.iter().map(rank).collect();
                table("sweep", 1, ranks, &["TFORM1  = '1B      '"])
            }
        }
    }
}

/// The card of the order of bytes.
fn endian(big_endian: bool) -> &'static str {
    match big_endian {
        true => "ENDIAN  = '01:02:03:04'",
        false => "ENDIAN  = '04:03:02:01'",
    }
}

fn cards(cards: &[&str]) -> Vec<String> {
    cards.iter().map(|card| (*card).to_owned()).collect()
}

/// A table of a file.
struct Table {
    /// Bytes of a row.
    row_bytes: usize,
    /// Rows before those of `data`, which are holes.
    before: u32,
    data: Vec<u8>,
    /// Its cards, besides those of its size.
    cards: Vec<String>,
}

impl Table {
    fn after(self, before: u32) -> Self {
        Self { before, ..self }
    }

    fn header(&self) -> Vec<u8> {
        let rows = self.data.len().checked_div(self.row_bytes).unwrap_or(0);
        let rows = rows + self.before as usize;
        let mut header = cards(&[
            "XTENSION= 'BINTABLE'",
            "BITPIX  =                    8",
            "NAXIS   =                    2",
        ]);
        header.push(format!("NAXIS1  = {:20}", self.row_bytes));
        header.push(format!("NAXIS2  = {rows:20}"));
        header.push("PCOUNT  =                    0".to_owned());
        header.push("GCOUNT  =                    1".to_owned());
        header.extend(self.cards.iter().cloned());
        fits_header(&header)
    }

    fn write(&self, mut file: impl Write + Seek) {
        file.write_all(&self.header()).unwrap();
        let before = u64::from(self.before) * self.row_bytes as u64;
        let start = file.stream_position().unwrap();
        file.seek(SeekFrom::Start(start + before)).unwrap();
        file.write_all(&self.data).unwrap();
        let end = file.stream_position().unwrap();
        let rest = end.next_multiple_of(2880) - end;
        file.write_all(&vec![0; rest as usize]).unwrap();
    }
}

/// A table with one column of bytes.
fn table(name: &str, row_bytes: usize, data: Vec<u8>, more: &[&str]) -> Table {
    let mut cards = cards(more);
    cards.push("TFIELDS =                    1".to_owned());
    if !cards.iter().any(|card| card.starts_with("TFORM1")) {
        cards.push(format!("TFORM1  = '{row_bytes}A'"));
    }
    cards.push(format!("TTYPE1  = '{name}'"));
    Table {
        row_bytes,
        before: 0,
        data,
        cards,
    }
}
