//! The exponential function of negative numbers, without branches and calls: loops over it run in
//! vector registers.

/// e to the power of each of `exponents`, which must not be positive, to a few units in the last
/// place; 0 below −708.
#[inline(always)]
pub fn exp_of_negative<const N: usize>(exponents: [f64; N]) -> [f64; N] {
    /// Below it, the result would be subnormal.
    const LOWEST: f64 = -708.0;
    /// Adding it rounds to a whole number, which is then in the lowest bits.
    const ROUNDING: f64 = 1.5 * (1u64 << 52) as f64;
    const EXPONENT_BIAS: u64 = 1023;
    const MANTISSA_BITS: u32 = 52;
    /// ln 2 in two parts: the first has few digits, so that its multiples are exact.
    const LN_2: [f64; 2] = [
        f64::from_bits(0x3fe6_2e42_fee0_0000),
        f64::from_bits(0x3dea_39ef_3579_3c76),
    ];
    let mut results = [0.0; N];
    for (result, exponent) in results.iter_mut().zip(exponents) {
        let clamped = exponent.max(LOWEST);
        let rounded = clamped * std::f64::consts::LOG2_E + ROUNDING;
        let power = rounded - ROUNDING;
        let rest = clamped - power * LN_2[0] - power * LN_2[1];
        let mut series = TAYLOR[TAYLOR.len() - 1];
        for coefficient in TAYLOR[..TAYLOR.len() - 1].iter().rev() {
            series = series * rest + coefficient;
        }
        let bits = rounded.to_bits().wrapping_add(EXPONENT_BIAS) << MANTISSA_BITS;
        let value = series * f64::from_bits(bits);
        *result = if exponent < LOWEST { 0.0 } else { value };
    }
    results
}

/// 1 / n!: beyond the last term, the series is exact for exponents up to ln 2 / 2.
const TAYLOR: [f64; 14] = {
    let mut coefficients = [1.0; 14];
    let mut n = 1;
    while n < coefficients.len() {
        coefficients[n] = coefficients[n - 1] / n as f64;
        n += 1;
    }
    coefficients
};

/// Smallest argument of [`rough_exp_of_negative`].
pub const MIN_EXPONENT: f64 = -700.0;

/// `exp(x)` for −700 ≤ x ≤ 0, to a relative 1e-10: 2ⁿ times the series of the remainder.
#[inline(always)]
pub fn rough_exp_of_negative(x: f64) -> f64 {
    /// Added to a number, leaves the nearest integer in the lowest bits of the sum.
    const ROUNDER: f64 = 6_755_399_441_055_744.0;
    const EXPONENT_BITS: u32 = 52;
    const EXPONENT_BIAS: u64 = 1023;
    /// 1/n!, from n = 9 down to 0: |rest| ≤ ln 2 / 2, so the next term is below 1e-11.
    const SERIES: [f64; 10] = [
        1.0 / 362_880.0,
        1.0 / 40_320.0,
        1.0 / 5_040.0,
        1.0 / 720.0,
        1.0 / 120.0,
        1.0 / 24.0,
        1.0 / 6.0,
        0.5,
        1.0,
        1.0,
    ];
    let shifted = x * std::f64::consts::LOG2_E + ROUNDER;
    let power = shifted - ROUNDER;
    let rest = x - power * std::f64::consts::LN_2;
    let mut sum = 0.0;
    for term in SERIES {
        sum = sum * rest + term;
    }
    let bits = (shifted.to_bits() << EXPONENT_BITS).wrapping_add(EXPONENT_BIAS << EXPONENT_BITS);
    sum * f64::from_bits(bits)
}

/// [`rough_exp_of_negative`] in single precision, for −80 ≤ x ≤ 0, to a relative 2e-6.
#[inline(always)]
pub fn rough_exp_of_negative_f32(x: f32) -> f32 {
    const ROUNDER: f32 = 12_582_912.0;
    const FRACTION_BITS: u32 = 23;
    const EXPONENT_BIAS: u32 = 127;
    /// 1/n!, from n = 6 down to 0: the next term is below 2e-7.
    const SERIES: [f32; 7] = [
        1.0 / 720.0,
        1.0 / 120.0,
        1.0 / 24.0,
        1.0 / 6.0,
        0.5,
        1.0,
        1.0,
    ];
    let shifted = x * std::f32::consts::LOG2_E + ROUNDER;
    let power = shifted - ROUNDER;
    let rest = x - power * std::f32::consts::LN_2;
    let mut sum = 0.0;
    for term in SERIES {
        sum = sum * rest + term;
    }
    let bits = (shifted.to_bits() << FRACTION_BITS).wrapping_add(EXPONENT_BIAS << FRACTION_BITS);
    sum * f32::from_bits(bits)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_exponential() {
        for step in 0..70_000 {
            let exponent = -0.01 * f64::from(step);
            let [found] = exp_of_negative([exponent]);
            let error = (found / libm::exp(exponent) - 1.0).abs();
            assert!(error < 8.0 * f64::EPSILON, "{exponent} {error}");
        }
    }

    #[test]
    fn it_is_one_at_zero_and_vanishes_far_below() {
        let found = exp_of_negative([0.0, -708.1, -1e9, f64::NEG_INFINITY]);
        assert_eq!(found, [1.0, 0.0, 0.0, 0.0]);
    }

    #[test]
    fn the_rough_one_agrees_with_the_standard_library() {
        for i in 0..=2500 {
            let x = -0.01 * f64::from(i);
            assert!(
                (rough_exp_of_negative(x) / x.exp() - 1.0).abs() < 1e-10,
                "{x}"
            );
        }
    }
}
