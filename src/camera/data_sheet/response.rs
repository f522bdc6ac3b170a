//! A transmission or an efficiency as a function of wavelength.

use crate::base::files;
use crate::base::format::excerpt;
use csv::ByteRecord;
use std::borrow::Cow;
use std::io::Read as _;
use std::path::{Path, PathBuf};

/// Maximum size of a table, in bytes.
const MAX_BYTES: u64 = 1 << 20;

/// A number from 0 to 1 at each wavelength.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Response {
    /// The same at every wavelength.
    Constant(f64),
    /// Points of wavelength in nm and value, by rising wavelength, with linear interpolation.
    Table(Vec<(f64, f64)>),
}

/// Error of reading a response.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ResponseError {
    /// The file cannot be read.
    #[error("{}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The file is larger than any table.
    #[error("{}: larger than {limit} bytes: too large for a table of wavelengths and values", path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Maximum size, in bytes.
        limit: u64,
    },
    /// A row does not hold two valid numbers.
    #[error("{}, line {line}: found '{}', expected {expected}", path.display(), excerpt(.found))]
    Value {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: u64,
        /// The value.
        found: String,
        /// What is valid.
        expected: &'static str,
    },
    /// The wavelengths do not rise.
    #[error("{}, line {line}: {wavelength_nm} nm after {before_nm} nm: wavelengths must rise from line to line", path.display())]
    NotSorted {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: u64,
        /// The wavelength.
        wavelength_nm: f64,
        /// The previous wavelength.
        before_nm: f64,
    },
    /// There are fewer than two rows.
    #[error("{}: too few rows of wavelength and value: found {found}, expected two or more", path.display())]
    TooShort {
        /// The file.
        path: PathBuf,
        /// Number of rows.
        found: usize,
    },
}

impl Response {
    /// The value at a wavelength in nm. Outside a table, the value at its nearer end.
    pub fn at(&self, wavelength_nm: f64) -> f64 {
        let points = match self {
            Self::Constant(value) => return *value,
            Self::Table(points) => points,
        };
        let after = points.partition_point(|(nm, _)| *nm < wavelength_nm);
        match (after.checked_sub(1).map(|i| points[i]), points.get(after)) {
            (Some((low_nm, low)), Some((high_nm, high))) => {
                low + (high - low) * (wavelength_nm - low_nm) / (high_nm - low_nm)
            }
            (Some((_, last)), None) => last,
            (None, first) => first.map_or(0.0, |(_, value)| *value),
        }
    }

    /// The peak value.
    pub fn peak(&self) -> f64 {
        match self {
            Self::Constant(value) => *value,
            Self::Table(points) => points.iter().map(|(_, v)| *v).fold(0.0, f64::max),
        }
    }

    /// The curve scaled to the given peak value.
    #[must_use]
    pub fn with_peak(&self, peak: f64) -> Self {
        match self {
            Self::Constant(_) => Self::Constant(peak),
            Self::Table(points) => {
                let factor = peak / self.peak();
                Self::Table(points.iter().map(|(nm, v)| (*nm, v * factor)).collect())
            }
        }
    }

    /// First and last wavelength of a table, in nm.
    pub fn range_nm(&self) -> Option<(f64, f64)> {
        match self {
            Self::Constant(_) => None,
            Self::Table(points) => Some((points.first()?.0, points.last()?.0)),
        }
    }

    /// Reads a CSV file with wavelength in nm and value in each row, with or without a heading.
    ///
    /// # Errors
    /// [`ResponseError`] with the file and the line.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, ResponseError> {
        let path = path.as_ref();
        let read = |source| ResponseError::Read {
            path: path.to_owned(),
            source,
        };
        let mut bytes = Vec::new();
        let file = files::open(path).map_err(read)?;
        file.take(MAX_BYTES + 1)
            .read_to_end(&mut bytes)
            .map_err(read)?;
        if bytes.len() as u64 > MAX_BYTES {
            return Err(ResponseError::TooLarge {
                path: path.to_owned(),
                limit: MAX_BYTES,
            });
        }
        Self::parse(path, &bytes)
    }

    /// Parses the content of such a file; `path` is its name in errors.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn parse(path: &Path, content: &[u8]) -> Result<Self, ResponseError> {
        let mut reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .comment(Some(b'#'))
            .trim(csv::Trim::All)
            .from_reader(content);
        let mut points: Vec<(f64, f64)> = Vec::new();
        for (i, row) in reader.byte_records().enumerate() {
            let row = row.map_err(|error| ResponseError::Read {
                path: path.to_owned(),
                source: error.into(),
            })?;
            let is_heading = i == 0 && cell(&row, 0).parse::<f64>().is_err();
            if !is_heading {
                let point = parse_row(path, &row, points.last())?;
                points.push(point);
            }
        }
        if points.len() < 2 {
            return Err(ResponseError::TooShort {
                path: path.to_owned(),
                found: points.len(),
            });
        }
        Ok(Self::Table(points))
    }
}

