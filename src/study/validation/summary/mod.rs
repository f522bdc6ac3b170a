//! What many frames say together.
//!
//! rows of both tables, one by one → [`Accumulator`] → [`Summary`]
//!
//! The memory needed does not depend on the number of stars, and is three numbers a frame.

mod centroids;
mod completeness;
mod identification;
mod pulls;

pub use centroids::{CentroidBin, CentroidSummary};
pub use completeness::{CompletenessBin, CompletenessSummary};
pub use identification::{IdentificationBin, IdentificationSummary};
pub use pulls::{DifferenceSummary, Histogram, Pull, PullSummary};

use super::record::{FrameRecord, RowKind, StarRecord};
use crate::base::format::{to_decimals, to_significant};
use crate::study::robustness::{Answer, Interval};
use centroids::Centroids;
use completeness::Completeness;
use identification::Identifications;
use pulls::RunningStatistics;
use serde::Serialize;

/// Version of the JSON described here.
pub const SCHEMA: u32 = 1;

/// Pulls, centroids and light are of stars that are detected with this probability or more: of fainter ones those are found that
/// noise makes bright.
const SURE_PROBABILITY: f64 = 0.99;

/// What the tables do not say.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RunFacts {
    /// What the camera is called.
    pub camera: String,
    /// Columns.
    pub width_px: usize,
    /// Rows.
    pub height_px: usize,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Whether the pipeline had the camera's description, which gives it the scale.
    pub scale_known: bool,
    /// False detections in a million pixels that were asked for.
    pub false_alarms_per_mpx: f64,
}

/// What many frames say together.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Version of the fields described here.
    pub schema: u32,
    /// What was simulated.
    #[serde(flatten)]
    pub facts: RunFacts,
    /// Frames.
    pub frames: usize,
    /// How many were identified, and rightly.
    pub identification: IdentificationSummary,
    /// What was detected and named.
    pub detection: DetectionSummary,
    /// What part of the stars of each magnitude is found.
    pub completeness: CompletenessSummary,
    /// How well places and light are measured.
    pub centroids: CentroidSummary,
    /// Errors in units of their stated standard errors.
    pub pulls: PullSummary,
    /// How well the attitude is known; none where no frame was rightly identified.
    pub attitude: Option<AttitudeSummary>,
    /// The faintest star named minus the faintest to be expected, in magnitudes.
    pub faintest: DifferenceSummary,
    /// The limit that the pipeline measures on a frame minus the predicted one, in magnitudes.
    pub frame_limit: DifferenceSummary,
    /// The background as measured minus the true one, in ADU.
    pub background: DifferenceSummary,
    /// Its noise, measured over true.
    pub noise_ratio: DifferenceSummary,
}

/// What was detected and named.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DetectionSummary {
    /// Detections that may be stars.
    pub detected: u64,
    /// Those that were taken for no stars.
    pub rejected: u64,
    /// Those with the light of several stars, none of which has more than half.
    pub blends: u64,
    /// Those that were named.
    pub named: u64,
    /// Those of them that are another star, or none.
    pub misnamed: u64,
    /// Those of these that have the name of a star that stands there as well.
    pub misnamed_companions: u64,
    /// Those that may be stars to which no star's light belongs.
    pub false_detections: u64,
    /// The same in a million pixels.
    pub false_per_mpx: f64,
    /// Its 95 % interval's lower end.
    pub false_low_per_mpx: f64,
    /// And upper end.
    pub false_high_per_mpx: f64,
}

/// How well the attitude is known.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AttitudeSummary {
    /// Frames rightly identified.
    pub frames: usize,
    /// How far the boresight points off.
    pub boresight_arcsec: Quantiles,
    /// How far the frame is turned about the boresight.
    pub roll_arcsec: Quantiles,
    /// The same in steps of one percent, from the least to the largest.
    pub boresight_percentiles_arcsec: Vec<f64>,
    /// And of the roll.
    pub roll_percentiles_arcsec: Vec<f64>,
    /// Root mean square of the turns about x, y and the boresight.
    pub rms_arcsec: [f64; 3],
    /// Mean of the squared error in units of its stated covariance: 3 where that is true.
    pub nees_mean: f64,
    /// Standard error of that mean where the covariance is true.
    pub nees_sigma: f64,
    /// Root mean square of the residuals, on average over frames.
    pub rms_px: f64,
}

/// What part of many values lies below.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Quantiles {
    /// Half of them.
    pub p50: f64,
    /// 68.3 %.
    pub p68: f64,
    /// 95 %.
    pub p95: f64,
    /// 99 %.
    pub p99: f64,
    /// All.
    pub max: f64,
}

