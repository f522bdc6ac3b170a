//! Rounds numbers for output, to decimals or significant digits.

/// Rounds `value` to `decimals` places; −0 becomes 0.
pub(crate) fn to_decimals(value: f64, decimals: i32) -> f64 {
    let scale = 10_f64.powi(decimals);
    let rounded = (value * scale).round() / scale;
    // The product overflowed: `value` has no fraction to round.
    if rounded.is_finite() {
        rounded + 0.0
    } else {
        value
    }
}

/// Rounds `value` to `digits` significant digits.
pub(crate) fn to_significant(value: f64, digits: i32) -> f64 {
    if value == 0.0 || !value.is_finite() {
        return value;
    }
    // Dividing by a power of ten is exact where multiplying by its inverse is not.
    let decimals = digits - 1 - libm::log10(value.abs()).floor() as i32;
    if decimals >= 0 {
        to_decimals(value, decimals)
    } else {
        let scale = 10_f64.powi(-decimals);
        (value / scale).round() * scale
    }
}

/// [`to_decimals`]; `None` for NaN and infinities.
pub(crate) fn finite(value: f64, decimals: i32) -> Option<f64> {
    value.is_finite().then(|| to_decimals(value, decimals))
}

/// [`to_significant`]; `None` for NaN and infinities.
pub(crate) fn significant(value: f64, digits: i32) -> Option<f64> {
    value.is_finite().then(|| to_significant(value, digits))
}

/// An angle in degrees to `decimals` places, in [0, 360) after rounding.
pub(crate) fn turn_deg(angle_deg: f64, decimals: i32) -> f64 {
    let rounded = to_decimals(angle_deg.rem_euclid(360.0), decimals);
    if rounded >= 360.0 { 0.0 } else { rounded }
}

/// An angle in degrees to `decimals` places, in (−180, 180] after rounding.
pub(crate) fn half_turn_deg(angle_deg: f64, decimals: i32) -> f64 {
    let turn = turn_deg(angle_deg, decimals);
    if turn > 180.0 {
        to_decimals(turn - 360.0, decimals)
    } else {
        turn
    }
}

/// The decimals that show two significant digits of the standard error `sigma`, at most `most`.
pub(crate) fn decimals_for(sigma: f64, most: usize) -> usize {
    if !(sigma > 0.0 && sigma.is_finite()) {
        return most;
    }
    let wanted = 1.0 - libm::log10(sigma).floor();
    wanted.clamp(0.0, most as f64) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_stay_in_their_range_after_rounding() {
        assert_eq!(turn_deg(359.999_999_99, 6), 0.0);
        assert_eq!(turn_deg(-1e-12, 6), 0.0);
        assert_eq!(half_turn_deg(-179.999_999_99, 6), 180.0);
        assert_eq!(half_turn_deg(-170.5, 6), -170.5);
        assert_eq!(half_turn_deg(180.0, 6), 180.0);
    }

    #[test]
    fn significant_digits_hold_for_large_and_small_numbers() {
        assert_eq!(to_significant(123_456.789, 4), 123_500.0);
        assert_eq!(to_significant(0.001_234_56, 3), 0.001_23);
        assert_eq!(to_significant(0.0, 3), 0.0);
        assert_eq!(to_significant(9.999_9, 3), 10.0);
    }

    #[test]
    fn nan_and_infinities_are_none() {
        assert_eq!(finite(f64::NAN, 3), None);
        assert_eq!(finite(f64::INFINITY, 3), None);
        assert_eq!(finite(-0.000_01, 3), Some(0.0));
        assert!(finite(-0.000_01, 3).is_some_and(f64::is_sign_positive));
        assert_eq!(finite(1e300, 10), Some(1e300));
        assert_eq!(significant(f64::NAN, 3), None);
    }

    #[test]
    fn decimals_show_two_digits_of_the_error() {
        assert_eq!(decimals_for(0.0012, 9), 4);
        assert_eq!(decimals_for(3.4, 9), 1);
        assert_eq!(decimals_for(34.0, 9), 0);
        assert_eq!(decimals_for(1e-30, 7), 7);
        assert_eq!(decimals_for(f64::NAN, 3), 3);
    }
}
