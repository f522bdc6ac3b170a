//! A night in a few numbers.

use super::moments::{DatedRows, Moment};
use super::pointing::PointingJump;
use super::row::NightRow;
use crate::base::format::finite;
use crate::base::statistics::{median, median_of};
use crate::ephemeris::observer::Site;
use serde::Serialize;

/// A night is clear where less of the sky is behind clouds,
const CLEAR_FRACTION: f64 = 0.2;
/// and its stars lost less light than this all over the sky, in magnitudes.
const CLEAR_DIMMING_MAG: f64 = 0.3;
/// Frames further apart do not stand for the time between them, in days.
const MAX_GAP_D: f64 = 0.5 / 24.0;

/// A night in a few numbers.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[expect(missing_docs, reason = "as in docs/night.md")]
#[non_exhaustive]
pub struct NightSummary {
    pub schema: u32,
    pub first_date: String,
    pub last_date: String,
    pub site: Option<[f64; 3]>,
    pub frames: usize,
    pub identified: usize,
    pub held: usize,
    pub unread: usize,
    pub passed_over: Vec<PassedOverFiles>,
    pub timed: usize,
    pub judged: usize,
    pub clear: usize,
    pub hours: Option<f64>,
    pub clear_hours: Option<f64>,
    pub dark_hours: Option<f64>,
    pub clear_dark_hours: Option<f64>,
    pub darkest_hour: Option<DarkestHour>,
    pub median: Medians,
    pub knocks: Vec<PointingJump>,
    pub moments: Vec<Moment>,
    pub hot_pixels: Option<usize>,
    pub site_or_time: Option<String>,
    pub map: Vec<MapCell>,
}

/// Files of one kind that are no frames of the night.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[expect(missing_docs, reason = "as in docs/json.md")]
pub struct PassedOverFiles {
    pub kind: String,
    pub count: usize,
    pub files: Vec<String>,
}

/// The hour with the darkest zenith.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct DarkestHour {
    pub from: String,
    pub to: String,
    pub zenith_mag_arcsec2: f64,
}

/// Medians of the series.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
#[non_exhaustive]
pub struct Medians {
    pub zenith_mag_arcsec2: Option<f64>,
    pub limit_vmag: Option<f64>,
    pub limit_difference_mag: Option<f64>,
    pub extinction_mag_per_airmass: Option<f64>,
    pub cloud_share: Option<f64>,
    pub spot_sigma_px: Option<f64>,
}

/// A place of the sky over the night.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct MapCell {
    pub altitude_deg: f64,
    pub azimuth_deg: f64,
    pub darkest_mag_arcsec2: Option<f64>,
    pub median_mag_arcsec2: Option<f64>,
    pub cloudy: Option<f64>,
}

/// The summary of `rows`, in the order of their dates, without those of frames that were passed over.
pub fn summarize(rows: &[NightRow], site: Option<Site>, knocks: &[PointingJump]) -> NightSummary {
    let count = |is: fn(&NightRow) -> bool| rows.iter().filter(|row| is(row)).count();
    let hours = |is: fn(&NightRow) -> bool| hours_of(rows, is).and_then(|hours| finite(hours, 3));
    let judged = count(|row| row.cloud_share.is_some());
    let has_sun = rows.iter().any(|row| !row.twilight.is_empty());
    let is_dark = |row: &NightRow| row.twilight == "night";
    let mut dates = rows
        .iter()
        .filter(|row| row.no_sky().is_none())
        .map(|row| &row.date)
        .filter(|date| !date.is_empty());
    let first_date = dates.next().cloned().unwrap_or_default();
    NightSummary {
        schema: 1,
        last_date: dates.next_back().unwrap_or(&first_date).clone(),
        first_date,
        site: site.map(|site| [site.lat_deg(), site.lon_deg(), site.height_m()]),
        frames: count(|row| row.no_sky().is_none()),
        identified: count(NightRow::is_identified),
        held: count(|row| row.pointing == "held"),
        unread: count(NightRow::is_unread),
        passed_over: Vec::new(),
        timed: count(|row| row.mjd.is_some()),
        judged,
        clear: count(is_clear),
        hours: hours(|_| true),
        clear_hours: hours(is_clear).filter(|_| judged > 0),
        dark_hours: hours(is_dark).filter(|_| has_sun),
        clear_dark_hours: hours(|row| row.twilight == "night" && is_clear(row))
            .filter(|_| judged > 0 && has_sun),
        darkest_hour: darkest_hour(rows),
        median: Medians {
            zenith_mag_arcsec2: median_of_rows(rows, |row| row.zenith_mag_arcsec2),
            limit_vmag: median_of_rows(rows, |row| row.limit_vmag),
            limit_difference_mag: median_of_rows(rows, |row| row.limit_difference_mag),
            extinction_mag_per_airmass: median_of_rows(rows, |row| {
                row.extinction_mag_per_airmass
                    .filter(|_| row.extinction_measured)
            }),
            cloud_share: median_of_rows(rows, |row| row.cloud_share),
            spot_sigma_px: median_of_rows(rows, |row| row.spot_sigma_px),
        },
        moments: DatedRows::new(rows).moments(site, knocks),
        knocks: knocks.to_vec(),
        hot_pixels: None,
        site_or_time: None,
        map: map(rows),
    }
}

