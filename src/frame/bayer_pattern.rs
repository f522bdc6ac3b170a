//! The arrangement of filters in a mosaic.

use serde::Serialize;
use std::fmt;

/// The filters over the upper left 2 × 2 pixels, row by row.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "UPPERCASE")]
pub enum BayerPattern {
    /// Red in the corner.
    Rggb,
    /// Blue in the corner.
    Bggr,
    /// Green in the corner, red beside it.
    Grbg,
    /// Green in the corner, blue beside it.
    Gbrg,
}

impl BayerPattern {
    const ALL: [Self; 4] = [Self::Rggb, Self::Bggr, Self::Grbg, Self::Gbrg];

    /// Its name: the filters' initials.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Rggb => "RGGB",
            Self::Bggr => "BGGR",
            Self::Grbg => "GRBG",
            Self::Gbrg => "GBRG",
        }
    }

    /// The pattern with this name, in any case.
    pub fn of_name(name: &str) -> Option<Self> {
        let is_it = |pattern: &Self| name.trim().eq_ignore_ascii_case(pattern.name());
        Self::ALL.into_iter().find(is_it)
    }

    /// The pattern that begins `columns` and `rows` later.
    #[must_use]
    pub fn shifted(self, columns: i64, rows: i64) -> Self {
        let shifted = if columns.rem_euclid(2) == 0 {
            self
        } else {
            self.mirrored()
        };
        if rows.rem_euclid(2) == 0 {
            shifted
        } else {
            shifted.upside_down()
        }
    }

    /// The pattern that begins with its second row.
    #[must_use]
    pub fn upside_down(self) -> Self {
        match self {
            Self::Rggb => Self::Gbrg,
            Self::Gbrg => Self::Rggb,
            Self::Bggr => Self::Grbg,
            Self::Grbg => Self::Bggr,
        }
    }

    /// The pattern that begins with its second column.
    fn mirrored(self) -> Self {
        match self {
            Self::Rggb => Self::Grbg,
            Self::Grbg => Self::Rggb,
            Self::Bggr => Self::Gbrg,
            Self::Gbrg => Self::Bggr,
        }
    }

    /// The diagonal of the green pixels.
    pub(super) fn green(self) -> Diagonal {
        match self {
            Self::Rggb | Self::Bggr => Diagonal::Rising,
            Self::Grbg | Self::Gbrg => Diagonal::Falling,
        }
    }
}

impl fmt::Display for BayerPattern {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Two of each 2 × 2 pixels that touch at a corner.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Diagonal {
    /// The upper left and the lower right one.
    Falling,
    /// The upper right and the lower left one.
    Rising,
}

impl Diagonal {
    /// That of the pixel in column `x`, row `y`.
    pub fn at(x: usize, y: usize) -> Self {
        if (x + y).is_multiple_of(2) {
            Self::Falling
        } else {
            Self::Rising
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The pattern at (0, 0) of a grid of `pattern` from (`columns`, `rows`) on, by its definition.
    fn cut(pattern: BayerPattern, columns: usize, rows: usize) -> String {
        let name = pattern.name().as_bytes();
        let at = |x: usize, y: usize| name[2 * ((y + rows) % 2) + (x + columns) % 2] as char;
        [at(0, 0), at(1, 0), at(0, 1), at(1, 1)].iter().collect()
    }

    #[test]
    fn shifts_are_those_of_the_grid_and_greens_are_where_the_name_says() {
        for pattern in BayerPattern::ALL {
            for (columns, rows) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                let shifted = pattern.shifted(columns, rows);
                let expected = cut(pattern, columns as usize, rows as usize);
                assert_eq!(shifted.name(), expected);
                assert_eq!(pattern.shifted(columns - 2, rows + 4), shifted);
            }
            let is_falling = pattern.name().starts_with('G');
            assert_eq!(pattern.green() == Diagonal::Falling, is_falling);
            let name = pattern.name().to_lowercase();
            assert_eq!(BayerPattern::of_name(&format!(" {name} ")), Some(pattern));
        }
        assert_eq!(BayerPattern::of_name("CYGM"), None);
    }
}
