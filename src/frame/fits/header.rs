//! The header of one header-data unit: cards of 80 bytes, in blocks of 2880.

use super::{BLOCK_BYTES, malformed, truncated};
use crate::frame::FrameError;
use std::borrow::Cow;

const CARD_BYTES: usize = 80;
const KEYWORD_BYTES: usize = 8;
/// A header of more cards than this is taken for something else.
const MAX_CARDS: usize = 100_000;

/// A keyword and what it is set to.
struct Card<'a> {
    /// Where in the file.
    at: usize,
    keyword: &'a [u8],
    /// From behind `= ` to the card's end, any comment included.
    value: &'a [u8],
}

/// The keywords of one header.
pub(super) struct Header<'a> {
    cards: Vec<Card<'a>>,
    /// Where in the file it begins.
    at: usize,
}

impl<'a> Header<'a> {
    /// Reads the header at byte `at`; also tells where the data begin.
    pub fn parse(bytes: &'a [u8], at: usize) -> Result<(Self, usize), FrameError> {
        let mut cards = Vec::new();
        let all = bytes.get(at..).unwrap_or_default().chunks_exact(CARD_BYTES);
        for (number, card) in all.enumerate().take(MAX_CARDS) {
            let at_card = at + number * CARD_BYTES;
            let (keyword, rest) = card.split_at(KEYWORD_BYTES);
            let keyword = keyword.trim_ascii_end();
            if keyword == b"END" {
                let length = (number + 1) * CARD_BYTES;
                return Ok((
                    Self { cards, at },
                    at + length.next_multiple_of(BLOCK_BYTES),
                ));
            }
            if let Some(value) = rest.strip_prefix(b"= ") {
                cards.push(Card {
                    at: at_card,
                    keyword,
                    value,
                });
            }
        }
        if cards.len() >= MAX_CARDS {
            let detail = format!("no END among the first {MAX_CARDS} keywords of a header");
            return Err(malformed(detail));
        }
        Err(truncated(
            bytes.len(),
            format!("the header at byte {at} has no END"),
        ))
    }

    fn card(&self, keyword: &str) -> Option<&Card<'a>> {
        self.cards
            .iter()
            .find(|card| card.keyword == keyword.as_bytes())
    }

    /// The value without quotation marks, blanks around it and comment; nothing where there is no value.
    pub fn text(&self, keyword: &str) -> Option<Cow<'a, str>> {
        let value = self.card(keyword)?.value.trim_ascii_start();
        let text = match value.strip_prefix(b"'") {
            Some(quoted) => string(quoted),
            None => {
                let end = value.iter().position(|b| *b == b'/');
                String::from_utf8_lossy(&value[..end.unwrap_or(value.len())])
            }
        };
        let text = match text {
            Cow::Borrowed(text) => Cow::Borrowed(text.trim()),
            Cow::Owned(text) => Cow::Owned(text.trim().to_owned()),
        };
        (!text.is_empty()).then_some(text)
    }

    /// A number, also one that somebody put between quotation marks.
    pub fn number(&self, keyword: &str) -> Option<f64> {
        number(&self.text(keyword)?)
    }

    pub fn is_true(&self, keyword: &str) -> bool {
        self.text(keyword).as_deref() == Some("T")
    }

    /// An integer that has to be there.
    pub fn required(&self, keyword: &str, expected: &str) -> Result<i64, FrameError> {
        match self.optional(keyword, expected) {
            Ok(None) => Err(malformed(format!(
                "the header at byte {} has no {keyword}, expected {expected}",
                self.at
            ))),
            Ok(Some(value)) => Ok(value),
            Err(error) => Err(error),
        }
    }

    /// An integer, if it is there.
    pub fn optional(&self, keyword: &str, expected: &str) -> Result<Option<i64>, FrameError> {
        let Some(text) = self.text(keyword) else {
            return Ok(None);
        };
        let value = text.parse();
        value.map(Some).map_err(|_| self.bad(keyword, expected))
    }

    /// A finite number that is `otherwise` where it is not there.
    pub fn factor(&self, keyword: &str, otherwise: f64) -> Result<f64, FrameError> {
        let Some(text) = self.text(keyword) else {
            return Ok(otherwise);
        };
        number(&text)
            .filter(|value| value.is_finite())
            .ok_or_else(|| self.bad(keyword, "a finite number"))
    }

    /// That the value of `keyword` is not as `expected`.
    pub fn bad(&self, keyword: &str, expected: &str) -> FrameError {
        let at = self.card(keyword).map_or(self.at, |card| card.at);
        let found = self.text(keyword).unwrap_or_default();
        malformed(format!(
            "keyword {keyword} at byte {at}: found {found}, expected {expected}"
        ))
    }
}

