//! What many simulated frames say together.

use super::simulated::{Identified, SHIFT_PX, StarTrial, Trial};
use crate::base::format::to_decimals;
use crate::model::sensitivity::{Detector, Faintest};
use serde::Serialize;

/// What became of the simulated frames.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SimulatedReport {
    /// Frames simulated.
    pub frames: usize,
    /// Seed of their random numbers.
    pub seed: u64,
    /// The pointing of each was moved along x and y by up to so many pixels, evenly.
    pub shift_px: f64,
    /// Frames identified.
    pub frames_identified: usize,
    /// The faintest star named, over the frames; none where no frame was identified.
    pub faintest: Option<FoundFaintest>,
    /// What is to be expected of it, given the stars on the frames and the detector's completeness.
    pub expected: Option<ExpectedFaintest>,
    /// The same by the paper's rule: the brightest pixel stands above the noise by the wanted ratio.
    pub expected_by_brightest_pixel: Option<ExpectedFaintest>,
    /// Stars named on a frame, on average over those that are identified.
    pub stars_named: f64,
    /// Stars named on all frames where the light is another star's, or no star's.
    pub named_wrongly: usize,
    /// Frames whose faintest star named is one of these.
    pub faintest_wrong: usize,
    /// What part of the stars is found, by magnitude, bright ones first.
    pub completeness: Vec<CompletenessBin>,
}

/// The faintest star named, over the frames.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FoundFaintest {
    /// Mean of its V magnitude.
    pub mean_vmag: f64,
    /// Standard deviation of one frame.
    pub sigma_mag: f64,
    /// On the frame on which it is brightest.
    pub least_vmag: f64,
    /// On the frame on which it is faintest.
    pub most_vmag: f64,
    /// Mean less what is expected.
    pub difference_mag: Option<f64>,
    /// Standard error of that.
    pub difference_sigma_mag: Option<f64>,
}

/// The faintest star to be found on a frame, on average over the frames.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ExpectedFaintest {
    /// Its V magnitude.
    pub mean_vmag: f64,
    /// Standard deviation of one frame.
    pub sigma_mag: f64,
    /// Stars found on a frame.
    pub stars_found: f64,
}

/// Stars of about one magnitude on all frames.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CompletenessBin {
    /// V magnitude from.
    pub from_vmag: f64,
    /// To below.
    pub to_vmag: f64,
    /// Stars on the frames.
    pub stars: usize,
    /// Those detected.
    pub detected: usize,
    /// Those named.
    pub named: usize,
    /// Those that should be detected, on average.
    pub expected: f64,
}

impl SimulatedReport {
    pub(super) fn new(trials: &[Trial], detector: &Detector, seed: u64) -> Self {
        let identified: Vec<&Identified> = trials
            .iter()
            .filter_map(|t| t.identified.as_ref())
            .collect();
        let faintest: Vec<f64> = identified.iter().map(|i| i.faintest_vmag).collect();
        let [expected, by_brightest_pixel] =
            [0, 1].map(|rule| ExpectedFaintest::over(trials, rule));
        let stars = trials.iter().flat_map(|trial| &trial.stars);
        let named = stars.filter(|star| star.identified).count();
        Self {
            frames: trials.len(),
            seed,
            shift_px: SHIFT_PX,
            frames_identified: identified.len(),
            faintest: FoundFaintest::of(&faintest, expected.as_ref()),
            expected,
            expected_by_brightest_pixel: by_brightest_pixel,
            stars_named: to_decimals(named as f64 / identified.len().max(1) as f64, 2),
            named_wrongly: identified.iter().map(|i| i.wrong).sum(),
            faintest_wrong: identified.iter().filter(|i| i.faintest_is_wrong).count(),
            completeness: completeness(trials, detector),
        }
    }
}

impl FoundFaintest {
    fn of(vmags: &[f64], expected: Option<&ExpectedFaintest>) -> Option<Self> {
        let count = vmags.len() as f64;
        let mean = vmags.iter().sum::<f64>() / count;
        let squares = vmags.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
        let sigma = (squares / (count - 1.0).max(1.0)).sqrt();
        // One frame says nothing of the scatter: there the expected one holds.
        let of_mean = if vmags.len() > 1 {
            Some(sigma)
        } else {
            expected.map(|e| e.sigma_mag)
        };
        let magnitude = |value| to_decimals(value, 3);
        (!vmags.is_empty()).then(|| Self {
            mean_vmag: magnitude(mean),
            sigma_mag: magnitude(sigma),
            least_vmag: magnitude(vmags.iter().copied().fold(f64::INFINITY, f64::min)),
            most_vmag: magnitude(vmags.iter().copied().fold(f64::NEG_INFINITY, f64::max)),
            difference_mag: expected.map(|e| magnitude(mean - e.mean_vmag)),
            difference_sigma_mag: of_mean.map(|sigma| magnitude(sigma / count.sqrt())),
        })
    }
}

impl ExpectedFaintest {
    fn over(trials: &[Trial], rule: usize) -> Option<Self> {
        let all: Vec<Faintest> = trials.iter().filter_map(|t| t.expected[rule]).collect();
        let mean = |value: fn(&Faintest) -> f64| {
            to_decimals(all.iter().map(value).sum::<f64>() / all.len() as f64, 3)
        };
        (!all.is_empty()).then(|| Self {
            mean_vmag: mean(|e| e.mean_vmag),
            sigma_mag: mean(|e| e.sigma_mag),
            stars_found: mean(|e| e.stars_found),
        })
    }
}

/// Width of a bin, in magnitudes.
const BIN_MAG: f64 = 0.25;
/// From so much brighter than the limit to so much fainter.
const BINS_MAG: (f64, f64) = (1.0, 1.0);

/// By magnitude around the detector's limit; what is brighter is one bin.
fn completeness(trials: &[Trial], detector: &Detector) -> Vec<CompletenessBin> {
    let limit = (detector.vmag_at(0.5) / BIN_MAG).round() * BIN_MAG;
    let (first, last) = (limit - BINS_MAG.0, limit + BINS_MAG.1);
    let brightest = trials.iter().flat_map(|t| &t.stars).map(|s| s.v_mag);
    let brightest = brightest.fold(first, f64::min).floor();
    let steps = ((last - first) / BIN_MAG).round() as usize;
    let mut edges = vec![brightest];
    edges.extend((0..=steps).map(|i| first + i as f64 * BIN_MAG));
    let bins = edges.windows(2).filter(|edge| edge[0] < edge[1]);
    bins.map(|edge| bin(trials, detector, [edge[0], edge[1]]))
        .collect()
}

fn bin(trials: &[Trial], detector: &Detector, [from_vmag, to_vmag]: [f64; 2]) -> CompletenessBin {
    let all = trials.iter().flat_map(|trial| &trial.stars);
    let stars: Vec<&StarTrial> = all
        .filter(|s| (from_vmag..to_vmag).contains(&s.v_mag))
        .collect();
    let count = |of: fn(&StarTrial) -> bool| stars.iter().filter(|star| of(star)).count();
    let expected = stars.iter().map(|star| detector.probability(star.v_mag));
    CompletenessBin {
        from_vmag,
        to_vmag,
        stars: stars.len(),
        detected: count(|star| star.detected),
        named: count(|star| star.identified),
        expected: to_decimals(expected.sum(), 1),
    }
}
