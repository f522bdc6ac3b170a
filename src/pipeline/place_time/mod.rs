//! Do the stars agree with the place and the time that are stated? If not, what would put it right?
//!
//! (identified frame, site, date) → [`PlaceTime`] where they contradict each other
//!
//! Place and time say where the zenith is among the stars, and where the Sun is. Against that stand:
//!
//! 1. Named stars below the horizon.
//! 2. Refraction: with the stated zenith the stars are farther from their places than without any air.
//! 3. Stars fainter than a sky lit by the Sun would show.
//! 4. A bright planet where there is none, and one in its stead that another reading of the date explains.
//!
//! Each of these alone has to be as good as impossible where place and time are right. Then changes that a
//! single mistake makes are tried: signs, order, hours, days. Those that explain the frame as well as the best
//! does are proposed. Where an all-sky camera looks orders them: its axis is near the zenith.
//!
//! Caveat: an hour of time and 15° of longitude are the same to the stars, and 15 days nearly so.

mod bending;
mod change;
mod planets;
mod proposal;
mod sky;
mod sun;
mod zone;

pub use change::Change;
pub use proposal::Proposal;
pub(super) use sky::Sky;

use super::identification::observation;
use super::outcome::Outcome;
use super::solution::Source;
use crate::base::clock::UtcOffset;
use crate::base::epoch::ObservationDate;
use crate::identify::{DateZone, FrameDate, Priors};
use crate::sky::catalog::Catalog;
use crate::sky::observer::{Observation, Site};
use crate::sky::places::StarPlaces;
use crate::sky::solar_system::BodyKind;
use bending::Bending;
use change::{Candidate, candidates};

/// A place and a time that the stars contradict.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct PlaceTime {
    /// Where the frame's centre would be in the sky.
    pub stated: Option<Observation>,
    /// What contradicts them.
    pub contradictions: Vec<Contradiction>,
    /// What would put them right, the most likely first.
    pub proposals: Vec<Proposal>,
}

/// What contradicts a place and a time.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Contradiction {
    /// Stars are named that would be below the horizon.
    StarsBelowHorizon {
        /// How many.
        below: usize,
        /// Of how many.
        named: usize,
        /// True altitude of the lowest, in radians.
        lowest_rad: f64,
    },
    /// The air would bend light otherwise.
    Refraction {
        /// By how much the squared misfit is larger than without air, in standard errors.
        excess: f64,
    },
    /// The sky would be brighter than the stars.
    SunIsUp {
        /// True altitude of the Sun, in radians.
        altitude_rad: f64,
    },
    /// A planet is not where it would be, and another one is where there is none.
    Planets {
        /// The one that is missing.
        missing: BodyKind,
        /// The one that another date has where a detection is no star.
        seen: BodyKind,
    },
}

impl Contradiction {
    /// Code for programs.
    pub const fn code(&self) -> &'static str {
        match self {
            Self::StarsBelowHorizon { .. } => "stars_below_horizon",
            Self::Refraction { .. } => "refraction",
            Self::SunIsUp { .. } => "sun_is_up",
            Self::Planets { .. } => "planets",
        }
    }
}

/// An identified frame, with the place and the time that were found good for it.
pub(super) struct Settled {
    pub outcome: Outcome,
    /// Where the catalogue's stars appear.
    pub places: StarPlaces,
    /// Without a site that is contradicted, and with the zone that was found.
    pub priors: Priors,
    /// What contradicts place and time.
    pub place_time: Option<PlaceTime>,
}

/// Holds the outcome of `identify`, found at `places`, against the place and the time of `priors`. Where they
/// are contradicted, the frame is identified again without air.
pub(super) fn settle(
    (outcome, places): (Outcome, StarPlaces),
    (priors, offset): (&Priors, Option<UtcOffset>),
    (sources, catalog): (&[Source], &Catalog),
    mut identify: impl FnMut(StarPlaces) -> (Outcome, StarPlaces),
) -> Settled {
    let mut settled = Settled {
        outcome,
        places,
        priors: *priors,
        place_time: None,
    };
    if offset == Some(UtcOffset::Auto) {
        settled.find_zone(sources, catalog, &mut identify);
    }
    let Some((site, date)) = settled.stated() else {
        return settled;
    };
    let examined = |outcome: &Outcome| {
        let found = outcome.identification()?;
        let sky = Sky::new(found, sources, catalog);
        let examination = Examination::new(&sky, sources);
        let assessed = examination.of(site, date);
        let verdict = assessed.verdict();
        Some((assessed.is_odd() || verdict.is_some(), verdict))
    };
    let Some((is_odd, mut verdict)) = examined(&settled.outcome) else {
        return settled;
    };
    if is_odd && settled.places.has_refraction() {
        // The wrong air may have spoiled the fit, or its names.
        let airless = identify(settled.places.without_refraction());
        verdict = examined(&airless.0).and_then(|(_, verdict)| verdict);
        if verdict.is_some() {
            (settled.outcome, settled.places) = airless;
        }
    }
    settled.place_time = verdict.map(|verdict| PlaceTime {
        stated: observation(&settled.outcome, &settled.priors),
        ..verdict
    });
    if settled.place_time.is_some() {
        settled.distrust();
    }
    settled
}

