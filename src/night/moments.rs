//! The moments of a night at which something changes.

use super::almanac::Almanac;
use super::cells::{NightCells, middles_deg};
use super::change_detection::{DetectedChange, find_changes};
use super::pointing::PointingJump;
use super::row::NightRow;
use crate::base::epoch::ObservationDate;
use crate::base::format::finite;
use crate::base::units::{DEG_PER_RAD, RAD_PER_DEG};
use crate::ephemeris::observer::Site;
use serde::Serialize;
use std::f64::consts::TAU;

/// Least change of the share of the sky that is behind clouds,
const MIN_CLOUDS: f64 = 0.1;
/// of the spot, as a part of it,
const MIN_WIDENING: f64 = 0.05;
/// and of the stars' brightness, in magnitudes.
const MIN_DIMMING_MAG: f64 = 0.1;

/// Frames in which clouds come, or go,
const BEGINNING: usize = 2;
/// and clear ones that they are compared with.
const COMPARED: usize = 3;

/// What changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum MomentKind {
    /// The Sun is 0.8°, 6°, 12° or 18° below the horizon, and sinks.
    TwilightEnds,
    /// The same, and it rises.
    TwilightBegins,
    /// The Moon's upper limb rises.
    Moonrise,
    /// It sets.
    Moonset,
    /// Clouds come.
    CloudsCome,
    /// They are gone.
    CloudsGo,
    /// The camera was moved.
    Knock,
    /// Stars grow wider and dimmer, and the sky no brighter: dew on the lens.
    Dew,
    /// Stars grow wider, and no dimmer: the focus drifts.
    Focus,
    /// Stars grow dimmer all over the sky, and no wider: haze, even clouds, or frost.
    Dimming,
}

impl MomentKind {
    /// In words.
    pub const fn text(self) -> &'static str {
        match self {
            Self::TwilightEnds => "twilight ends",
            Self::TwilightBegins => "twilight begins",
            Self::Moonrise => "moonrise",
            Self::Moonset => "moonset",
            Self::CloudsCome => "clouds come",
            Self::CloudsGo => "clouds go",
            Self::Knock => "the camera was moved",
            Self::Dew => "dew",
            Self::Focus => "focus drifts",
            Self::Dimming => "stars dim over the whole sky",
        }
    }
}

/// A moment at which something changes.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Moment {
    /// What changes.
    pub kind: MomentKind,
    /// When, in UTC.
    pub date: String,
    /// The same as Modified Julian Date.
    pub mjd: f64,
    /// Number of the first frame at or after it, from 0.
    pub frame: usize,
    /// Where clouds enter or leave, from north through east, in degrees.
    pub azimuth_deg: Option<f64>,
    /// By how much the camera was turned, in degrees, or the Sun's altitude.
    pub angle_deg: Option<f64>,
}

impl Moment {
    /// In words.
    pub fn to_text(&self) -> String {
        let mut text = self.kind.text().to_owned();
        if let Some(azimuth_deg) = self.azimuth_deg {
            text += &format!(", {} ({azimuth_deg:.0}°)", compass(azimuth_deg));
        }
        if let Some(angle_deg) = self.angle_deg {
            text += &format!(" ({angle_deg}°)");
        }
        text
    }
}

/// The nearest of 16 compass points.
fn compass(azimuth_deg: f64) -> &'static str {
    const POINTS: [&str; 16] = [
        "N", "NNE", "NE", "ENE", "E", "ESE", "SE", "SSE", "S", "SSW", "SW", "WSW", "W", "WNW",
        "NW", "NNW",
    ];
    POINTS[(azimuth_deg / 22.5).round() as usize % POINTS.len()]
}

/// Rows of a night and their dates.
pub(super) struct DatedRows<'a> {
    rows: &'a [NightRow],
    /// Number, date and Modified Julian Date of those that have one.
    dated: Vec<(usize, ObservationDate, f64)>,
}

