//! Headings of columns, and units.

use super::cells::unquoted;

/// The unit of a decimal number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum HeadingUnit {
    Degrees,
    Hours,
    Radians,
}

impl HeadingUnit {
    /// Parses the name of a unit; `None` for any other text.
    pub(super) fn parse(text: &str) -> Option<Self> {
        match text {
            "deg" | "degree" | "degrees" | "°" => Some(Self::Degrees),
            "h" | "hr" | "hour" | "hours" => Some(Self::Hours),
            "rad" | "radian" | "radians" => Some(Self::Radians),
            _ => None,
        }
    }

    pub(super) fn to_degrees(self, value: f64) -> f64 {
        match self {
            Self::Degrees => value,
            Self::Hours => value * 15.0,
            Self::Radians => value.to_degrees(),
        }
    }
}

/// A heading of a column.
pub(in crate::catalog) struct Heading {
    /// As in the file.
    pub(super) text: String,
    /// In lower case, without the unit.
    pub(super) label: String,
    /// In lower case; empty if not given.
    pub(super) unit: String,
}

impl Heading {
    /// The heading `text`, with its unit in the line below, or empty.
    pub(in crate::catalog) fn new(text: &str, unit_below: &str) -> Self {
        let text = unquoted(text);
        let (label, bracket) = match text.split_once(['(', '[']) {
            Some((label, bracket)) if !label.is_empty() => (label, bracket),
            _ => (text, ""),
        };
        let bracket = bracket.trim_end_matches([')', ']']);
        let unit = if unit_below.is_empty() {
            bracket
        } else {
            unit_below
        };
        Self {
            text: text.to_owned(),
            label: label.trim().to_lowercase().replace([' ', '.'], "_"),
            unit: unquoted(unit).to_lowercase(),
        }
    }
}

/// The column of the first of `labels`, separated by blanks, that is a heading.
pub(super) fn find_column(headings: &[Heading], labels: &str) -> Option<usize> {
    let position = |label: &str| headings.iter().position(|heading| heading.label == label);
    labels.split(' ').find_map(position)
}
