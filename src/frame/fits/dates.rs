//! The date of an exposure, from all keywords that may have it.
//!
//! 1. A date in calendar form, if necessary with the time of day in a keyword of its own.
//! 2. A Julian or Modified Julian Date. It is used where the calendar has no date, no time, or one of
//!    which part is assumed; where the two contradict each other, the calendar's is used otherwise.
//! 3. The time scale behind the time or in TIMESYS; a time in an unknown one is dropped.
//!
//! The moment within the exposure does not matter for star positions.

use super::calendar::{self, CalendarDate, DateProblem};
use super::keywords::Keywords;
use super::time_scale::TimeScale;
use crate::base::epoch::ObservationDate;
use crate::frame::metadata::{Assumption, FrameMetadata};
use jiff::SignedDuration;

/// Dates in calendar form. A blank may stand for a dash in the middle of any keyword.
const CALENDAR: [&str; 8] = [
    "DATE-OBS", "DATEOBS", "DATE-BEG", "DATE-AVG", "UTDATE", "UT-DATE", "DATE-END", "OBSDATE",
];
/// The time of day, where the date has none.
const TIMES: [&str; 11] = [
    "TIME-OBS", "UT", "UTC", "UTSTART", "UT-START", "UTC-OBS", "UT-OBS", "UT-TIME", "TIME-BEG",
    "UTC-BEG", "UTSHUT",
];
/// Modified Julian Dates.
const MODIFIED: [&str; 5] = ["MJD-OBS", "MJD-BEG", "MJD-AVG", "MJD", "MJD-END"];
/// Julian Dates.
const JULIAN: [&str; 4] = ["JD-OBS", "JD", "JD-UTC", "JULIAN"];

/// Difference of two dates in one header that is no contradiction: begin, middle and end of an
/// exposure, and what clocks are off.
const TOLERANCE_S: i64 = 3600;
/// The same where only the day is known: nights are named by the day on which they begin.
const DAY_TOLERANCE_S: i64 = 36 * 3600;

/// A date, and where it is from.
struct FoundDate {
    keyword: &'static str,
    text: String,
    date: CalendarDate,
}

impl FoundDate {
    fn is_assumed(&self) -> bool {
        self.date.may_be_swapped || self.date.is_century_assumed
    }

    fn date(&self) -> ObservationDate {
        self.date.date
    }
}