fn cell(row: &ByteRecord, column: usize) -> Cow<'_, str> {
    String::from_utf8_lossy(row.get(column).unwrap_or_default())
}

/// Wavelength and value in `row`; the wavelength must be above that of the `previous` row.
fn parse_row(
    path: &Path,
    row: &ByteRecord,
    previous: Option<&(f64, f64)>,
) -> Result<(f64, f64), ResponseError> {
    let line = row.position().map_or(0, csv::Position::line);
    let number = |column: usize, expected, accepts: fn(f64) -> bool| {
        let found = cell(row, column);
        let value = found.parse::<f64>().ok();
        value.filter(|v| accepts(*v)).ok_or(ResponseError::Value {
            path: path.to_owned(),
            line,
            found: found.chars().take(40).collect(),
            expected,
        })
    };
    let nm = number(0, "a wavelength in nanometers, before a comma,", |nm| {
        nm > 0.0 && nm.is_finite()
    })?;
    let value = number(1, "a value from 0 to 1", |v| (0.0..=1.0).contains(&v))?;
    match previous {
        Some((before_nm, _)) if *before_nm >= nm => Err(ResponseError::NotSorted {
            path: path.to_owned(),
            line,
            wavelength_nm: nm,
            before_nm: *before_nm,
        }),
        _ => Ok((nm, value)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(text: &str) -> Result<Response, ResponseError> {
        Response::parse("qe.csv".as_ref(), text.as_bytes())
    }

    #[test]
    fn a_table_is_interpolated_and_ends_flat() {
        let table = parsed("nm,qe\n400,0.2\n500,0.6\n700,0.4\n").unwrap();
        for (nm, expected) in [
            (300.0, 0.2),
            (400.0, 0.2),
            (450.0, 0.4),
            (600.0, 0.5),
            (900.0, 0.4),
        ] {
            assert!((table.at(nm) - expected).abs() < 1e-12, "{nm}");
        }
        assert_eq!(table.range_nm(), Some((400.0, 700.0)));
        assert_eq!(table.peak(), 0.6);
        assert!((table.with_peak(0.3).at(450.0) - 0.2).abs() < 1e-12);
    }

    #[test]
    fn no_row_is_lost_without_a_heading() {
        let rows = "400,0.2\n500,0.6\n";
        let expected = Response::Table(vec![(400.0, 0.2), (500.0, 0.6)]);
        for head in [
            "",
            "\u{feff}",
            "# a comment\n",
            "nm,qe\n",
            "\u{feff}nm,qe\r\n",
        ] {
            assert_eq!(
                parsed(&format!("{head}{rows}")).unwrap(),
                expected,
                "{head:?}"
            );
        }
        let latin1 = [b"Wellenl\xe4nge,QE\n", rows.as_bytes()].concat();
        assert_eq!(
            Response::parse("qe.csv".as_ref(), &latin1).unwrap(),
            expected
        );
    }

    #[test]
    fn an_invalid_table_is_refused_with_its_line() {
        for (text, expected) in [
            (
                "nm,qe\n400,0.2\n390,0.3\n",
                "qe.csv, line 3: 390 nm after 400 nm",
            ),
            (
                "nm,qe\n400,1.2\n500,0.3\n",
                "line 2: found '1.2', expected a value from 0 to 1",
            ),
            ("nm,qe\n400,NaN\n500,0.3\n", "line 2: found 'NaN'"),
            (
                "nm,qe\n-5,0.1\n500,0.3\n",
                "line 2: found '-5', expected a wavelength",
            ),
            (
                "nm,qe\n400,0.2\n",
                "too few rows of wavelength and value: found 1",
            ),
            (
                "nm;qe\n400;0.2\n500;0.3\n",
                "line 2: found '400;0.2', expected a wavelength in nanometers, before a comma",
            ),
        ] {
            let error = parsed(text).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        }
    }
}
