//! What the first frames tell of a camera and its night.

use crate::base::coords::{Camera, Horizon, Rotation};
use crate::base::statistics::median_of;
use crate::camera::KnownLens;
use crate::ephemeris::observer::Site;
use crate::identify::lens::{LensFrame, calibrate};
use crate::identify::{DateZone, Identification};
use crate::sky::{ClearSky, CurveEvidence, DarkLevel, DarkSource};
use crate::solve::{FixedCamera, Outcome, Solution};
use jiff::SignedDuration;
use std::sync::Arc;

/// Frames that tell the lens at least, where so many are identified.
const WANTED: usize = 5;
/// Frames that are tried at most.
const MAX_TRIED: usize = 40;

/// A frame that was identified with nothing known beforehand.
#[derive(Debug, Clone)]
pub struct Probe {
    stars: LensFrame,
    camera: KnownLens,
    /// Modified Julian Date.
    mjd: Option<f64>,
    pointing: Option<Rotation<Horizon, Camera>>,
    sigma_rad: f64,
    spot_sigma_px: Option<f64>,
    clear_sky: Option<ClearSky>,
    has_exposure: bool,
    curves: Option<CurveEvidence>,
    has_dark_level: bool,
    site: Option<Site>,
    /// What its local time is ahead of UTC, by the stars.
    ahead: Option<SignedDuration>,
    /// What the stars contradict of place and time.
    site_or_time: Option<String>,
}

impl Probe {
    /// That of a solved frame; `None` if its stars are not identified.
    pub fn from_solution(name: &str, solution: &Solution) -> Option<Self> {
        let Outcome::Identified(found) = &solution.outcome else {
            return None;
        };
        let date = solution.date.map(|known| known.date);
        Some(Self {
            stars: solution.lens_frame(name).ok()?,
            camera: KnownLens::with_assumed_errors(found.camera)?,
            mjd: date.and_then(|date| date.modified_julian_date()),
            pointing: horizon_attitude(found),
            sigma_rad: found.attitude_sigma_rad().into_iter().fold(0.0, f64::max),
            spot_sigma_px: solution.spot_sigma_px,
            clear_sky: solution.sky.as_ref().map(|sky| sky.clear_sky),
            has_exposure: solution.exposure_s.is_some(),
            curves: solution
                .sky
                .as_ref()
                .and_then(|sky| sky.curve_evidence.clone()),
            has_dark_level: solution.sky.as_ref().is_none_or(|sky| {
                let source = sky.dark.map(|dark| dark.source);
                source.is_some_and(|source| source != DarkSource::Darkest)
            }),
            site: solution.site,
            ahead: match solution.date.map(|known| known.zone) {
                Some(DateZone::ByStars(ahead)) => Some(ahead),
                _ => None,
            },
            site_or_time: solution.place_time.as_ref().map(ToString::to_string),
        })
    }
}

/// How an identified camera stands in the sky of its site: apparent directions in the axes of the horizon
/// to camera axes. `None` where site or time are not known.
pub(super) fn horizon_attitude(found: &Identification) -> Option<Rotation<Horizon, Camera>> {
    let horizon = found.places.horizon()?;
    let matrix = found.icrs_to_camera.matrix() * horizon.matrix().transpose();
    Some(Rotation::from_matrix(matrix))
}

/// What is held from the start of a night.
#[derive(Debug, Clone, Default)]
pub struct NightStart {
    /// The lens.
    pub lens: Option<Arc<KnownLens>>,
    /// How the camera stands, and its clear sky.
    pub fixed_camera: Option<FixedCamera>,
    /// Zero point through one airmass in the clearest of the frames whose exposure is known, in V.
    pub clear_ground_vmag: Option<f64>,
    /// Whether frames do not tell the level of a pixel without light.
    pub lacks_dark_level: bool,
    /// Where it is.
    pub site: Option<Site>,
    /// What local times are ahead of UTC, as the stars of all frames that tell it agree.
    pub ahead: Option<SignedDuration>,
    /// What the stars of most frames contradict of place and time.
    pub site_or_time: Option<String>,
}

