//! Summary of an import.

use crate::catalog::RecordError;
use std::fmt;

/// What became of the records of a source file.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct ImportSummary {
    /// Records in the file.
    pub records: u64,
    /// Records that became stars.
    pub stars: u64,
    /// Lines, from 1, of the records without a magnitude.
    pub without_magnitude: Vec<u64>,
    /// Lines, from 1, of the records without a position.
    pub without_position: Vec<u64>,
    /// The unreadable records: at most 1 % of all.
    pub unreadable: Vec<RecordError>,
}

impl ImportSummary {
    /// Why records gave no star, with the first lines of each reason; `None` if all gave one.
    pub fn left_out(&self) -> Option<String> {
        let unreadable: Vec<u64> = self.unreadable.iter().map(|error| error.line).collect();
        let reasons = [
            ("without a magnitude", &self.without_magnitude),
            ("without a position", &self.without_position),
            ("unreadable", &unreadable),
        ];
        let shown: Vec<String> = reasons
            .into_iter()
            .filter(|(_, lines)| !lines.is_empty())
            .map(|(what, lines)| counted_lines(what, lines))
            .collect();
        (!shown.is_empty()).then(|| shown.join(", "))
    }
}

/// The number of lines, and the first of them.
fn counted_lines(what: &str, lines: &[u64]) -> String {
    const LINES_SHOWN: usize = 5;
    let shown: Vec<String> = lines.iter().take(LINES_SHOWN).map(u64::to_string).collect();
    let more = if lines.len() > LINES_SHOWN {
        ", …"
    } else {
        ""
    };
    let count = lines.len();
    let noun = if count == 1 { "line" } else { "lines" };
    format!("{count} {what} ({noun} {}{more})", shown.join(", "))
}

impl fmt::Display for ImportSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} records, {} stars", self.records, self.stars)?;
        match self.left_out() {
            Some(reasons) => write!(f, ", {reasons}"),
            None => Ok(()),
        }
    }
}