impl Keywords<'_> {
    /// The date of the exposure in UTC. What cannot be read, and what is contradicted, is recorded as
    /// ignored.
    pub(super) fn date(&self, metadata: &mut FrameMetadata) -> Option<ObservationDate> {
        let scale = self.time_scale(metadata);
        let calendar = self.calendar_date(metadata);
        let needs_number = calendar
            .as_ref()
            .is_none_or(|found| !found.date().has_time());
        // Zero stands for an unknown number, and is not worth a note if it is not needed.
        let mut unread = FrameMetadata::default();
        let number = self.julian_date(&mut unread);
        if needs_number {
            metadata.ignored.append(&mut unread.ignored);
        }
        let found = chosen(calendar, number, metadata)?;
        let utc = match found.date.scale.or(scale) {
            Some(scale) => scale.to_utc(found.date()),
            None => Some(found.date().without_time()),
        };
        if utc.is_none() {
            metadata.ignore(found.keyword, &found.text, &DateProblem::Year.expected());
        }
        utc
    }

    /// The time scale that the header states, UTC if it states none; `None` if it is unknown.
    fn time_scale(&self, metadata: &mut FrameMetadata) -> Option<TimeScale> {
        const KEYWORD: &str = "TIMESYS";
        let Some(text) = self.text(KEYWORD) else {
            return Some(TimeScale::Utc);
        };
        let scale = TimeScale::parse(&text);
        if scale.is_none() {
            metadata.ignore(KEYWORD, &text, TimeScale::EXPECTED);
        }
        scale
    }

    fn calendar_date(&self, metadata: &mut FrameMetadata) -> Option<FoundDate> {
        CALENDAR.iter().find_map(|keyword| {
            let text = self.text(keyword)?;
            match calendar::date(&text) {
                Ok(mut date) => {
                    if !date.date.has_time() {
                        self.add_time(&mut date, metadata);
                    }
                    Some(FoundDate {
                        keyword,
                        text,
                        date,
                    })
                }
                Err(problem) => {
                    metadata.ignore(keyword, &text, &problem.expected());
                    None
                }
            }
        })
    }

    /// Adds the time of day from a keyword of its own.
    fn add_time(&self, date: &mut CalendarDate, metadata: &mut FrameMetadata) {
        for keyword in TIMES {
            let Some(text) = self.text(keyword) else {
                continue;
            };
            let number = || calendar::time_of_number(self.number_of(keyword)?);
            let time = calendar::time(&text).or_else(|| Some((number()?, None)));
            let with_time = time.and_then(|(time, scale)| {
                Some((ObservationDate::of_day(date.date.day(), Some(time))?, scale))
            });
            match with_time {
                Some((with_time, scale)) => {
                    date.date = with_time;
                    date.scale = scale;
                    return;
                }
                // Some programs write the whole date again.
                None => match calendar::date(&text) {
                    Ok(again) if again.date.has_time() => {
                        *date = again;
                        return;
                    }
                    _ => metadata.ignore(keyword, &text, "a time such as 20:47:26"),
                },
            }
        }
    }

    fn julian_date(&self, metadata: &mut FrameMetadata) -> Option<FoundDate> {
        /// Julian Date of the beginning of Modified Julian Dates.
        const MJD_ZERO_JD: f64 = 2_400_000.5;
        let modified = MODIFIED.map(|keyword| (keyword, 0.0, "a Modified Julian Date"));
        let julian = JULIAN.map(|keyword| (keyword, MJD_ZERO_JD, "a Julian Date"));
        modified
            .into_iter()
            .chain(julian)
            .find_map(|(keyword, zero, name)| {
                let text = self.text(keyword)?;
                let date = self.number_of(keyword).and_then(|number| {
                    let date = ObservationDate::from_modified_julian_date(number - zero)?;
                    // A number without a fraction is that of a day.
                    let is_day = number.fract() == 0.0;
                    Some(if is_day { date.without_time() } else { date })
                });
                if date.is_none() {
                    let years = crate::base::epoch::YEARS;
                    let expected = format!("{name} from {} to {}", years.start(), years.end());
                    metadata.ignore(keyword, &text, &expected);
                }
                Some(FoundDate {
                    keyword,
                    text,
                    date: CalendarDate {
                        date: date?,
                        scale: None,
                        may_be_swapped: false,
                        is_century_assumed: false,
                    },
                })
            })
    }
}

/// The date of two that is used. If they contradict each other, the other is recorded as ignored.
fn chosen(
    calendar: Option<FoundDate>,
    number: Option<FoundDate>,
    metadata: &mut FrameMetadata,
) -> Option<FoundDate> {
    let (calendar, number) = match (calendar, number) {
        (Some(calendar), Some(number)) => (calendar, number),
        (calendar, None) => {
            let unclear = calendar.as_ref().filter(|found| found.date.may_be_swapped);
            metadata
                .assumed
                .extend(unclear.map(|found| Assumption::DayFirst {
                    keyword: found.keyword.to_owned(),
                    found: found.text.clone(),
                }));
            return calendar;
        }
        (None, number) => return number,
    };
    let agree = is_same(&calendar, &number, metadata.exposure_s);
    let by_number =
        calendar.is_assumed() || (agree && !calendar.date().has_time() && number.date().has_time());
    let (used, other) = if by_number {
        (number, calendar)
    } else {
        (calendar, number)
    };
    if !agree {
        let expected = format!("the date of {}, {}", used.keyword, used.date().to_iso());
        metadata.ignore(other.keyword, &other.text, &expected);
    }
    Some(used)
}

/// Whether two dates may be of the same exposure.
fn is_same(one: &FoundDate, other: &FoundDate, exposure_s: Option<f64>) -> bool {
    let exposure = SignedDuration::try_from_secs_f64(exposure_s.unwrap_or(0.0));
    let has_times = one.date().has_time() && other.date().has_time();
    let of_span = [one, other]
        .iter()
        .any(|found| found.keyword.ends_with("AVG") || found.keyword.ends_with("END"));
    // The middle and the end of a stack may be hours after its first exposure.
    let tolerance_s = if has_times && !of_span {
        TOLERANCE_S
    } else {
        DAY_TOLERANCE_S
    };
    let tolerance = SignedDuration::from_secs(tolerance_s) + exposure.unwrap_or_default();
    one.date().since(&other.date()).abs() <= tolerance
}
