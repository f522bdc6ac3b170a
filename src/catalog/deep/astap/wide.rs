//! The database of bright stars for wide fields: one file of the whole sky.

use crate::base::coords::UnitVector;
use crate::base::file_ranges::FileRanges;
use crate::catalog::deep::error::Damage;
use crate::catalog::star::rounded_mag;
use crate::catalog::{PlaceId, Star, StarId};

/// Bytes of the number of stars, and of a star.
const COUNT_BYTES: u64 = 4;
const STAR_BYTES: u64 = 12;
/// More stars are not of this kind: they are those to V 8.
const MAX_STARS: u64 = 1_000_000;

/// The database in a file ending in `.001`.
#[derive(Debug)]
pub struct WideDatabase {
    /// Its stars.
    pub stars: Vec<Star>,
}

impl WideDatabase {
    /// Reads a file; `None` where its length is not that of such a file.
    pub fn read(file: &FileRanges) -> Result<Option<Self>, Damage> {
        let Some(count) = file
            .head(COUNT_BYTES)?
            .try_into()
            .ok()
            .map(i32::from_le_bytes)
        else {
            return Ok(None);
        };
        let count = u64::try_from(count).unwrap_or(0);
        if count == 0 || count > MAX_STARS || file.length() != COUNT_BYTES + STAR_BYTES * count {
            return Ok(None);
        }
        let bytes = file.read(COUNT_BYTES..file.length())?;
        let (records, _) = bytes.as_chunks::<{ STAR_BYTES as usize }>();
        let stars: Option<Vec<Star>> = records.iter().map(star).collect();
        Ok(stars.map(|stars| Self { stars }))
    }
}

/// The star in a record; `None` where its numbers are none of a star.
fn star(record: &[u8; STAR_BYTES as usize]) -> Option<Star> {
    let (numbers, _) = record.as_chunks::<4>();
    let number = |index: usize| f64::from(f32::from_le_bytes(numbers[index]));
    let [tenths, ra_rad, dec_rad] = [number(0), number(1), number(2)];
    let is_star = (-50.0..300.0).contains(&tenths) && ra_rad.abs() < 7.0 && dec_rad.abs() < 1.571;
    is_star.then(|| {
        let direction = UnitVector::from_ra_dec(ra_rad, dec_rad);
        let id = StarId::Place(PlaceId::of(&direction));
        Star::new(id, direction, rounded_mag(tenths / 10.0))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::units::DEG_PER_RAD;

    #[test]
    fn a_file_of_bright_stars_is_read() {
        // Sirius and Canopus.
        let bytes = [
            2, 0, 0, 0, 0x00, 0x00, 0x70, 0xc1, 0xd2, 0x44, 0xe2, 0x3f, 0xda, 0x73, 0x95, 0xbe,
            0x00, 0x00, 0xc0, 0xc0, 0x8e, 0x70, 0xd6, 0x3f, 0x1c, 0x72, 0x6b, 0xbf,
        ];
        let file = tempfile::NamedTempFile::new().unwrap();
        let read = |bytes: &[u8]| {
            std::fs::write(&file, bytes).unwrap();
            let ranges = FileRanges::open(file.path()).unwrap();
            WideDatabase::read(&ranges).unwrap()
        };
        let stars = read(&bytes).unwrap().stars;
        assert_eq!(stars.len(), 2);
        assert_eq!(stars[0].v_mag, -1.5);
        let (ra_rad, dec_rad) = stars[0].direction.to_ra_dec();
        assert!((ra_rad * DEG_PER_RAD - 101.283_2).abs() < 1e-4);
        assert!((dec_rad * DEG_PER_RAD + 16.724_6).abs() < 1e-4);
        assert!(read(&bytes[..27]).is_none());
        assert!(read(b"\x02\0").is_none());
    }
}
