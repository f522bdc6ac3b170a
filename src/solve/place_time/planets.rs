//! Bright planets: where none is though one would be, and one that another reading of the date explains.
//!
//! A planet that is missing alone says little: it may be behind a tree, and drawn frames have none.

use super::change::{PlaceTimeCandidate, other_dates};
use super::contradiction::Contradiction;
use super::examination::Assessed;
use crate::base::coords::{PixelPoint, UnitVector};
use crate::base::statistics::median_of;
use crate::base::units::RAD_PER_DEG;
use crate::ephemeris::solar_system::{Body, BodyKind, TimeError, bodies_at};
use crate::solve::body_in_frame::BodyInFrame;
use std::collections::HashSet;

/// Planets to this V magnitude are missed where they are missing.
const CONSPICUOUS_V_MAG: f64 = -0.5;
/// Sources to this are bright enough for a planet.
const BRIGHT_V_MAG: f64 = 2.0;
/// Sine of the altitude below which lamps stand.
const LOW: f64 = 0.26;
/// By how much a planet's magnitude may be off: tone curves, clipped cores.
const MAX_OFF_MAG: f64 = 2.5;

/// A bright source that is no star.
struct Stranger {
    position: PixelPoint,
    v_mag: f64,
}

/// That a conspicuous planet is missing, with the dates that have one where a bright source is no star, and
/// miss none.
pub(super) fn contradiction(
    assessed: &Assessed,
) -> Option<(Contradiction, Vec<PlaceTimeCandidate>)> {
    let strangers = strangers(assessed);
    if strangers.is_empty() {
        return None;
    }
    let missing = missing(
        assessed,
        &bodies_of(assessed, &assessed.as_candidate()),
        &strangers,
    )?;
    let mut seen = None;
    let mut dates = Vec::new();
    for candidate in other_dates((assessed.site, assessed.date)) {
        let bodies = bodies_of(assessed, &candidate);
        let is = |body: &&BodyInFrame| {
            strangers
                .iter()
                .any(|stranger| stranger.may_be(body, assessed))
        };
        let there = bodies.iter().find(is);
        if let (Some(there), None) = (there, self::missing(assessed, &bodies, &strangers)) {
            seen = seen.or(Some(there.body.kind));
            dates.push(candidate);
        }
    }
    let seen = seen?;
    Some((Contradiction::Planets { missing, seen }, dates))
}

impl Assessed<'_, '_> {
    fn as_candidate(&self) -> PlaceTimeCandidate {
        PlaceTimeCandidate {
            change: super::Change::Hours(0.0),
            site: self.site,
            date: self.date,
        }
    }

    fn is_high(&self, position: &PixelPoint) -> bool {
        let found = self.examination.sky.found;
        let direction = found.apparent_direction_of(position);
        let zenith = self.places.zenith();
        zenith
            .zip(direction)
            .is_some_and(|(zenith, direction): (_, UnitVector<_>)| zenith.dot(&direction) > LOW)
    }

    fn gate_px(&self) -> f64 {
        const RESIDUALS: f64 = 3.0;
        const BLOOMED_PX: f64 = 4.0;
        RESIDUALS * self.examination.sky.found.rms_px + BLOOMED_PX
    }
}

impl Stranger {
    fn may_be(&self, seen: &BodyInFrame, assessed: &Assessed) -> bool {
        (self.v_mag - seen.body.v_mag).abs() < MAX_OFF_MAG
            && seen.position.distance_to(&self.position) < seen.uncertainty_px + assessed.gate_px()
    }
}

/// The bright sources well above the horizon that no star is.
fn strangers(assessed: &Assessed) -> Vec<Stranger> {
    let examination = assessed.examination;
    let (sources, found) = (examination.sources, examination.sky.found);
    let named: HashSet<usize> = found
        .matches
        .iter()
        .map(|named| named.source.get())
        .collect();
    let stars = examination.sky.stars.iter();
    let zero_points =
        stars.filter_map(|star| Some(star.v_mag - sources[star.source.get()].instrumental_mag()?));
    let Some(zero_point) = median_of(zero_points) else {
        return Vec::new();
    };
    let unnamed = sources.iter().enumerate().filter(|(at, source)| {
        let is_starlike = source
            .measured
            .is_none_or(|m| !(m.flags.trail || m.flags.hot_pixel));
        !named.contains(at) && is_starlike
    });
    let strangers = unnamed.filter_map(|(_, source)| {
        let v_mag = zero_point + source.instrumental_mag()?;
        (v_mag < BRIGHT_V_MAG && assessed.is_high(&source.position)).then_some(Stranger {
            position: source.position,
            v_mag,
        })
    });
    strangers.collect()
}

/// The bright planets in the frame at a place and time.
fn bodies_of(assessed: &Assessed, candidate: &PlaceTimeCandidate) -> Vec<BodyInFrame> {
    let found = assessed.examination.sky.found;
    let bodies = bodies_at(&candidate.date, TimeError::None, Some(candidate.site));
    let bright = bodies
        .into_iter()
        .filter(|body: &Body| body.kind != BodyKind::Moon && body.v_mag < BRIGHT_V_MAG);
    bright
        .filter_map(|body| BodyInFrame::expected(body, found))
        .collect()
}

/// A conspicuous planet that would be well within the frame, and that no source may be.
fn missing(
    assessed: &Assessed,
    bodies: &[BodyInFrame],
    strangers: &[Stranger],
) -> Option<BodyKind> {
    let conspicuous = bodies.iter().filter(|seen| {
        seen.body.v_mag < CONSPICUOUS_V_MAG
            && assessed.is_high(&seen.position)
            && is_among_stars(assessed, seen)
    });
    let gone = conspicuous.filter(|seen| {
        !strangers
            .iter()
            .any(|stranger| stranger.may_be(seen, assessed))
    });
    gone.map(|seen| seen.body.kind).next()
}

/// Whether stars are named on all sides of a planet: nothing stands before the sky there.
fn is_among_stars(assessed: &Assessed, seen: &BodyInFrame) -> bool {
    const NEAR_RAD: f64 = 12.0 * RAD_PER_DEG;
    let direction = assessed
        .examination
        .sky
        .found
        .apparent_direction_of(&seen.position);
    let Some(direction) = direction else {
        return false;
    };
    let stars = &assessed.examination.sky.stars;
    let near = stars
        .iter()
        .filter(|star| star.airless.angle_to(&direction) < NEAR_RAD);
    let mut sides = [false; 4];
    for star in near {
        let right = usize::from(star.pixel.x > seen.position.x);
        let down = usize::from(star.pixel.y > seen.position.y);
        sides[2 * right + down] = true;
    }
    sides.into_iter().all(|is_seen| is_seen)
}
