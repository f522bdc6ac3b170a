//! Numbers of any magnitude as short text.

/// `value` with five significant digits, without trailing zeros: `8.1504`, `21000`; below 1e-3 and
/// from 1e6 in scientific notation: `2.7883e-9`.
pub fn five_digits(value: f64) -> String {
    let size = value.abs();
    if value != 0.0 && !(1e-3..1e6).contains(&size) {
        let text = format!("{value:.4e}");
        return match text.split_once('e') {
            Some((digits, exponent)) => format!("{}e{exponent}", trimmed(digits)),
            None => text,
        };
    }
    let decimals = (4.0 - libm::log10(size.max(1e-3)).floor()).max(0.0) as usize;
    trimmed(&format!("{value:.decimals$}")).to_owned()
}

/// A decimal number without trailing zeros.
fn trimmed(text: &str) -> &str {
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.')
    } else {
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_has_five_digits() {
        for (value, expected) in [
            (0.0, "0"),
            (0.1, "0.1"),
            (8.150_432, "8.1504"),
            (336.810_9, "336.81"),
            (21_000.0, "21000"),
            (999_999.9, "1000000"),
            (2.788_281e-9, "2.7883e-9"),
            (5e10, "5e10"),
            (-12.345_678, "-12.346"),
        ] {
            assert_eq!(five_digits(value), expected);
        }
    }
}
