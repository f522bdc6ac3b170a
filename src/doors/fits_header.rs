//! The primary header of a FITS file, with other coordinates.
//!
//! A header stays as it is, but for the coordinates that it had: those of a solution stand at its end.
//!
//! # Reference
//! FITS Standard 4.0 (2018), sect. 4 (cards) and 8 (world coordinates); Shupe et al. 2005, ASP Conf. 347, 491 (SIP).

use crate::frame::FitsHeader;

/// Characters of a card.
const CARD: usize = 80;
/// Bytes of a block.
const BLOCK: usize = 2880;
const END: &[u8] = b"END     ";

type Card = [u8; CARD];

/// The primary header of a FITS file.
#[derive(Debug, Clone, Default)]
pub struct FitsFileHeader {
    /// Those before END.
    cards: Vec<Card>,
    /// Where the data begin.
    bytes: usize,
}

impl FitsFileHeader {
    /// The header of a file; `None` of one that is not FITS, or whose header has no end.
    pub fn of_file(file: &[u8]) -> Option<Self> {
        let (cards, _) = file.as_chunks::<CARD>();
        let end = cards.iter().position(|card| card.starts_with(END))?;
        file.starts_with(b"SIMPLE  =").then(|| Self {
            cards: cards[..end].to_vec(),
            bytes: ((end + 1) * CARD).next_multiple_of(BLOCK),
        })
    }

    /// Whether an image is below it.
    pub fn has_image(&self) -> bool {
        self.integer("NAXIS").is_some_and(|axes| axes > 0)
    }

    /// Whether the image below it has this size.
    pub fn is_of_image(&self, size_px: [usize; 2]) -> bool {
        let sides = ["NAXIS1", "NAXIS2"].map(|name| self.integer(name));
        sides == size_px.map(Some)
    }

    /// `file`, whose header this is, with the cards of a solution.
    pub fn updated(&self, file: &[u8], solved: &FitsHeader) -> Vec<u8> {
        self.file_with(file, cards_of(solved))
    }

    /// `file`, whose header this is, with the coordinates and the history of another header.
    pub fn with_coordinates_of(&self, file: &[u8], other: &Self) -> Vec<u8> {
        let is_wanted = |card: &&Card| is_coordinate(keyword(card)) || keyword(card) == "HISTORY";
        self.file_with(file, other.cards.iter().filter(is_wanted).copied())
    }

    fn file_with(&self, file: &[u8], cards: impl Iterator<Item = Card>) -> Vec<u8> {
        let mut updated = self.with(cards).in_blocks();
        updated.extend_from_slice(file.get(self.bytes..).unwrap_or_default());
        updated
    }

    /// The header without an image: cards in blocks as FITS has them.
    pub fn wcs_blocks(&self, solved: &FitsHeader) -> Vec<u8> {
        self.without_image().with(cards_of(solved)).in_blocks()
    }

    /// The same with a line for each card.
    pub fn wcs_lines(&self, solved: &FitsHeader) -> Vec<u8> {
        let header = self.without_image().with(cards_of(solved));
        let cards = header.cards.iter().map(|card| &card[..]);
        let lines = cards.chain([b"END".as_slice()]);
        lines
            .flat_map(|line| line.iter().copied().chain([b'\n']))
            .collect()
    }

    /// The same with these cards in place of its coordinates. The sum of the old header is not that of the new one.
    fn with(&self, cards: impl Iterator<Item = Card>) -> Self {
        let is_kept = |card: &&Card| {
            let keyword = keyword(card);
            !is_coordinate(keyword) && keyword != "CHECKSUM"
        };
        let kept = self.cards.iter().filter(is_kept).copied();
        Self {
            cards: kept.chain(cards).collect(),
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
    const WHOLE: [&str; 9] = [
        "WARNING", "WCSAXES", "WCSNAME", "LONPOLE", "LATPOLE", "RADESYS", "RADECSYS", "EQUINOX",
        "PLTSOLVD",
    ];
    const BY_AXIS: [&str; 8] = [
        "CTYPE", "CUNIT", "CRPIX", "CRVAL", "CDELT", "CROTA", "CRDER", "CSYER",
    ];
    const BY_TWO_NUMBERS: [&str; 8] = ["CD", "PC", "PV", "PS", "A_", "B_", "AP_", "BP_"];
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
        let header = FitsFileHeader::of_file(&file).unwrap();
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
        let header = FitsFileHeader::of_file(&file).unwrap();
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
    fn coordinates_and_history_come_from_another_header() {
        let own = file(&[
            "SIMPLE  =                    T",
            "NAXIS   =                    2 / axes",
            "CRVAL1  = 1.0",
            "CHECKSUM= 'a'",
            "A_TEXT  = 1",
        ]);
        let solved = file(&[
            "SIMPLE  =                    T",
            "NAXIS   =                    0",
            "IMAGEW  = 3",
            "CRVAL1  = 2.0",
            "HISTORY a",
        ]);
        let [header, other] = [&own, &solved].map(|file| FitsFileHeader::of_file(file).unwrap());
        assert!(header.has_image() && !other.has_image());
        let expected = file(&[
            "SIMPLE  =                    T",
            "NAXIS   =                    2 / axes",
            "A_TEXT  = 1",
            "CRVAL1  = 2.0",
            "HISTORY a",
        ]);
        assert_eq!(header.with_coordinates_of(&own, &other), expected);
    }

    #[test]
    fn what_is_no_fits_has_no_header() {
        assert!(FitsFileHeader::of_file(b"").is_none());
        assert!(FitsFileHeader::of_file(&b"SIMPLE  = T".repeat(500)).is_none());
        let mut other = file(&["XTENSION= 'IMAGE   '"]);
        assert!(FitsFileHeader::of_file(&other).is_none());
        other[..9].copy_from_slice(b"SIMPLE  =");
        // A file that ends in its header.
        let header = FitsFileHeader::of_file(&other[..200]).unwrap();
        assert_eq!(header.updated(&other[..200], &solved()).len(), BLOCK);
    }
}
