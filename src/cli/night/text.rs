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
        ("extinction", median.extinction_mag_per_airmass, " mag per airmass"),
        ("clouds", median.cloud_share.map(|share| 100.0 * share), " %"),
    ];
    let values = values
        .into_iter()
        .filter_map(|(name, value, unit)| Some(format!("{name} {:.2}{unit}", value?)));
    let values: Vec<String> = values.collect();
    if !values.is_empty() {
        let _ = writeln!(text, "medians    {}", values.join(", "));
    }
    for moment in &night.moments {
        let _ = write!(text, "{:<10} {}", time_of(&moment.date), moment.kind.text());
        if let Some(azimuth_deg) = moment.azimuth_deg {
            let _ = write!(text, ", {} ({azimuth_deg:.0}°)", compass(azimuth_deg));
        }
        if let Some(angle_deg) = moment.angle_deg {
            let _ = write!(text, " ({angle_deg}°)");
        }
        text.push('\n');
    }
    text
}

fn or_dash(text: &str) -> &str {
    if text.is_empty() { "-" } else { text }
}

/// The time of a date, to the second.
fn time_of(date: &str) -> String {
    let time = date.split_once('T').map_or(date, |(_, time)| time);
    time.chars().take(8).collect::<String>().trim_end_matches('Z').to_owned()
}

/// The nearest of 16 compass points.
fn compass(azimuth_deg: f64) -> &'static str {
    const POINTS: [&str; 16] = [
        "N", "NNE", "NE", "ENE", "E", "ESE", "SE", "SSE", "S", "SSW", "SW", "WSW", "W", "WNW", "NW",
        "NNW",
    ];
    POINTS[(azimuth_deg / 22.5).round() as usize % POINTS.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn compass_points_are_the_nearest() {
        assert_eq!([0.0, 11.0, 12.0, 180.0, 281.0, 355.0].map(compass), ["N", "N", "NNE", "S", "W", "N"]);
    }
}
