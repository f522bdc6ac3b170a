//! Formats numbers, angles and counts as text, for people and files.

mod number;
mod rounding;
mod sexagesimal;

use std::borrow::Cow;

pub use number::five_digits;
pub(crate) use rounding::{
    decimals_for, finite, half_turn_deg, significant, to_decimals, to_significant, turn_deg,
};
pub(crate) use sexagesimal::{degrees, hours, small};

/// `text` with control characters escaped, as `\n` and `\u{1b}`: file names and headers may contain
/// terminal escape sequences. Those that change the order in which characters are drawn, or break the
/// line, are escaped, too: with them a name looks like another.
pub fn printable(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    for character in text.chars() {
        if character.is_control() || is_deceptive(character) {
            shown.extend(character.escape_default());
        } else {
            shown.push(character);
        }
    }
    shown
}

/// The beginning of a text that a message quotes; how long it is where it goes on.
pub fn excerpt(text: &str) -> Cow<'_, str> {
    const MAX: usize = 80;
    match text.char_indices().nth(MAX) {
        None => text.into(),
        Some((end, _)) => format!("{}… ({} characters)", &text[..end], text.chars().count()).into(),
    }
}

/// Whether a character is not drawn itself, but changes how others are: marks, embeddings, overrides
/// and isolates of the bidirectional algorithm (Unicode Standard Annex 9), and separators of lines and
/// paragraphs. Those that are no characters, which XML does not allow, are among them.
pub const fn is_deceptive(character: char) -> bool {
    matches!(
        character,
        '\u{61c}'
            | '\u{200e}'
            | '\u{200f}'
            | '\u{2028}'..='\u{202e}'
            | '\u{2066}'..='\u{2069}'
            | '\u{feff}'
            | '\u{fffe}'
            | '\u{ffff}'
    )
}

/// JSON with the characters escaped that change how others are drawn ([`is_deceptive`]). They stand in
/// strings alone, which are the same to a program.
pub fn json_escaped(json: String) -> String {
    // Most have none of the bytes that all of them begin with.
    let begins = |byte: u8| matches!(byte, 0xd8 | 0xe2 | 0xef);
    let may_have = json.bytes().fold(false, |any, byte| any | begins(byte));
    if !may_have || !json.contains(is_deceptive) {
        return json;
    }
    let mut escaped = String::with_capacity(json.len());
    for character in json.chars() {
        if is_deceptive(character) {
            escaped += &format!("\\u{:04x}", u32::from(character));
        } else {
            escaped.push(character);
        }
    }
    escaped
}

/// Text between the tags of XML, with the characters escaped as [`printable`] does: XML allows few of them.
pub(crate) fn xml_escaped(text: &str) -> String {
    printable(text)
        .replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

/// A name or other text in a cell of a CSV table, on one line, and never a formula to a spreadsheet:
/// if it begins like one, an apostrophe stands before it.
pub fn table_name(text: &str) -> String {
    let shown = printable(text);
    let is_formula = text.starts_with(['=', '+', '-', '@', '\t', '\r']);
    // Minus signs of numbers are none of formulas.
    if is_formula && text.parse::<f64>().is_err() {
        return format!("'{shown}");
    }
    shown
}

/// A count with its noun: `1 detection`, `2 detections`.
pub fn counted(count: usize, noun: &str) -> String {
    let plural = if count == 1 { "" } else { "s" };
    format!("{count} {noun}{plural}")
}

/// A count with what is said of one and of several.
pub fn counted_as(count: usize, [one, several]: [&str; 2]) -> String {
    format!("{count} {}", if count == 1 { one } else { several })
}

/// Ascending numbers as `0-4 7`.
pub fn ranges(numbers: &[usize]) -> String {
    let runs = numbers.chunk_by(|one, next| one + 1 == *next);
    let texts = runs.map(|run| match run {
        [first, .., last] => format!("{first}-{last}"),
        _ => run.iter().map(usize::to_string).collect(),
    });
    texts.collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_terminal_would_obey_is_escaped() {
        for (text, shown) in [
            ("plain é 星.fits", "plain é 星.fits"),
            ("a\nb\tc\u{1b}[31m", "a\\nb\\tc\\u{1b}[31m"),
            ("a\u{202e}stif.b", "a\\u{202e}stif.b"),
            (
                "\u{2066}a\u{2028}b\u{feff}",
                "\\u{2066}a\\u{2028}b\\u{feff}",
            ),
        ] {
            assert_eq!(printable(text), shown);
        }
    }

    #[test]
    fn of_a_long_text_the_beginning_is_quoted() {
        assert_eq!(excerpt("short"), "short");
        let long = "ä".repeat(200_000);
        let expected = format!("{}… (200000 characters)", "ä".repeat(80));
        assert_eq!(excerpt(&long), expected);
    }

    #[test]
    fn text_of_xml_has_only_what_xml_allows() {
        for (text, shown) in [
            ("a<b>&\"'", "a&lt;b&gt;&amp;\"'"),
            ("\n\t\u{1b}[31m\u{85}", "\\n\\t\\u{1b}[31m\\u{85}"),
            ("\u{0}\u{202e}\u{ffff}é星", "\\u{0}\\u{202e}\\u{ffff}é星"),
        ] {
            assert_eq!(xml_escaped(text), shown);
        }
    }

    #[test]
    fn json_means_the_same_when_it_is_escaped() {
        let text = "a\u{202e}b\u{2066}é";
        let json = json_escaped(serde_json::to_string(text).unwrap());
        assert_eq!(json, "\"a\\u202eb\\u2066é\"");
        assert_eq!(serde_json::from_str::<String>(&json).unwrap(), text);
    }

    #[test]
    fn no_cell_is_a_formula_and_numbers_stay() {
        for (text, cell) in [
            ("=1+1.fits", "'=1+1.fits"),
            ("+a", "'+a"),
            ("-", "'-"),
            ("@a", "'@a"),
            ("\t=a", "'\\t=a"),
            ("-1.5", "-1.5"),
            ("+2e-3", "+2e-3"),
            ("a=b", "a=b"),
            ("./-a", "./-a"),
            ("", ""),
        ] {
            assert_eq!(table_name(text), cell);
        }
    }
}
