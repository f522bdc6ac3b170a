//! The exponential function of several numbers at once.

/// e to the power of each of `exponents`, which must not be positive, to a few units in the last
/// place; 0 below −708. Without branches and calls, so that a loop over it runs in vector registers.
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
}