impl Settled {
    /// The place, and the time as it is stated or assumed.
    fn stated(&self) -> Option<(Site, ObservationDate)> {
        let known = self.priors.date.filter(|known| known.date.has_time())?;
        Some((self.priors.site?, known.date))
    }

    /// Sets the zone of a local time by the stars, and identifies the frame with it.
    fn find_zone(
        &mut self,
        sources: &[Source],
        catalog: &Catalog,
        identify: &mut impl FnMut(StarPlaces) -> (Outcome, StarPlaces),
    ) {
        let local = self
            .priors
            .date
            .filter(|known| known.zone == DateZone::Unknown);
        let found = self.outcome.identification();
        let (Some(local), Some(site), Some(found)) = (local, self.priors.site, found) else {
            return;
        };
        let sky = Sky::new(found, sources, catalog);
        let examination = Examination::new(&sky, sources);
        let Some((ahead, date)) = zone::by_stars(&examination, site, local.date) else {
            return;
        };
        self.priors.date = Some(FrameDate {
            date,
            zone: DateZone::ByStars(ahead),
            ..local
        });
        let in_air = identify(self.priors.places());
        if in_air.0.identification().is_some() {
            (self.outcome, self.places) = in_air;
        }
    }

    /// Takes place and time for unknown.
    fn distrust(&mut self) {
        self.priors.site = None;
        if let Some(known) = &mut self.priors.date {
            known.zone = DateZone::Contradicted;
        }
    }
}

/// What a frame shows, ready to be held against places and times.
struct Examination<'a> {
    sky: &'a Sky<'a>,
    sources: &'a [Source],
    bending: Option<Bending<'a>>,
}

/// A place and a time held against a frame.
struct Assessed<'e, 'a> {
    examination: &'e Examination<'a>,
    site: Site,
    date: ObservationDate,
    places: StarPlaces,
    below: Vec<f64>,
    lowest_rad: f64,
    /// Excess of the squared misfit over that without air.
    bending: f64,
    sun_rad: f64,
    /// By how many magnitudes the faint stars are fainter than what a lit sky would hide.
    hidden_mag: f64,
}

impl<'a> Examination<'a> {
    fn new(sky: &'a Sky<'a>, sources: &'a [Source]) -> Self {
        Self {
            sky,
            sources,
            bending: Bending::new(sky),
        }
    }

    fn of(&self, site: Site, date: ObservationDate) -> Assessed<'_, 'a> {
        let places = StarPlaces::at(&date, Some(site), None);
        let mut assessed = Assessed {
            examination: self,
            site,
            date,
            places,
            below: Vec::new(),
            lowest_rad: 0.0,
            bending: self
                .bending
                .as_ref()
                .map_or(0.0, |bending| bending.excess(&places)),
            sun_rad: 0.0,
            hidden_mag: 0.0,
        };
        let Some(zenith) = places.zenith() else {
            return assessed;
        };
        let hidden_rad = -hidden_depth_rad(&site);
        for star in &self.sky.stars {
            let altitude_rad = libm::asin(zenith.dot(&star.airless).clamp(-1.0, 1.0));
            if altitude_rad < hidden_rad {
                assessed.below.push(star.p_chance);
            }
            assessed.lowest_rad = assessed.lowest_rad.min(altitude_rad);
        }
        assessed.sun_rad = sun::altitude_rad(&date, site, zenith);
        assessed.hidden_mag = sun::hidden_mag(self.sky, assessed.sun_rad);
        assessed
    }
}

