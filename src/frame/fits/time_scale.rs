//! Time scales of dates in headers, and how far they are ahead of UTC.
//!
//! # Reference
//! FITS Standard 4.0 (2018), table 30; leap seconds: IERS Bulletin C.

use crate::base::epoch::ObservationDate;
use jiff::SignedDuration;

/// A time scale.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum TimeScale {
    /// Coordinated Universal Time, and UT1, which differs by less than a second.
    Utc,
    /// International Atomic Time.
    Tai,
    /// Terrestrial Time, and barycentric TDB, which differs by milliseconds.
    Tt,
    /// The time of the Global Positioning System.
    Gps,
}

/// The words for time scales; longer ones stand before those that they end with.
const WORDS: [(&str, TimeScale); 11] = [
    ("UTC", TimeScale::Utc),
    ("UT1", TimeScale::Utc),
    ("UT", TimeScale::Utc),
    ("GMT", TimeScale::Utc),
    ("Z", TimeScale::Utc),
    ("TAI", TimeScale::Tai),
    ("TDT", TimeScale::Tt),
    ("TDB", TimeScale::Tt),
    ("TT", TimeScale::Tt),
    ("ET", TimeScale::Tt),
    ("GPS", TimeScale::Gps),
];

impl TimeScale {
    /// The words that a message lists.
    pub const EXPECTED: &str = "UTC, UT1, TAI, TT, TDB or GPS";

    /// The scale that `word` names, in any case; a realization in brackets is dropped: `UTC(NIST)`.
    pub fn parse(word: &str) -> Option<Self> {
        let word = word.split('(').next().unwrap_or_default().trim();
        let known = WORDS
            .iter()
            .find(|(name, _)| name.eq_ignore_ascii_case(word));
        known.map(|&(_, scale)| scale)
    }

    /// The text before the word for a scale at its end, and that scale: `20:47:26 UTC`, `20:47:26Z`,
    /// `20:47:26(TAI)`.
    pub fn behind(text: &str) -> Option<(&str, Self)> {
        let (before, scale) = match text.strip_suffix(')').and_then(|text| text.split_once('(')) {
            Some((before, word)) => (before, Self::parse(word)?),
            None => WORDS.iter().find_map(|&(word, scale)| {
                let (before, end) = text.split_at_checked(text.len().checked_sub(word.len())?)?;
                end.eq_ignore_ascii_case(word).then_some((before, scale))
            })?,
        };
        let before = before.trim_end();
        let is_behind_number = before.ends_with(|c: char| c.is_ascii_digit() || c == '.');
        is_behind_number.then_some((before, scale))
    }

    /// The date in UTC of `date` in this scale. A day alone stays.
    pub fn to_utc(self, date: ObservationDate) -> Option<ObservationDate> {
        /// TT − TAI.
        const TT_TAI: SignedDuration = SignedDuration::from_millis(32_184);
        /// TAI − GPS time.
        const TAI_GPS: SignedDuration = SignedDuration::from_secs(19);
        let tai_utc = SignedDuration::from_secs(tai_utc_s(date.modified_julian_day()));
        date.earlier_by(match self {
            Self::Utc => SignedDuration::ZERO,
            Self::Tai => tai_utc,
            Self::Tt => tai_utc + TT_TAI,
            Self::Gps => tai_utc - TAI_GPS,
        })
    }
}

/// Modified Julian Dates at which TAI − UTC became 10 s, 11 s, and so on. Before, when the two drifted
/// apart slowly, 10 s are right to some seconds since 1960.
const LEAPS: [i32; 28] = [
    41_317, 41_499, 41_683, 42_048, 42_413, 42_778, 43_144, 43_509, 43_874, 44_239, 44_786, 45_151,
    45_516, 46_247, 47_161, 47_892, 48_257, 48_804, 49_169, 49_534, 50_083, 50_630, 51_179, 53_736,
    54_832, 56_109, 57_204, 57_754,
];

/// TAI − UTC in seconds on the day of a Modified Julian Date.
fn tai_utc_s(day: i32) -> i64 {
    9 + LEAPS.iter().filter(|leap| day >= **leap).count().max(1) as i64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leap_seconds_are_those_of_the_bulletin() {
        for (day, seconds) in [
            (30_000, 10),
            (41_317, 10),
            (51_544, 32),
            (57_753, 36),
            (57_754, 37),
            (60_000, 37),
        ] {
            assert_eq!(tai_utc_s(day), seconds, "{day}");
        }
    }

    #[test]
    fn scales_are_found_behind_a_time() {
        for (text, expected) in [
            ("20:00:00 UTC", Some(("20:00:00", TimeScale::Utc))),
            ("20:00:00.5(tai)", Some(("20:00:00.5", TimeScale::Tai))),
            ("20:00:00 UT1", Some(("20:00:00", TimeScale::Utc))),
            ("20:00:00Z", Some(("20:00:00", TimeScale::Utc))),
            ("20:00:00 (UTC(NIST))", Some(("20:00:00", TimeScale::Utc))),
            ("20:00:00", None),
            ("August", None),
            ("", None),
        ] {
            assert_eq!(TimeScale::behind(text), expected, "{text}");
        }
        assert_eq!(TimeScale::parse(" utc(NIST) "), Some(TimeScale::Utc));
        assert_eq!(TimeScale::parse("LOCAL"), None);
    }
}
