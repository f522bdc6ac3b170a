//! From whole numbers back to the floats that were quantized.
//!
//! A float is zero + scale × (whole number), of which a random number between −0.5 and 0.5 is taken
//! where the numbers were dithered. The random numbers are those of the standard, so that writer and
//! reader have the same.
//!
//! # Reference
//! FITS Standard 4.0 (2018), sect. 10.2 and appendix I. S. K. Park and K. W. Miller 1988,
//! Communications of the ACM 31, 1192.

use std::sync::LazyLock;

/// How floats were made whole numbers (ZQUANTIZ).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Dither {
    /// Rounded.
    None,
    /// With a random number; `seed` (ZDITHER0) says which of them the first tile begins with.
    Subtractive { seed: i64, keeps_zero: bool },
}

/// One quantized tile.
#[derive(Debug, Clone, Copy)]
pub(super) struct Quantized {
    pub scale: f64,
    pub zero: f64,
    /// The whole number of pixels without a value.
    pub blank: Option<i64>,
    pub dither: Dither,
}

/// Number of random numbers.
const RANDOM: usize = 10_000;
/// The whole number for pixels of exactly 0, where they are kept.
const EXACT_ZERO: i32 = -2_147_483_646;

/// The random numbers, between 0 and 1.
static RANDOM_NUMBERS: LazyLock<Vec<f32>> = LazyLock::new(|| {
    const FACTOR: u64 = 16_807;
    const MODULUS: u64 = (1 << 31) - 1;
    let mut state = 1;
    let mut next = || {
        state = state * FACTOR % MODULUS;
        (state as f64 / MODULUS as f64) as f32
    };
    (0..RANDOM).map(|_| next()).collect()
});

impl Quantized {
    /// The floats of `numbers`, the pixels of the tile in row `row` of the table, from 0.
    pub fn floats(&self, numbers: &[i32], row: usize) -> impl Iterator<Item = f64> {
        let (seed, keeps_zero) = match self.dither {
            Dither::None => (None, false),
            Dither::Subtractive { seed, keeps_zero } => (Some(seed), keeps_zero),
        };
        let mut random = seed.map(|seed| RandomNumbers::of_tile(row, seed));
        numbers.iter().map(move |&number| {
            let dither = random.as_mut().map(RandomNumbers::next);
            match number {
                _ if Some(number.into()) == self.blank => f64::NAN,
                EXACT_ZERO if keeps_zero => 0.0,
                // The order of these operations decides the last bit.
                _ => {
                    let exact = match dither {
                        Some(dither) => f64::from(number) - f64::from(dither) + 0.5,
                        None => number.into(),
                    };
                    exact * self.scale + self.zero
                }
            }
        })
    }
}

/// The random numbers of one tile.
struct RandomNumbers {
    /// Which number decides where the next run begins.
    start: usize,
    next: usize,
}

impl RandomNumbers {
    fn of_tile(row: usize, seed: i64) -> Self {
        let start = (row as i64).wrapping_add(seed).wrapping_sub(1);
        let start = start.rem_euclid(RANDOM as i64) as usize;
        let next = Self::first_of_run(start);
        Self { start, next }
    }

    /// Runs of random numbers begin in the first 500.
    fn first_of_run(start: usize) -> usize {
        (f64::from(RANDOM_NUMBERS[start]) * 500.0) as usize
    }

    fn next(&mut self) -> f32 {
        let number = RANDOM_NUMBERS[self.next];
        self.next += 1;
        if self.next == RANDOM {
            self.start = (self.start + 1) % RANDOM;
            self.next = Self::first_of_run(self.start);
        }
        number
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_random_numbers_are_those_of_the_standard() {
        // The state after the last of them, from appendix I.
        const LAST: f64 = 1_043_618_065.0;
        let last = RANDOM_NUMBERS[RANDOM - 1];
        assert_eq!(last, (LAST / 2_147_483_647.0) as f32);
        assert_eq!(RANDOM_NUMBERS[0], (16_807.0 / 2_147_483_647.0) as f32);
    }

    #[test]
    fn blanks_and_exact_zeros_are_kept() {
        let numbers = [-5, EXACT_ZERO, 3];
        let mut tile = Quantized {
            scale: 2.0,
            zero: 10.0,
            blank: Some(-5),
            dither: Dither::None,
        };
        let floats: Vec<f64> = tile.floats(&numbers, 0).collect();
        assert!(floats[0].is_nan());
        assert_eq!(floats[1..], [2.0 * f64::from(EXACT_ZERO) + 10.0, 16.0]);
        tile.dither = Dither::Subtractive {
            seed: 1,
            keeps_zero: true,
        };
        let floats: Vec<f64> = tile.floats(&numbers, 0).collect();
        assert!(floats[0].is_nan() && floats[1] == 0.0);
        assert!((floats[2] - 16.0).abs() <= 1.0);
    }

    #[test]
    fn any_seed_and_any_length_have_random_numbers() {
        for seed in [i64::MIN, -1, 0, 1, 10_000, i64::MAX] {
            let mut random = RandomNumbers::of_tile(7, seed);
            assert!((0..30_000).all(|_| (0.0..1.0).contains(&random.next())));
        }
    }
}
