//! Parses angles, decimal or sexagesimal: text → [`Angle`].

/// A parsed angle, with the form in which it was written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Angle {
    /// A decimal number without a unit.
    Decimal(f64),
    /// Sexagesimal without a unit (`05:34:48.0`, `-00 24 00`): hours or degrees.
    Sexagesimal(f64),
    /// Sexagesimal hours (`05h34m48.0s`).
    Hours(f64),
    /// Sexagesimal degrees (`-00d24m00s`, `-00°24′00″`).
    Degrees(f64),
}

/// The unit marks allowed after the first, second and third number.
const MARKS: [&[char]; 3] = [
    &['h', 'd', '°', 'H', 'D'],
    &['m', '\'', '′', 'M'],
    &['s', '"', '″', 'S'],
];

impl Angle {
    /// The value in degrees, which are assumed where no unit is given; `None` for hours.
    pub fn in_degrees(self) -> Option<f64> {
        match self {
            Self::Decimal(value) | Self::Sexagesimal(value) | Self::Degrees(value) => Some(value),
            Self::Hours(_) => None,
        }
    }

    /// Parses `text`; `None` if it is no angle, or its minutes or seconds reach 60.
    pub fn parse(text: &str) -> Option<Self> {
        let text = text.trim();
        if let Some(number) = decimal(text) {
            return Some(Self::Decimal(number));
        }
        let (negative, mut rest) = match text.strip_prefix(['-', '−']) {
            Some(rest) => (true, rest.trim_start()),
            None => (false, text.strip_prefix('+').unwrap_or(text).trim_start()),
        };
        let mut value = 0.0;
        let mut unit = None;
        let mut whole = true;
        for (marks, seconds) in MARKS.into_iter().zip([3600.0, 60.0, 1.0]) {
            let end = rest.find(|c: char| !(c.is_ascii_digit() || c == '.'));
            let (number, behind) = rest.split_at(end.unwrap_or(rest.len()));
            let part = decimal(number)?;
            // Only the last number may have decimals, and only the first may reach 60.
            if !whole || (seconds < 3600.0 && part >= 60.0) {
                return None;
            }
            whole = !number.contains('.');
            value += part * seconds;
            let behind = behind.trim_start();
            let mark = behind.chars().next().filter(|c| marks.contains(c));
            if seconds == 3600.0 {
                unit = mark;
            }
            rest = match (mark, behind.strip_prefix(':')) {
                (Some(mark), _) => behind[mark.len_utf8()..].trim_start(),
                (None, Some(behind)) if seconds > 1.0 && !behind.is_empty() => behind.trim_start(),
                (None, _) => behind,
            };
            if rest.is_empty() {
                break;
            }
        }
        if !rest.is_empty() {
            return None;
        }
        let value = if negative { -value } else { value } / 3600.0;
        Some(match unit {
            None => Self::Sexagesimal(value),
            Some('h' | 'H') => Self::Hours(value),
            Some(_) => Self::Degrees(value),
        })
    }
}

/// A right ascension in degrees, written in degrees, or in hours, minutes and seconds; `None` where it is
/// more than a turn, or none.
pub fn right_ascension_deg(text: &str) -> Option<f64> {
    const DEG_PER_HOUR: f64 = 15.0;
    let deg = match Angle::parse(text)? {
        Angle::Hours(hours) | Angle::Sexagesimal(hours) => hours * DEG_PER_HOUR,
        Angle::Decimal(deg) | Angle::Degrees(deg) => deg,
    };
    (0.0..=360.0).contains(&deg).then_some(deg)
}

/// A declination in degrees, written in degrees, or in degrees, minutes and seconds; `None` where it is
/// beyond a pole, or none.
pub fn declination_deg(text: &str) -> Option<f64> {
    let deg = Angle::parse(text)?.in_degrees()?;
    (-90.0..=90.0).contains(&deg).then_some(deg)
}

/// Parses a finite decimal number; unlike `str::parse`, rejects words such as `inf`.
pub fn decimal(text: &str) -> Option<f64> {
    let plain = text
        .bytes()
        .all(|byte| byte.is_ascii_digit() || b"+-.eE".contains(&byte));
    let number: f64 = plain.then(|| text.parse().ok())??;
    number.is_finite().then_some(number)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn all_common_notations_are_parsed() {
        let hours = 5.0 + 34.0 / 60.0 + 48.0 / 3600.0;
        for text in [
            "05:34:48.0",
            "05 34 48.0",
            " 5 34 48",
            "5:34:48.",
            "+05 34 48",
            "5 : 34 : 48",
        ] {
            assert_eq!(
                Angle::parse(text),
                Some(Angle::Sexagesimal(hours)),
                "{text}"
            );
        }
        for text in ["05h34m48.0s", "5h 34m 48s", "5H34M48S", "5h34m48"] {
            assert_eq!(Angle::parse(text), Some(Angle::Hours(hours)), "{text}");
        }
        for text in ["-00 24 00.0", "-0:24", "−00:24:00", "- 0 24 0"] {
            assert_eq!(Angle::parse(text), Some(Angle::Sexagesimal(-0.4)), "{text}");
        }
        for text in ["-00°24′00″", "-0d24m", "-00d 24' 00\""] {
            assert_eq!(Angle::parse(text), Some(Angle::Degrees(-0.4)), "{text}");
        }
        assert_eq!(Angle::parse("8.37e1"), Some(Angle::Decimal(83.7)));
        assert_eq!(Angle::parse("-0.4"), Some(Angle::Decimal(-0.4)));
    }

    #[test]
    fn other_text_is_rejected() {
        for text in [
            "",
            "-",
            "x",
            "nan",
            "inf",
            "5:60:00",
            "5 34 60",
            "5:34.5:10",
            "5 -34 10",
            "5:34:",
            "5h34s",
            "1 2 3 4",
            "5:34:48x",
            "5m",
            "0x10",
            "5::34",
            "1.2.3",
        ] {
            assert_eq!(Angle::parse(text), None, "{text}");
        }
    }

    proptest! {
        #[test]
        fn sexagesimal_text_round_trips(
            steps in 0..359_u64 * 3_600_000,
            south in any::<bool>(),
        ) {
            let (whole, minutes, ms) = (steps / 3_600_000, steps / 60_000 % 60, steps % 60_000);
            let sign = if south { "-" } else { "" };
            let seconds = format!("{:02}.{:03}", ms / 1000, ms % 1000);
            let expected = if south { -1.0 } else { 1.0 } * steps as f64 / 3_600_000.0;
            let value_of = |text: String, form: fn(f64) -> Angle| {
                let found = Angle::parse(&text).unwrap();
                let (Angle::Decimal(value)
                | Angle::Sexagesimal(value)
                | Angle::Hours(value)
                | Angle::Degrees(value)) = found;
                assert_eq!(form(value), found);
                value
            };
            for value in [
                value_of(format!("{sign}{whole:02}:{minutes:02}:{seconds}"), Angle::Sexagesimal),
                value_of(format!("{sign}{whole} {minutes} {seconds}"), Angle::Sexagesimal),
                value_of(format!("{sign}{whole}h{minutes}m{seconds}s"), Angle::Hours),
                value_of(format!("{sign}{whole}°{minutes}′{seconds}″"), Angle::Degrees),
            ] {
                prop_assert!((value - expected).abs() < 1e-12, "{}", value);
            }
        }

        #[test]
        fn no_text_panics(text in "\\PC{0,20}", similar in "[-+0-9:hdms°'\". ]{0,16}") {
            let _ = (Angle::parse(&text), Angle::parse(&similar));
        }
    }
}
