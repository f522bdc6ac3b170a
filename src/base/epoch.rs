//! When was a frame taken? Text or a file name → [`ObservationDate`] → Julian years since J2000.0.
//!
//! Caveats: UTC is used as if it were the uniform time of the catalogue. They differ by about a
//! minute, in which no star moves measurably. Only dates within [`YEARS`] are accepted: linear
//! proper motion does not hold over longer times.

use jiff::SignedDuration;
use jiff::civil::{Date, DateTime, Time};
use jiff::tz::TimeZone;
use std::ops::RangeInclusive;
use std::path::Path;
use std::str::FromStr;

/// Accepted years of observation: from the first photograph of a star.
pub const YEARS: RangeInclusive<i16> = 1850..=2100;

/// The epoch J2000.0.
const J2000: DateTime = jiff::civil::datetime(2000, 1, 1, 12, 0, 0, 0);
/// Where Modified Julian Dates begin.
const MJD_ZERO: DateTime = jiff::civil::datetime(1858, 11, 17, 0, 0, 0, 0);
/// The time assumed where only the day is known.
const MIDDAY: Time = jiff::civil::time(12, 0, 0, 0);
const SECONDS_PER_JULIAN_YEAR: f64 = 365.25 * 86_400.0;

/// Why a text is not an observation date.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum DateError {
    /// It is not ISO 8601, or the day or time does not exist.
    #[error(
        "'{text}' is not a valid date; expected ISO 8601, like 2019-07-29, 2019-07-29T20:47:26Z or \
         2019-07-29T22:47:26+02:00"
    )]
    Malformed {
        /// What was found.
        text: String,
    },
    /// The year is outside [`YEARS`].
    #[error("the year {year} is outside the supported range, {} to {}", YEARS.start(), YEARS.end())]
    OutOfRange {
        /// The year found.
        year: i16,
    },
}

/// When a frame was taken, in UTC: the day, and the time where known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ObservationDate {
    day: Date,
    time: Option<Time>,
}

impl ObservationDate {
    /// The epoch J2000.0.
    pub(crate) const J2000: Self = Self {
        day: jiff::civil::date(2000, 1, 1),
        time: Some(MIDDAY),
    };

    /// The date in the file name of `path`, in the formats of capture programs:
    /// `2019-07-29T204726`, `2019-07-29_20-47-26`, `20190729_204726`, `20190729204726`, or the day
    /// alone.
    ///
    /// `None` where a name holds two different days. Parts of longer numbers are ignored.
    pub fn in_file_name(path: &Path) -> Option<Self> {
        Self::found_in_name(path).map(|(date, _)| date)
    }

    /// The same, and what follows it in the name.
    pub(super) fn found_in_name(path: &Path) -> Option<(Self, String)> {
        let name = path.file_name()?.to_string_lossy();
        let bytes = name.as_bytes();
        let mut found = (0..bytes.len()).filter_map(|at| Self::at(bytes, at));
        let (first, end) = found.next()?;
        let is_alone = found.all(|(other, _)| other.day == first.day);
        let rest = String::from_utf8_lossy(&bytes[end..]).into_owned();
        is_alone.then_some((first, rest))
    }

    /// The date that begins at byte `start`, and where it ends.
    fn at(bytes: &[u8], start: usize) -> Option<(Self, usize)> {
        if start > 0 && bytes[start - 1].is_ascii_digit() {
            return None;
        }
        let mut text = Cursor { bytes, at: start };
        let year = text.number(4)?;
        let separator = text.any_of(b"-_.");
        let month = text.number(2)?;
        if separator != text.any_of(b"-_.") {
            return None;
        }
        let day = Date::new(year, month as i8, text.number(2)? as i8).ok()?;
        let mut after = text.clone();
        let time = after.time();
        let end = if time.is_some() { after.at } else { text.at };
        // Digits after the day are a time, or the day is part of a longer number.
        let alone = !text.number_follows() || (separator.is_none() && time.is_some());
        (YEARS.contains(&year) && alone).then_some((Self { day, time }, end))
    }

    /// The date of a day, and of the time since its midnight if that is known; `None` outside
    /// [`YEARS`].
    pub(crate) fn of_day(day: Date, time: Option<SignedDuration>) -> Option<Self> {
        let utc = day
            .to_datetime(Time::midnight())
            .checked_add(time.unwrap_or_default());
        let utc = utc.ok().filter(|utc| YEARS.contains(&utc.year()))?;
        Some(Self {
            day: utc.date(),
            time: time.map(|_| utc.time()),
        })
    }

