//! The header of one header-data unit: cards of 80 bytes, in blocks of 2880.

use super::error::{malformed, truncated};
use crate::base::format::excerpt;
use crate::frame::FrameError;
use std::borrow::Cow;
use std::collections::HashMap;

/// Headers and data are padded to a multiple of this.
pub(crate) const BLOCK_BYTES: usize = 2880;
const CARD_BYTES: usize = 80;
const KEYWORD_BYTES: usize = 8;
/// Maximum number of cards. A longer header is assumed to be damaged.
const MAX_CARDS: usize = 100_000;

/// The value of a keyword.
struct Card<'a> {
    /// Offset in the file.
    offset: usize,
    /// Everything after `= `, including the comment.
    value: &'a [u8],
}

/// The keywords of one header.
pub(super) struct UnitHeader<'a> {
    /// The first card of each keyword.
    cards: HashMap<&'a [u8], Card<'a>>,
    /// Offset in the file.
    offset: usize,
}

impl<'a> UnitHeader<'a> {
    /// Parses the header at `offset`. Also returns the offset of the data.
    pub fn parse(bytes: &'a [u8], offset: usize) -> Result<(Self, usize), FrameError> {
        let mut cards = HashMap::new();
        let header = bytes.get(offset..).unwrap_or_default();
        let all = header.chunks_exact(CARD_BYTES);
        for (number, card) in all.enumerate().take(MAX_CARDS) {
            let (keyword, rest) = card.split_at(KEYWORD_BYTES);
            let keyword = keyword.trim_ascii_end();
            if keyword == b"END" {
                let length = (number + 1) * CARD_BYTES;
                return Ok((
                    Self { cards, offset },
                    offset + length.next_multiple_of(BLOCK_BYTES),
                ));
            }
            if let Some(value) = rest.strip_prefix(b"= ") {
                cards.entry(keyword).or_insert(Card {
                    offset: offset + number * CARD_BYTES,
                    value,
                });
            }
        }
        if header.len() / CARD_BYTES >= MAX_CARDS {
            let detail = format!("no END among the first {MAX_CARDS} cards of a header");
            return Err(malformed(detail));
        }
        Err(truncated(
            bytes.len(),
            format!("the header at byte {offset} has no END"),
        ))
    }

    fn card(&self, keyword: &str) -> Option<&Card<'a>> {
        self.cards.get(keyword.as_bytes())
    }

    /// The value of `keyword` without quotation marks, surrounding blanks and comment; `None` if
    /// empty.
    pub fn text(&self, keyword: &str) -> Option<Cow<'a, str>> {
        let value = self.card(keyword)?.value.trim_ascii_start();
        let text = match value.strip_prefix(b"'") {
            Some(quoted) => quoted_text(quoted),
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

    /// Whether the value is `T`.
    pub fn is_true(&self, keyword: &str) -> bool {
        self.text(keyword).as_deref() == Some("T")
    }

    /// The value as an integer; an error if it is missing.
    pub fn required(&self, keyword: &str, expected: &str) -> Result<i64, FrameError> {
        match self.optional(keyword, expected) {
            Ok(None) => Err(malformed(format!(
                "the header at byte {} has no {keyword}, expected {expected}",
                self.offset
            ))),
            Ok(Some(value)) => Ok(value),
            Err(error) => Err(error),
        }
    }

    /// The value as an integer, `None` if it is missing.
    pub fn optional(&self, keyword: &str, expected: &str) -> Result<Option<i64>, FrameError> {
        let Some(text) = self.text(keyword) else {
            return Ok(None);
        };
        let value = text.parse();
        value.map(Some).map_err(|_| self.invalid(keyword, expected))
    }

    /// The value as a finite number, `None` if it is missing.
    pub fn finite(&self, keyword: &str) -> Result<Option<f64>, FrameError> {
        let Some(text) = self.text(keyword) else {
            return Ok(None);
        };
        let value = parse_number(&text).filter(|value| value.is_finite());
        value
            .map(Some)
            .ok_or_else(|| self.invalid(keyword, "a finite number"))
    }

    /// The value as a finite number, `default` if it is missing.
    pub fn number_or(&self, keyword: &str, default: f64) -> Result<f64, FrameError> {
        Ok(self.finite(keyword)?.unwrap_or(default))
    }

    /// The error for a value of `keyword` that is not as `expected`.
    pub fn invalid(&self, keyword: &str, expected: &str) -> FrameError {
        let at = self.card(keyword).map_or(self.offset, |card| card.offset);
        let text = self.text(keyword).unwrap_or_default();
        let found = excerpt(&text);
        malformed(format!(
            "keyword {keyword} at byte {at}: found {found}, expected {expected}"
        ))
    }
}

/// Parses a FITS number, with E or D before the exponent.
pub(super) fn parse_number(text: &str) -> Option<f64> {
    text.replace(['D', 'd'], "E").parse().ok()
}

/// The text up to the closing quotation mark; a doubled mark inside stands for one.
fn quoted_text(quoted: &[u8]) -> Cow<'_, str> {
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
        let (header, data) = UnitHeader::parse(&bytes, 0).unwrap();
        assert_eq!(data, BLOCK_BYTES);
        assert!(header.is_true("SIMPLE"));
        assert_eq!(
            header.text("OBJECT").unwrap(),
            "Barnard's star / no comment"
        );
        assert_eq!(header.finite("EXPTIME").unwrap(), Some(12.5));
        assert_eq!(header.text("EMPTY"), None);
        assert_eq!(header.text("NOVALUE"), None);
        assert_eq!(header.required("NAXIS", "axes").unwrap(), 2);
        assert_eq!(header.finite("QUOTED").unwrap(), Some(7.5));
        assert_eq!(header.text("OPEN").unwrap(), "never closed");
        assert_eq!(header.text("ABSENT"), None);
    }

    #[test]
    fn an_invalid_value_is_reported_with_its_offset() {
        let bytes = header(&["SIMPLE  = T", "NAXIS   = two", "BSCALE  = NaN"]);
        let (header, _) = UnitHeader::parse(&bytes, 0).unwrap();
        let error = header.required("NAXIS", "a number").unwrap_err();
        assert!(
            error
                .to_string()
                .contains("keyword NAXIS at byte 80: found two, expected a number"),
            "{error}"
        );
        assert!(header.number_or("BSCALE", 1.0).is_err());
        assert_eq!(header.number_or("BZERO", 0.0).unwrap(), 0.0);
        assert!(header.required("BITPIX", "it").is_err());
    }

    #[test]
    fn a_header_without_an_end_is_truncated() {
        let bytes = header(&["SIMPLE  = T"]);
        for length in [0, 79, 80, 159] {
            let Err(error) = UnitHeader::parse(&bytes[..length], 0) else {
                panic!("{length} bytes are no header");
            };
            assert!(matches!(error, FrameError::Truncated { .. }), "{error}");
        }
        assert!(UnitHeader::parse(&bytes, usize::MAX).is_err());
    }
}
