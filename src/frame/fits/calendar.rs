//! Dates and times of day in headers, in the forms that programs write.
//!
//! Text → [`CalendarDate`]. Read are year, month, day and day, month, year with the usual separators,
//! names of months, and times with or without separators, a fraction, `AM` and `PM`, an offset from
//! UTC and a time scale (`Z`, `UTC`, `(TAI)`).
//!
//! Of day/month/year and month/day/year the first is assumed if both are possible. A year of two
//! digits is read as the FITS standard has it: DD/MM/YY is of the twentieth century. Those below 50
//! are refused, as programs write them for this century.
//!
//! # Reference
//! FITS Standard 4.0 (2018), sect. 4.4.2 and 9.1.

use super::time_scale::TimeScale;
use crate::base::epoch::{ObservationDate, YEARS};
use jiff::SignedDuration;
use jiff::civil::Date;

/// What a header says about a date.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CalendarDate {
    /// In the time scale that is stated, or else in that of the header.
    pub date: ObservationDate,
    /// The time scale behind the time.
    pub scale: Option<TimeScale>,
    /// Whether day and month may be exchanged.
    pub may_be_swapped: bool,
    /// Whether the century is assumed.
    pub is_century_assumed: bool,
}

/// Why a text is not a valid date.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum DateProblem {
    /// It has another form, or there is no such day or time.
    Form,
    /// The year has two digits.
    ShortYear,
    /// The year is outside [`YEARS`].
    Year,
}

impl DateProblem {
    /// What was expected instead.
    pub fn expected(self) -> String {
        match self {
            Self::Form => "a date such as 2019-07-29, 2019-07-29T20:47:26 or 29/07/2019".to_owned(),
            Self::ShortYear => "a year of four digits".to_owned(),
            Self::Year => format!("a year from {} to {}", YEARS.start(), YEARS.end()),
        }
    }
}

/// Separators between the parts of a date.
const DAY_SEPARATORS: [char; 7] = ['-', '/', '.', ':', '_', ',', ' '];
/// Between date and time.
const TIME_STARTS: [char; 5] = ['T', 't', ' ', '_', ','];
/// Years of two digits from this on are of the twentieth century.
const FIRST_SHORT_YEAR: u32 = 50;

/// Parses a date with or without a time of day.
pub(super) fn date(text: &str) -> Result<CalendarDate, DateProblem> {
    let (text, scale) = split_scale(text.trim());
    if let Some(day) = day(text) {
        return day?.with_time(None, scale);
    }
    let mut splits = text.char_indices().filter(|(_, c)| TIME_STARTS.contains(c));
    let found = splits.find_map(|(at, c)| {
        let day = day(text[..at].trim_end())?;
        let time = time_of_day(text[at + c.len_utf8()..].trim_start())?;
        Some(day.and_then(|day| day.with_time(Some(time), scale)))
    });
    found.unwrap_or(Err(DateProblem::Form))
}

/// Parses a time of day alone: the time since midnight, and the time scale behind it.
pub(super) fn time(text: &str) -> Option<(SignedDuration, Option<TimeScale>)> {
    let (text, scale) = split_scale(text.trim());
    Some((time_of_day(text)?, scale))
}

/// A time of day as a number of hours, or where it is too large for that, of seconds.
pub(super) fn time_of_number(number: f64) -> Option<SignedDuration> {
    const HOURS: f64 = 24.0;
    const SECONDS: f64 = 86_400.0;
    let seconds = match number {
        0.0..=HOURS => number * 3600.0,
        HOURS..=SECONDS => number,
        _ => return None,
    };
    // Decimal fractions of hours are not exact.
    Some(SignedDuration::from_millis((seconds * 1e3).round() as i64))
}

fn split_scale(text: &str) -> (&str, Option<TimeScale>) {
    match TimeScale::behind(text) {
        Some((before, scale)) => (before, Some(scale)),
        None => (text, None),
    }
}

/// A day, and what is assumed of it.
#[derive(Clone, Copy)]
struct Day {
    day: Date,
    may_be_swapped: bool,
    is_century_assumed: bool,
}

impl Day {
    fn with_time(
        self,
        time: Option<SignedDuration>,
        scale: Option<TimeScale>,
    ) -> Result<CalendarDate, DateProblem> {
        Ok(CalendarDate {
            date: ObservationDate::of_day(self.day, time).ok_or(DateProblem::Year)?,
            scale,
            may_be_swapped: self.may_be_swapped,
            is_century_assumed: self.is_century_assumed,
        })
    }
}