impl Quantiles {
    /// Of `sorted` values, of which there is at least one.
    fn of(sorted: &[f64]) -> Option<Self> {
        (!sorted.is_empty()).then(|| Self {
            p50: quantile(sorted, 0.5),
            p68: quantile(sorted, 0.683),
            p95: quantile(sorted, 0.95),
            p99: quantile(sorted, 0.99),
            max: quantile(sorted, 1.0),
        })
    }
}

/// What this part of `sorted` values, of which there is at least one, lies below.
fn quantile(sorted: &[f64], part: f64) -> f64 {
    let place = part * (sorted.len() - 1) as f64;
    to_significant(sorted[place.round() as usize], 6)
}

fn percentiles(sorted: &[f64]) -> Vec<f64> {
    let percentile = |percent: u32| quantile(sorted, f64::from(percent) / 100.0);
    (0..=100).map(percentile).collect()
}

/// Takes rows in, one by one.
pub struct Accumulator {
    facts: RunFacts,
    frames: usize,
    counts: [u64; 7],
    identification: Identifications,
    completeness: Completeness,
    centroids: Centroids,
    /// Of x, y and light; of the turns about x, y and the boresight; of the focal length.
    pulls: [RunningStatistics; 7],
    boresight_arcsec: Vec<f64>,
    roll_arcsec: Vec<f64>,
    squares_arcsec2: [f64; 3],
    nees_sum: f64,
    rms_px_sum: f64,
    faintest: RunningStatistics,
    faintest_variance_sum: f64,
    frame_limit: RunningStatistics,
    background: RunningStatistics,
    noise_ratio: RunningStatistics,
}

impl Accumulator {
    /// Of a run with the predicted limit of its detector.
    pub fn new(facts: RunFacts, limit_vmag: f64) -> Self {
        let magnitudes = || RunningStatistics::new(0.1, 2.0);
        Self {
            facts,
            frames: 0,
            counts: [0; 7],
            identification: Identifications::default(),
            completeness: Completeness::around(limit_vmag),
            centroids: Centroids::default(),
            pulls: std::array::from_fn(|_| RunningStatistics::new(0.25, 5.0)),
            boresight_arcsec: Vec::new(),
            roll_arcsec: Vec::new(),
            squares_arcsec2: [0.0; 3],
            nees_sum: 0.0,
            rms_px_sum: 0.0,
            faintest: magnitudes(),
            faintest_variance_sum: 0.0,
            frame_limit: magnitudes(),
            background: magnitudes(),
            noise_ratio: magnitudes(),
        }
    }

    /// Takes in a frame.
    pub fn add_frame(&mut self, row: &FrameRecord) {
        self.frames += 1;
        let counts = [
            row.detected,
            row.rejected,
            row.blends,
            row.named,
            row.misnamed,
            row.misnamed_companions,
            row.false_detections,
        ];
        for (sum, count) in self.counts.iter_mut().zip(counts) {
            *sum += count;
        }
        self.identification.add(row.stars_above_limit, row.status);
        if let (Some(found), Some(expected)) = (row.faintest_vmag, row.expected_faintest_vmag)
            && row.status == Answer::Right
        {
            self.faintest.add(found - expected);
            let sigma_mag = row.expected_faintest_sigma_mag.unwrap_or(0.0);
            self.faintest_variance_sum += sigma_mag * sigma_mag;
        }
        if let Some(limit) = row.measured_limit_vmag {
            self.frame_limit.add(limit - row.predicted_limit_vmag);
        }
        if let (Some(level), Some(noise)) = (row.background_adu, row.noise_adu) {
            self.background.add(level - row.true_background_adu);
            self.noise_ratio.add(noise / row.true_noise_adu);
        }
        self.add_attitude(row);
    }

    fn add_attitude(&mut self, row: &FrameRecord) {
        let errors = [
            row.error_x_arcsec,
            row.error_y_arcsec,
            row.error_roll_arcsec,
        ];
        let [Some(x), Some(y), Some(roll)] = errors else {
            return;
        };
        self.boresight_arcsec.push(x.hypot(y));
        self.roll_arcsec.push(roll.abs());
        for (sum, error) in self.squares_arcsec2.iter_mut().zip([x, y, roll]) {
            *sum += error * error;
        }
        self.nees_sum += row.nees.unwrap_or(f64::NAN);
        self.rms_px_sum += row.rms_px.unwrap_or(f64::NAN);
        let errors = errors.into_iter().chain([row.focal_error_px]);
        let sigmas = [
            row.sigma_x_arcsec,
            row.sigma_y_arcsec,
            row.sigma_roll_arcsec,
            row.focal_sigma_px,
        ];
        for (pull, (error, sigma)) in self.pulls[3..].iter_mut().zip(errors.zip(sigmas)) {
            pull.add_pull(error, sigma);
        }
    }

