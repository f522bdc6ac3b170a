//! The numbers of stars in other catalogues.
//!
//! # Reference
//! HD, SAO and HR numbers are SKY2000's own. Hipparcos numbers are those of van Leeuwen 2007
//! (CDS I/311), matched by position. `catalogs/README.md` describes the file.

use super::id::{HipparcosId, StarId};
use std::sync::OnceLock;

/// Ordered by Skymap number; read where it lies.
const TABLE: &[u8] = include_bytes!("../../../catalogs/star-numbers.bin");
const HEADER_BYTES: usize = 16;
/// Bytes of the numbers of one star: Skymap, HD, SAO, Hipparcos.
const WIDTHS: [usize; 4] = [4, 3, 3, 3];
const HR_BYTES: usize = 2;

/// The numbers of a star in catalogues that people look it up in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct StarNumbers {
    /// In the Hipparcos Catalogue.
    pub hip: Option<u32>,
    /// In the Henry Draper Catalogue and its extension. The components of a double star may share it.
    pub hd: Option<u32>,
    /// In the Bright Star Catalogue (Harvard Revised).
    pub hr: Option<u32>,
    /// In the catalogue of the Smithsonian Astrophysical Observatory.
    pub sao: Option<u32>,
}

impl StarNumbers {
    /// The numbers of the star with a Skymap or Hipparcos number; none of any other star.
    pub(super) fn of(id: StarId) -> Self {
        let row = match id {
            StarId::Skymap(skymap) => row_of_skymap(skymap),
            StarId::Hipparcos(hipparcos) => row_of_hipparcos(hipparcos),
            _ => None,
        };
        row.map_or(Self::default(), |row| Self {
            hd: number(1, row),
            sao: number(2, row),
            hip: number(3, row),
            hr: hr(row),
        })
    }
}

/// A count of the header.
fn count(at: usize) -> usize {
    little_endian(&TABLE[at..at + 4]) as usize
}

fn little_endian(bytes: &[u8]) -> u32 {
    let high_first = bytes.iter().rev();
    high_first.fold(0, |value, byte| value << 8 | u32::from(*byte))
}

/// The number of a star in a column; 0 is none.
fn number(column: usize, row: usize) -> Option<u32> {
    let before: usize = WIDTHS[..column].iter().sum();
    let at = HEADER_BYTES + before * count(8) + WIDTHS[column] * row;
    let value = little_endian(&TABLE[at..at + WIDTHS[column]]);
    (value != 0).then_some(value)
}

/// The first index below `len` at which `value` is at least `wanted`, if it is `wanted` there.
fn search(len: usize, wanted: u32, value: impl Fn(usize) -> u32) -> Option<usize> {
    let (mut low, mut high) = (0, len);
    while low < high {
        let middle = usize::midpoint(low, high);
        if value(middle) < wanted {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    (low < len && value(low) == wanted).then_some(low)
}

fn row_of_skymap(skymap: u32) -> Option<usize> {
    search(count(8), skymap, |row| number(0, row).unwrap_or(0))
}

/// The few stars with an HR number are listed by their row.
fn hr(row: usize) -> Option<u32> {
    let (rows_at, listed) = (
        HEADER_BYTES + WIDTHS.iter().sum::<usize>() * count(8),
        count(12),
    );
    let value = |at: usize, width: usize, index: usize| {
        let start = at + width * index;
        little_endian(&TABLE[start..start + width])
    };
    let row = u32::try_from(row).ok()?;
    let found = search(listed, row, |index| value(rows_at, 4, index))?;
    Some(value(rows_at + 4 * listed, HR_BYTES, found))
}

/// The entry of a component of a double star is that of the whole.
fn row_of_hipparcos(id: HipparcosId) -> Option<usize> {
    static ROWS: OnceLock<Vec<(u32, u32)>> = OnceLock::new();
    let rows = ROWS.get_or_init(|| {
        let hip_and_row = |row: usize| Some((number(3, row)?, u32::try_from(row).ok()?));
        let mut rows: Vec<_> = (0..count(8)).filter_map(hip_and_row).collect();
        rows.sort_unstable();
        rows
    });
    let found = rows
        .binary_search_by_key(&id.number(), |(hip, _)| *hip)
        .ok()?;
    Some(rows[found].1 as usize)
}

#[cfg(test)]
mod tests {
    use super::super::{Catalog, StarIndex};
    use super::*;

    #[test]
    fn bright_stars_have_the_numbers_that_everyone_knows() {
        let numbers = |skymap| StarNumbers::of(StarId::Skymap(skymap));
        let known = |hip, hd, hr, sao| StarNumbers {
            hip: Some(hip),
            hd: Some(hd),
            hr: Some(hr),
            sao: Some(sao),
        };
        // Sirius, Polaris, Vega.
        let sirius = known(32_349, 48_915, 2491, 151_881);
        assert_eq!(numbers(6_450_045), sirius);
        assert_eq!(numbers(2_480_053), known(11_767, 8890, 424, 308));
        assert_eq!(numbers(18_360_206), known(91_262, 172_167, 7001, 67_174));
        let by_hip = |component| HipparcosId::new(32_349, component).unwrap();
        for component in [None, Some(b'A')] {
            let id = StarId::Hipparcos(by_hip(component));
            assert_eq!(StarNumbers::of(id), sirius);
        }
    }

    #[test]
    fn stars_of_other_catalogs_have_none() {
        for id in [
            StarId::Number(32_349),
            StarId::Skymap(0),
            StarId::Skymap(u32::MAX),
        ] {
            assert_eq!(StarNumbers::of(id), StarNumbers::default());
        }
    }

    #[test]
    fn the_table_has_every_star_of_the_built_in_catalog_in_order() {
        let stars = Catalog::built_in().stars().iter();
        let mut skymap: Vec<u32> = stars.map(|star| star.id.to_raw().1 as u32).collect();
        skymap.sort_unstable();
        let listed: Vec<u32> = (0..count(8)).filter_map(|row| number(0, row)).collect();
        assert_eq!(skymap, listed);
        let bytes = WIDTHS.iter().sum::<usize>() * count(8) + (4 + HR_BYTES) * count(12);
        assert_eq!(TABLE.len(), HEADER_BYTES + bytes);
    }

    #[test]
    fn stars_with_proper_names_have_the_hipparcos_numbers_of_their_names() {
        let catalog = Catalog::built_in();
        let named = (0..catalog.stars().len()).map(StarIndex::new);
        for star in named.filter(|star| catalog.proper_name(*star).is_some()) {
            let Some(hip) = catalog.numbers_of(star).hip else {
                continue;
            };
            let id = StarId::Hipparcos(HipparcosId::new(hip, None).unwrap());
            let by_hip = super::super::proper_names::of(id);
            assert_eq!(by_hip, catalog.proper_name(star));
        }
    }
}
