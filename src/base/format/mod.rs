//! Formats numbers, angles and counts as text, for people and files.

mod number;
mod rounding;
mod sexagesimal;

pub use number::five_digits;
pub(crate) use rounding::{
    decimals_for, finite, half_turn_deg, significant, to_decimals, to_significant, turn_deg,
};
pub(crate) use sexagesimal::{degrees, hours, small};

/// `text` with control characters escaped, as `\n` and `\u{1b}`: file names and headers may contain
/// terminal escape sequences.
pub fn printable(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    for character in text.chars() {
        if character.is_control() {
            shown.extend(character.escape_default());
        } else {
            shown.push(character);
        }
    }
    shown
}

/// A count with its noun: `1 detection`, `2 detections`.
pub fn counted(count: usize, noun: &str) -> String {
    let plural = if count == 1 { "" } else { "s" };
    format!("{count} {noun}{plural}")
}
