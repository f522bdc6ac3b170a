//! Splits rows into cells.

use std::borrow::Cow;

/// The separators of columns, the preferred ones first.
pub(super) const SEPARATORS: [u8; 4] = *b"\t;|,";

/// Whether cells may be quoted with this separator. With others, a quote is an inch sign.
pub(super) fn may_quote(separator: u8) -> bool {
    b",; ".contains(&separator)
}

/// The units in a line below the headings; `None` if it is not a line of units.
pub(super) fn units_in(text: &[u8], separator: u8, width: usize) -> Option<Vec<String>> {
    const UNITS: &str = "deg degrees h hours rad min s arcmin arcsec h:m:s d:m:s mag mas/yr mas/a \
         s/a s/yr arcsec/a arcsec/yr yr";
    let cells: Vec<String> = split(text, separator)
        .iter()
        .map(|cell| unquoted(cell).to_lowercase())
        .collect();
    let is_unit = |cell: &String| UNITS.split(' ').any(|unit| unit == cell);
    let is_number =
        |cell: &String| cell.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c));
    let units = cells.len() == width && cells.iter().any(is_unit) && !cells.iter().any(is_number);
    units.then_some(cells)
}

/// The cells of a row, without quotes where cells may be quoted.
pub(super) fn split(text: &[u8], separator: u8) -> Vec<Cow<'_, str>> {
    if may_quote(separator) && text.contains(&b'"') {
        let mut reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .delimiter(separator)
            .from_reader(text);
        let row = reader.byte_records().next().and_then(Result::ok);
        let cells = row.iter().flatten();
        return cells
            .map(|cell| Cow::Owned(String::from_utf8_lossy(cell).into_owned()))
            .collect();
    }
    text.split(|&byte| byte == separator)
        .map(String::from_utf8_lossy)
        .collect()
}

/// Text without surrounding quotes.
pub(super) fn unquoted(text: &str) -> &str {
    let text = text.trim();
    let inner = text
        .strip_prefix('"')
        .and_then(|text| text.strip_suffix('"'));
    inner.unwrap_or(text).trim()
}
