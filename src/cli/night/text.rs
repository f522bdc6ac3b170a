//! A night for people.

use starpipe::base::format::{counted, counted_as};
use starpipe::frame::OtherFile;
use starpipe::night::{NightSummary, NoSky, PassedOverFiles};
use std::fmt::Write as _;

/// The summary as text.
pub(super) fn text(night: &NightSummary) -> String {
    let mut text = format!(
        "night      {} to {}: {}, {} identified, {} with computed pointing, {} unreadable\n",
        or_dash(&night.first_date),
        or_dash(&night.last_date),
        counted(night.frames, "frame"),
        night.identified,
        night.held,
        night.unread
    );
    if !night.passed_over.is_empty() {
        let counts: Vec<String> = night.passed_over.iter().map(passed_over).collect();
        let _ = writeln!(text, "skipped    {}", counts.join(", "));
    }
    let _ = writeln!(text, "hours      {}", hours(night));
    if let Some(hour) = &night.darkest_hour {
        let _ = writeln!(
            text,
            "darkest    median of the zenith V {:.2} mag/arcsec² from {} to {}",
            hour.zenith_mag_arcsec2, hour.from, hour.to
        );
    }
    let medians = medians(night).map(|median| format!("{} {}", median.name, median.value));
    let medians: Vec<String> = medians.collect();
    if !medians.is_empty() {
        let _ = writeln!(text, "medians    {}", medians.join(", "));
    }
    if let Some(pixels) = night.hot_pixels.filter(|pixels| *pixels > 0) {
        let _ = writeln!(
            text,
            "hot        {}, listed in hot-pixels.csv",
            counted(pixels, "pixel")
        );
    }
    if let Some(wrong) = &night.site_or_time {
        let _ = writeln!(text, "note       {wrong}");
    }
    for moment in &night.moments {
        let _ = writeln!(text, "{:<10} {}", time_of(&moment.date), moment.to_text());
    }
    text
}

/// Files of one kind with their count.
fn passed_over(files: &PassedOverFiles) -> String {
    let kinds = [
        OtherFile::of_code(&files.kind).map(OtherFile::text),
        NoSky::of_code(&files.kind).map(NoSky::text),
    ];
    let text = kinds.into_iter().flatten().next();
    counted_as(files.count, text.unwrap_or(["other file", "other files"]))
}

/// How long there were frames, and how long the sky was clear; their number where times do not tell.
fn hours(night: &NightSummary) -> String {
    let Some(hours) = night.hours else {
        return format!("{}; {}", unknown_hours(night), clear_frames(night));
    };
    let clear = |hours: Option<f64>| {
        hours.map_or(String::new(), |hours| format!(", {hours:.2} of them clear"))
    };
    let mut text = format!("{hours:.2}{}", clear(night.clear_hours));
    if let Some(dark) = night.dark_hours {
        text += &format!(
            "; {dark:.2} without twilight{}",
            clear(night.clear_dark_hours)
        );
    }
    if night.timed < night.frames {
        text += &format!(
            "; from the {} of {} frames that have a time",
            night.timed, night.frames
        );
    }
    text
}

/// Why no hours are known.
fn unknown_hours(night: &NightSummary) -> &'static str {
    match night.timed {
        0 => "not known, because no frame has a time",
        1 => "not known, because only one frame has a time",
        _ => "not known, because all frames have the same time",
    }
}

fn clear_frames(night: &NightSummary) -> String {
    match night.judged {
        0 => "cloud cover not known".to_owned(),
        judged => format!("{} of {} clear", night.clear, counted(judged, "frame")),
    }
}

/// How much of the night was clear, in a sentence.
pub(super) fn answer(night: &NightSummary) -> String {
    match (night.hours, night.clear_hours) {
        (Some(hours), Some(clear)) => format!("{clear:.1} of {hours:.1} hours were clear."),
        (None, _) if night.judged > 0 => {
            let frames = counted(night.judged, "frame");
            format!(
                "Clear: {} of {frames}. Hours are {}.",
                night.clear,
                unknown_hours(night)
            )
        }
        _ => "The cloud cover is not known.".to_owned(),
    }
}

/// The median of a series, as it is shown.
pub(super) struct ShownMedian {
    pub(super) name: &'static str,
    /// With its unit.
    pub(super) value: String,
}

/// The medians that there are.
pub(super) fn medians(night: &NightSummary) -> impl Iterator<Item = ShownMedian> {
    let of = &night.median;
    let cloud_percent = of.cloud_share.map(|share| 100.0 * share);
    let mag = |value: Option<f64>, unit: &str| Some(format!("{:.2} {unit}", value?));
    let all = [
        ("zenith", mag(of.zenith_mag_arcsec2, "mag/arcsec²")),
        ("limit", of.limit_vmag.map(|limit| format!("V {limit:.2}"))),
        (
            "measured minus expected limit",
            mag(of.limit_difference_mag, "mag"),
        ),
        (
            "extinction",
            mag(of.extinction_mag_per_airmass, "mag per airmass"),
        ),
        (
            "cloud cover",
            cloud_percent.map(|percent| format!("{percent:.0} %")),
        ),
    ];
    let shown = |(name, value): (&'static str, Option<String>)| {
        Some(ShownMedian {
            name,
            value: value?,
        })
    };
    all.into_iter().filter_map(shown)
}

fn or_dash(text: &str) -> &str {
    if text.is_empty() { "-" } else { text }
}

/// The time of a date, to the second.
fn time_of(date: &str) -> String {
    let time = date.split_once('T').map_or(date, |(_, time)| time);
    time.chars()
        .take(8)
        .collect::<String>()
        .trim_end_matches('Z')
        .to_owned()
}