impl<'a> DatedRows<'a> {
    pub(super) fn new(rows: &'a [NightRow]) -> Self {
        let dated = rows.iter().enumerate();
        let dated = dated.filter_map(|(at, row)| Some((at, row.observed()?, row.mjd?)));
        Self {
            rows,
            dated: dated.collect(),
        }
    }

    /// All moments, in the order of their dates.
    pub(super) fn moments(&self, site: Option<Site>, knocks: &[PointingJump]) -> Vec<Moment> {
        let mut all = site.map_or(Vec::new(), |site| self.of_almanac(site));
        all.extend(self.clouds());
        all.extend(self.optics());
        all.extend(knocks.iter().filter_map(|jump| {
            let mut moment = self.at(MomentKind::Knock, jump.frame)?;
            moment.angle_deg = finite(jump.shift_deg, 3);
            Some(moment)
        }));
        all.sort_by(|a, b| a.mjd.total_cmp(&b.mjd).then(a.kind.cmp(&b.kind)));
        all
    }

    fn at(&self, kind: MomentKind, frame: usize) -> Option<Moment> {
        let row = &self.rows[frame];
        Some(Moment {
            kind,
            date: row.date.clone(),
            mjd: row.mjd?,
            frame,
            azimuth_deg: None,
            angle_deg: None,
        })
    }

    /// When clouds come and go, and from where to where.
    fn clouds(&self) -> Vec<Moment> {
        let shares: Vec<Option<f64>> = self.rows.iter().map(|row| row.cloud_share).collect();
        let known = |at: &usize| self.rows[*at].cells.is_some();
        let mut moments = Vec::new();
        for DetectedChange { start, end } in find_changes(&shares, MIN_CLOUDS) {
            let clear = (0..start).rev().filter(known).take(COMPARED);
            let cloudy = (start..self.rows.len()).filter(known).take(BEGINNING);
            let come = self.at(MomentKind::CloudsCome, start).map(|moment| Moment {
                azimuth_deg: self.clouds_deg(cloudy, clear),
                ..moment
            });
            let go = end.and_then(|end| {
                let clear = (end..self.rows.len()).filter(known).take(COMPARED);
                let cloudy = (start..end).rev().filter(known).take(BEGINNING);
                Some(Moment {
                    azimuth_deg: self.clouds_deg(cloudy, clear),
                    ..self.at(MomentKind::CloudsGo, end)?
                })
            });
            // What the night begins with does not come.
            let first = shares.iter().position(Option::is_some);
            moments.extend(come.filter(|_| Some(start) != first));
            moments.extend(go);
        }
        moments
    }

    /// The mean azimuth of the clouds that are in the frames `cloudy` and not in those `clear`, from north
    /// through east, in degrees.
    fn clouds_deg(
        &self,
        cloudy: impl Iterator<Item = usize>,
        clear: impl Iterator<Item = usize>,
    ) -> Option<f64> {
        let middles = middles_deg();
        let [cloudy, clear] = [
            self.mean_clouds(cloudy, middles.len()),
            self.mean_clouds(clear, middles.len()),
        ];
        let (mut east, mut north) = (0.0, 0.0);
        for (cell, [altitude_deg, azimuth_deg]) in middles.into_iter().enumerate() {
            let Some(cloudy) = cloudy[cell] else { continue };
            let weight = cloudy - clear[cell].unwrap_or(0.0);
            let weight = weight * libm::cos(altitude_deg * RAD_PER_DEG);
            let (sin, cos) = libm::sincos(azimuth_deg * RAD_PER_DEG);
            east += weight * sin;
            north += weight * cos;
        }
        let turn_rad = libm::atan2(east, north).rem_euclid(TAU);
        (east != 0.0 || north != 0.0)
            .then(|| finite(turn_rad * DEG_PER_RAD, 0))
            .flatten()
    }