    /// The date `duration` earlier, if the time is known; `None` outside [`YEARS`].
    pub(crate) fn earlier_by(self, duration: SignedDuration) -> Option<Self> {
        if self.time.is_none() {
            return Some(self);
        }
        let utc = self.utc().checked_sub(duration).ok()?;
        YEARS.contains(&utc.year()).then_some(Self {
            day: utc.date(),
            time: Some(utc.time()),
        })
    }

    /// The same day and time so many years later; `None` outside [`YEARS`], and on the 29th of February of a
    /// year without one.
    pub(crate) fn in_other_year(self, later: i16) -> Option<Self> {
        let year = self.day.year().checked_add(later)?;
        let day = Date::new(year, self.day.month(), self.day.day()).ok()?;
        YEARS.contains(&year).then_some(Self { day, ..self })
    }

    /// The other dates that have the same numbers for the year in its century, the month and the day, in any
    /// order.
    pub(crate) fn reordered(self) -> Vec<Self> {
        let century = self.day.year() / 100 * 100;
        let [y, m, d] = [
            self.day.year() % 100,
            i16::from(self.day.month()),
            i16::from(self.day.day()),
        ];
        let orders = [[y, d, m], [d, m, y], [m, d, y], [m, y, d], [d, y, m]];
        let mut others: Vec<Self> = Vec::new();
        for [year, month, day] in orders {
            let Ok(day) = Date::new(century + year, month as i8, day as i8) else {
                continue;
            };
            let other = Self { day, ..self };
            if YEARS.contains(&day.year()) && other != self && !others.contains(&other) {
                others.push(other);
            }
        }
        others
    }

    /// The day in UTC.
    pub(crate) fn day(&self) -> Date {
        self.day
    }

    /// The same day without the time.
    pub(crate) fn without_time(self) -> Self {
        Self { time: None, ..self }
    }

    /// Modified Julian Date of the midnight at which the day begins.
    pub(crate) fn modified_julian_day(&self) -> i32 {
        let since = self
            .day
            .to_datetime(Time::midnight())
            .duration_since(MJD_ZERO);
        (since.as_hours() / 24) as i32
    }

    /// The time from `other` to this date; midday is assumed where the time is not known.
    pub(crate) fn since(&self, other: &Self) -> SignedDuration {
        self.utc().duration_since(other.utc())
    }

    /// The date of a Modified Julian Date, in days since 1858-11-17 00:00 UTC; `None` outside
    /// [`YEARS`].
    pub fn from_modified_julian_date(days: f64) -> Option<Self> {
        const SECONDS_PER_DAY: f64 = 86_400.0;
        let since = SignedDuration::try_from_secs_f64((days * SECONDS_PER_DAY).round()).ok()?;
        let utc = MJD_ZERO.checked_add(since).ok()?;
        YEARS.contains(&utc.year()).then_some(Self {
            day: utc.date(),
            time: Some(utc.time()),
        })
    }

    fn utc(&self) -> DateTime {
        self.day.to_datetime(self.time.unwrap_or(MIDDAY))
    }

    /// Whether the time of day is known.
    pub fn has_time(&self) -> bool {
        self.time.is_some()
    }

    /// The Modified Julian Date in UTC; `None` where the time is not known.
    pub fn modified_julian_date(&self) -> Option<f64> {
        /// That of J2000.0.
        const J2000_MJD: f64 = 51_544.5;
        let (seconds, _) = self.seconds_since_j2000()?;
        Some(J2000_MJD + seconds / 86_400.0)
    }

    /// Seconds since J2000.0, exact to a microsecond, and whether the date has fractions of a
    /// second; `None` where the time is not known.
    pub fn seconds_since_j2000(&self) -> Option<(f64, bool)> {
        let time = self.time?;
        let seconds = self.utc().duration_since(J2000).as_secs_f64();
        Some((seconds, time.subsec_nanosecond() != 0))
    }

    /// Julian years of 365.25 days since J2000.0; midday is assumed where the time is not known.
    pub fn years_since_j2000(&self) -> f64 {
        self.utc().duration_since(J2000).as_secs_f64() / SECONDS_PER_JULIAN_YEAR
    }

    /// The Julian epoch: 2000 plus the years since J2000.0.
    pub fn julian_epoch(&self) -> f64 {
        2000.0 + self.years_since_j2000()
    }

    /// The date in ISO 8601: `2019-07-29T20:47:26Z`, or `2019-07-29` where the time is not known.
    pub fn to_iso(&self) -> String {
        self.time
            .map_or(self.day.to_string(), |_| format!("{}Z", self.utc()))
    }
}