/// Parses a day; `None` if the text has not its form.
fn day(text: &str) -> Option<Result<Day, DateProblem>> {
    if text.len() == 8
        && let Some(digits) = number(text, 8)
    {
        return Some(certain(digits / 10_000, digits / 100 % 100, digits % 100));
    }
    let [first, second, third] = parts(text)?;
    if let Some(month) = month(second) {
        let (day, year) = if first.len() == 4 {
            (third, first)
        } else {
            (first, third)
        };
        return Some(named(day, month, year));
    }
    if let Some(month) = month(first) {
        return Some(named(second, month, third));
    }
    let of = |part: &str| number(part, 4);
    let (a, b, c) = (of(first)?, of(second)?, of(third)?);
    Some(match [first.len(), second.len(), third.len()] {
        [4, 1 | 2, 1 | 2] => certain(a, b, c),
        [1 | 2, 1 | 2, 4] if a <= 12 && b > 12 => certain(c, a, b),
        [1 | 2, 1 | 2, 4] => certain(c, b, a).map(|day| Day {
            may_be_swapped: a <= 12 && a != b,
            ..day
        }),
        [2, 2, 2] if text.contains('/') && c >= FIRST_SHORT_YEAR => {
            certain(1900 + c, b, a).map(|day| Day {
                is_century_assumed: true,
                ..day
            })
        }
        [1 | 2, 1 | 2, 1 | 2] => Err(DateProblem::ShortYear),
        _ => return None,
    })
}

/// The three parts of a date with one separator between them, or a comma and a blank.
fn parts(text: &str) -> Option<[&str; 3]> {
    let mut parts = text.split(DAY_SEPARATORS).filter(|part| !part.is_empty());
    let found = [parts.next()?, parts.next()?, parts.next()?];
    let separators = text.len() - found.iter().map(|part| part.len()).sum::<usize>();
    let extra = usize::from(text.contains(", "));
    let is_whole = parts.next().is_none() && separators == 2 + extra;
    let is_bare = text.starts_with(char::is_alphanumeric) && text.ends_with(char::is_alphanumeric);
    (is_whole && is_bare).then_some(found)
}

fn named(day: &str, month: u32, year: &str) -> Result<Day, DateProblem> {
    match (number(day, 2), number(year, 4), year.len()) {
        (Some(day), Some(year), 4) => certain(year, month, day),
        (Some(_), Some(_), _) => Err(DateProblem::ShortYear),
        _ => Err(DateProblem::Form),
    }
}

fn certain(year: u32, month: u32, day: u32) -> Result<Day, DateProblem> {
    let day = Date::new(year as i16, month as i8, day as i8).map_err(|_| DateProblem::Form)?;
    Ok(Day {
        day,
        may_be_swapped: false,
        is_century_assumed: false,
    })
}

/// The number of a month by its English name, at least three letters of it.
fn month(name: &str) -> Option<u32> {
    const MONTHS: [&str; 12] = [
        "january",
        "february",
        "march",
        "april",
        "may",
        "june",
        "july",
        "august",
        "september",
        "october",
        "november",
        "december",
    ];
    let name = name.to_ascii_lowercase();
    let found = MONTHS.iter().position(|month| month.starts_with(&name));
    found.filter(|_| name.len() >= 3).map(|at| at as u32 + 1)
}

/// A number of at most `digits` digits, without a sign.
fn number(text: &str, digits: usize) -> Option<u32> {
    let is_number = !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    (is_number && text.len() <= digits).then(|| text.parse().ok())?
}

/// The time since midnight UTC of a time of day, which may be of the next or the last day there.
fn time_of_day(text: &str) -> Option<SignedDuration> {
    let (text, half) = half_of_day(text);
    let (text, offset) = without_offset(text);
    let (hour, minute, second) = clock(text)?;
    let hour = match half {
        None => hour,
        Some(_) if !(1..=12).contains(&hour) => return None,
        Some(start) => hour % 12 + start,
    };
    let (whole, nanoseconds) = second;
    // A leap second is 60; the end of a day may be written as 24:00:00.
    let is_end = hour == 24 && minute == 0 && whole == 0 && nanoseconds == 0;
    if (hour > 23 && !is_end) || minute > 59 || whole > 60 {
        return None;
    }
    let seconds = i64::from((hour * 60 + minute) * 60 + whole);
    SignedDuration::new(seconds, nanoseconds).checked_sub(offset)
}

