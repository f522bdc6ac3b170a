//! Columns of a detector that hold one value instead of light: dead, stuck or full, over all rows or
//! from one on.

use super::image::Frame;
use super::pixels::Pixels;
use std::ops::Range;

/// Of so many rows one is compared with the one compared before.
const ROW_STEP: usize = 8;
/// Of so many comparisons one tells how often noise gives the same value twice.
const SAMPLE_STEP: usize = 16;
/// Fewest compared rows with the same value, one after the other.
const MIN_RUN: usize = 12;
/// Natural logarithm of the chance at most that noise makes a run in a frame.
const MAX_LN_CHANCE: f64 = -14.0;
/// Fewest rows that are taken for defective: where a defect ends, light by chance has its value.
const MIN_ROWS: usize = 32;
/// More columns than this share are no defects: the picture is drawn, or black.
const MAX_FRACTION: f64 = 0.2;
/// The nearest column with light is at most so far away, on both sides.
const REACH: usize = 3;
/// Share of neighboring rows with the same value from which on a column has no light.
const MAX_EQUAL_FRACTION: f64 = 0.5;

/// Rows of a column that hold one value instead of light.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DefectiveColumn {
    /// The column.
    pub x: usize,
    /// Its rows.
    pub rows: Range<usize>,
}

impl Frame<'_> {
    /// The columns that hold one value over many rows while those beside them do not, from the left.
    pub fn defective_columns(&self) -> Vec<DefectiveColumn> {
        let runs = match &self.pixels {
            Pixels::U8(values) => LongestRuns::measure(values, self.width),
            Pixels::U16(values) => LongestRuns::measure(values, self.width),
            Pixels::F32(values) => LongestRuns::measure(values, self.width),
        };
        let suspects = runs.suspects();
        if suspects.is_empty() || suspects.len() as f64 > MAX_FRACTION * self.width as f64 {
            return Vec::new();
        }
        let highest = self.pixels.highest();
        let mut found = Vec::new();
        for &x in &suspects {
            let of_column = self.constant_rows(x).filter(|rows| {
                // The charge of a bright star fills a part of a column.
                let is_full = self.at(x, rows.start) >= highest;
                !(is_full && 2 * rows.len() < self.height)
            });
            let isolated = of_column.filter(|rows| self.has_light_beside(x, rows));
            found.extend(isolated.map(|rows| DefectiveColumn { x, rows }));
        }
        found
    }

    /// The frame with no values in some columns.
    #[must_use]
    pub fn without_columns(&self, columns: &[DefectiveColumn]) -> Frame<'static> {
        let (width, height) = (self.width, self.height);
        let mut values = self.values().into_owned();
        for DefectiveColumn { x, rows } in columns {
            rows.clone().for_each(|y| values[y * width + x] = f32::NAN);
        }
        Frame::from_checked(width, height, values)
            .with_levels(self.step_adu, self.saturation_adu)
            .with_metadata(self.metadata.clone())
    }

    /// The long runs of one value in a column.
    fn constant_rows(&self, x: usize) -> impl Iterator<Item = Range<usize>> {
        let mut start = 0;
        let ends = (1..=self.height)
            .filter(move |&y| y == self.height || self.at(x, y) != self.at(x, y - 1));
        let runs = ends.map(move |end| std::mem::replace(&mut start, end)..end);
        runs.filter(|rows| rows.len() >= MIN_ROWS)
    }

    /// Whether columns near `x` change from row to row, on every side on which there are any.
    fn has_light_beside(&self, x: usize, rows: &Range<usize>) -> bool {
        let changes = |x: usize| {
            let pairs = rows.clone().skip(1);
            let equal = pairs
                .filter(|&y| self.at(x, y) == self.at(x, y - 1))
                .count();
            (equal as f64) < MAX_EQUAL_FRACTION * rows.len() as f64
        };
        let mut left = x.saturating_sub(REACH)..x;
        let mut right = x + 1..(x + 1 + REACH).min(self.width);
        (left.is_empty() || left.any(changes)) && (right.is_empty() || right.any(changes))
    }
}

