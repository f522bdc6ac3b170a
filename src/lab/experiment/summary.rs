//! Summary of the simulated frames.

use super::simulated::{ExperimentFrameResult, IdentifiedStars, SHIFT_PX, StarResult};
use crate::base::format::to_decimals;
use crate::base::statistics::mean_and_squares;
use crate::predict::{Detector, Faintest};
use serde::Serialize;

/// The report of the simulated frames.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[expect(missing_docs, reason = "docs/json.md describes the fields")]
pub struct SimulatedReport {
    pub frames: usize,
    pub seed: u64,
    pub shift_px: f64,
    pub frames_identified: usize,
    pub faintest: Option<FoundFaintest>,
    pub expected: Option<ExpectedFaintest>,
    pub expected_by_brightest_pixel: Option<ExpectedFaintest>,
    pub stars_named: f64,
    pub named_wrongly: usize,
    pub faintest_wrong: usize,
    pub completeness: Vec<DetectionBin>,
}

/// The faintest identified star, over the frames.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[expect(missing_docs, reason = "docs/json.md describes the fields")]
pub struct FoundFaintest {
    pub mean_vmag: f64,
    pub sigma_mag: f64,
    pub least_vmag: f64,
    pub most_vmag: f64,
    pub difference_mag: Option<f64>,
    pub difference_sigma_mag: Option<f64>,
}

/// The expected faintest star of a frame, on average over the frames.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[expect(missing_docs, reason = "docs/json.md describes the fields")]
pub struct ExpectedFaintest {
    pub mean_vmag: f64,
    pub sigma_mag: f64,
    pub stars_found: f64,
}

/// The stars of one magnitude bin on all frames.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[expect(missing_docs, reason = "docs/json.md describes the fields")]
pub struct DetectionBin {
    pub from_vmag: f64,
    pub to_vmag: f64,
    pub stars: usize,
    pub detected: usize,
    pub named: usize,
    pub expected: f64,
}

impl SimulatedReport {
    pub(super) fn new(results: &[ExperimentFrameResult], detector: &Detector, seed: u64) -> Self {
        let identified: Vec<&IdentifiedStars> = results
            .iter()
            .filter_map(|frame| frame.identified.as_ref())
            .collect();
        let faintest: Vec<f64> = identified.iter().map(|stars| stars.faintest_vmag).collect();
        let [expected, by_brightest_pixel] =
            [0, 1].map(|rule| ExpectedFaintest::over(results, rule));
        let stars = results.iter().flat_map(|result| &result.stars);
        let named = stars.filter(|star| star.identified).count();
        Self {
            frames: results.len(),
            seed,
            shift_px: SHIFT_PX,
            frames_identified: identified.len(),
            faintest: FoundFaintest::of(&faintest, expected.as_ref()),
            expected,
            expected_by_brightest_pixel: by_brightest_pixel,
            stars_named: to_decimals(named as f64 / identified.len().max(1) as f64, 2),
            named_wrongly: identified.iter().map(|stars| stars.wrong).sum(),
            faintest_wrong: identified
                .iter()
                .filter(|stars| stars.faintest_is_wrong)
                .count(),
            completeness: completeness(results, detector),
        }
    }
}

impl FoundFaintest {
    fn of(vmags: &[f64], expected: Option<&ExpectedFaintest>) -> Option<Self> {
        let count = vmags.len() as f64;
        let (mean, squares) = mean_and_squares(vmags);
        let sigma = (squares / (count - 1.0).max(1.0)).sqrt();
        // One frame has no scatter of its own; the expected one is used.
        let sigma_of_one = if vmags.len() > 1 {
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
            difference_sigma_mag: sigma_of_one.map(|sigma| magnitude(sigma / count.sqrt())),
        })
    }
}

impl ExpectedFaintest {
    fn over(results: &[ExperimentFrameResult], rule: usize) -> Option<Self> {
        let all: Vec<Faintest> = results
            .iter()
            .filter_map(|frame| frame.expected[rule])
            .collect();
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

/// Bins around the detector's limit; all brighter stars are one bin.
fn completeness(results: &[ExperimentFrameResult], detector: &Detector) -> Vec<DetectionBin> {
    const BIN_MAG: f64 = 0.25;
    /// Bins reach from this much brighter than the limit to this much fainter.
    const REACH_MAG: f64 = 1.0;
    let limit = (detector.vmag_at(0.5) / BIN_MAG).round() * BIN_MAG;
    let (first, last) = (limit - REACH_MAG, limit + REACH_MAG);
    let brightest = results
        .iter()
        .flat_map(|frame| &frame.stars)
        .map(|s| s.v_mag);
    let brightest = brightest.fold(first, f64::min).floor();
    let steps = ((last - first) / BIN_MAG).round() as usize;
    let mut edges = vec![brightest];
    edges.extend((0..=steps).map(|i| first + i as f64 * BIN_MAG));
    let bins = edges.windows(2).filter(|edge| edge[0] < edge[1]);
    bins.map(|edge| bin(results, detector, [edge[0], edge[1]]))
        .collect()
}

fn bin(
    results: &[ExperimentFrameResult],
    detector: &Detector,
    [from_vmag, to_vmag]: [f64; 2],
) -> DetectionBin {
    let all = results.iter().flat_map(|result| &result.stars);
    let stars: Vec<&StarResult> = all
        .filter(|s| (from_vmag..to_vmag).contains(&s.v_mag))
        .collect();
    let count = |of: fn(&StarResult) -> bool| stars.iter().filter(|star| of(star)).count();
    let expected = stars.iter().map(|star| detector.probability(star.v_mag));
    DetectionBin {
        from_vmag,
        to_vmag,
        stars: stars.len(),
        detected: count(|star| star.detected),
        named: count(|star| star.identified),
        expected: to_decimals(expected.sum(), 1),
    }
}
