//! Headers of FITS with a solution: that of a frame's file, and that of `.wcs`.
//!
//! A header is the file's own, without the coordinates that it had, and with those of the solution at its end. All
//! other cards and the data stay as they are.

use super::plate::Plate;
use crate::frame::{FitsHeader, RowOrder};
use crate::identify::SkyView;
use crate::report::wcs;
use crate::solve::Solution;

/// Characters of a card.
const CARD: usize = 80;
/// Bytes of a block.
const BLOCK: usize = 2880;
const END: &[u8] = b"END     ";

type Card = [u8; CARD];

/// The cards of a solution: linear, or with the distortion of the lens as `SIP` has it.
pub fn solved_cards(
    plate: &Plate,
    solution: &Solution,
    rows: RowOrder,
    with_distortion: bool,
    warning: Option<&str>,
) -> FitsHeader {
    let mut header = FitsHeader::default();
    let found = solution.outcome.identification();
    match found.filter(|_| with_distortion) {
        Some(found) => {
            let view = SkyView {
                camera: &found.camera,
                icrs_to_camera: &found.icrs_to_camera,
                places: found.places,
            };
            wcs::add_projection(&mut header, &view, rows);
        }
        None => add_plane(&mut header, plate),
    }
    let [[x, y], [turn_x, turn_y]] = [plate.cdelt_deg(), plate.crota_deg()];
    header.real("CDELT1", x, "X pixel size (deg)");
    header.real("CDELT2", y, "Y pixel size (deg)");
    header.real("CROTA1", turn_x, "Image twist of X axis (deg)");
    header.real("CROTA2", turn_y, "Image twist of Y axis (deg)");
    let program = concat!("solved by starpipe ", env!("CARGO_PKG_VERSION"));
    header.logical("PLTSOLVD", true, program);
    if let Some(warning) = warning {
        header.text("WARNING", warning, "");
    }
    header
}

fn add_plane(header: &mut FitsHeader, plate: &Plate) {
    header.text("CTYPE1", "RA---TAN", "");
    header.text("CTYPE2", "DEC--TAN", "");
    header.text("CUNIT1", "deg", "");
    header.text("CUNIT2", "deg", "");
    header.real("EQUINOX", 2000.0, "");
    for (axis, name) in [(0, "X"), (1, "Y")] {
        let (number, pixel) = (axis + 1, plate.crpix[axis]);
        header.real(
            &format!("CRPIX{number}"),
            pixel,
            &format!("{name} of reference pixel"),
        );
    }
    header.real("CRVAL1", plate.crval_deg[0], "RA of reference pixel (deg)");
    header.real("CRVAL2", plate.crval_deg[1], "DEC of reference pixel (deg)");
    for (row, column) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
        let keyword = format!("CD{}_{}", row + 1, column + 1);
        header.real(&keyword, plate.cd_deg[row][column], "degrees a pixel");
    }
}

/// The primary header of a FITS file.
#[derive(Debug, Clone, Default)]
pub struct Header {
    /// Those before END.
    cards: Vec<Card>,
    /// Where the data begin.
    bytes: usize,
}

impl Header {
    /// The header of a file; `None` of one that is not FITS, or whose header has no end.
    pub fn of_file(file: &[u8]) -> Option<Self> {
        let (cards, _) = file.as_chunks::<CARD>();
        let end = cards.iter().position(|card| card.starts_with(END))?;
        file.starts_with(b"SIMPLE  =").then(|| Self {
            cards: cards[..end].to_vec(),
            bytes: ((end + 1) * CARD).next_multiple_of(BLOCK),
        })
    }

    /// Whether the image below it has this size.
    pub fn is_of_image(&self, size_px: [usize; 2]) -> bool {
        let sides = ["NAXIS1", "NAXIS2"].map(|name| self.integer(name));
        sides == size_px.map(Some)
    }

    /// `file`, whose header this is, with the cards of a solution.
    pub fn updated(&self, file: &[u8], solved: &FitsHeader) -> Vec<u8> {
        let mut updated = self.solved(solved).in_blocks();
        updated.extend_from_slice(file.get(self.bytes..).unwrap_or_default());
        updated
    }

    /// The header without an image: cards in blocks as FITS has them.
    pub fn wcs_blocks(&self, solved: &FitsHeader) -> Vec<u8> {
        self.without_image().solved(solved).in_blocks()
    }

    /// The same with a line for each card.
    pub fn wcs_lines(&self, solved: &FitsHeader) -> Vec<u8> {
        let header = self.without_image().solved(solved);
        let cards = header.cards.iter().map(|card| &card[..]);
        let lines = cards.chain([b"END".as_slice()]);
        lines
            .flat_map(|line| line.iter().copied().chain([b'\n']))
            .collect()
    }

    fn solved(&self, solved: &FitsHeader) -> Self {
        let kept = self
            .cards
            .iter()
            .filter(|card| !is_coordinate(keyword(card)));
        Self {
            cards: kept.copied().chain(cards_of(solved)).collect(),
            bytes: self.bytes,
        }
    }

    fn without_image(&self) -> Self {
        let mut start = FitsHeader::default();
        start.logical("SIMPLE", true, "FITS header");
        start.integer("BITPIX", 8, "");
        start.integer("NAXIS", 0, "Minimal header");
        let is_of_image =
            |name: &str| ["SIMPLE", "BITPIX"].contains(&name) || name.starts_with("NAXIS");
        let rest = self.cards.iter().filter(|card| !is_of_image(keyword(card)));
        Self {
            cards: cards_of(&start).chain(rest.copied()).collect(),
            bytes: 0,
        }
    }

