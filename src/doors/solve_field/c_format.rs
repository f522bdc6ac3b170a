//! Numbers as C writes them.

/// A number as `%g` has it: six digits, without zeros at the end.
///
/// # Reference
/// ISO/IEC 9899:2018, 7.21.6.1.
pub(super) fn general(value: f64) -> String {
    const DIGITS: i32 = 6;
    if !value.is_finite() {
        return format!("{value}").to_lowercase();
    }
    let rounded = format!("{value:.5e}");
    let (mantissa, exponent) = rounded.split_once('e').unwrap_or((&rounded, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    if (-4..DIGITS).contains(&exponent) {
        let decimals = usize::try_from(DIGITS - 1 - exponent).unwrap_or(0);
        return without_zeros(&format!("{value:.decimals$}")).to_owned();
    }
    let sign = if exponent < 0 { '-' } else { '+' };
    format!("{}e{sign}{:02}", without_zeros(mantissa), exponent.abs())
}

fn without_zeros(number: &str) -> &str {
    match number.contains('.') {
        true => number.trim_end_matches('0').trim_end_matches('.'),
        false => number,
    }
}

/// `value` units in parts of sixty, with thousandths of the smallest: `07:36:32.044`.
pub(super) fn sexagesimal(value: f64) -> String {
    let thousandths = (value * 3_600_000.0).round() as u64;
    let (seconds, thousandths) = (thousandths / 1000, thousandths % 1000);
    let (minutes, seconds) = (seconds / 60, seconds % 60);
    let (hours, minutes) = (minutes / 60, minutes % 60);
    format!("{hours:02}:{minutes:02}:{seconds:02}.{thousandths:03}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_those_of_printf() {
        // As printf of GNU coreutils 9.1 writes them.
        for (value, expected) in [
            (0.0, "0"),
            (28.9649, "28.9649"),
            (11.423_456_7, "11.4235"),
            (-179.999_999_9, "-180"),
            (100_000.0, "100000"),
            (999_999.5, "1e+06"),
            (1_234_567.0, "1.23457e+06"),
            (0.000_123_456_78, "0.000123457"),
            (-0.000_012_3, "-1.23e-05"),
            (1.05343e44, "1.05343e+44"),
            (f64::INFINITY, "inf"),
        ] {
            assert_eq!(general(value), expected);
        }
    }

    #[test]
    fn angles_are_rounded_as_a_whole() {
        assert_eq!(sexagesimal(114.133_515 / 15.0), "07:36:32.044");
        assert_eq!(sexagesimal(1.0 - 1e-9), "01:00:00.000");
    }
}