    /// Takes in a star.
    pub fn add_star(&mut self, row: &StarRecord) {
        if row.kind != RowKind::Star || row.isolated != Some(true) {
            return;
        }
        if let (Some(vmag), Some(probability)) = (row.vmag, row.probability) {
            self.completeness.add(vmag, probability, row.detected);
        }
        let is_sure = row.probability.is_some_and(|p| p >= SURE_PROBABILITY);
        if row.saturated != Some(false) || !row.detected {
            return;
        }
        let minus = |found: Option<f64>, truth: Option<f64>| Some(found? - truth?);
        let errors = [
            minus(row.x_px, row.true_x_px),
            minus(row.y_px, row.true_y_px),
            minus(row.flux_e, row.true_flux_e),
        ];
        self.centroids.add(row, errors, is_sure);
        if is_sure {
            let sigmas = [row.sigma_x_px, row.sigma_y_px, row.sigma_flux_e];
            for (pull, (error, sigma)) in self.pulls.iter_mut().zip(errors.into_iter().zip(sigmas))
            {
                pull.add_pull(error, sigma);
            }
        }
    }

    /// What they say together.
    pub fn finish(mut self) -> Summary {
        let attitude = self.attitude();
        let detection = self.detection();
        let [x, y, flux, attitude_x, attitude_y, roll, focal_length] = self.pulls.map(|p| p.pull());
        let faintest_sigma = self.faintest.count().max(1) as f64;
        let expected_sigma = (self.faintest_variance_sum / faintest_sigma).sqrt();
        Summary {
            schema: SCHEMA,
            frames: self.frames,
            identification: self.identification.finish(),
            detection,
            completeness: self.completeness.finish(),
            centroids: self.centroids.finish(),
            pulls: PullSummary {
                x,
                y,
                flux,
                attitude_x,
                attitude_y,
                roll,
                focal_length,
            },
            attitude,
            faintest: self.faintest.difference(Some(expected_sigma)),
            frame_limit: self.frame_limit.difference(None),
            background: self.background.difference(None),
            noise_ratio: self.noise_ratio.difference(None),
            facts: self.facts,
        }
    }

    fn detection(&self) -> DetectionSummary {
        let [
            detected,
            rejected,
            blends,
            named,
            misnamed,
            misnamed_companions,
            false_detections,
        ] = self.counts;
        let pixels = self.frames * self.facts.width_px * self.facts.height_px;
        let interval = Interval::of(false_detections as usize, pixels);
        let per_mpx = |part: f64| to_significant(part * 1e6, 4);
        DetectionSummary {
            detected,
            rejected,
            blends,
            named,
            misnamed,
            misnamed_companions,
            false_detections,
            false_per_mpx: per_mpx(false_detections as f64 / pixels.max(1) as f64),
            false_low_per_mpx: per_mpx(interval.low),
            false_high_per_mpx: per_mpx(interval.high),
        }
    }

    fn attitude(&mut self) -> Option<AttitudeSummary> {
        self.boresight_arcsec.sort_unstable_by(f64::total_cmp);
        self.roll_arcsec.sort_unstable_by(f64::total_cmp);
        let frames = self.roll_arcsec.len();
        let mean = |sum: f64| sum / frames as f64;
        Some(AttitudeSummary {
            frames,
            boresight_arcsec: Quantiles::of(&self.boresight_arcsec)?,
            roll_arcsec: Quantiles::of(&self.roll_arcsec)?,
            boresight_percentiles_arcsec: percentiles(&self.boresight_arcsec),
            roll_percentiles_arcsec: percentiles(&self.roll_arcsec),
            rms_arcsec: self
                .squares_arcsec2
                .map(|sum| to_significant(mean(sum).sqrt(), 6)),
            nees_mean: to_decimals(mean(self.nees_sum), 4),
            // A χ² of three degrees of freedom has a variance of 6.
            nees_sigma: to_decimals((6.0 / frames as f64).sqrt(), 4),
            rms_px: to_significant(mean(self.rms_px_sum), 6),
        })
    }
}

#[cfg(test)]
mod tests;