/// The text before `AM` or `PM`, and the hour at which that half of the day starts.
fn half_of_day(text: &str) -> (&str, Option<u32>) {
    for (word, start) in [("AM", 0), ("PM", 12)] {
        let at = text.len().saturating_sub(word.len());
        if text
            .get(at..)
            .is_some_and(|end| end.eq_ignore_ascii_case(word))
        {
            return (text[..at].trim_end(), Some(start));
        }
    }
    (text, None)
}

/// The text before an offset from UTC, and that offset: `+02:00`, `-0330`, `+01`.
fn without_offset(text: &str) -> (&str, SignedDuration) {
    let offset = || {
        let at = text.rfind(['+', '-'])?;
        let (before, after) = text.split_at(at);
        let (hours, minutes) = match after[1..].split_once(':') {
            Some(parts) => parts,
            None if after.len() == 5 => after[1..].split_at_checked(2)?,
            None => (&after[1..], "00"),
        };
        let is_form = hours.len() == 2 && minutes.len() == 2;
        // Dashes may also be the separators of the time.
        let is_time = before.contains(':') || (before.len() >= 4 && !before.contains('-'));
        let minutes = number(hours, 2)? * 60 + number(minutes, 2)?;
        let sign = if after.starts_with('-') { -1 } else { 1 };
        (is_form && is_time && minutes <= 14 * 60).then(|| {
            (
                before.trim_end(),
                SignedDuration::from_mins(sign * i64::from(minutes)),
            )
        })
    };
    offset().unwrap_or((text, SignedDuration::ZERO))
}

/// Hour, minute, second and its nanoseconds.
fn clock(text: &str) -> Option<(u32, u32, (u32, i32))> {
    const MARKS: [char; 8] = [':', '-', ' ', '_', 'h', 'H', 'm', 'M'];
    let text = text.strip_suffix(['s', 'S']).unwrap_or(text).trim_end();
    let compact = text.split(['.', ',']).next()?;
    if matches!(compact.len(), 4 | 6) && number(compact, 6).is_some() {
        let (hour, rest) = text.split_at(2);
        let (minute, rest) = rest.split_at(2);
        let rest = if rest.is_empty() { "0" } else { rest };
        return Some((number(hour, 2)?, number(minute, 2)?, second(rest)?));
    }
    let by_dots: Vec<&str> = text.split('.').collect();
    let parts: Vec<&str> = if by_dots.len() == 3 && !text.contains(MARKS) {
        by_dots
    } else {
        text.split(MARKS).map(str::trim).collect()
    };
    match parts[..] {
        [hour, minute] | [hour, minute, ""] => Some((number(hour, 2)?, number(minute, 2)?, (0, 0))),
        [hour, minute, rest] => Some((number(hour, 2)?, number(minute, 2)?, second(rest)?)),
        _ => None,
    }
}

