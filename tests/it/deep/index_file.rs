//! Writes index files as those of astrometry.net, without quads.

use super::patch::DrawnStar;
use crate::common::fits_header;

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
    let levels = (stars.len() as f64 / LEAF as f64).log2().ceil().max(1.0) as u32;
    let mut tree = Tree {
        stars,
        splits: vec![0; (1 << levels) - 1],
        ends: vec![0; 1 << levels],
    };
    let mut order: Vec<usize> = (0..stars.len()).collect();
    tree.divide(0, &mut order, 0);
    tree.file(&order, series, big_endian)
}

struct Tree<'a> {
    stars: &'a [DrawnStar],
    splits: Vec<u32>,
    ends: Vec<u32>,
}

/// A coordinate as it is stored.
fn steps(coordinate: f64) -> u32 {
    ((coordinate + 1.0) * SCALE).round() as u32
}

const SCALE: f64 = u32::MAX as f64 / 2.0;

impl Tree<'_> {
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

    fn file(&self, order: &[usize], series: Series, big_endian: bool) -> Vec<u8> {
        let u32_of = |number: u32| match big_endian {
            true => number.to_be_bytes(),
            false => number.to_le_bytes(),
        };
        let f64_of = |number: f64| match big_endian {
            true => number.to_be_bytes(),
            false => number.to_le_bytes(),
        };
        let stars: Vec<DrawnStar> = order.iter().map(|star| self.stars[*star]).collect();
        let endian = match big_endian {
            true => "ENDIAN  = '01:02:03:04'",
            false => "ENDIAN  = '04:03:02:01'",
        };
        let mut file = fits_header(&cards(&[
            "SIMPLE  =                    T",
            "BITPIX  =                    8",
            "NAXIS   =                    0",
            endian,
            "AN_FILE = 'QUAD    '",
            "SCALE_U =     0.00087266462599",
            "HEALPIX =                   -1",
            "HPNSIDE =                    0",
        ]));
        let trees = [
            "AN_FILE = 'SKDT    '",
            endian,
            "KDT_NDIM=                    3",
            "KDT_DATA= 'u32     '",
        ];
        file.extend(table("kdtree_header_stars", 0, &[], &trees));
        let ends: Vec<u8> = self.ends.iter().flat_map(|end| u32_of(*end)).collect();
        file.extend(table("kdtree_lr_stars", 4, &ends, &[]));
        let splits: Vec<u8> = self
            .splits
            .iter()
            .flat_map(|split| u32_of(*split))
            .collect();
        file.extend(table("kdtree_split_stars", 4, &splits, &[]));
        let range = [-1.0, -1.0, -1.0, 1.0, 1.0, 1.0, SCALE];
        let range: Vec<u8> = range.into_iter().flat_map(f64_of).collect();
        file.extend(table("kdtree_range_stars", 8, &range, &[]));
        let vectors = stars
            .iter()
            .flat_map(|star| <[f64; 3]>::from(*star.direction.as_vector()));
        let vectors: Vec<u8> = vectors.flat_map(|value| u32_of(steps(value))).collect();
        file.extend(table("kdtree_data_stars", 12, &vectors, &[]));
        file.extend(self.beside(order, &stars, series));
        file
    }

    /// The tables of brightness.
    fn beside(&self, order: &[usize], stars: &[DrawnStar], series: Series) -> Vec<u8> {
        let tag = |columns: &[(&str, f64)]| {
            let mut more = vec![
                "AN_FILE = 'TAGALONG'".to_owned(),
                format!("TFIELDS = {:20}", columns.len()),
            ];
            for (number, (name, _)) in columns.iter().enumerate() {
                more.push(format!("TFORM{}  = '1E      '", number + 1));
                more.push(format!("TTYPE{}  = '{name}'", number + 1));
            }
            let rows = stars.iter().flat_map(|star| {
                let magnitudes = columns.iter().map(|(_, less)| (star.v_mag - less) as f32);
                magnitudes.flat_map(f32::to_be_bytes)
            });
            let rows: Vec<u8> = rows.collect();
            raw_table(4 * columns.len(), &rows, &more)
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
                let ranks: Vec<u8> = order.iter().map(rank).collect();
                table("sweep", 1, &ranks, &["TFORM1  = '1B      '"])
            }
        }
    }
}

fn cards(cards: &[&str]) -> Vec<String> {
    cards.iter().map(|card| (*card).to_owned()).collect()
}

/// A table with one column of bytes.
fn table(name: &str, row_bytes: usize, data: &[u8], more: &[&str]) -> Vec<u8> {
    let mut more = cards(more);
    more.push("TFIELDS =                    1".to_owned());
    if !more.iter().any(|card| card.starts_with("TFORM1")) {
        more.push(format!("TFORM1  = '{row_bytes}A'"));
    }
    more.push(format!("TTYPE1  = '{name}'"));
    raw_table(row_bytes, data, &more)
}

fn raw_table(row_bytes: usize, data: &[u8], more: &[String]) -> Vec<u8> {
    let rows = data.len().checked_div(row_bytes).unwrap_or(0);
    let mut header = cards(&[
        "XTENSION= 'BINTABLE'",
        "BITPIX  =                    8",
        "NAXIS   =                    2",
    ]);
    header.push(format!("NAXIS1  = {row_bytes:20}"));
    header.push(format!("NAXIS2  = {rows:20}"));
    header.push("PCOUNT  =                    0".to_owned());
    header.push("GCOUNT  =                    1".to_owned());
    header.extend(more.iter().cloned());
    let mut bytes = fits_header(&header);
    bytes.extend(data);
    bytes.resize(bytes.len().next_multiple_of(2880), 0);
    bytes
}