fn is_clear(row: &NightRow) -> bool {
    row.cloud_share.is_some_and(|share| share < CLEAR_FRACTION)
        && row.dimming_mag.is_none_or(|mag| mag < CLEAR_DIMMING_MAG)
}

fn median_of_rows(rows: &[NightRow], value: fn(&NightRow) -> Option<f64>) -> Option<f64> {
    finite(median_of(rows.iter().filter_map(value))?, 4)
}

/// Hours for which frames stand that are like this: each half of the way to its neighbors. `None` where the frames
/// have fewer than two times.
fn hours_of(rows: &[NightRow], is: fn(&NightRow) -> bool) -> Option<f64> {
    let dated: Vec<(f64, bool)> = rows
        .iter()
        .filter_map(|row| Some((row.mjd?, is(row))))
        .collect();
    let half = |pair: &[(f64, bool)]| {
        let gap_d = (pair[1].0 - pair[0].0).clamp(0.0, MAX_GAP_D);
        0.5 * gap_d * f64::from(u8::from(pair[0].1) + u8::from(pair[1].1))
    };
    let has_two = dated.first()?.0 < dated.last()?.0;
    has_two.then(|| 24.0 * dated.windows(2).map(half).sum::<f64>())
}

/// The hour, or what there is of it, in which the median of the zenith is darkest.
fn darkest_hour(rows: &[NightRow]) -> Option<DarkestHour> {
    const HOUR_D: f64 = 1.0 / 24.0;
    const MIN_FRAMES: usize = 3;
    let known = rows
        .iter()
        .filter_map(|row| Some((row.mjd?, row.zenith_mag_arcsec2?, row)));
    let known: Vec<(f64, f64, &NightRow)> = known.collect();
    let hour = |start: usize| {
        let frames = known[start..]
            .iter()
            .take_while(|(mjd, _, _)| mjd - known[start].0 <= HOUR_D);
        let mut values: Vec<f64> = frames.map(|(_, mag, _)| *mag).collect();
        let last = start + values.len() - 1;
        (values.len() >= MIN_FRAMES).then(|| (median(&mut values), start, last))
    };
    let darkest = (0..known.len())
        .filter_map(hour)
        .max_by(|a, b| a.0.total_cmp(&b.0));
    let (mag, first, last) = darkest?;
    Some(DarkestHour {
        from: known[first].2.date.clone(),
        to: known[last].2.date.clone(),
        zenith_mag_arcsec2: finite(mag, 3)?,
    })
}

/// Each place of the sky over the night, where it was seen.
fn map(rows: &[NightRow]) -> Vec<MapCell> {
    let cells: Vec<_> = rows.iter().filter_map(|row| row.cells.as_ref()).collect();
    let middles = super::cells::middles_deg();
    let of = |(cell, [altitude_deg, azimuth_deg]): (usize, &[f64; 2])| {
        let mags = cells
            .iter()
            .filter_map(|cells| cells.mag_arcsec2[cell].get());
        let clear: Vec<f64> = cells
            .iter()
            .filter_map(|cells| cells.clear[cell].get())
            .collect();
        let cloudy = clear.iter().filter(|clear| **clear < 0.5).count();
        let darkest = mags.clone().reduce(f64::max);
        let seen = darkest.is_some() || !clear.is_empty();
        seen.then(|| MapCell {
            altitude_deg: *altitude_deg,
            azimuth_deg: finite(*azimuth_deg, 3).unwrap_or(0.0),
            darkest_mag_arcsec2: darkest.and_then(|mag| finite(mag, 2)),
            median_mag_arcsec2: median_of(mags).and_then(|mag| finite(mag, 2)),
            cloudy: (!clear.is_empty())
                .then(|| cloudy as f64 / clear.len() as f64)
                .and_then(|share| finite(share, 3)),
        })
    };
    middles.iter().enumerate().filter_map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Clear frames at these Modified Julian Dates, and one behind clouds.
    fn summary(mjds: &[Option<f64>]) -> NightSummary {
        let row = |(number, mjd): (usize, &Option<f64>)| NightRow {
            mjd: *mjd,
            cloud_share: Some(if number == 0 { 0.9 } else { 0.0 }),
            ..NightRow::default()
        };
        let rows: Vec<NightRow> = mjds.iter().enumerate().map(row).collect();
        summarize(&rows, None, &[])
    }

    #[test]
    fn hours_are_known_where_two_times_are() {
        let day = 61_055.0;
        for unknown in [
            &[][..],
            &[None; 3],
            &[Some(day)],
            &[Some(day), Some(day), None],
        ] {
            let night = summary(unknown);
            assert_eq!(
                (night.hours, night.clear_hours),
                (None, None),
                "{unknown:?}"
            );
            assert_eq!(night.clear, unknown.len().saturating_sub(1));
            assert_eq!(night.judged, unknown.len());
        }
        let night = summary(&[Some(day), None, Some(day + 0.01)]);
        assert_eq!((night.hours, night.clear_hours), (Some(0.24), Some(0.12)));
        // Without a site, nothing is known of twilight.
        assert_eq!((night.dark_hours, night.timed), (None, 2));
    }
}
