//! A night for people.

use starpipe::base::format::counted;
use starpipe::night::NightSummary;
use std::fmt::Write as _;

/// The summary as text.
pub(super) fn text(night: &NightSummary) -> String {
    let mut text = format!(
        "night      {} to {}: {}, {} identified, {} held, {} unread\n",
        or_dash(&night.first_date),
        or_dash(&night.last_date),
        counted(night.frames, "frame"),
        night.identified,
        night.held,
        night.unread
    );
    let _ = writeln!(
        text,
        "hours      {:.2}, {:.2} of them clear; {:.2} without twilight, {:.2} of them clear",
        night.hours, night.clear_hours, night.dark_hours, night.clear_dark_hours
    );
    if let Some(hour) = &night.darkest_hour {
        let _ = writeln!(
            text,
            "darkest    zenith V {:.2} mag/arcsec² from {} to {}",
            hour.zenith_mag_arcsec2, hour.from, hour.to
        );
    }
    let median = &night.median;
    let values = [
        ("zenith", median.zenith_mag_arcsec2, " mag/arcsec²"),
        ("limit", median.limit_vmag, " V"),
        ("minus expected", median.limit_difference_mag, " mag"),
        (
            "extinction",
            median.extinction_mag_per_airmass,
            " mag per airmass",
        ),
        (
            "clouds",
            median.cloud_share.map(|share| 100.0 * share),
            " %",
        ),
    ];
    let values = values
        .into_iter()
        .filter_map(|(name, value, unit)| Some(format!("{name} {:.2}{unit}", value?)));
    let values: Vec<String> = values.collect();
    if !values.is_empty() {
        let _ = writeln!(text, "medians    {}", values.join(", "));
    }
    if let Some(pixels) = night.hot_pixels.filter(|pixels| *pixels > 0) {
        let _ = writeln!(
            text,
            "hot        {}, listed in hot-pixels.csv",
            counted(pixels, "pixel")
        );
    }
    for moment in &night.moments {
        let _ = writeln!(text, "{:<10} {}", time_of(&moment.date), moment.to_text());
    }
    text
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