/// Parses ISO 8601: a day, or a day and a time, with `Z`, an offset, or nothing for UTC.
impl FromStr for ObservationDate {
    type Err = DateError;

    fn from_str(text: &str) -> Result<Self, DateError> {
        let text = text.trim();
        let malformed = || DateError::Malformed { text: text.into() };
        // A time zone's name in brackets would need a time zone database.
        if text.contains('[') {
            return Err(malformed());
        }
        let with_offset = text.parse::<jiff::Timestamp>();
        let utc = match with_offset {
            Ok(instant) => instant.to_zoned(TimeZone::UTC).datetime(),
            Err(_) => text.parse::<DateTime>().map_err(|_| malformed())?,
        };
        if !YEARS.contains(&utc.year()) {
            return Err(DateError::OutOfRange { year: utc.year() });
        }
        let has_time = text.contains(['T', 't', ' ']);
        Ok(Self {
            day: utc.date(),
            time: has_time.then(|| utc.time()),
        })
    }
}

/// A reading position in a file name.
#[derive(Clone)]
struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Cursor<'_> {
    fn number_follows(&self) -> bool {
        self.bytes.get(self.at).is_some_and(u8::is_ascii_digit)
    }

    /// Reads a number of exactly `digits` digits.
    fn number(&mut self, digits: usize) -> Option<i16> {
        let end = self.at + digits;
        let text = self.bytes.get(self.at..end)?;
        // `parse` would accept a sign.
        if !text.iter().all(u8::is_ascii_digit) {
            return None;
        }
        self.at = end;
        std::str::from_utf8(text).ok()?.parse().ok()
    }

    /// Reads the next byte if it is one of `wanted`.
    fn any_of(&mut self, wanted: &[u8]) -> Option<u8> {
        let next = *self.bytes.get(self.at)?;
        wanted.contains(&next).then(|| self.at += 1).map(|()| next)
    }

    /// Reads hour, minute and second, with the usual separators before and between them.
    fn time(&mut self) -> Option<Time> {
        self.any_of(b"T_- t");
        let hour = self.number(2)?;
        let separator = self.any_of(b":-_.");
        let minute = self.number(2)?;
        if separator != self.any_of(b":-_.") {
            return None;
        }
        let second = self.number(2)?;
        if self.number_follows() {
            return None;
        }
        Time::new(hour as i8, minute as i8, second as i8, 0).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn parsed(text: &str) -> ObservationDate {
        text.parse().unwrap()
    }

    fn named(name: &str) -> Option<String> {
        ObservationDate::in_file_name(name.as_ref()).map(|date| date.to_iso())
    }

    #[test]
    fn a_date_is_read_with_any_offset_and_with_none() {
        for text in [
            "2019-07-29T20:47:26Z",
            "2019-07-29 20:47:26",
            "2019-07-29T22:47:26+02:00",
            "20190729T204726Z",
            "2019-07-30T00:47:26+04",
        ] {
            assert_eq!(parsed(text).to_iso(), "2019-07-29T20:47:26Z", "{text}");
        }
        assert_eq!(parsed(" 2019-07-29 ").to_iso(), "2019-07-29");
        assert_eq!(parsed("20190729").to_iso(), "2019-07-29");
    }

    #[test]
    fn other_text_is_rejected_with_the_expected_format() {
        for text in [
            "",
            "today",
            "2019",
            "2019-13-01",
            "2019-02-29",
            "29.07.2019",
            "2019-07-29T25:00:00Z",
            "2019-07-29T20:47:26[Europe/Vienna]",
            "2019-07-29T20:47:26+99:00",
        ] {
            let error = text.parse::<ObservationDate>().unwrap_err();
            assert!(error.to_string().contains("ISO 8601"), "{text}: {error}");
        }
        let error = "1066-10-14".parse::<ObservationDate>().unwrap_err();
        assert_eq!(error, DateError::OutOfRange { year: 1066 });
        assert!("2101-01-01".parse::<ObservationDate>().is_err());
    }

    #[test]
    fn years_are_julian_and_counted_from_noon() {
        assert_eq!(parsed("2000-01-01T12:00:00Z").years_since_j2000(), 0.0);
        assert_eq!(parsed("2000-01-01").years_since_j2000(), 0.0);
        assert_eq!(parsed("2000-01-01").seconds_since_j2000(), None);
        let later = parsed("2000-01-01T12:00:10.25Z").seconds_since_j2000();
        assert_eq!(later, Some((10.25, true)));
        // By Julian dates: noon of that day is 2458694, J2000.0 is 2451545, and 1899-12-31 is
        // 2415020.
        let night = parsed("2019-07-29T20:47:26Z").julian_epoch();
        let expected = 2000.0 + (7149.0 + 31_646.0 / 86_400.0) / 365.25;
        assert!((night - expected).abs() < 1e-9, "{night}");
        let b1900 = parsed("1899-12-31T12:00:00Z").years_since_j2000();
        assert!((b1900 + 100.0).abs() < 1e-9, "{b1900}");
    }

    #[test]
    fn modified_julian_dates_are_converted() {
        let iso = |days| ObservationDate::from_modified_julian_date(days).map(|date| date.to_iso());
        assert_eq!(iso(51_544.5).as_deref(), Some("2000-01-01T12:00:00Z"));
        assert_eq!(
            iso(58_693.866_273_148).as_deref(),
            Some("2019-07-29T20:47:26Z")
        );
        for days in [f64::NAN, f64::INFINITY, -1e5, 1e9, 1e300] {
            assert_eq!(iso(days), None, "{days}");
        }
    }

    #[test]
    fn timestamps_of_capture_programs_are_found_in_names() {
        for name in [
            "2019-07-29T204726_Alt40_Azi-135_Try1.tiff",
            "2019-07-29T20:47:26.fits",
            "2019-07-29T20:47:26.123Z.png",
            "2019-07-29_20-47-26.png",
            "2019-07-29 20.47.26.png",
            "2019_07_29_20_47_26.jpg",
            "20190729T204726.tif",
            "20190729_204726.jpg",
            "20190729-204726-1.jpg",
            "IMG20190729204726.jpg",
            "PXL_20190729_204726.jpg",
            "M45_30s_2019-07-29_20-47-26_0001.png",
        ] {
            let found = named(name);
            assert_eq!(found.as_deref(), Some("2019-07-29T20:47:26Z"), "{name}");
        }
        for name in [
            "night/2019-07-29.png",
            "2019-07-29_0012.png",
            "2019-07-29-2047_8.png",
            "2019-07-29T256199.png",
            "20190729.png",
            "M31_2019.07.29_dark.png",
        ] {
            assert_eq!(named(name).as_deref(), Some("2019-07-29"), "{name}");
        }
    }

    #[test]
    fn numbers_that_resemble_a_date_are_ignored() {
        for name in [
            "orion.png",
            "2019.png",
            "2019-07.png",
            "12019-07-29.png",
            "2019-07-291.png",
            "201907291.png",
            "120190729204726.png",
            "201907292047261.png",
            "2019-13-01.png",
            "2019-02-30.png",
            "2019-07_29.png",
            "1849-07-29.png",
            "2101-07-29.png",
            "20190001.png",
            "2019-07-29_to_2019-08-01.png",
            "2019-07-29/orion.png",
            "",
            "..",
        ] {
            assert_eq!(named(name), None, "{name}");
        }
    }

    fn moments() -> impl Strategy<Value = ObservationDate> {
        let day = (YEARS, 1..=12_i8, 1..=28_i8);
        let time = proptest::option::of((0..24_i8, 0..60_i8, 0..60_i8));
        (day, time).prop_map(|((year, month, day), time)| ObservationDate {
            day: Date::new(year, month, day).unwrap(),
            time: time.map(|(h, m, s)| Time::new(h, m, s, 0).unwrap()),
        })
    }

    proptest! {
        #[test]
        fn dates_round_trip(date in moments()) {
            prop_assert_eq!(parsed(&date.to_iso()), date);
            prop_assert_eq!(ObservationDate::in_file_name(date.to_iso().as_ref()), Some(date));
            let plain = date.to_iso().replace([':', '-'], "").replace('T', "_");
            prop_assert_eq!(ObservationDate::in_file_name(plain.as_ref()), Some(date));
        }

        #[test]
        fn no_text_panics(text in "\\PC{0,40}", digits in "[-0-9T:_.é ]{0,30}") {
            let _ = (text.parse::<ObservationDate>(), digits.parse::<ObservationDate>());
            let _ = (named(&text), named(&digits));
        }

        #[test]
        fn later_dates_are_more_years_away(a in moments(), b in moments()) {
            let (years_a, years_b) = (a.years_since_j2000(), b.years_since_j2000());
            prop_assert_eq!(a.utc().cmp(&b.utc()), years_a.total_cmp(&years_b));
        }
    }
}
