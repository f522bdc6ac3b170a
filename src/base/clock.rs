//! Clocks: what a time in a file is ahead of UTC.

use super::epoch::ObservationDate;
use jiff::SignedDuration;
use serde::{Serialize, Serializer};
use std::path::Path;
use std::str::FromStr;

const S_PER_HOUR: f64 = 3600.0;
/// No zone is further from UTC, in hours.
const MAX_OFFSET_H: f64 = 14.0;

/// A date as a clock showed it, and what the clock was ahead of UTC where that is stated beside it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ClockDate {
    /// What the clock showed.
    pub shown: ObservationDate,
    /// By how much it was ahead of UTC; `None` where nothing says so.
    pub ahead: Option<SignedDuration>,
}

impl ClockDate {
    /// The date in a file's name, see [`ObservationDate::in_file_name`]. A time is that of a local clock
    /// unless `Z` or an offset such as `+02:00` follows it.
    pub fn in_file_name(path: &Path) -> Option<Self> {
        let (shown, rest) = ObservationDate::found_in_name(path)?;
        Some(Self {
            shown,
            ahead: stated_offset(&rest).filter(|_| shown.has_time()),
        })
    }

    /// A date of which nothing says what it is ahead of UTC.
    pub fn local(shown: ObservationDate) -> Self {
        Self { shown, ahead: None }
    }

    /// The date in UTC where the clock is this far ahead; `None` outside the years that are accepted.
    pub fn minus(&self, ahead: SignedDuration) -> Option<ObservationDate> {
        self.shown.earlier_by(ahead)
    }
}

/// The offset at the start of what follows a time: `Z`, `+02:00`, `+0200` or `-05:00`. A minus sign and
/// digits alone number a frame.
fn stated_offset(text: &str) -> Option<SignedDuration> {
    let digits = |text: &str| text.bytes().take_while(u8::is_ascii_digit).count();
    let text = match text.strip_prefix('.') {
        Some(fraction) if digits(fraction) > 0 => &fraction[digits(fraction)..],
        _ => text,
    };
    let next = |at: usize| text.as_bytes().get(at).copied();
    match next(0)? {
        b'Z' | b'z' if !next(1).is_some_and(|c| c.is_ascii_alphanumeric()) => {
            Some(SignedDuration::ZERO)
        }
        sign @ (b'+' | b'-') => {
            let has_colon = next(3) == Some(b':');
            let minutes = if has_colon {
                text.get(4..6)?
            } else {
                text.get(3..5)?
            };
            let is_plain = digits(text.get(1..3)?) == 2 && digits(minutes) == 2;
            let hours: f64 = text.get(1..3)?.parse().ok()?;
            let hours = hours + minutes.parse::<f64>().ok()? / 60.0;
            let is_offset = is_plain && hours <= MAX_OFFSET_H && (sign == b'+' || has_colon);
            let ends = !next(if has_colon { 6 } else { 5 }).is_some_and(|c| c.is_ascii_digit());
            (is_offset && ends).then(|| of_hours(if sign == b'-' { -hours } else { hours }))
        }
        _ => None,
    }
}

/// A duration of so many hours, to the second.
pub fn of_hours(hours: f64) -> SignedDuration {
    SignedDuration::from_secs((hours * S_PER_HOUR).round() as i64)
}

/// A duration in hours.
pub fn hours_of(duration: SignedDuration) -> f64 {
    duration.as_secs_f64() / S_PER_HOUR
}

/// What local times in names of files and in Exif are ahead of UTC.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum UtcOffset {
    /// As much as is stated.
    Ahead(SignedDuration),
    /// As much as the stars over the site show.
    Auto,
}

/// Why a text is no [`UtcOffset`].
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("'{0}' is not a UTC offset; expected hours from -14 to 14, like 2 or -3.5, or auto")]
pub struct UtcOffsetError(String);

/// Parses hours, or `auto`.
impl FromStr for UtcOffset {
    type Err = UtcOffsetError;

    fn from_str(text: &str) -> Result<Self, UtcOffsetError> {
        let text = text.trim();
        if text == "auto" {
            return Ok(Self::Auto);
        }
        let hours = text.parse::<f64>().ok();
        let hours = hours.filter(|hours| hours.abs() <= MAX_OFFSET_H);
        let ahead = hours.map(|hours| Self::Ahead(of_hours(hours)));
        ahead.ok_or_else(|| UtcOffsetError(text.to_owned()))
    }
}

/// Hours, or `auto`.
impl Serialize for UtcOffset {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Ahead(ahead) => serializer.serialize_f64(hours_of(*ahead)),
            Self::Auto => serializer.serialize_str("auto"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ahead_h(name: &str) -> Option<f64> {
        let found = ClockDate::in_file_name(name.as_ref()).unwrap();
        found.ahead.map(hours_of)
    }

    #[test]
    fn a_time_in_a_name_is_local_unless_it_says_more() {
        for name in [
            "2019-07-29T204726_Alt40_Azi-135_Try1.tiff",
            "20190729_204726.jpg",
            "20190729-204726-1.jpg",
            "20190729204726-0500.jpg",
            "20190729_204726_Zenith.jpg",
            "2019-07-29_20-47-26.png",
            "2019-07-29T204726Zenith.tif",
            "2019-07-29Z.tif",
            "20190729_204726+99.jpg",
            "20190729_204726+020012.jpg",
        ] {
            assert_eq!(ahead_h(name), None, "{name}");
        }
        for (name, expected) in [
            ("2019-07-29T20:47:26Z.fits", 0.0),
            ("20190729T204726Z_0001.fits", 0.0),
            ("2019-07-29T20:47:26.123Z.png", 0.0),
            ("20190729T204726+0200.jpg", 2.0),
            ("2019-07-29T20:47:26+05:30.jpg", 5.5),
            ("2019-07-29T20:47:26-05:00.jpg", -5.0),
        ] {
            assert_eq!(ahead_h(name), Some(expected), "{name}");
        }
    }

    #[test]
    fn an_offset_is_hours_or_auto() {
        let parsed = |text: &str| text.parse::<UtcOffset>();
        assert_eq!(parsed("auto"), Ok(UtcOffset::Auto));
        assert_eq!(parsed(" -3.5 "), Ok(UtcOffset::Ahead(of_hours(-3.5))));
        for text in ["", "14.5", "NaN", "inf", "2h", "Auto+1"] {
            assert!(parsed(text).is_err(), "{text}");
        }
    }

    #[test]
    fn no_name_panics() {
        for text in ["é", "+", "+é2:00", "-0", ".", ".5", "+02:é", "Z"] {
            let _ = stated_offset(text);
        }
    }
}
