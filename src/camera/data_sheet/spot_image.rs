//! A star's spot as a picture, for example of a lens's design.

use crate::base::files;
use std::path::{Path, PathBuf};

/// Largest number of samples of a spot.
const MAX_SAMPLES: usize = 1 << 22;

/// A star's spot, sampled on a grid. Its place is the centre of its light.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct SpotImage {
    /// Light above and left of each corner of the samples, of 1 in all; row-major.
    light_before: Vec<f64>,
    columns: usize,
    rows: usize,
    /// Centre of the light, in samples from the upper left corner.
    centre: [f64; 2],
}

/// Why a spot cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SpotImageError {
    /// The file cannot be read.
    #[error("{}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The table is not one of numbers from 0 on, all rows of one length.
    #[error("{}, line {line}: found {found}, expected {expected}", path.display())]
    Value {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: usize,
        /// What stands there.
        found: String,
        /// What is valid.
        expected: String,
    },
    /// There is no light in it, or too many samples.
    #[error("{}: {found}, expected light on at most {MAX_SAMPLES} samples", path.display())]
    Unfit {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        found: String,
    },
}

/// Largest size of a table.
const MAX_BYTES: u64 = 1 << 24;

impl SpotImage {
    /// Reads a CSV table without a heading: a number for each sample, a line for each row.
    ///
    /// # Errors
    /// [`SpotImageError`] with the file and the line.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, SpotImageError> {
        let path = path.as_ref();
        let text = files::read_text(path, MAX_BYTES).map_err(|source| SpotImageError::Read {
            path: path.to_owned(),
            source,
        })?;
        Self::parse(path, &text)
    }

    fn parse(path: &Path, text: &str) -> Result<Self, SpotImageError> {
        let (mut samples, mut columns) = (Vec::new(), 0);
        for (number, line) in text.lines().enumerate() {
            let wrong = |found: String, expected: String| SpotImageError::Value {
                path: path.to_owned(),
                line: number + 1,
                found,
                expected,
            };
            let before = samples.len();
            for field in line.split(',') {
                let field = field.trim();
                let value = field.parse::<f64>().ok();
                let value = value.filter(|value| value.is_finite() && *value >= 0.0);
                let expected = || "a number of 0 or more".to_owned();
                samples.push(value.ok_or_else(|| wrong(format!("'{field}'"), expected()))?);
            }
            let found = samples.len() - before;
            if number > 0 && found != columns {
                let expected = format!("{columns}, as in the first line");
                return Err(wrong(format!("{found} numbers"), expected));
            }
            columns = found;
        }
        let unfit = |found: String| SpotImageError::Unfit {
            path: path.to_owned(),
            found,
        };
        if samples.len() > MAX_SAMPLES {
            return Err(unfit(format!("{} samples", samples.len())));
        }
        Self::new(&samples, columns).ok_or_else(|| unfit("no light".to_owned()))
    }

    /// The spot of these samples, row by row; `None` without light.
    fn new(samples: &[f64], columns: usize) -> Option<Self> {
        let total: f64 = samples.iter().sum();
        if !(total > 0.0 && total.is_finite()) {
            return None;
        }
        let rows = samples.len() / columns;
        let width = columns + 1;
        let mut light_before = vec![0.0; width * (rows + 1)];
        let mut centre = [0.0; 2];
        for (y, row) in samples.chunks_exact(columns).enumerate() {
            let mut in_row = 0.0;
            for (x, sample) in row.iter().enumerate() {
                let share = sample / total;
                in_row += share;
                light_before[(y + 1) * width + x + 1] = light_before[y * width + x + 1] + in_row;
                centre[0] += share * (x as f64 + 0.5);
                centre[1] += share * (y as f64 + 0.5);
            }
        }
        Some(Self {
            light_before,
            columns,
            rows,
            centre,
        })
    }

    /// Share of the light in a pixel whose centre is at (x, y) from the star, where samples are
    /// `step_px` apart: each sample's light is even over its square.
    pub fn share(&self, x_px: f64, y_px: f64, step_px: f64) -> f64 {
        let edges =
            |at_px: f64, centre: f64| [-0.5, 0.5].map(|half| (at_px + half) / step_px + centre);
        let [left, right] = edges(x_px, self.centre[0]);
        let [top, bottom] = edges(y_px, self.centre[1]);
        let light =
            self.before(right, bottom) - self.before(left, bottom) - self.before(right, top)
                + self.before(left, top);
        light.max(0.0)
    }

    /// Radius of the circle about the star with all of its light, in samples.
    pub fn reach(&self) -> f64 {
        let side = |centre: f64, side: usize| centre.max(side as f64 - centre);
        libm::hypot(
            side(self.centre[0], self.columns),
            side(self.centre[1], self.rows),
        )
    }

    /// Light above and left of a place, in samples from the upper left corner.
    fn before(&self, x: f64, y: f64) -> f64 {
        let place = |at: f64, side: usize| {
            let at = at.clamp(0.0, side as f64);
            let whole = (at as usize).min(side - 1);
            (whole, at - whole as f64)
        };
        let ((x, part_x), (y, part_y)) = (place(x, self.columns), place(y, self.rows));
        let row = |y: usize| {
            let at = y * (self.columns + 1) + x;
            let [left, right] = [self.light_before[at], self.light_before[at + 1]];
            left + (right - left) * part_x
        };
        row(y) + (row(y + 1) - row(y)) * part_y
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(text: &str) -> Result<SpotImage, SpotImageError> {
        SpotImage::parse("psf.csv".as_ref(), text)
    }

    #[test]
    fn pixels_share_the_light_about_its_centre() {
        // Twice the light on the right: the centre is at 7/6 samples of 2.
        let spot = parsed("1,2\n1,2\n").unwrap();
        let all: f64 = (-2..=2)
            .flat_map(|y| (-2..=2).map(move |x| (f64::from(x), f64::from(y))))
            .map(|(x, y)| spot.share(x + 0.3, y - 0.2, 0.5))
            .sum();
        assert!((all - 1.0).abs() < 1e-12, "{all}");
        // A pixel covers two samples of half a pixel, about the centre of light.
        let expected = 1.0 - 2.0 / 6.0 * (1.0 / 6.0);
        assert!((spot.share(0.0, 0.0, 0.5) - expected).abs() < 1e-12);
        assert!(spot.share(0.0, 3.0, 0.5) == 0.0);
        assert!((spot.reach() - (7f64 / 6.0).hypot(1.0)).abs() < 1e-12);
    }

    #[test]
    fn a_table_that_is_no_spot_is_reported_with_its_line() {
        for (text, expected) in [
            (
                "1,2\n1,x\n",
                "line 2: found 'x', expected a number of 0 or more",
            ),
            ("1,2\n-1,2\n", "line 2: found '-1'"),
            (
                "1,2\n1\n",
                "line 2: found 1 numbers, expected 2, as in the first line",
            ),
            ("0,0\n0,0\n", "found no light"),
            ("", "no light"),
        ] {
            let error = parsed(text).unwrap_err().to_string();
            assert!(
                error.contains(expected.trim_start_matches("found ")),
                "{error}"
            );
        }
    }
}
