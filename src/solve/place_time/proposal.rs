//! What would put a place and a time right.

use super::change::{Change, PlaceTimeCandidate, longitude_of_hours};
use super::contradiction::Contradiction;
use crate::base::epoch::ObservationDate;
use crate::base::format::counted;
use crate::base::units::DEG_PER_RAD;
use crate::ephemeris::observer::{Observation, Site};
use std::fmt;

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

/// A change that would put a place and a time right.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Proposal {
    /// The change that explains the frame best, of its kind.
    pub change: Change,
    /// The place with it.
    pub site: Site,
    /// The time with it.
    pub date: ObservationDate,
    /// Changes of the same kind that explain the frame nearly as well: from and to this, in the unit of the
    /// change.
    pub range: Option<[f64; 2]>,
    /// Odds of the best proposal against it, at least 1.
    pub odds_against: f64,
}

/// Proposals that the best one beats by these odds are left out.
const MAX_ODDS: f64 = 50.0;

/// Of changes with their costs, those that are nearly as good as the best, one of each kind.
pub(super) fn select(mut assessed: Vec<(PlaceTimeCandidate, f64)>) -> Vec<Proposal> {
    assessed.sort_by(|a, b| a.1.total_cmp(&b.1));
    let Some(least) = assessed.first().map(|(_, cost)| *cost) else {
        return Vec::new();
    };
    assessed.retain(|(_, cost)| *cost - least < libm::log(MAX_ODDS));
    let mut proposals: Vec<Proposal> = Vec::new();
    for (candidate, cost) in assessed {
        let amount = candidate.change.amount();
        let same = proposals.iter_mut().find(|kept| {
            let are_of_kind = kept.change.code() == candidate.change.code();
            are_of_kind && kept.is_forward() == amount.map(|amount| amount > 0.0)
        });
        match (same, amount) {
            (Some(kept), Some(amount)) => kept.widen(amount),
            _ => proposals.push(Proposal {
                change: candidate.change,
                site: candidate.site,
                date: candidate.date,
                range: amount.map(|amount| [amount; 2]),
                odds_against: libm::exp(cost - least),
            }),
        }
    }
    proposals
}

impl Proposal {
    fn is_forward(&self) -> Option<bool> {
        self.change.amount().map(|amount| amount > 0.0)
    }

    fn widen(&mut self, amount: f64) {
        if let Some([from, to]) = &mut self.range {
            *from = from.min(amount);
            *to = to.max(amount);
        }
    }

    /// From the smaller shift to the larger one.
    fn sizes(&self) -> [f64; 2] {
        let [a, b] = self.range.unwrap_or_default().map(f64::abs);
        [a.min(b), a.max(b)]
    }
}

/// What it says: `latitude -47.10 in place of 47.10`.
impl fmt::Display for Proposal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (lat, lon) = (self.site.lat_deg(), self.site.lon_deg());
        match self.change {
            Change::LatitudeSign => write!(f, "latitude {lat:.2}° (sign reversed)"),
            Change::LongitudeSign => write!(f, "longitude {lon:.2}° (sign reversed)"),
            Change::BothSigns => write!(f, "site {lat:.2},{lon:.2} (both signs reversed)"),
            Change::Exchanged => {
                write!(f, "site {lat:.2},{lon:.2} (latitude and longitude swapped)")
            }
            Change::Place => write!(
                f,
                "a different site, near {lat:.0},{lon:.0} if the camera points to the zenith"
            ),
            Change::OrderOfDate => write!(
                f,
                "date {} (day, month and year reordered)",
                self.date.to_iso()
            ),
            Change::Hours(hours) => {
                let [least, most] = self.sizes();
                let word = if hours > 0.0 { "later" } else { "earlier" };
                let (clock, way) = if hours > 0.0 {
                    ("behind", "east")
                } else {
                    ("ahead of", "west")
                };
                write!(
                    f,
                    "a time {} h {word} ({}; as if the clock were {} h {clock} UTC, or the longitude {:.0}° \
                     farther {way})",
                    range_text(least, most),
                    self.date.to_iso(),
                    hours.abs(),
                    longitude_of_hours(hours.abs())
                )
            }
            Change::Days(days) => {
                let [least, most] = self.sizes();
                let word = if days > 0 { "later" } else { "earlier" };
                write!(f, "a date {} days {word}", range_text(least, most))
            }
            Change::Years(years) => {
                let word = if years > 0 { "later" } else { "earlier" };
                write!(
                    f,
                    "the date {}, {} {word}",
                    self.date.to_iso(),
                    counted(years.unsigned_abs() as usize, "year")
                )
            }
        }
    }
}

fn range_text(least: f64, most: f64) -> String {
    if least == most {
        format!("{least}")
    } else {
        format!("{least} to {most}")
    }
}

/// What is wrong, and what would put it right, in a sentence.
impl fmt::Display for PlaceTime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let reasons: Vec<String> = self
            .contradictions
            .iter()
            .map(ToString::to_string)
            .collect();
        write!(
            f,
            "the stars contradict the site or the time, so neither is used: {}; ",
            reasons.join("; ")
        )?;
        let proposals: Vec<String> = self.proposals.iter().map(ToString::to_string).collect();
        match &proposals[..] {
            [] => {
                f.write_str("no single change of a sign, the time or the date would resolve this")
            }
            [only] => write!(f, "{only} would resolve this"),
            [others @ .., last] => write!(
                f,
                "one of these would resolve this: {}; or {last}",
                others.join("; ")
            ),
        }
    }
}

impl fmt::Display for Contradiction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::StarsBelowHorizon {
                below,
                named,
                lowest_rad,
            } => write!(
                f,
                "{below} of {named} identified stars would be below the horizon, down to {:.0}°",
                lowest_rad * DEG_PER_RAD
            ),
            Self::Refraction { .. } => f.write_str(
                "the stars fit worse with the refraction at that site and time than without refraction",
            ),
            Self::SunIsUp { altitude_rad } => write!(
                f,
                "the Sun would be at an altitude of {:.0}°, too high for the fainter stars to be visible",
                altitude_rad * DEG_PER_RAD
            ),
            Self::Planets { missing, seen } => write!(
                f,
                "{} should be in the frame but is not; a bright source that is not a star is where {} would \
                 be on another date",
                missing.name(),
                seen.name()
            ),
        }
    }
}
