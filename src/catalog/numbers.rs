//! The numbers of stars in other catalogues.
//!
//! # Reference
//! HD, SAO and HR numbers are SKY2000's own. Hipparcos numbers are those of van Leeuwen 2007
//! (CDS I/311), matched by position. `catalogs/README.md` describes the file.

use super::compact::{ByteReader, invalid};
use super::error::{CompactError, quoted};
use super::id::{HipparcosId, StarId};
use std::sync::OnceLock;

#[cfg(any(feature = "built-in-catalog", test))]
const BUILT_IN: &[u8] = include_bytes!("../../catalogs/star-numbers.bin");
const MAGIC: [u8; 8] = *b"\x89STARNUM";
const HEADER_BYTES: usize = 16;
/// Of a star, and of one with an HR number beyond that.
const STAR_BYTES: u64 = 13;
const HR_BYTES: u64 = 6;

static TABLE: OnceLock<NumberColumns> = OnceLock::new();

/// The columns of the file, which are read where they lie; a number of 0 is none.
struct NumberColumns {
    /// Ascending.
    skymap: &'static [[u8; 4]],
    hd: &'static [[u8; 3]],
    sao: &'static [[u8; 3]],
    hip: &'static [[u8; 3]],
    /// Rows of the few stars with an HR number, ascending.
    hr_row: &'static [[u8; 4]],
    hr: &'static [[u8; 2]],
}

impl NumberColumns {
    /// The table in use: the one that was given, else the built-in one.
    fn table() -> Option<&'static Self> {
        #[cfg(any(feature = "built-in-catalog", test))]
        return Some(TABLE.get_or_init(|| Self::open(BUILT_IN).expect("a test checks it")));
        #[cfg(not(any(feature = "built-in-catalog", test)))]
        TABLE.get()
    }

    fn open(bytes: &'static [u8]) -> Result<Self, CompactError> {
        if bytes.len() < HEADER_BYTES || !bytes.starts_with(&MAGIC) {
            let found = quoted(&bytes[..bytes.len().min(MAGIC.len())]);
            return invalid(0, found, format!("the signature {}", quoted(&MAGIC)));
        }
        let mut file = ByteReader {
            bytes,
            at: MAGIC.len(),
        };
        let [stars, listed] = [(); 2].map(|()| u32::from_le_bytes(file.take()) as usize);
        let length = HEADER_BYTES as u64 + STAR_BYTES * stars as u64 + HR_BYTES * listed as u64;
        if bytes.len() as u64 != length {
            let found = format!("the end of a file of {} bytes", bytes.len());
            return invalid(bytes.len(), found, format!("{length} bytes"));
        }
        Ok(Self {
            skymap: file.column(stars),
            hd: file.column(stars),
            sao: file.column(stars),
            hip: file.column(stars),
            hr_row: file.column(listed),
            hr: file.column(listed),
        })
    }

    fn row_of_skymap(&self, skymap: u32) -> Option<usize> {
        self.skymap
            .binary_search_by_key(&skymap, little_endian)
            .ok()
    }

    /// The entry of a component of a double star is that of the whole.
    fn row_of_hipparcos(&self, id: HipparcosId) -> Option<usize> {
        static ROWS: OnceLock<Vec<(u32, usize)>> = OnceLock::new();
        let rows = ROWS.get_or_init(|| {
            let hip_and_row = |(row, hip)| Some((number(hip)?, row));
            let mut rows: Vec<_> = self
                .hip
                .iter()
                .enumerate()
                .filter_map(hip_and_row)
                .collect();
            rows.sort_unstable();
            rows
        });
        let found = rows
            .binary_search_by_key(&id.number(), |(hip, _)| *hip)
            .ok()?;
        Some(rows[found].1)
    }

    fn hr(&self, row: usize) -> Option<u32> {
        let row = u32::try_from(row).ok()?;
        let found = self.hr_row.binary_search_by_key(&row, little_endian).ok()?;
        number(&self.hr[found])
    }
}

fn little_endian<const N: usize>(bytes: &[u8; N]) -> u32 {
    let high_first = bytes.iter().rev();
    high_first.fold(0, |value, byte| value << 8 | u32::from(*byte))
}

fn number<const N: usize>(bytes: &[u8; N]) -> Option<u32> {
    let value = little_endian(bytes);
    (value != 0).then_some(value)
}

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
    /// Gives the table of numbers, for programs without the feature `built-in-catalog`. It is kept to
    /// the end; only the first one that is given counts.
    ///
    /// # Errors
    /// [`CompactError`] if it is not such a table.
    pub fn give_table(bytes: Vec<u8>) -> Result<(), CompactError> {
        if TABLE.get().is_none() {
            let _ = TABLE.set(NumberColumns::open(bytes.leak())?);
        }
        Ok(())
    }

    /// The numbers of the star with a Skymap or Hipparcos number; none of any other star.
    pub(super) fn find(id: StarId) -> Self {
        let Some(numbers) = NumberColumns::table() else {
            return Self::default();
        };
        let row = match id {
            StarId::Skymap(skymap) => numbers.row_of_skymap(skymap),
            StarId::Hipparcos(hipparcos) => numbers.row_of_hipparcos(hipparcos),
            _ => None,
        };
        row.map_or(Self::default(), |row| Self {
            hip: number(&numbers.hip[row]),
            hd: number(&numbers.hd[row]),
            hr: numbers.hr(row),
            sao: number(&numbers.sao[row]),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Catalog, StarIndex};
    use super::*;

    #[test]
    fn bright_stars_have_the_numbers_that_everyone_knows() {
        let numbers = |skymap| StarNumbers::find(StarId::Skymap(skymap));
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
            assert_eq!(StarNumbers::find(id), sirius);
        }
    }

    #[test]
    fn stars_of_other_catalogs_have_none() {
        for id in [
            StarId::Number(32_349),
            StarId::Skymap(0),
            StarId::Skymap(u32::MAX),
        ] {
            assert_eq!(StarNumbers::find(id), StarNumbers::default());
        }
    }

    #[test]
    fn the_table_has_every_star_of_the_built_in_catalog_in_order() {
        let stars = Catalog::built_in().stars().iter();
        let mut skymap: Vec<u32> = stars.map(|star| star.id.to_raw().1 as u32).collect();
        skymap.sort_unstable();
        let numbers = NumberColumns::table().unwrap();
        let listed: Vec<u32> = numbers.skymap.iter().filter_map(number).collect();
        assert_eq!(skymap, listed);
    }

    #[test]
    fn what_is_no_table_is_refused() {
        let refused = |bytes| NumberColumns::open(bytes).err().unwrap().to_string();
        assert!(refused(b"no table").contains("the signature"));
        assert!(refused(b"").contains("the signature"));
        assert!(refused(&BUILT_IN[..BUILT_IN.len() - 1]).contains("the end of a file"));
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
            let by_hip = super::super::proper_names::find(id);
            assert_eq!(by_hip, catalog.proper_name(star));
        }
    }
}
