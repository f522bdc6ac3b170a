//! Header cards for writing: 80 characters each, values in fixed format.

use super::header::BLOCK_BYTES;

/// Width of a card, in characters.
const CARD: usize = 80;
/// Width of a number in fixed format.
const NUMBER_WIDTH: usize = 20;
/// Width of a keyword.
const KEYWORD: usize = 8;
/// Number of characters of text between the quotation marks on one card.
const TEXT_WIDTH: usize = CARD - "KEYWORD = '".len() - 1;

/// A FITS header for [`write_fits`](super::write_fits) or a file of its own. Each call adds cards.
///
/// FITS allows printable ASCII only: other characters become question marks. A long text continues
/// on further cards (`CONTINUE`); a comment that does not fit is cut off.
///
/// # Reference
/// FITS Standard 4.0 (2018), sect. 4.1 and 4.2.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FitsHeader {
    /// Each keyword as given, and its card.
    cards: Vec<(String, String)>,
}

impl FitsHeader {
    /// Adds a card with a truth value.
    pub fn logical(&mut self, keyword: &str, value: bool, comment: &str) {
        self.value(keyword, if value { "T" } else { "F" }, comment);
    }

    /// Adds a card with an integer.
    pub fn integer(&mut self, keyword: &str, value: i64, comment: &str) {
        self.value(keyword, &value.to_string(), comment);
    }

    /// Adds a card with a real number, to at least 13 significant digits. NaN and infinities, which
    /// FITS cannot represent, give a keyword without a value.
    pub fn real(&mut self, keyword: &str, value: f64, comment: &str) {
        let text = if value.is_finite() {
            real(value)
        } else {
            String::new()
        };
        self.value(keyword, &text, comment);
    }

    /// Adds one or more cards with a text.
    pub fn text(&mut self, keyword: &str, value: &str, comment: &str) {
        let quoted: Vec<char> = printable(&value.replace('\'', "''")).chars().collect();
        let pieces = pieces(&quoted);
        let last = pieces.len() - 1;
        for (number, piece) in pieces.iter().enumerate() {
            let start = if number == 0 {
                format!("{keyword:<KEYWORD$}= ")
            } else {
                format!("{:<KEYWORD$}  ", "CONTINUE")
            };
            let card = if number < last {
                format!("{start}'{piece}&'")
            } else {
                let quoted = format!("'{piece:<8}'");
                with_comment(format!("{start}{quoted:<NUMBER_WIDTH$}"), comment)
            };
            self.card(keyword, &card);
        }
    }

    /// Adds one or more HISTORY cards.
    pub fn history(&mut self, text: &str) {
        let characters: Vec<char> = text.chars().collect();
        for piece in characters.chunks(CARD - "HISTORY ".len()) {
            self.card(
                "HISTORY",
                &format!("HISTORY {}", piece.iter().collect::<String>()),
            );
        }
    }

    /// Appends the cards of `other`.
    pub(crate) fn extend(&mut self, other: &Self) {
        self.cards.extend_from_slice(&other.cards);
    }

    /// The keywords as given, one per card.
    pub(super) fn keywords(&self) -> impl Iterator<Item = &str> {
        self.cards.iter().map(|(keyword, _)| keyword.as_str())
    }

    /// The header with END, padded to blocks of 2880 bytes.
    pub fn to_bytes(&self) -> Vec<u8> {
        let cards = self.cards.iter().flat_map(|(_, card)| card.bytes());
        let mut bytes: Vec<u8> = cards.chain(*b"END").collect();
        bytes.resize(bytes.len().next_multiple_of(BLOCK_BYTES), b' ');
        bytes
    }

    fn value(&mut self, keyword: &str, value: &str, comment: &str) {
        let card = format!("{keyword:<KEYWORD$}= {value:>NUMBER_WIDTH$}");
        self.card(keyword, &with_comment(card, comment));
    }

    fn card(&mut self, keyword: &str, text: &str) {
        let card: String = printable(text).chars().take(CARD).collect();
        self.cards
            .push((keyword.to_owned(), format!("{card:<CARD$}")));
    }
}

fn printable(text: &str) -> String {
    let printable = |c| if matches!(c, ' '..='~') { c } else { '?' };
    text.chars().map(printable).collect()
}

