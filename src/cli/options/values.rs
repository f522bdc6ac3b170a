//! Parsers of option values, which refuse values out of range.

use starpipe::base::angle::{declination_deg, right_ascension_deg};
use std::fmt::Display;

/// Largest side of a frame, in pixels.
pub(crate) const MAX_SIDE_PX: i64 = 1_000_000;

/// A number; neither NaN nor infinite.
pub(crate) fn finite(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err(format!("'{text}' is not a number")),
    }
}

fn within(
    text: &str,
    what: impl Display,
    accepts: impl Fn(f64) -> bool,
    limits: &str,
) -> Result<f64, String> {
    let value = finite(text)?;
    if accepts(value) {
        Ok(value)
    } else {
        Err(format!("{what} must be {limits}"))
    }
}

/// A number above zero.
pub(crate) fn positive(text: &str) -> Result<f64, String> {
    within(text, "the number", |v| v > 0.0, "above 0")
}

/// A number of zero or above.
pub(crate) fn not_negative(text: &str) -> Result<f64, String> {
    within(text, "the number", |v| v >= 0.0, "0 or above")
}

/// A number above zero and at most one.
pub(crate) fn share(text: &str) -> Result<f64, String> {
    within(
        text,
        "the fraction",
        |v| v > 0.0 && v <= 1.0,
        "above 0 and at most 1",
    )
}

/// A right ascension: degrees, or hours, minutes and seconds. In degrees.
pub(crate) fn right_ascension(text: &str) -> Result<f64, &'static str> {
    const RANGE: &str = "the right ascension must be from 0 to 360 degrees, or from 0 to 24 hours";
    right_ascension_deg(text).ok_or(RANGE)
}

/// A declination: degrees, or degrees, minutes and seconds. In degrees.
pub(crate) fn declination(text: &str) -> Result<f64, &'static str> {
    declination_deg(text).ok_or("the declination must be from -90 to 90 degrees")
}

/// A mean number of stars.
pub(crate) fn star_count(text: &str) -> Result<f64, String> {
    let limits = "above 0 and at most 10000";
    within(text, "the number of stars", |v| v > 0.0 && v <= 1e4, limits)
}

/// A part of something, in percent.
pub(crate) fn part(text: &str) -> Result<f64, String> {
    let limits = "0 to 100 percent";
    within(
        text,
        "the percentage",
        |v| (0.0..=100.0).contains(&v),
        limits,
    )
}

/// A multiple of something, in percent.
pub(crate) fn multiple(text: &str) -> Result<f64, String> {
    let limits = "0 to 10000 percent";
    within(text, "the percentage", |v| (0.0..=1e4).contains(&v), limits)
}

/// A horizontal field of view in degrees.
pub(crate) fn field_of_view(text: &str) -> Result<f64, String> {
    within(
        text,
        "the field of view",
        |v| v > 0.0 && v < 180.0,
        "above 0 and below 180 degrees",
    )
}

/// An exposure in seconds.
pub(crate) fn exposure(text: &str) -> Result<f64, String> {
    let limits = "from 0.000001 to 1000000 s";
    within(text, "the exposure", |v| (1e-6..=1e6).contains(&v), limits)
}

/// A relative error in percent.
pub(crate) fn percent(text: &str) -> Result<f64, String> {
    within(
        text,
        "the error of the scale",
        |v| v > 0.0 && v < 100.0,
        "above 0 and below 100 percent",
    )
}

pub(crate) fn not_of_form(text: &str, form: &str) -> String {
    format!("'{text}' is not of the form {form}")
}

pub(crate) fn whole(text: &str) -> Result<usize, String> {
    let count = text.trim().parse();
    count.map_err(|_| format!("'{text}' is not a whole number"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nan_infinity_and_words_are_refused() {
        assert_eq!(finite(" -1.5 "), Ok(-1.5));
        for text in ["NaN", "inf", "-inf", "", "ten", "1,5"] {
            assert!(finite(text).is_err(), "{text}");
        }
    }

    #[test]
    fn values_out_of_range_are_refused() {
        assert!(field_of_view("180").is_err() && field_of_view("0").is_err());
        assert!(percent("100").is_err() && percent("10").is_ok());
        assert!(right_ascension("361").is_err() && declination("91").is_err());
        assert!(positive("0").is_err());
    }
}
