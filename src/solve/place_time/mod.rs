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
mod contradiction;
mod examination;
mod planets;
mod proposal;
mod sky;
mod sun;
mod zone;

pub use change::Change;
pub use contradiction::Contradiction;
pub use proposal::{PlaceTime, Proposal};
pub(super) use sky::ObservedSky;

use super::identification::observation;
use super::outcome::Outcome;
use super::source::Source;
use crate::base::clock::UtcOffset;
use crate::base::epoch::ObservationDate;
use crate::catalog::Catalog;
use crate::ephemeris::observer::Site;
use crate::ephemeris::places::StarPlaces;
use crate::identify::{DateZone, FrameDate, Priors};
use change::{PlaceTimeCandidate, candidates};
use examination::{Assessed, Examination};

/// An identified frame, with the place and the time that were found good for it.
pub(super) struct ConfirmedPlaceTime {
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
) -> ConfirmedPlaceTime {
    let mut settled = ConfirmedPlaceTime {
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
        let sky = ObservedSky::new(found, sources, catalog);
        let examination = Examination::new(&sky, sources);
        let assessed = examination.assess(site, date);
        let verdict = verdict(&assessed);
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

impl ConfirmedPlaceTime {
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
        let sky = ObservedSky::new(found, sources, catalog);
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

/// What contradicts a place and a time, and what would put it right; `None` where nothing does.
fn verdict(assessed: &Assessed) -> Option<PlaceTime> {
    let mut contradictions = assessed.contradictions();
    let planets = planets::contradiction(assessed);
    contradictions.extend(planets.iter().map(|(contradiction, _)| *contradiction));
    if contradictions.is_empty() {
        return None;
    }
    let by_planets = planets.map(|(_, dates)| dates);
    let others = match (&by_planets, assessed.places.zenith()) {
        (Some(dates), _) => dates.clone(),
        (None, Some(zenith)) => candidates(
            (assessed.site, assessed.date),
            zenith,
            assessed.examination.sky,
        ),
        (None, None) => Vec::new(),
    };
    let held = others
        .into_iter()
        .filter_map(|candidate: PlaceTimeCandidate| {
            let other = assessed.examination.assess(candidate.site, candidate.date);
            let is_possible = other.contradictions().is_empty();
            is_possible.then(|| (candidate, other.cost() + candidate.change.rarity()))
        });
    Some(PlaceTime {
        stated: None,
        contradictions,
        proposals: proposal::select(held.collect()),
    })
}