impl NightStart {
    /// What `probes` tell; `known` is the lens that was measured before.
    pub fn from_probes(probes: Vec<Probe>, known: Option<Arc<KnownLens>>) -> Self {
        let clearest = |is: fn(&&Probe) -> bool| {
            let skies = probes.iter().filter(is).filter_map(|probe| probe.clear_sky);
            skies.max_by(|a, b| a.ground_vmag().total_cmp(&b.ground_vmag()))
        };
        let clear_sky = clearest(|_| true);
        let exposed_sky = clearest(|probe| probe.has_exposure);
        let spots_px = probes.iter().filter_map(|probe| probe.spot_sigma_px);
        let spot_sigma_px = median_of(spots_px);
        let first = probes
            .iter()
            .filter_map(|probe| Some((probe.mjd?, probe.pointing?, probe.sigma_rad)))
            .min_by(|a, b| a.0.total_cmp(&b.0));
        let lacks_dark_level = probes.iter().any(|probe| !probe.has_dark_level);
        let curves = probes.iter().filter_map(|probe| probe.curves.clone());
        let curves = CurveEvidence::of_frames(&curves.collect::<Vec<_>>());
        let site = probes.iter().find_map(|probe| probe.site);
        let ahead = agreed(probes.iter().filter_map(|probe| probe.ahead));
        let wrong = probes.iter().filter_map(|probe| probe.site_or_time.clone());
        let wrong: Vec<String> = wrong.collect();
        let are_most = 2 * wrong.len() > probes.len();
        let site_or_time = wrong.into_iter().next().filter(|_| are_most);
        let lens = known.or_else(|| measured_lens(probes));
        let held = first
            .zip(lens.as_ref())
            .map(|((_, pointing, sigma_rad), lens)| FixedCamera {
                camera: *lens.camera(),
                pointing,
                sigma_rad,
                spot_sigma_px,
                clear_sky,
                dark: None,
                curves,
            });
        Self {
            lens,
            lacks_dark_level: lacks_dark_level && held.is_some(),
            fixed_camera: held,
            clear_ground_vmag: exposed_sky.map(|sky| sky.ground_vmag()),
            site,
            ahead,
            site_or_time,
        }
    }

    /// The same with a level of a pixel without light for frames that do not tell it.
    #[must_use]
    pub fn with_dark_level(self, dark: Option<DarkLevel>) -> Self {
        Self {
            fixed_camera: self.fixed_camera.map(|held| FixedCamera { dark, ..held }),
            ..self
        }
    }

    /// Whether so many frames tell enough, of `tried` ones.
    pub fn is_enough(identified: usize, tried: usize) -> bool {
        identified >= WANTED || tried >= MAX_TRIED
    }
}

/// The value that all have, if there is one.
fn agreed<T: PartialEq>(mut values: impl Iterator<Item = T>) -> Option<T> {
    let first = values.next()?;
    values.all(|value| value == first).then_some(first)
}

/// The lens that the frames show together, else that of the one with the most stars.
fn measured_lens(probes: Vec<Probe>) -> Option<Arc<KnownLens>> {
    let most = probes.iter().max_by_key(|probe| probe.stars.stars());
    let own = most.map(|probe| probe.camera.clone());
    let frames = probes.into_iter().map(|probe| probe.stars).collect();
    let together = calibrate(frames, Vec::new()).ok().map(|found| found.lens);
    together.or(own).map(Arc::new)
}

/// The order in which the frames of a night are tried: the first, then halves, quarters and so on of the
/// night, so that any number of them is spread over it.
pub fn probe_order(frames: usize) -> Vec<usize> {
    let bits = frames.max(2).next_power_of_two().trailing_zeros();
    let reversed = |at: usize| at.reverse_bits() >> (usize::BITS - bits);
    (0..1_usize << bits)
        .map(reversed)
        .filter(|at| *at < frames)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_tried_all_over_the_night_and_each_once() {
        assert_eq!(probe_order(8), [0, 4, 2, 6, 1, 5, 3, 7]);
        let mut all = probe_order(100);
        assert!(all[..8].iter().any(|at| *at > 80));
        all.sort_unstable();
        assert!(all.into_iter().eq(0..100));
        assert_eq!(probe_order(1), [0]);
        assert!(probe_order(0).is_empty());
    }
}