/// Whole seconds and nanoseconds; digits beyond these are dropped.
fn second(text: &str) -> Option<(u32, i32)> {
    const NANO_DIGITS: usize = 9;
    let (whole, fraction) = text.split_once(['.', ',']).unwrap_or((text, ""));
    if !fraction.bytes().all(|byte| byte.is_ascii_digit()) {
        return None;
    }
    let nanoseconds: String = fraction
        .chars()
        .chain("0".repeat(NANO_DIGITS).chars())
        .take(NANO_DIGITS)
        .collect();
    Some((number(whole, 2)?, nanoseconds.parse().ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn iso(text: &str) -> Result<String, DateProblem> {
        date(text).map(|found| found.date.to_iso())
    }

    #[test]
    fn dates_are_read_in_every_form_that_programs_write() {
        for text in [
            "2019-07-09T20:47:06",
            "2019-07-09T20:47:06Z",
            "2019-07-09 20:47:06 UTC",
            "2019-07-09T20:47:06(UTC)",
            "2019-07-09T20:47:06 (UTC)",
            "2019-07-09T20:47:06 UT",
            "2019-07-09T20:47:06+00:00",
            "2019-07-09T22:47:06+02:00",
            "2019-07-09T22:47:06+0200",
            "2019-07-09T17:17:06-03:30",
            "2019-07-10T00:47:06+04",
            "2019-7-9T20:47:6",
            "2019/07/09 20:47:06",
            "2019/7/9T20:47:06",
            "2019.07.09 20:47:06",
            "2019:07:09 20:47:06",
            "2019-07-09_20-47-06",
            "2019-07-09T20-47-06",
            "2019-07-09T20 47 06",
            "2019-07-09T20.47.06",
            "2019-07-09T204706",
            "20190709T204706Z",
            "20190709 20:47:06",
            "2019-07-09T20h47m06s",
            "2019-07-09T20:47:06.",
            "2019-07-09, 20:47:06",
            "2019 07 09 20 47 06",
            "09/07/2019 20:47:06",
            "9/7/2019 8:47:06 PM",
            "09.07.2019 20:47:06",
            "09-07-2019T20:47:06",
            "9 July 2019 20:47:06",
            "09-Jul-2019 20:47:06",
            "Jul 9 2019 20:47:06",
            "July 9, 2019 08:47:06 pm",
            "2019-Jul-09T20:47:06",
        ] {
            assert_eq!(iso(text).as_deref(), Ok("2019-07-09T20:47:06Z"), "{text}");
        }
        for (text, expected) in [
            ("2019-07-09", "2019-07-09"),
            ("20190709", "2019-07-09"),
            ("2019/07/09", "2019-07-09"),
            ("29/07/2019", "2019-07-29"),
            ("07/29/2019", "2019-07-29"),
            ("29/07/94", "1994-07-29"),
            ("2019-07-09T24:00:00", "2019-07-10T00:00:00Z"),
            ("2019-12-31T24:00:00.000", "2020-01-01T00:00:00Z"),
            ("2016-12-31T23:59:60", "2017-01-01T00:00:00Z"),
            ("2019-07-09T20:47", "2019-07-09T20:47:00Z"),
            ("2019-07-09T2047", "2019-07-09T20:47:00Z"),
            (
                "2019-07-09T20:47:06.1234567",
                "2019-07-09T20:47:06.1234567Z",
            ),
            ("2019-07-09T20:47:06,5", "2019-07-09T20:47:06.5Z"),
            ("2019-07-09T204706.25", "2019-07-09T20:47:06.25Z"),
            ("2019-07-09T12:00:00 AM", "2019-07-09T00:00:00Z"),
            ("2019-07-09T12:00:00 PM", "2019-07-09T12:00:00Z"),
            ("2019-07-09T00:10:00+01:00", "2019-07-08T23:10:00Z"),
        ] {
            assert_eq!(iso(text).as_deref(), Ok(expected), "{text}");
        }
    }

    #[test]
    fn other_text_is_refused_by_what_is_wrong_with_it() {
        for (text, problem) in [
            ("", DateProblem::Form),
            ("tonight", DateProblem::Form),
            ("2019", DateProblem::Form),
            ("2019-07", DateProblem::Form),
            ("2019-13-01", DateProblem::Form),
            ("2019-02-29", DateProblem::Form),
            ("0000-00-00T00:00:00", DateProblem::Form),
            ("-2019-07-09", DateProblem::Form),
            ("2019--07-09", DateProblem::Form),
            ("2019-07-09T25:00:00", DateProblem::Form),
            ("2019-07-09T24:00:01", DateProblem::Form),
            ("2019-07-09T20:60:00", DateProblem::Form),
            ("2019-07-09T20:47:61", DateProblem::Form),
            ("2019-07-09T20:47:06+99:00", DateProblem::Form),
            ("2019-07-09T13:00:00 PM", DateProblem::Form),
            ("2019-07-09T20:47:06 CEST", DateProblem::Form),
            ("2019-07-09T", DateProblem::Form),
            ("31/31/2019", DateProblem::Form),
            ("15/01/20", DateProblem::ShortYear),
            ("15/01/20 20:00:00", DateProblem::ShortYear),
            ("99/07/29", DateProblem::ShortYear),
            ("20-01-15", DateProblem::ShortYear),
            ("15-Jan-20", DateProblem::ShortYear),
            ("1066-10-14", DateProblem::Year),
            ("2101-01-01T00:00:00", DateProblem::Year),
            ("9999-12-31T24:00:00", DateProblem::Year),
        ] {
            assert_eq!(iso(text), Err(problem), "{text}");
        }
    }

    #[test]
    fn what_is_assumed_is_said() {
        let swapped = |text| date(text).unwrap().may_be_swapped;
        assert!(swapped("09/07/2019") && swapped("9.7.2019 20:00:00"));
        assert!(!swapped("29/07/2019") && !swapped("07/29/2019") && !swapped("07/07/2019"));
        assert!(!swapped("2019-07-09") && !swapped("9 Jul 2019"));
        assert!(date("29/07/94").unwrap().is_century_assumed);
        assert_eq!(
            date("2019-07-09T20:00:00(TAI)").unwrap().scale,
            Some(TimeScale::Tai)
        );
    }

    #[test]
    fn times_alone_and_hours_are_read() {
        let seconds = |text| time(text).map(|(time, _)| time.as_secs_f64());
        for text in [
            "20:47:06.5",
            "20 47 06.5",
            "20-47-06.5",
            "20h47m06.5s",
            "204706.5",
            "20:47:06.5 UT",
        ] {
            assert_eq!(seconds(text), Some(74_826.5), "{text}");
        }
        assert_eq!(seconds("8:00:00"), Some(28_800.0));
        for text in [
            "",
            "20",
            "20.5",
            "25:00:00",
            "-1:00:00",
            "20:00:00:00",
            "noon",
        ] {
            assert_eq!(seconds(text), None, "{text}");
        }
        let hours = |number| time_of_number(number).map(|time| time.as_secs_f64());
        assert_eq!(hours(20.0), Some(72_000.0));
        assert_eq!(hours(20.785_138_888_9), Some(74_826.5));
        assert_eq!(hours(74_826.5), Some(74_826.5));
        for number in [-1.0, 86_401.0, f64::NAN, f64::INFINITY] {
            assert_eq!(hours(number), None, "{number}");
        }
    }

    prop_compose! {
        /// A day of a year of four digits, and a time in milliseconds since midnight.
        fn moments()(
            year in YEARS,
            month in 1..=12_i8,
            day in 1..=28_i8,
            time_ms in 0..86_400_000_i64,
        ) -> (Date, i64) {
            (Date::new(year, month, day).unwrap(), time_ms)
        }
    }

    proptest! {
        #[test]
        fn every_form_of_a_date_round_trips(
            (day, time_ms) in moments(),
            form in 0..6_usize,
            between in prop::sample::select(vec!["T", "t", " ", "_", "  ", ", "]),
            in_time in prop::sample::select(vec![":", "-", " ", ""]),
            scale in prop::sample::select(vec!["", "Z", " UTC", "(UTC)", " (UT)", " GMT"]),
        ) {
            let (y, m, d) = (day.year(), day.month(), day.day());
            let name = day.strftime("%b").to_string();
            let text = [
                format!("{y}-{m:02}-{d:02}"),
                format!("{y}/{m}/{d}"),
                format!("{y}{m:02}{d:02}"),
                format!("{d}-{name}-{y}"),
                format!("{name} {d}, {y}"),
                format!("{y}.{m:02}.{d:02}"),
            ];
            let seconds = time_ms / 1000;
            let (hour, minute, second) = (seconds / 3600, seconds / 60 % 60, seconds % 60);
            let time = format!("{hour:02}{in_time}{minute:02}{in_time}{second:02}.{:03}", time_ms % 1000);
            let text = format!(" {}{between}{time}{scale} ", text[form]);
            let found = date(&text).unwrap().date;
            let wanted = ObservationDate::of_day(day, Some(SignedDuration::from_millis(time_ms)));
            prop_assert_eq!(Some(found), wanted, "{}", text);
        }

        #[test]
        fn days_come_first_where_they_may(day in moments().prop_map(|(day, _)| day)) {
            let found = date(&day.strftime("%d/%m/%Y").to_string()).unwrap();
            prop_assert_eq!(found.date, ObservationDate::of_day(day, None).unwrap());
            let is_unclear = day.day() <= 12 && day.day() != day.month();
            prop_assert_eq!(found.may_be_swapped, is_unclear);
        }

        #[test]
        fn no_text_panics(any in "\\PC{0,40}", near in "[-0-9TtZ:/., +_()hmsAPMUCé]{0,30}") {
            for text in [any, near] {
                let _ = (date(&text), time(&text));
            }
        }
    }
}
