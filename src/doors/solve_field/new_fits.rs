//! A FITS image with other coordinates: its own cards and data, and the coordinates of a header.

use crate::frame::BLOCK_BYTES;

const CARD: usize = 80;
/// Keywords of coordinates, without the number of the axis.
const COORDINATES: [&str; 19] = [
    "WCSAXES", "WCSNAME", "CTYPE", "CUNIT", "CRVAL", "CRPIX", "CDELT", "CROTA", "CRDER", "CSYER",
    "CD", "PC", "PV", "PS", "LONPOLE", "LATPOLE", "RADESYS", "RADECSYS", "EQUINOX",
];
/// Names of SIP polynomials.
const POLYNOMIALS: [&str; 4] = ["A_", "B_", "AP_", "BP_"];

/// The FITS file `image`, whose primary header has an image, with the coordinates of `header` in place of its own;
/// `None` where it has none there, or is no FITS file.
pub fn with_coordinates(image: &[u8], header: &[u8]) -> Option<Vec<u8>> {
    let (cards, data) = split(image)?;
    let axes = cards.iter().find(|card| keyword(card) == "NAXIS")?;
    let axes = str::from_utf8(&axes[10..]).ok()?.split('/').next()?.trim();
    if !image.starts_with(b"SIMPLE  =") || axes == "0" {
        return None;
    }
    let (solved, _) = split(header)?;
    // The sum of the old header is not that of the new one.
    let is_kept = |card: &&[u8]| !is_coordinate(card) && keyword(card) != "CHECKSUM";
    let own = cards.into_iter().filter(is_kept);
    let is_new = |card: &&[u8]| is_coordinate(card) || keyword(card) == "HISTORY";
    let mut bytes: Vec<u8> = own
        .chain(solved.into_iter().filter(is_new))
        .flatten()
        .copied()
        .collect();
    bytes.extend(b"END");
    bytes.resize(bytes.len().next_multiple_of(BLOCK_BYTES), b' ');
    bytes.extend(data);
    Some(bytes)
}

/// The cards of the first header before `END`, and what follows that header.
fn split(file: &[u8]) -> Option<(Vec<&[u8]>, &[u8])> {
    let cards: Vec<&[u8]> = file
        .chunks_exact(CARD)
        .take_while(|card| keyword(card) != "END")
        .collect();
    let end = ((cards.len() + 1) * CARD).next_multiple_of(BLOCK_BYTES);
    Some((cards, file.get(end..)?))
}

fn keyword(card: &[u8]) -> &str {
    str::from_utf8(&card[..8]).unwrap_or_default().trim_end()
}

fn is_coordinate(card: &[u8]) -> bool {
    let keyword = keyword(card);
    let is_of_axis = |name: &str| {
        let axis = keyword.strip_prefix(name);
        axis.is_some_and(|axis| {
            axis.bytes()
                .all(|byte| byte.is_ascii_digit() || byte == b'_')
        })
    };
    let is_term = |name: &str| {
        let term = keyword.strip_prefix(name);
        term.is_some_and(|term| {
            term == "ORDER" || term == "DMAX" || term.as_bytes().get(1) == Some(&b'_')
        })
    };
    COORDINATES.into_iter().any(is_of_axis) || POLYNOMIALS.into_iter().any(is_term)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(cards: &[&str]) -> Vec<u8> {
        let cards = cards.iter().chain(&["END"]);
        let text: String = cards.map(|card| format!("{card:<CARD$}")).collect();
        let length = text.len().next_multiple_of(BLOCK_BYTES);
        format!("{text:<length$}").into_bytes()
    }

    #[test]
    fn an_image_keeps_what_is_no_coordinate() {
        let own = [
            "SIMPLE  = T",
            "NAXIS   =    2 / axes",
            "CRVAL1  = 1.0",
            "PCOUNT  = 0",
            "CHECKSUM= 'a'",
            "A_0_2   = 1",
            "A_TEXT  = 1",
        ];
        let image = [header(&own), vec![7; BLOCK_BYTES]].concat();
        let solved = header(&[
            "SIMPLE  = T",
            "NAXIS   = 0",
            "IMAGEW  = 3",
            "CRVAL1  = 2.0",
            "CD1_1   = 3.0",
            "HISTORY a",
        ]);
        let new = with_coordinates(&image, &solved).unwrap();
        let expected = [
            "SIMPLE  = T",
            "NAXIS   =    2 / axes",
            "PCOUNT  = 0",
            "A_TEXT  = 1",
            "CRVAL1  = 2.0",
            "CD1_1   = 3.0",
            "HISTORY a",
        ];
        assert_eq!(new, [header(&expected), vec![7; BLOCK_BYTES]].concat());
    }

    #[test]
    fn a_file_without_an_image_in_its_first_header_is_left_alone() {
        let empty = header(&["SIMPLE  = T", "NAXIS   = 0"]);
        assert_eq!(with_coordinates(&empty, &empty), None);
        assert_eq!(with_coordinates(b"\x89PNG", &empty), None);
        assert_eq!(with_coordinates(b"", &empty), None);
    }
}
