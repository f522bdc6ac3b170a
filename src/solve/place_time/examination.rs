//! A frame held against places and times.

use super::bending::Bending;
use super::contradiction::Contradiction;
use super::sky::ObservedSky;
use super::sun;
use crate::base::epoch::ObservationDate;
use crate::ephemeris::observer::Site;
use crate::ephemeris::places::StarPlaces;
use crate::solve::source::Source;

/// What a frame shows, ready to be held against places and times.
pub(super) struct Examination<'a> {
    pub sky: &'a ObservedSky<'a>,
    pub sources: &'a [Source],
    pub bending: Option<Bending<'a>>,
}

/// A place and a time held against a frame.
pub(super) struct Assessed<'e, 'a> {
    pub examination: &'e Examination<'a>,
    pub site: Site,
    pub date: ObservationDate,
    pub places: StarPlaces,
    pub below: Vec<f64>,
    pub lowest_rad: f64,
    /// Excess of the squared misfit over that without air.
    pub bending: f64,
    pub sun_rad: f64,
    /// By how many magnitudes the faint stars are fainter than what a lit sky would hide.
    pub hidden_mag: f64,
}

impl<'a> Examination<'a> {
    pub fn new(sky: &'a ObservedSky<'a>, sources: &'a [Source]) -> Self {
        Self {
            sky,
            sources,
            bending: Bending::new(sky),
        }
    }

    pub fn assess(&self, site: Site, date: ObservationDate) -> Assessed<'_, 'a> {
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
    const MIN_CHANCE: f64 = 0.01;

    /// log10 of the probability that all names below the horizon are chance.
    pub fn log10_chance_below(&self) -> f64 {
        let chances = self.below.iter().map(|chance| chance.max(Self::MIN_CHANCE));
        chances.map(libm::log10).sum()
    }

    /// Whether anything speaks against it.
    pub fn is_odd(&self) -> bool {
        const ODD_EXCESS: f64 = 10.0;
        !self.below.is_empty() || self.bending > ODD_EXCESS || !self.contradictions().is_empty()
    }

    /// What is as good as impossible if it is true.
    pub fn contradictions(&self) -> Vec<Contradiction> {
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
    pub fn cost(&self) -> f64 {
        const PER_STAR_BELOW: f64 = 4.6;
        const MAX_BENDING: f64 = 50.0;
        let bending = (self.bending / 2.0).clamp(-MAX_BENDING, MAX_BENDING);
        let tilt = self.tilt_rad().map_or(0.0, cost_of_tilt);
        PER_STAR_BELOW * self.below.len() as f64 + bending + tilt + sun::cost(self.sun_rad)
    }

    /// The angle between the axis of an all-sky camera and the zenith.
    pub fn tilt_rad(&self) -> Option<f64> {
        let level = self.examination.sky.level_zenith()?;
        Some(self.places.zenith()?.angle_to(&level))
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
