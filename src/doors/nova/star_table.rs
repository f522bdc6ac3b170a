//! Lists of stars as tables of FITS, which KStars and StellarSolver upload: the columns `X` and `Y`, and `MAG` or
//! `FLUX` where they are known.
//!
//! # Reference
//! FITS Standard 4.0 (2018), sect. 4 and 7.3; `xylist` of astrometry.net.

use crate::base::fits_types::element_bytes;
use std::collections::HashMap;
use std::ops::Range;

const BLOCK: usize = 2880;
const CARD: usize = 80;
/// More columns than any such table has.
const MAX_COLUMNS: usize = 999;

/// A column of numbers.
struct Column {
    name: String,
    /// The letter of `TFORM`.
    code: u8,
    /// Where its cell is in a row.
    bytes: Range<usize>,
}

/// The places in the first extension of a file without a picture, brightest first where the table says so, else
/// in its order. `None` where the file is not such a table.
pub(super) fn places(file: &[u8]) -> Option<Vec<[f64; 2]>> {
    let (primary, end) = header(file, 0)?;
    if number(&primary, "NAXIS")? != 0 {
        return None;
    }
    let (cards, start) = header(file, end)?;
    if !cards.get("XTENSION")?.starts_with("BINTABLE") {
        return None;
    }
    let row_bytes = number(&cards, "NAXIS1").filter(|bytes| *bytes > 0)?;
    let data = file.get(start..)?;
    let rows = data.chunks_exact(row_bytes).take(number(&cards, "NAXIS2")?);
    let columns = columns(&cards)?;
    let column = |name: &str| {
        let named = |column: &&Column| column.name.eq_ignore_ascii_case(name);
        columns.iter().find(named)
    };
    let (x, y) = (column("X")?, column("Y")?);
    let faintness = |row: &[u8]| match (column("MAG"), column("FLUX")) {
        (Some(mag), _) => mag.value(row),
        (None, Some(flux)) => flux.value(row).map(|flux| -flux),
        (None, None) => Some(0.0),
    };
    let star = |row: &[u8]| Some((faintness(row)?, [x.value(row)?, y.value(row)?]));
    let mut stars: Vec<(f64, [f64; 2])> = rows.map(star).collect::<Option<_>>()?;
    stars.sort_by(|a, b| a.0.total_cmp(&b.0));
    Some(stars.into_iter().map(|(_, place)| place).collect())
}

impl Column {
    fn value(&self, row: &[u8]) -> Option<f64> {
        let cell = row.get(self.bytes.clone())?;
        match self.code {
            b'E' => Some(f64::from(f32::from_be_bytes(*cell.first_chunk()?))),
            b'D' => Some(f64::from_be_bytes(*cell.first_chunk()?)),
            b'J' => Some(f64::from(i32::from_be_bytes(*cell.first_chunk()?))),
            _ => None,
        }
    }
}

fn columns(cards: &HashMap<String, String>) -> Option<Vec<Column>> {
    let mut start: usize = 0;
    let mut columns = Vec::new();
    for place in 1..=number(cards, "TFIELDS")?.min(MAX_COLUMNS) {
        let form = cards.get(&format!("TFORM{place}"))?;
        let digits = form.find(|letter: char| !letter.is_ascii_digit())?;
        let code = *form.as_bytes().get(digits)?;
        let count: usize = match &form[..digits] {
            "" => 1,
            digits => digits.parse().ok()?,
        };
        let end = start.checked_add(count.checked_mul(element_bytes(code)?)?)?;
        let name = cards.get(&format!("TTYPE{place}"));
        columns.push(Column {
            name: name.cloned().unwrap_or_default(),
            code,
            bytes: start..end,
        });
        start = end;
    }
    Some(columns)
}

/// The values of the header at `start` by keyword, and where its blocks end.
fn header(file: &[u8], start: usize) -> Option<(HashMap<String, String>, usize)> {
    let mut cards = HashMap::new();
    for (place, card) in file.get(start..)?.chunks_exact(CARD).enumerate() {
        let card = str::from_utf8(card).ok()?;
        let keyword = card.get(..8)?.trim_end();
        if keyword == "END" {
            let bytes = (place + 1) * CARD;
            return Some((cards, start + bytes.next_multiple_of(BLOCK)));
        }
        if let Some(value) = card.get(8..)?.strip_prefix("= ") {
            let value = match value.trim_start().strip_prefix('\'') {
                Some(text) => text.split('\'').next(),
                None => value.split('/').next(),
            };
            let value = value.unwrap_or_default().trim();
            cards.insert(keyword.to_owned(), value.to_owned());
        }
    }
    None
}

fn number(cards: &HashMap<String, String>, keyword: &str) -> Option<usize> {
    cards.get(keyword)?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit(cards: &[&str], data: &[u8]) -> Vec<u8> {
        let cards = cards.iter().chain(&["END"]);
        let mut unit: Vec<u8> = cards
            .flat_map(|card| format!("{card:<80}").into_bytes())
            .collect();
        unit.resize(unit.len().next_multiple_of(BLOCK), b' ');
        unit.extend(data);
        unit.resize(unit.len().next_multiple_of(BLOCK), 0);
        unit
    }

    fn table(rows: &[[f32; 3]]) -> Vec<u8> {
        let data: Vec<u8> = rows
            .iter()
            .flatten()
            .flat_map(|value| value.to_be_bytes())
            .collect();
        let mut file = unit(&["SIMPLE  = T", "BITPIX  = 8", "NAXIS   = 0 / none"], &[]);
        let count = format!("NAXIS2  = {}", rows.len());
        let cards = [
            "XTENSION= 'BINTABLE' / table",
            "NAXIS1  = 12",
            &count,
            "TFIELDS = 3",
            "TTYPE1  = 'X       '",
            "TFORM1  = '1E      '",
            "TTYPE2  = 'Y       '",
            "TFORM2  = 'E'",
            "TTYPE3  = 'MAG     '",
            "TFORM3  = 'E'",
        ];
        file.extend(unit(&cards, &data));
        file
    }

    #[test]
    fn the_brightest_comes_first() {
        let table = table(&[[1.0, 2.0, 9.0], [3.5, 4.0, -1.0]]);
        assert_eq!(places(&table), Some(vec![[3.5, 4.0], [1.0, 2.0]]));
    }

    #[test]
    fn what_is_no_such_table_is_none() {
        let table = table(&[[1.0, 2.0, 9.0]; 30]);
        for length in (0..table.len()).step_by(7) {
            let found = places(&table[..length]);
            assert!(found.is_none_or(|places| places.len() <= 30), "{length}");
        }
        assert_eq!(places(&unit(&["SIMPLE  = T", "NAXIS   = 2"], &[])), None);
    }
}
