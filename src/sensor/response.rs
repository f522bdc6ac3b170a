//! A transmission or an efficiency, by wavelength.

use std::path::{Path, PathBuf};

/// A number between 0 and 1 at each wavelength.
#[derive(Debug, Clone, PartialEq)]
pub enum Response {
    /// The same at every wavelength.
    Constant(f64),
    /// Straight lines between points, wavelength in nm and value, the wavelengths rising; nothing is known outside.
    Table(Vec<(f64, f64)>),
}

/// Why a table is no response.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ResponseError {
    /// The file cannot be read.
    #[error("{}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system or the CSV reader says.
        source: csv::Error,
    },
    /// A row is not two numbers.
    #[error("{}, line {line}: '{found}' where {expected} was expected", path.display())]
    Value {
        /// The file.
        path: PathBuf,
        /// The line.
        line: u64,
        /// What is there.
        found: String,
        /// What should be.
        expected: &'static str,
    },
    /// The wavelengths do not rise.
    #[error("{}, line {line}: {wavelength_nm} nm after {before_nm} nm: wavelengths must rise from line to line", path.display())]
    NotSorted {
        /// The file.
        path: PathBuf,
        /// The line.
        line: u64,
        /// The wavelength there.
        wavelength_nm: f64,
        /// The one before it.
        before_nm: f64,
    },
    /// There are fewer than two rows.
    #[error("{}: {found} rows of wavelength and value, expected two or more", path.display())]
    TooShort {
        /// The file.
        path: PathBuf,
        /// The rows there are.
        found: usize,
    },
}

impl Response {
    /// The value at a wavelength in nm; outside of a table that of its nearer end.
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

    /// The largest value.
    pub fn peak(&self) -> f64 {
        match self {
            Self::Constant(value) => *value,
            Self::Table(points) => points.iter().map(|(_, v)| *v).fold(0.0, f64::max),
        }
    }

    /// The same curve with its largest value `peak`.
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

    /// Reads a CSV file: a heading, then wavelength in nm and value in each row.
    ///
    /// # Errors
    /// [`ResponseError`] with the file and the line.
    pub fn read(path: &Path) -> Result<Self, ResponseError> {
        let read = |source| ResponseError::Read {
            path: path.to_owned(),
            source,
        };
        let mut reader = csv::ReaderBuilder::new()
            .flexible(true)
            .comment(Some(b'#'))
            .trim(csv::Trim::All)
            .from_path(path)
            .map_err(read)?;
        Self::from_rows(path, reader.records(), read)
    }

    /// Parses the text of such a file; `path` stands for its name in errors.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn parse(path: &Path, text: &str) -> Result<Self, ResponseError> {
        let read = |source| ResponseError::Read {
            path: path.to_owned(),
            source,
        };
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        Self::from_rows(path, reader.records(), read)
    }

    fn from_rows(
        path: &Path,
        rows: impl Iterator<Item = csv::Result<csv::StringRecord>>,
        read: impl Fn(csv::Error) -> ResponseError,
    ) -> Result<Self, ResponseError> {
        let mut points: Vec<(f64, f64)> = Vec::new();
        for row in rows {
            let row = row.map_err(&read)?;
            let line = row.position().map_or(0, csv::Position::line);
            let number = |column: usize, expected, accepts: fn(f64) -> bool| {
                let found = row.get(column).unwrap_or_default();
                let value = found.parse::<f64>().ok();
                value.filter(|v| accepts(*v)).ok_or(ResponseError::Value {
                    path: path.to_owned(),
                    line,
                    found: found.to_owned(),
                    expected,
                })
            };
            let nm = number(0, "a wavelength in nanometres", |nm| {
                nm > 0.0 && nm.is_finite()
            })?;
            let value = number(1, "a value from 0 to 1", |v| (0.0..=1.0).contains(&v))?;
            if let Some((before_nm, _)) = points.last().filter(|(before, _)| *before >= nm) {
                return Err(ResponseError::NotSorted {
                    path: path.to_owned(),
                    line,
                    wavelength_nm: nm,
                    before_nm: *before_nm,
                });
            }
            points.push((nm, value));
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

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(text: &str) -> Result<Response, ResponseError> {
        Response::parse("qe.csv".as_ref(), text)
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
    fn what_is_no_table_is_refused_with_its_line() {
        for (text, expected) in [
            (
                "nm,qe\n400,0.2\n390,0.3\n",
                "qe.csv, line 3: 390 nm after 400 nm",
            ),
            (
                "nm,qe\n400,1.2\n500,0.3\n",
                "line 2: '1.2' where a value from 0 to 1",
            ),
            ("nm,qe\n400,NaN\n500,0.3\n", "line 2: 'NaN'"),
            (
                "nm,qe\n-5,0.1\n500,0.3\n",
                "line 2: '-5' where a wavelength",
            ),
            ("nm,qe\n400,0.2\n", "1 rows of wavelength and value"),
        ] {
            let error = parsed(text).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        }
    }
}
