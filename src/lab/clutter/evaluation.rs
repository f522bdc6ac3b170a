//! Compares what was found in a frame with the truth.

use super::frames::{FrameMaker, FrameTruth};
use crate::base::coords::PixelPoint;
use crate::identify::{Identification, StarMatch};
use crate::lab::robustness::Answer;
use crate::lab::simulate::{TrueStar, Truth};
use crate::lab::trials::is_star_like;
use crate::lab::validation::LightMap;
use crate::solve::{Solution, Source};

/// The result of one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClutterFrameResult {
    /// Whether the pointing is right. A frame without sky has no right one.
    pub answer: Answer,
    /// Millions of pixels.
    pub megapixels: f64,
    /// Detections that may be stars.
    pub detected: usize,
    /// Detections that may be stars where none is.
    pub false_detections: usize,
    /// Detections with a name.
    pub named: usize,
    /// Detections with a wrong name: that star is not there.
    pub misnamed: usize,
    /// The sum of the stated probabilities that a name is chance.
    pub stated_misnamed: f64,
}

/// Compares `solution` with the truth of its frame.
pub(super) fn evaluate(
    maker: &FrameMaker,
    sky: Option<&FrameTruth>,
    solution: &Solution,
) -> ClutterFrameResult {
    let found = solution.outcome.identification();
    let matches = found.map_or(&[][..], |found| &found.matches);
    let truth = sky.map(|sky| ClutterStars::of(maker, &sky.truth));
    let star_like = solution
        .sources
        .iter()
        .filter(|source| is_star_like(source));
    let is_false = |source: &&Source| {
        let place = &source.position;
        truth.as_ref().is_none_or(|sky| !sky.has_star_at(place))
    };
    let is_misnamed = |named: &&StarMatch| {
        let source = solution.source(named.source);
        truth
            .as_ref()
            .is_none_or(|sky| !sky.is_there(named, source))
    };
    ClutterFrameResult {
        answer: answer(maker, sky, found),
        megapixels: (solution.width * solution.height) as f64 / 1e6,
        detected: star_like.clone().count(),
        false_detections: star_like.filter(is_false).count(),
        named: matches.len(),
        misnamed: matches.iter().filter(is_misnamed).count(),
        stated_misnamed: matches.iter().map(|named| named.p_chance).sum(),
    }
}

fn answer(maker: &FrameMaker, sky: Option<&FrameTruth>, found: Option<&Identification>) -> Answer {
    match (found, sky) {
        (None, _) => Answer::None,
        (Some(_), None) => Answer::Wrong,
        (Some(found), Some(sky)) => Answer::of(
            found,
            maker.simulator.camera(),
            &sky.pointing.icrs_to_camera,
        ),
    }
}

/// The true stars of a frame.
struct ClutterStars<'a> {
    light: LightMap<'a>,
    limit_vmag: f64,
    /// Half of the length of a trail.
    half_trail_px: f64,
}

impl<'a> ClutterStars<'a> {
    fn of(maker: &FrameMaker, truth: &'a Truth) -> Self {
        let [x, y] = truth.motion_px;
        Self {
            light: LightMap::of(&maker.scenario, truth),
            limit_vmag: maker.limit_vmag,
            half_trail_px: libm::hypot(x, y) / 2.0,
        }
    }

    /// Whether a star bright enough to be detected has light at `place`.
    fn has_star_at(&self, place: &PixelPoint) -> bool {
        /// Magnitudes beyond the limit at which a star may still cause a detection.
        const BEYOND_LIMIT_MAG: f64 = 1.5;
        /// The widest wings, of the brightest stars.
        const MAX_PX: f64 = 20.0;
        let mut near = self.light.stars_near(place, MAX_PX + self.half_trail_px);
        near.any(|star| {
            star.v_mag < self.limit_vmag + BEYOND_LIMIT_MAG
                && star.position.distance_to(place) < self.reach_px(star)
        })
    }

    /// How far from a star a detection may be due to its light: to where its wings are below the
    /// noise.
    fn reach_px(&self, star: &TrueStar) -> f64 {
        /// About the signal-to-noise ratio of a star at the limit.
        const SNR_AT_LIMIT: f64 = 5.0;
        /// Beyond the wings: a pixel and a half, for the peak of noise on them.
        const MARGIN_PX: f64 = 1.5;
        let brighter_mag = (self.limit_vmag - star.v_mag).max(0.0);
        let peak_snr = SNR_AT_LIMIT * libm::pow(10.0, 0.4 * brighter_mag);
        let wings = (2.0 * libm::log(peak_snr)).sqrt();
        wings * self.light.sigma_px() + MARGIN_PX + self.half_trail_px
    }

    /// Whether `source` was named after a star that is there: it is within the errors, two pixels or
    /// two standard deviations of the spot, as noise on a star at the limit moves its peak as far; and
    /// no nearer star gives more than twice its light.
    fn is_there(&self, named: &StarMatch, source: &Source) -> bool {
        const MIN_PX: f64 = 2.0;
        const SPOT_SIGMAS: f64 = 2.0;
        const SIGMAS: f64 = 3.0;
        const MIN_LIGHT: f64 = 0.5;
        let place = &source.position;
        let sigma_px = source
            .measured
            .map_or(0.0, |m| m.sigma_px[0].max(m.sigma_px[1]));
        let least_px = MIN_PX.max(SPOT_SIGMAS * self.light.sigma_px());
        let tolerance_px = least_px.max(SIGMAS * sigma_px) + self.half_trail_px;
        let light = |star: &TrueStar| self.light.light_of(star, place);
        let mut most_of_nearer = 0.0_f64;
        for star in self.light.stars_near(place, tolerance_px) {
            if star.catalog == Some(named.star) {
                return light(star) >= MIN_LIGHT * most_of_nearer;
            }
            most_of_nearer = most_of_nearer.max(light(star));
        }
        false
    }
}