/// How far below the horizon something may be and still be seen: by refraction, and from a mountain. The
/// height of a site is often not given.
fn hidden_depth_rad(site: &Site) -> f64 {
    const EARTH_RADIUS_M: f64 = 6.371e6;
    /// Refraction at the horizon, in radians, and some more.
    const REFRACTION_RAD: f64 = 0.012;
    const HIGH_M: f64 = 3000.0;
    let height_m = site.height_m().max(HIGH_M);
    REFRACTION_RAD + libm::acos(EARTH_RADIUS_M / (EARTH_RADIUS_M + height_m))
}

impl Assessed<'_, '_> {
    /// More squared standard errors than this are no accident: six standard deviations and more, whatever the
    /// refraction is.
    const REFRACTION_LIMIT: f64 = 60.0;
    /// A named star may be no star at all with at least this probability.
    const LEAST_CHANCE: f64 = 0.01;

    /// log10 of the probability that all names below the horizon are chance.
    fn log10_chance_below(&self) -> f64 {
        let chances = self
            .below
            .iter()
            .map(|chance| chance.max(Self::LEAST_CHANCE));
        chances.map(libm::log10).sum()
    }

    /// Whether anything speaks against it.
    fn is_odd(&self) -> bool {
        const ODD_EXCESS: f64 = 10.0;
        !self.below.is_empty() || self.bending > ODD_EXCESS || !self.contradictions().is_empty()
    }

    /// What is as good as impossible if it is true.
    fn contradictions(&self) -> Vec<Contradiction> {
        /// Fewer stars may share one cause: a lamp, an aeroplane.
        const MIN_BELOW: usize = 3;
        const LOG10_LIMIT: f64 = -5.0;
        let mut all = Vec::new();
        if self.below.len() >= MIN_BELOW && self.log10_chance_below() < LOG10_LIMIT {
            all.push(Contradiction::StarsBelowHorizon {
                below: self.below.len(),
                named: self.examination.sky.stars.len(),
                lowest_rad: self.lowest_rad,
            });
        }
        if self.bending > Self::REFRACTION_LIMIT {
            let excess = self.bending;
            all.push(Contradiction::Refraction { excess });
        }
        if self.hidden_mag > 0.0 {
            let altitude_rad = self.sun_rad;
            all.push(Contradiction::SunIsUp { altitude_rad });
        }
        all
    }

    /// How badly it explains the frame: the negative logarithm of its odds.
    fn cost(&self) -> f64 {
        const PER_STAR_BELOW: f64 = 4.6;
        const MAX_BENDING: f64 = 50.0;
        let bending = (self.bending / 2.0).clamp(-MAX_BENDING, MAX_BENDING);
        let tilt = self.tilt_rad().map_or(0.0, cost_of_tilt);
        PER_STAR_BELOW * self.below.len() as f64 + bending + tilt + sun::cost(self.sun_rad)
    }

    /// The angle between the axis of an all-sky camera and the zenith.
    fn tilt_rad(&self) -> Option<f64> {
        let level = self.examination.sky.level_zenith()?;
        Some(self.places.zenith()?.angle_to(&level))
    }

    /// What contradicts it, and what would put it right; `None` where nothing does.
    fn verdict(&self) -> Option<PlaceTime> {
        let mut contradictions = self.contradictions();
        let planets = planets::contradiction(self);
        contradictions.extend(planets.iter().map(|(contradiction, _)| *contradiction));
        if contradictions.is_empty() {
            return None;
        }
        let by_planets = planets.map(|(_, dates)| dates);
        let others = match (&by_planets, self.places.zenith()) {
            (Some(dates), _) => dates.clone(),
            (None, Some(zenith)) => {
                candidates((self.site, self.date), zenith, self.examination.sky)
            }
            (None, None) => Vec::new(),
        };
        let assessed = others.into_iter().filter_map(|candidate: Candidate| {
            let other = self.examination.of(candidate.site, candidate.date);
            let is_possible = other.contradictions().is_empty();
            is_possible.then(|| (candidate, other.cost() + candidate.change.rarity()))
        });
        Some(PlaceTime {
            stated: None,
            contradictions,
            proposals: proposal::of(assessed.collect()),
        })
    }
}

/// How unlikely it is that an all-sky camera is tilted by so much: most stand level within degrees, some do
/// not.
fn cost_of_tilt(tilt_rad: f64) -> f64 {
    const LEVEL_RAD: f64 = 0.07;
    const TILTED: f64 = 0.03;
    const TILTED_RAD: f64 = 0.5;
    let level = tilt_rad / LEVEL_RAD;
    let likely = (1.0 - TILTED) * libm::exp(-0.5 * level * level)
        + TILTED * libm::exp(-tilt_rad / TILTED_RAD);
    -libm::log(likely)
}