/// A number as FITS writes it, with E or D before the exponent.
fn number(text: &str) -> Option<f64> {
    text.replace(['D', 'd'], "E").parse().ok()
}

/// What is between quotation marks, of which the first is gone; two of them inside stand for one.
fn string(quoted: &[u8]) -> Cow<'_, str> {
    let mut end = 0;
    let mut doubled = false;
    while end < quoted.len() {
        if quoted[end] == b'\'' {
            if quoted.get(end + 1) != Some(&b'\'') {
                break;
            }
            doubled = true;
            end += 1;
        }
        end += 1;
    }
    let text = String::from_utf8_lossy(&quoted[..end.min(quoted.len())]);
    if doubled {
        return text.replace("''", "'").into();
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(cards: &[&str]) -> Vec<u8> {
        let mut text: String = cards.iter().map(|card| format!("{card:<80}")).collect();
        text += &format!("{:<80}", "END");
        let mut bytes = text.into_bytes();
        bytes.resize(bytes.len().next_multiple_of(BLOCK_BYTES), b' ');
        bytes
    }

    #[test]
    fn values_are_read_without_quotes_blanks_and_comments() {
        let bytes = header(&[
            "SIMPLE  =                    T / standard",
            "OBJECT  = 'Barnard''s star / no comment'  / a comment",
            "EXPTIME =             1.25D+01 / [s]",
            "EMPTY   = '        '",
            "NOVALUE =                      / nothing",
            "NAXIS   = 2",
            "QUOTED  = ' 7.5 '",
            "OPEN    = 'never closed",
            "COMMENT = not a value at all",
            "NAXIS   = 3",
        ]);
        let (header, data) = Header::parse(&bytes, 0).unwrap();
        assert_eq!(data, BLOCK_BYTES);
        assert!(header.is_true("SIMPLE"));
        assert_eq!(
            header.text("OBJECT").unwrap(),
            "Barnard's star / no comment"
        );
        assert_eq!(header.number("EXPTIME"), Some(12.5));
        assert_eq!(header.text("EMPTY"), None);
        assert_eq!(header.text("NOVALUE"), None);
        assert_eq!(header.required("NAXIS", "axes").unwrap(), 2);
        assert_eq!(header.number("QUOTED"), Some(7.5));
        assert_eq!(header.text("OPEN").unwrap(), "never closed");
        assert_eq!(header.text("ABSENT"), None);
    }

    #[test]
    fn a_wrong_value_is_named_with_its_place() {
        let bytes = header(&["SIMPLE  = T", "NAXIS   = two", "BSCALE  = NaN"]);
        let (header, _) = Header::parse(&bytes, 0).unwrap();
        let complaint = header.required("NAXIS", "a number").unwrap_err();
        assert!(
            complaint
                .to_string()
                .contains("keyword NAXIS at byte 80: found two, expected a number"),
            "{complaint}"
        );
        assert!(header.factor("BSCALE", 1.0).is_err());
        assert_eq!(header.factor("BZERO", 0.0).unwrap(), 0.0);
        assert!(header.required("BITPIX", "it").is_err());
    }

    #[test]
    fn a_header_without_an_end_is_truncated() {
        let bytes = header(&["SIMPLE  = T"]);
        for length in [0, 79, 80, 159] {
            let Err(error) = Header::parse(&bytes[..length], 0) else {
                panic!("{length} bytes are no header");
            };
            assert!(matches!(error, FrameError::Truncated { .. }), "{error}");
        }
        assert!(Header::parse(&bytes, usize::MAX).is_err());
    }
}
