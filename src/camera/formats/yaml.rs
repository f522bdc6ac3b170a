//! The part of YAML that camera calibrations are made of: numbers, words and matrices.

use super::error::FormatError;
use std::fmt::Write as _;

/// A number as YAML 1.0 and 1.1 know it: with a decimal point, and a sign in the exponent. No bit is lost.
pub(super) fn number(value: f64) -> String {
    let text = format!("{value:?}");
    let Some((mantissa, exponent)) = text.split_once('e') else {
        return text;
    };
    let point = if mantissa.contains('.') { "" } else { ".0" };
    let sign = if exponent.starts_with('-') { "" } else { "+" };
    format!("{mantissa}{point}e{sign}{exponent}")
}

/// Writes an entry that holds a matrix. `tag` names its type, `indent` is that of what it holds.
pub(super) fn write_matrix(
    text: &mut String,
    key: &str,
    [tag, kind, indent]: [&str; 3],
    [rows, columns]: [usize; 2],
    data: &[f64],
) {
    let data: Vec<String> = data.iter().map(|value| number(*value)).collect();
    let data = data.join(", ");
    // Writing to a text does not fail.
    let _ = writeln!(text, "{key}:{tag}");
    let _ = writeln!(text, "{indent}rows: {rows}\n{indent}cols: {columns}");
    if !kind.is_empty() {
        let _ = writeln!(text, "{indent}dt: {kind}");
    }
    let _ = writeln!(text, "{indent}data: [{data}]");
}

/// An entry of the file.
#[derive(Debug)]
struct YamlEntry {
    line: usize,
    key: String,
    value: String,
    /// What is indented below it.
    below: Vec<(String, String)>,
}

/// A file of numbers, words and matrices. Names are compared without regard to case.
#[derive(Debug)]
pub(super) struct Document {
    entries: Vec<YamlEntry>,
}

/// A matrix and where it was found.
#[derive(Debug)]
pub(super) struct Matrix {
    pub rows: usize,
    pub columns: usize,
    pub data: Vec<f64>,
}

impl Document {
    /// Reads the entries of a mapping, and those of the mappings one level below.
    pub(super) fn read(text: &str) -> Result<Self, FormatError> {
        let mut entries: Vec<YamlEntry> = Vec::new();
        let mut lines = text.lines().enumerate();
        while let Some((index, raw)) = lines.next() {
            let mut content = without_comment(raw).to_owned();
            let is_mark = content.starts_with('%') || content.starts_with("---");
            if content.trim().is_empty() || is_mark || content.starts_with("...") {
                continue;
            }
            // A list that goes on in the next lines.
            while content.contains('[') && !content.contains(']') {
                let Some((_, next)) = lines.next() else {
                    return Err(syntax(index, raw, "a ']' after the '['"));
                };
                content.push(' ');
                content.push_str(without_comment(next).trim());
            }
            let Some((key, value)) = content.split_once(':') else {
                return Err(syntax(index, raw, "'name: value'"));
            };
            let value = value.trim().trim_matches(['"', '\'']).to_owned();
            let name = key.trim().trim_matches(['"', '\'']).to_lowercase();
            if !key.starts_with([' ', '\t', '-']) {
                if entries.iter().any(|entry| entry.key == name) {
                    return Err(syntax(index, raw, "a name that no line before it has"));
                }
                entries.push(YamlEntry {
                    line: index,
                    key: name,
                    value,
                    below: Vec::new(),
                });
            } else if let Some(entry) = entries.last_mut() {
                entry.below.push((name, value));
            } else {
                return Err(syntax(index, raw, "an entry that is not indented"));
            }
        }
        Ok(Self { entries })
    }

