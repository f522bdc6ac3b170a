//! Lists of hot pixels, as `starpipe darks` writes them.

use super::error::{CalibrationError, check_bad};
use crate::base::files;
use crate::frame::Frame;
use std::path::{Path, PathBuf};

/// Largest size of a list: some millions of pixels.
const MAX_BYTES: u64 = 1 << 26;

/// Hot pixels of a detector, with the file that lists them.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct HotPixelList {
    path: PathBuf,
    /// Line, column, row.
    pixels: Vec<(u64, usize, usize)>,
}

/// Reads a list of hot pixels: CSV with the columns `x` and `y`, whole numbers; (0, 0) is the
/// top-left pixel. Other columns are ignored.
/// # Errors
/// [`CalibrationError::List`], [`CalibrationError::Malformed`].
pub fn read_hot_pixels(path: impl AsRef<Path>) -> Result<HotPixelList, CalibrationError> {
    let path = path.as_ref();
    let unreadable = |source| CalibrationError::List {
        path: path.to_owned(),
        source,
    };
    let malformed = |line, found: &str, expected| CalibrationError::Malformed {
        path: path.to_owned(),
        line,
        found: found.to_owned(),
        expected,
    };
    let bytes = files::read(path, MAX_BYTES).map_err(unreadable)?;
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .from_reader(&bytes[..]);
    let headings = reader
        .headers()
        .map_err(|error| unreadable(error.into()))?
        .clone();
    let column = |name: &str| {
        headings
            .iter()
            .position(|h| h.trim_start_matches('\u{feff}').eq_ignore_ascii_case(name))
    };
    let (Some(x_column), Some(y_column)) = (column("x"), column("y")) else {
        let found: Vec<_> = headings.iter().take(8).collect();
        return Err(malformed(
            1,
            &format!("the headings {found:?}"),
            "x and y among them",
        ));
    };
    let mut pixels = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| unreadable(error.into()))?;
        let line = record.position().map_or(0, csv::Position::line);
        let coordinate = |column: usize| {
            let text = record.get(column).unwrap_or_default();
            text.parse::<usize>()
                .map_err(|_| malformed(line, &format!("{text:?}"), "a whole number from 0"))
        };
        pixels.push((line, coordinate(x_column)?, coordinate(y_column)?));
    }
    Ok(HotPixelList {
        path: path.to_owned(),
        pixels,
    })
}

impl HotPixelList {
    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Column and row of each pixel.
    pub fn pixels(&self) -> impl Iterator<Item = (usize, usize)> {
        self.pixels.iter().map(|&(_, x, y)| (x, y))
    }

    /// Refuses pixels outside `frame`, and too many of them.
    pub(super) fn check(&self, frame: &Frame) -> Result<(), CalibrationError> {
        for &(line, x, y) in &self.pixels {
            if x >= frame.width || y >= frame.height {
                return Err(CalibrationError::Outside {
                    path: self.path.clone(),
                    line,
                    x,
                    y,
                    width: frame.width,
                    height: frame.height,
                });
            }
        }
        let name = self.path.display().to_string();
        check_bad(
            "the list of hot pixels",
            &name,
            self.pixels.len(),
            frame,
            "in it",
        )
    }
}