/// The longest run of one value in each column, in rows that are compared.
struct LongestRuns {
    longest: Vec<i16>,
    /// Rows that are compared with the last one.
    rows: usize,
    /// Share of the pixels that have the value of the last row's.
    equal_fraction: f64,
}

impl LongestRuns {
    fn measure<T: Copy + PartialEq>(values: &[T], width: usize) -> Self {
        let mut runs = vec![0i16; width];
        let mut longest = vec![0i16; width];
        let rows = || values.chunks_exact(width).step_by(ROW_STEP);
        let pairs = || rows().zip(rows().skip(1));
        for (above, row) in pairs() {
            let pixels = above.iter().zip(row);
            for ((run, longest), (above, pixel)) in runs.iter_mut().zip(&mut longest).zip(pixels) {
                // All ones where they are equal: without a branch, many columns are done at once.
                let is_equal = -i16::from(above == pixel);
                *run = run.saturating_add(1) & is_equal;
                *longest = (*longest).max(*run);
            }
        }
        let sample = || {
            pairs()
                .step_by(SAMPLE_STEP)
                .map(|(above, row)| above.iter().zip(row))
        };
        let equal = sample().flatten().filter(|(above, pixel)| above == pixel);
        let pixels = sample().count() * width;
        Self {
            longest,
            rows: pairs().count(),
            equal_fraction: equal.count() as f64 / pixels.max(1) as f64,
        }
    }

    /// The columns with a run that noise does not make.
    fn suspects(&self) -> Vec<usize> {
        let pixels = (self.rows * self.longest.len()).max(1) as f64;
        let chance = self.equal_fraction.clamp(1e-3, 0.999);
        let run = (MAX_LN_CHANCE - libm::log(pixels)) / libm::log(chance);
        let min_run = MIN_RUN.max(run.ceil() as usize);
        let columns = self.longest.iter().enumerate();
        let suspects = columns.filter(|&(_, &run)| run as usize >= min_run);
        suspects.map(|(x, _)| x).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 60 × 200 px of whole numbers that differ, but for some columns.
    fn frame(column: impl Fn(usize, usize) -> Option<f32>) -> Frame<'static> {
        let pixel = |i: usize| {
            let (x, y) = (i % 60, i / 60);
            let light = 100.0 + ((x * x * 7919 + y * y * 104_729 + x * y * 13) % 1009 % 53) as f32;
            column(x, y).unwrap_or(light)
        };
        Frame::new(60, 200, (0..60 * 200).map(pixel).collect()).unwrap()
    }

    fn column(x: usize, rows: Range<usize>) -> DefectiveColumn {
        DefectiveColumn { x, rows }
    }

    #[test]
    fn columns_of_one_value_are_found_where_they_have_it() {
        let found = frame(|x, y| match x {
            0 => Some(7.0),
            20 => (y >= 90).then_some(500.0),
            21 => (y >= 60).then_some(0.0),
            _ => None,
        });
        let expected = [column(0, 0..200), column(20, 90..200), column(21, 60..200)];
        assert_eq!(found.defective_columns(), expected);
        let masked = found.without_columns(&expected);
        assert!(masked.at(20, 90).is_nan() && !masked.at(20, 89).is_nan());
    }

    #[test]
    fn stars_that_bleed_and_black_skies_are_no_defects() {
        let bleeding = frame(|x, y| (x == 30 && (50..130).contains(&y)).then_some(4095.0));
        assert_eq!(bleeding.defective_columns(), []);
        let black = frame(|x, y| (x < 25 && y > 20).then_some(0.0));
        assert_eq!(black.defective_columns(), []);
        let dark = frame(|x, y| (x % 9 != 0 || y % 5 != 0).then_some(0.0));
        assert_eq!(dark.defective_columns(), []);
    }
}
