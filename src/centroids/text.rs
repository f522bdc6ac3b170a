//! The text of a list of centroids as CSV with commas, whatever the program that wrote it has between
//! its columns.
//!
//! Semicolons and tabs are separators where the heading has them, blanks where it has neither.
//! SExtractor's lists have their heading in comments: `#   2 X_IMAGE   Object position along x`; those
//! of numpy and of Astropy's `commented_header` in one comment: `# x y flux`.
//! Lines keep their numbers.

use std::borrow::Cow;

/// A list as the CSV reader takes it.
pub(super) struct ListText<'a> {
    /// Its lines.
    pub text: Cow<'a, [u8]>,
    /// What is between columns.
    pub separator: u8,
}

impl<'a> ListText<'a> {
    /// The list in `bytes`, which have no byte order mark.
    pub fn decode(bytes: &'a [u8]) -> Self {
        match without_mark_of_heading(bytes) {
            Some(text) => {
                let ListText { text, separator } = ListText::decode(&text);
                let text = text.into_owned().into();
                Self { text, separator }
            }
            None => Self::decode_plain(bytes),
        }
    }

    /// The list in `bytes`, whose heading is no comment, or a numbered one.
    fn decode_plain(bytes: &'a [u8]) -> Self {
        let mut lines = bytes.split(|byte| *byte == b'\n').map(<[u8]>::trim_ascii);
        let heading = lines.find(|line| !line.is_empty() && !line.starts_with(b"#"));
        let heading = heading.unwrap_or_default();
        let count = |separator: u8| heading.iter().filter(|byte| **byte == separator).count();
        let separators = [b',', b';', b'\t'].map(|separator| (count(separator), separator));
        // Of equally many the first.
        let most = separators.into_iter().rev().max_by_key(|(count, _)| *count);
        match (most, std::str::from_utf8(bytes)) {
            (Some((1.., separator)), _) => Self {
                text: bytes.into(),
                separator,
            },
            (_, Ok(text)) if heading.contains(&b' ') => Self {
                text: with_commas(text).into_bytes().into(),
                separator: b',',
            },
            _ => Self {
                text: bytes.into(),
                separator: b',',
            },
        }
    }
}

/// The list in `bytes` with the last comment before its numbers as heading, where it has as many names
/// as there are numbers.
fn without_mark_of_heading(bytes: &[u8]) -> Option<Vec<u8>> {
    let text = std::str::from_utf8(bytes).ok()?;
    let fields = |line| {
        let is_between = |c: char| c.is_whitespace() || c == ',' || c == ';';
        str::split(line, is_between).filter(|field| !field.is_empty())
    };
    let mut comment = None;
    let mut lines = text.split_inclusive('\n').scan(0, |start, line| {
        let at = *start;
        *start += line.len();
        Some((at, line.trim()))
    });
    let first = loop {
        match lines.next()? {
            (at, line) if line.starts_with('#') => comment = Some((at, line)),
            (_, "") => {}
            (_, line) => break line,
        }
    };
    let (at, comment) = comment?;
    let names = comment.trim_start_matches('#');
    let is_number = |field: &str| field.parse::<f64>().is_ok();
    let is_heading = fields(first).all(is_number)
        && !fields(names).any(is_number)
        && fields(names).count() == fields(first).count();
    let mark = at + text[at..].find('#')?;
    let marks = comment.len() - names.len();
    is_heading.then(|| [&bytes[..mark], &bytes[mark + marks..]].concat())
}

/// Lines with blanks between columns as lines with commas.
fn with_commas(text: &str) -> String {
    let numbered: Vec<(usize, &str)> = text.lines().map_while(numbered_column).collect();
    let mut heading = vec![
        "";
        numbered
            .iter()
            .map(|(number, _)| *number)
            .max()
            .unwrap_or(0)
    ];
    for (number, name) in &numbered {
        heading[number - 1] = name;
    }
    let line = |(at, line): (usize, &str)| {
        if numbered.len() == at + 1 {
            heading.join(",")
        } else if line.starts_with('#') {
            line.to_owned()
        } else {
            line.split_whitespace().collect::<Vec<_>>().join(",")
        }
    };
    let lines: Vec<String> = text.lines().enumerate().map(line).collect();
    lines.join("\n")
}

/// Number and name of a column in a comment of SExtractor.
fn numbered_column(line: &str) -> Option<(usize, &str)> {
    /// More columns than any program writes.
    const MAX_COLUMNS: usize = 10_000;
    let mut words = line.strip_prefix('#')?.split_whitespace();
    let number = words.next()?.parse().ok()?;
    let name = words.next()?;
    (1..=MAX_COLUMNS)
        .contains(&number)
        .then_some((number, name))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decoded(text: &str) -> (String, char) {
        let list = ListText::decode(text.as_bytes());
        let text = String::from_utf8(list.text.into_owned()).unwrap();
        (text, list.separator.into())
    }

    #[test]
    fn the_separator_is_that_of_the_heading() {
        for (text, separator) in [
            ("x,y,flux\n1,2,3\n", ','),
            ("# a remark; with, marks\nx;y;flux\n1,5;2,5;3\n", ';'),
            ("x\ty\tflux\n1\t2\t3\n", '\t'),
            ("x\n", ','),
            ("", ','),
        ] {
            assert_eq!(decoded(text), (text.to_owned(), separator), "{text}");
        }
        let (text, separator) = decoded("# %ECSV 1.0\nid  x y\n 1 2.5 3\n");
        assert_eq!(
            (text.as_str(), separator),
            ("# %ECSV 1.0\nid,x,y\n1,2.5,3", ',')
        );
    }

    #[test]
    fn a_heading_may_be_a_comment() {
        for (list, expected) in [
            (
                "# made by a program\n# x y flux\n1.5 2.5 3\n",
                "# made by a program\nx,y,flux\n1.5,2.5,3",
            ),
            ("#x,y,flux\n1.5,2.5,3\n", "x,y,flux\n1.5,2.5,3\n"),
        ] {
            assert_eq!(decoded(list), (expected.to_owned(), ','));
        }
        let remark = "# three words here\nx,y,flux\n1,2,3\n";
        assert_eq!(decoded(remark).0, remark);
    }

    #[test]
    fn headings_of_sextractor_stand_in_comments() {
        let list = "#   1 NUMBER     Running object number\n#   2 FLUX_APER  Fluxes [count]\n\
                    #   4 X_IMAGE    Object position [pixel]\n  1  5.0 6.0  7.5\n";
        let expected = "#   1 NUMBER     Running object number\n#   2 FLUX_APER  Fluxes [count]\n\
                        NUMBER,FLUX_APER,,X_IMAGE\n1,5.0,6.0,7.5";
        assert_eq!(decoded(list).0, expected);
    }
}
