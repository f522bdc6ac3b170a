//! When does a series leave what is usual, and when does it come back?
//!
//! Usual is the median of the lowest third of the values. The noise is that of the differences of
//! neighbors, which slow changes hardly add to. The series departs where three values in a row are above
//! the usual by more than four standard deviations and by a least step, and returns where three in a row
//! are not. It began to depart where it came above a third of that.
//!
//! The median of the lowest third is 0.97 standard deviations below the middle of a series of normal noise.
//! So such a series departs with a probability of (1 − Φ(3.03))³ = 2 × 10⁻⁹ at each frame, or 4 × 10⁻⁶ in
//! a night of 2000 frames. Noise that is alike in neighbors departs more often: the least step is there
//! for that.

use crate::base::statistics::{SIGMA_PER_MAD, median};

/// Values in a row.
const IN_A_ROW: usize = 3;
/// Standard deviations above the usual.
const SIGMAS: f64 = 4.0;

/// Part of the way to the limit at which a change begins or ends.
const BEGUN: f64 = 1.0 / 3.0;

/// A part of a series that is not usual.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct DetectedChange {
    /// First value of it.
    pub start: usize,
    /// First value after it; `None` if the series ends with it.
    pub end: Option<usize>,
}

/// Where `values` depart by `least_step` or more. Values that are not known are passed over.
pub(super) fn find_changes(values: &[Option<f64>], least_step: f64) -> Vec<DetectedChange> {
    let known = values.iter().enumerate();
    let known: Vec<(usize, f64)> = known
        .filter_map(|(at, value)| Some((at, (*value)?)))
        .collect();
    let Some([usual, limit]) = bounds(&known, least_step) else {
        return Vec::new();
    };
    let is_begun = |value: f64| value > usual + BEGUN * (limit - usual);
    let mut found: Vec<DetectedChange> = Vec::new();
    let mut is_away = false;
    for (at, window) in known.windows(IN_A_ROW).enumerate() {
        if !is_away && window.iter().all(|(_, value)| *value > limit) {
            let begun = known[..at].iter().rev();
            let before = found.last().and_then(|last| last.end).unwrap_or(0);
            let begun = begun.take_while(|(start, value)| *start > before && is_begun(*value));
            let begun = begun.last();
            let start = begun.unwrap_or(&window[0]).0;
            found.push(DetectedChange { start, end: None });
            is_away = true;
        } else if is_away && window.iter().all(|(_, value)| *value <= limit) {
            let over = window.iter().find(|(_, value)| !is_begun(*value));
            if let Some(last) = found.last_mut() {
                last.end = Some(over.unwrap_or(&window[0]).0);
            }
            is_away = false;
        }
    }
    found
}

/// What is usual of a series, and the value above which it is not.
fn bounds(known: &[(usize, f64)], least_step: f64) -> Option<[f64; 2]> {
    /// Standard deviation over the median size of a difference of two.
    const PER_DIFFERENCE: f64 = SIGMA_PER_MAD / std::f64::consts::SQRT_2;
    if known.len() < 2 * IN_A_ROW {
        return None;
    }
    let mut values: Vec<f64> = known.iter().map(|(_, value)| *value).collect();
    let steps = values.windows(2).map(|pair| (pair[1] - pair[0]).abs());
    let sigma = PER_DIFFERENCE * median(&mut steps.collect::<Vec<_>>());
    values.sort_unstable_by(f64::total_cmp);
    let lowest = values.len().div_ceil(3);
    let usual = median(&mut values[..lowest]);
    Some([usual, usual + (SIGMAS * sigma).max(least_step)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn some(values: &[f64]) -> Vec<Option<f64>> {
        values.iter().copied().map(Some).collect()
    }

    #[test]
    fn a_step_up_and_down_is_found_where_it_is() {
        let mut values = some(&[0.1, 0.0, 0.1, 0.0, 0.1, 0.0, 0.1, 0.0, 0.1, 0.1]);
        values.extend(some(&[2.0, 2.1, 2.0, 2.2]));
        values.push(None);
        values.extend(some(&[0.0, 0.1, 0.0, 0.1]));
        let expected = DetectedChange {
            start: 10,
            end: Some(15),
        };
        assert_eq!(find_changes(&values, 0.2), [expected]);
    }

    #[test]
    fn single_values_are_none() {
        let mut values = vec![Some(0.0); 30];
        values[7] = Some(9.0);
        values[20] = Some(9.0);
        values[21] = Some(9.0);
        assert!(find_changes(&values, 0.2).is_empty());
        assert!(find_changes(&[], 0.2).is_empty());
    }

    #[test]
    fn noise_does_not_depart() {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        for _ in 0..200 {
            // The sum of 12 is as good as normal.
            let noise = |_| Some((0..12).map(|_| random.random_range(-0.5..0.5)).sum());
            let values: Vec<Option<f64>> = (0..300).map(noise).collect();
            assert!(find_changes(&values, 0.0).is_empty());
        }
    }
}
