//! Numbers within texts as print has them.

/// `text` with the minus signs and the powers of ten of print: `-2e-7` is `−2×10⁻⁷`. Hyphens of words and dates
/// stay.
pub(super) fn typeset(text: &str) -> String {
    let mut set = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(character) = rest.chars().next() {
        let after = &rest[character.len_utf8()..];
        let is_number = after.starts_with(|next: char| next.is_ascii_digit());
        let follows = |is: fn(char) -> bool| set.ends_with(is);
        if character == 'e' && follows(|before| before.is_ascii_digit()) {
            let end = after.find(|c: char| c != '-' && !c.is_ascii_digit());
            let (exponent, remainder) = after.split_at(end.unwrap_or(after.len()));
            if let Ok(exponent) = exponent.parse() {
                set.push('×');
                set.push_str(&power_of_ten(exponent));
                rest = remainder;
                continue;
            }
        }
        let is_minus = character == '-' && is_number && !follows(char::is_alphanumeric);
        set.push(if is_minus { '−' } else { character });
        rest = after;
    }
    set
}

/// `10⁻³`
pub(super) fn power_of_ten(exponent: i32) -> String {
    let raised = |character| match character {
        '-' => '⁻',
        digit => ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'][digit as usize - '0' as usize],
    };
    let digits: String = exponent.to_string().chars().map(raised).collect();
    format!("10{digits}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_those_of_print() {
        for (text, shown) in [
            ("-2e-7", "−2×10⁻⁷"),
            (
                "noise 1.5e12 e, mean -0.3 (-6°)",
                "noise 1.5×10¹² e, mean −0.3 (−6°)",
            ),
            ("2026-01-15 f-3 1e- 10e", "2026-01-15 f-3 1e- 10e"),
        ] {
            assert_eq!(typeset(text), shown);
        }
    }
}