/// Splits a quoted text into pieces that fit on a card, with room for the continuation sign `&` on
/// all but the last. Doubled quotation marks are kept together.
fn pieces(quoted: &[char]) -> Vec<String> {
    let mut pieces = Vec::new();
    let mut rest = quoted;
    while rest.len() > TEXT_WIDTH {
        let mut end = TEXT_WIDTH - 1;
        let marks = rest[..end].iter().rev().take_while(|c| **c == '\'').count();
        end -= marks % 2;
        pieces.push(rest[..end].iter().collect());
        rest = &rest[end..];
    }
    pieces.push(rest.iter().collect());
    pieces
}

fn with_comment(card: String, comment: &str) -> String {
    if comment.is_empty() {
        card
    } else {
        format!("{card} / {comment}")
    }
}

/// Formats a number in at most [`NUMBER_WIDTH`] characters: in full if it fits, otherwise with an
/// exponent and 13 decimals, or 12 if the exponent is long.
fn real(value: f64) -> String {
    let full = format!("{value:?}");
    if full.len() <= NUMBER_WIDTH && !full.contains('e') {
        return full;
    }
    let rounded = format!("{value:.13E}");
    if rounded.len() <= NUMBER_WIDTH {
        rounded
    } else {
        format!("{value:.12E}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn cards(header: &FitsHeader) -> Vec<String> {
        let bytes = header.to_bytes();
        assert_eq!(bytes.len() % BLOCK_BYTES, 0);
        bytes
            .chunks(CARD)
            .map(|card| String::from_utf8(card.to_vec()).unwrap())
            .collect()
    }

    #[test]
    fn cards_stand_in_fixed_format() {
        let mut header = FitsHeader::default();
        header.logical("SIMPLE", true, "");
        header.integer("NAXIS", 0, "no data");
        header.text("OBJECT", "Barnard's", "");
        header.history(&"é".repeat(100));
        let cards = cards(&header);
        assert_eq!(cards[0].trim_end(), format!("SIMPLE  = {:>20}", "T"));
        assert_eq!(
            cards[1].trim_end(),
            format!("NAXIS   = {:>20} / no data", 0)
        );
        assert_eq!(cards[2].trim_end(), "OBJECT  = 'Barnard''s'");
        assert_eq!(cards[3], format!("HISTORY {}", "?".repeat(72)));
        assert_eq!(cards[4].trim_end(), format!("HISTORY {}", "?".repeat(28)));
        assert_eq!(cards[5].trim_end(), "END");
        assert!(cards[6..].iter().all(|card| card.trim().is_empty()));
    }

    #[test]
    fn a_long_text_is_continued_without_splitting_doubled_marks() {
        let mut header = FitsHeader::default();
        let long = format!("{}''{}", "a".repeat(65), "b".repeat(80));
        header.text("ORIGIN", &long, "made up");
        let cards = cards(&header);
        assert_eq!(
            cards[0].trim_end(),
            format!("ORIGIN  = '{}''&'", "a".repeat(65))
        );
        assert_eq!(
            cards[1].trim_end(),
            format!("CONTINUE  '''{}&'", "b".repeat(65))
        );
        assert_eq!(
            cards[2].trim_end(),
            format!("CONTINUE  '{}'    / made up", "b".repeat(15))
        );
    }

    #[test]
    fn nan_has_no_value() {
        let mut header = FitsHeader::default();
        header.real("GAIN", f64::NAN, "unknown");
        header.real("SMALL", -1.234_567_890_123_456e-300, "");
        let cards = cards(&header);
        assert_eq!(
            cards[0].trim_end(),
            format!("GAIN    = {:>20} / unknown", "")
        );
        assert_eq!(cards[1].trim_end(), "SMALL   = -1.234567890123E-300");
    }

    proptest! {
        #[test]
        fn numbers_keep_thirteen_digits(mantissa in -1.0..1.0_f64, exponent in -40..40_i32) {
            let value = mantissa * 10_f64.powi(exponent);
            let text = real(value);
            prop_assert!(text.len() <= NUMBER_WIDTH, "{}", text);
            prop_assert!(text.contains('.'));
            let back: f64 = text.parse().unwrap();
            prop_assert!((back - value).abs() <= 1e-13 * value.abs());
        }
    }
}