    /// The mean probability of clouds in each cell of some frames.
    fn mean_clouds(&self, frames: impl Iterator<Item = usize>, cells: usize) -> Vec<Option<f64>> {
        let mut sums = vec![(0.0, 0.0); cells];
        for NightCells { clear, .. } in frames.filter_map(|at| self.rows[at].cells.as_ref()) {
            for (sum, clear) in sums.iter_mut().zip(clear) {
                if let Some(clear) = clear.get() {
                    sum.0 += 1.0 - clear;
                    sum.1 += 1.0;
                }
            }
        }
        let mean = |(sum, count)| (count > 0.0).then(|| sum / count);
        sums.into_iter().map(mean).collect()
    }

    /// When stars grow wider or dimmer.
    fn optics(&self) -> Vec<Moment> {
        let is_identified = |row: &&NightRow| row.is_identified();
        let of = |value: fn(&NightRow) -> Option<f64>| -> Vec<Option<f64>> {
            let value_of = |row: &NightRow| Some(row).filter(is_identified).and_then(value);
            self.rows.iter().map(value_of).collect()
        };
        let widths = of(|row| row.spot_sigma_px.filter(|px| *px > 0.0).map(libm::log));
        let wider = find_changes(&widths, MIN_WIDENING);
        let dimmer = find_changes(&of(|row| row.dimming_mag), MIN_DIMMING_MAG);
        let meets = |a: &DetectedChange, b: &DetectedChange| {
            let last = |change: &DetectedChange| change.end.unwrap_or(self.rows.len());
            a.start < last(b) && b.start < last(a)
        };
        let mut moments = Vec::new();
        for change in &wider {
            let is_dimmer = dimmer.iter().any(|other| meets(change, other));
            let kind = if is_dimmer {
                MomentKind::Dew
            } else {
                MomentKind::Focus
            };
            moments.extend(self.at(kind, change.start));
        }
        let alone = dimmer
            .iter()
            .filter(|change| !wider.iter().any(|other| meets(change, other)));
        moments.extend(alone.filter_map(|change| self.at(MomentKind::Dimming, change.start)));
        moments
    }

    /// Rise and set of the Moon, and limits of twilight, between the first and the last frame.
    fn of_almanac(&self, site: Site) -> Vec<Moment> {
        const STEP_D: f64 = 1.0 / 1440.0;
        let ([(_, _, first), ..], Some((_, _, last))) = (&self.dated[..], self.dated.last()) else {
            return Vec::new();
        };
        let at = |step: usize| {
            let mjd = first + STEP_D * step as f64;
            let date = ObservationDate::from_modified_julian_date(mjd)?;
            Some((mjd, date, Almanac::at(&date, site)?))
        };
        let steps = ((last - first) / STEP_D) as usize;
        let all: Vec<_> = (0..=steps).filter_map(at).collect();
        let mut moments = Vec::new();
        for pair in all.windows(2) {
            let [(_, _, before), (mjd, date, after)] = [pair[0], pair[1]];
            let mut add = |kind, angle_deg| {
                let next = self.dated.iter().find(|(_, _, of_frame)| *of_frame >= mjd);
                moments.push(Moment {
                    kind,
                    date: date.to_iso(),
                    mjd,
                    frame: next.map_or(self.rows.len() - 1, |(at, _, _)| *at),
                    azimuth_deg: None,
                    angle_deg,
                });
            };
            match (before.is_moon_up(), after.is_moon_up()) {
                (false, true) => add(MomentKind::Moonrise, None),
                (true, false) => add(MomentKind::Moonset, None),
                _ => (),
            }
            for altitude_deg in [-0.833, -6.0, -12.0, -18.0] {
                let is_up = |almanac: &Almanac| almanac.sun_altitude_deg > altitude_deg;
                match (is_up(&before), is_up(&after)) {
                    (true, false) => add(MomentKind::TwilightEnds, Some(altitude_deg)),
                    (false, true) => add(MomentKind::TwilightBegins, Some(altitude_deg)),
                    _ => (),
                }
            }
        }
        moments
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn compass_points_are_the_nearest() {
        assert_eq!(
            [0.0, 11.0, 12.0, 180.0, 281.0, 355.0].map(compass),
            ["N", "N", "NNE", "S", "W", "N"]
        );
    }
}