    fn integer(&self, name: &str) -> Option<usize> {
        let card = self.cards.iter().find(|card| keyword(card) == name)?;
        let value = str::from_utf8(card.get(10..)?).ok()?;
        value.split('/').next()?.trim().parse().ok()
    }

    fn in_blocks(&self) -> Vec<u8> {
        let mut bytes = [self.cards.as_flattened(), END].concat();
        bytes.resize(bytes.len().next_multiple_of(BLOCK), b' ');
        bytes
    }
}

fn cards_of(header: &FitsHeader) -> impl Iterator<Item = Card> {
    let bytes = header.to_bytes();
    let (cards, _) = bytes.as_chunks::<CARD>();
    let own = cards.iter().take_while(|card| !card.starts_with(END));
    own.copied().collect::<Vec<_>>().into_iter()
}

fn keyword(card: &Card) -> &str {
    str::from_utf8(&card[..8]).unwrap_or_default().trim_end()
}

/// Whether a keyword belongs to the coordinates of an image.
fn is_coordinate(name: &str) -> bool {
    const WHOLE: [&str; 10] = [
        "WARNING", "WCSAXES", "LONPOLE", "LATPOLE", "RADESYS", "RADECSYS", "EQUINOX", "PLTSOLVD",
        "CRDER1", "CRDER2",
    ];
    const BY_AXIS: [&str; 6] = ["CTYPE", "CUNIT", "CRPIX", "CRVAL", "CDELT", "CROTA"];
    const BY_TWO_NUMBERS: [&str; 7] = ["CD", "PC", "PV", "A_", "B_", "AP_", "BP_"];
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    let has_two = |text: &str| {
        let two = text.split_once('_');
        two.is_some_and(|(first, second)| is_number(first) && is_number(second))
    };
    let after = |start: &&str| name.strip_prefix(*start);
    WHOLE.contains(&name)
        || BY_AXIS.iter().filter_map(after).any(is_number)
        || BY_TWO_NUMBERS
            .iter()
            .filter_map(after)
            .any(|rest| has_two(rest) || ["ORDER", "DMAX"].contains(&rest))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(cards: &[&str]) -> Vec<u8> {
        let cards = cards
            .iter()
            .chain(&["END"])
            .map(|card| format!("{card:<80}"));
        let mut file = cards.collect::<String>().into_bytes();
        file.resize(file.len().next_multiple_of(BLOCK), b' ');
        file.extend([7; BLOCK]);
        file
    }

    fn solved() -> FitsHeader {
        let mut solved = FitsHeader::default();
        solved.real("CRPIX1", 2.5, "");
        solved
    }

    #[test]
    fn other_cards_and_the_data_stay() {
        let file = file(&[
            "SIMPLE  =                    T",
            "BITPIX  =                    8",
            "NAXIS   =                    2",
            "NAXIS1  =                   40 / columns",
            "NAXIS2  =                   72",
            "CRPIX1  =                 99.0",
            "CD1_1   =                  1.0",
            "A_ORDER =                    2",
            "A_0_2   =                 1E-5",
            "CDS     =                  1.0",
            "OBJECT  = 'M 31'",
            "COMMENT A_0_2 of another",
        ]);
        let header = Header::of_file(&file).unwrap();
        assert!(header.is_of_image([40, 72]) && !header.is_of_image([72, 40]));
        let updated = header.updated(&file, &solved());
        assert_eq!(updated.len(), file.len());
        assert_eq!(updated[BLOCK..], file[BLOCK..]);
        let text = String::from_utf8(updated[..BLOCK].to_vec()).unwrap();
        let cards: Vec<_> = text
            .as_bytes()
            .chunks(CARD)
            .map(String::from_utf8_lossy)
            .collect();
        let expected = [0, 1, 2, 3, 4, 9, 10, 11];
        for (card, place) in cards.iter().zip(expected) {
            assert_eq!(card.as_bytes(), &file[place * CARD..][..CARD]);
        }
        assert_eq!(cards[8].trim_end(), "CRPIX1  =                  2.5");
        assert_eq!(cards[9].trim_end(), "END");
    }

    #[test]
    fn a_header_alone_has_no_image() {
        let file = file(&[
            "SIMPLE  =                    T",
            "NAXIS   =                    2",
            "NAXIS1  =  40",
        ]);
        let header = Header::of_file(&file).unwrap();
        let lines = String::from_utf8(header.wcs_lines(&solved())).unwrap();
        let lines: Vec<_> = lines.lines().map(str::trim_end).collect();
        assert_eq!(lines.len(), 5);
        assert!(lines[2].starts_with("NAXIS   =                    0 "));
        assert_eq!(lines[4], "END");
        let blocks = header.wcs_blocks(&solved());
        assert_eq!(blocks.len(), BLOCK);
        assert!(blocks[4 * CARD..].starts_with(END));
    }

    #[test]
    fn what_is_no_fits_has_no_header() {
        assert!(Header::of_file(b"").is_none());
        assert!(Header::of_file(&b"SIMPLE  = T".repeat(500)).is_none());
        let mut other = file(&["XTENSION= 'IMAGE   '"]);
        assert!(Header::of_file(&other).is_none());
        other[..9].copy_from_slice(b"SIMPLE  =");
        // A file that ends in its header.
        let header = Header::of_file(&other[..200]).unwrap();
        assert_eq!(header.updated(&other[..200], &solved()).len(), BLOCK);
    }
}