    fn find(&self, keys: &[&'static str]) -> Option<&YamlEntry> {
        let mut entries = self.entries.iter();
        entries.find(|entry| keys.contains(&entry.key.as_str()))
    }

    /// The text of the first of `keys` that there is.
    pub(super) fn word(&self, keys: &[&'static str]) -> Option<&str> {
        self.find(keys).map(|entry| entry.value.as_str())
    }

    /// The number of the first of `keys` that there is.
    pub(super) fn number(&self, keys: &[&'static str]) -> Result<Option<f64>, FormatError> {
        let Some(entry) = self.find(keys) else {
            return Ok(None);
        };
        Ok(Some(parsed(&entry.value, keys[0])?))
    }

    /// The matrix of the first of `keys` that there is: an OpenCV or ROS matrix, or a list of numbers,
    /// which is one row.
    pub(super) fn matrix(&self, keys: &[&'static str]) -> Result<Matrix, FormatError> {
        let missing = |key: &'static str| FormatError::Missing {
            key,
            expected: "a matrix with rows, cols and data",
        };
        let key = keys[0];
        let entry = self.find(keys).ok_or_else(|| missing(key))?;
        let of = |name: &str| {
            let mut below = entry.below.iter();
            below.find(|(key, _)| key == name).map(|(_, value)| value)
        };
        let list = if entry.value.starts_with('[') {
            Some(&entry.value)
        } else {
            of("data")
        };
        let list = list.ok_or_else(|| missing(key))?;
        let inner = list
            .trim()
            .strip_prefix('[')
            .and_then(|list| list.strip_suffix(']'))
            .ok_or_else(|| syntax(entry.line, list, "a list of numbers in brackets"))?;
        let numbers = inner.split(',').map(str::trim).filter(|n| !n.is_empty());
        let data = numbers
            .map(|number| parsed(number, key))
            .collect::<Result<Vec<f64>, _>>()?;
        let size = |name: &str, otherwise: usize| match of(name) {
            Some(value) => value.parse().map_err(|_| FormatError::Value {
                key,
                found: format!("a matrix with {name} {value}"),
                expected: "a whole number of rows and of columns",
            }),
            None => Ok(otherwise),
        };
        let (rows, columns) = (size("rows", 1)?, size("cols", data.len())?);
        if usize::checked_mul(rows, columns) != Some(data.len()) {
            return Err(FormatError::Value {
                key,
                found: format!("{} numbers for {rows} rows, {columns} columns", data.len()),
                expected: "one number for each row and column",
            });
        }
        Ok(Matrix {
            rows,
            columns,
            data,
        })
    }
}

/// A finite number.
fn parsed(text: &str, key: &'static str) -> Result<f64, FormatError> {
    let number = text.parse::<f64>().ok().filter(|n| n.is_finite());
    number.ok_or_else(|| FormatError::Value {
        key,
        found: format!("'{text}'"),
        expected: "numbers",
    })
}

/// A line without its comment.
fn without_comment(line: &str) -> &str {
    let ends = line.match_indices('#').map(|(at, _)| at);
    let mut comments = ends.filter(|at| *at == 0 || line[..*at].ends_with([' ', '\t']));
    comments.next().map_or(line, |at| &line[..at]).trim_end()
}

fn syntax(index: usize, found: &str, expected: &'static str) -> FormatError {
    FormatError::Syntax {
        line: index + 1,
        found: found.trim().to_owned(),
        expected,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_floats_for_every_reader_of_yaml() {
        for (value, text) in [
            (1.0, "1.0"),
            (-0.25, "-0.25"),
            (5e-20, "5.0e-20"),
            (1.5e300, "1.5e+300"),
            (0.0, "0.0"),
        ] {
            assert_eq!(number(value), text);
            assert_eq!(text.parse::<f64>().unwrap(), value);
        }
    }

    #[test]
    fn a_matrix_may_go_over_several_lines() {
        let text = "%YAML:1.0\n---\n# a comment\nName: \"a b\" # and another\nM: !!opencv-matrix\n   \
                    rows: 2\n   cols: 2\n   dt: d\n   data: [ 1., 2.,\n       -3e-1, 4 ]\nlist: [1, 2]\n";
        let document = Document::read(text).unwrap();
        assert_eq!(document.word(&["name"]), Some("a b"));
        let matrix = document.matrix(&["m"]).unwrap();
        assert_eq!((matrix.rows, matrix.columns), (2, 2));
        assert_eq!(matrix.data, [1.0, 2.0, -0.3, 4.0]);
        assert_eq!(document.matrix(&["list"]).unwrap().data, [1.0, 2.0]);
    }

    #[test]
    fn what_is_wrong_is_said() {
        for (text, expected) in [
            ("m", "line 1 is 'm'; expected 'name: value'"),
            (
                "m: [1, 2",
                "line 1 is 'm: [1, 2'; expected a ']' after the '['",
            ),
            ("m: [1, x]", "'m' is 'x'; expected numbers"),
            (
                "m:\n  rows: 2\n  cols: 2\n  data: [1]",
                "'m' is 1 numbers for 2 rows, 2 columns; expected one number for each row and column",
            ),
            (
                "m: [1]\nn: 1\nM: [2]",
                "line 3 is 'M: [2]'; expected a name that no line before it has",
            ),
            (
                "n: 1",
                "'m' is missing; expected a matrix with rows, cols and data",
            ),
        ] {
            let error = Document::read(text).and_then(|document| document.matrix(&["m"]));
            assert_eq!(error.unwrap_err().to_string(), expected);
        }
    }
}
