//! Cards of a FITS header: 80 characters each, values in fixed format.

/// Characters of a card, and bytes of a block.
const CARD: usize = 80;
const BLOCK: usize = 2880;
/// A number ends in this column.
const NUMBER_END: usize = 30;
/// Characters of a number in fixed format.
const NUMBER_WIDTH: usize = 20;

/// A header as it grows.
#[derive(Debug, Default)]
pub(super) struct Header {
    bytes: Vec<u8>,
}

impl Header {
    /// A card with a truth value.
    pub(super) fn logical(&mut self, keyword: &str, value: bool, comment: &str) {
        self.number(keyword, if value { "T" } else { "F" }, comment);
    }

    /// A card with a whole number.
    pub(super) fn integer(&mut self, keyword: &str, value: i64, comment: &str) {
        self.number(keyword, &value.to_string(), comment);
    }

    /// A card with a number; at least 13 significant digits are kept.
    pub(super) fn real(&mut self, keyword: &str, value: f64, comment: &str) {
        self.number(keyword, &real(value), comment);
    }

    /// A card with a text.
    pub(super) fn text(&mut self, keyword: &str, value: &str, comment: &str) {
        let quoted = format!("'{:<8}'", value.replace('\'', "''"));
        self.card(&with_comment(
            format!("{keyword:<8}= {quoted:<NUMBER_WIDTH$}"),
            comment,
        ));
    }

    /// Text on the file's history, on as many cards as it needs.
    pub(super) fn history(&mut self, text: &str) {
        let characters: Vec<char> = text.chars().collect();
        for piece in characters.chunks(CARD - "HISTORY ".len()) {
            self.card(&format!("HISTORY {}", piece.iter().collect::<String>()));
        }
    }

    /// The header with its end, in whole blocks.
    pub(super) fn finish(mut self) -> Vec<u8> {
        self.card("END");
        let length = self.bytes.len().next_multiple_of(BLOCK);
        self.bytes.resize(length, b' ');
        self.bytes
    }

    fn number(&mut self, keyword: &str, value: &str, comment: &str) {
        let card = format!("{keyword:<8}= {value:>NUMBER_WIDTH$}");
        debug_assert_eq!(card.len(), NUMBER_END);
        self.card(&with_comment(card, comment));
    }

    /// FITS knows printable ASCII only: anything else becomes a question mark.
    fn card(&mut self, text: &str) {
        let printable = |c: char| {
            if matches!(c, ' '..='~') {
                c as u8
            } else {
                b'?'
            }
        };
        let filled = text.chars().map(printable).chain(std::iter::repeat(b' '));
        self.bytes.extend(filled.take(CARD));
    }
}

fn with_comment(card: String, comment: &str) -> String {
    if comment.is_empty() {
        card
    } else {
        format!("{card} / {comment}")
    }
}

/// A number in at most [`NUMBER_WIDTH`] characters: in full where it fits, else with 13 decimals and an exponent.
fn real(value: f64) -> String {
    let full = format!("{value:?}");
    if full.len() <= NUMBER_WIDTH && !full.contains('e') {
        return full;
    }
    format!("{value:.13E}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn cards(header: Header) -> Vec<String> {
        let bytes = header.finish();
        assert_eq!(bytes.len() % BLOCK, 0);
        bytes
            .chunks(CARD)
            .map(|card| String::from_utf8(card.to_vec()).unwrap())
            .collect()
    }

    #[test]
    fn cards_stand_in_fixed_format() {
        let mut header = Header::default();
        header.logical("SIMPLE", true, "");
        header.integer("NAXIS", 0, "no data");
        header.text("OBJECT", "Barnard's", "");
        header.history(&"é".repeat(100));
        let cards = cards(header);
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
