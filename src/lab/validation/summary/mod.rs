//! Statistics over many frames.
//!
//! rows of both tables, one at a time → [`Accumulator`] → [`ValidationSummary`]
//!
//! Memory does not depend on the number of stars, and is three numbers per frame.

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
use crate::base::statistics::quantile;
use crate::lab::robustness::{Answer, Interval};
use centroids::Centroids;
use completeness::CompletenessTable;
use identification::Identifications;
use pulls::RunningStatistics;
use serde::Serialize;
use std::collections::BTreeMap;

/// Version of the JSON schema.
pub const SCHEMA: u32 = 1;

/// Smallest detection probability of stars in the statistics of pulls, centroids and flux: fainter
/// stars are detected preferentially when noise brightens them.
const SURE_PROBABILITY: f64 = 0.99;

/// Facts about the run that are not in the tables.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RunFacts {
    /// Name of the camera.
    pub camera: String,
    /// Width of a frame.
    pub width_px: usize,
    /// Height of a frame.
    pub height_px: usize,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Whether the pipeline was given the camera's data sheet, and thereby the scale.
    pub scale_known: bool,
    /// Configured false detections per million pixels.
    pub false_alarms_per_mpx: f64,
}

/// Statistics over many frames.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ValidationSummary {
    /// Version of the JSON schema.
    pub schema: u32,
    /// What was simulated.
    #[serde(flatten)]
    pub facts: RunFacts,
    /// Number of frames.
    pub frames: usize,
    /// Rates of right, wrong and no identification.
    pub identification: IdentificationSummary,
    /// Numbers of detections and names.
    pub detection: DetectionSummary,
    /// Completeness by magnitude.
    pub completeness: CompletenessSummary,
    /// Errors of positions and flux.
    pub centroids: CentroidSummary,
    /// Errors in units of their stated standard errors.
    pub pulls: PullSummary,
    /// Errors of the attitude; none without a right identification.
    pub attitude: Option<AttitudeSummary>,
    /// Faintest named star minus its expectation, in magnitudes.
    pub faintest: DifferenceSummary,
    /// Limit measured on a frame minus the predicted one, in magnitudes.
    pub frame_limit: DifferenceSummary,
    /// Measured minus true background, in ADU.
    pub background: DifferenceSummary,
    /// Measured over true noise.
    pub noise_ratio: DifferenceSummary,
    /// Measured minus true zero point, in magnitudes.
    pub zero_point: DifferenceSummary,
    /// Frames with a note, by its code.
    pub notes: BTreeMap<String, u64>,
}

/// Numbers of detections and names.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
#[expect(missing_docs, reason = "docs/json.md describes the fields")]
pub struct DetectionSummary {
    pub detected: u64,
    pub rejected: u64,
    pub blends: u64,
    pub split: u64,
    pub named: u64,
    pub misnamed: u64,
    pub misnamed_companions: u64,
    pub false_detections: u64,
    pub false_per_mpx: f64,
    pub false_low_per_mpx: f64,
    pub false_high_per_mpx: f64,
}

/// Errors of the attitude.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[expect(missing_docs, reason = "docs/json.md describes the fields")]
pub struct AttitudeSummary {
    pub frames: usize,
    pub boresight_arcsec: Quantiles,
    pub roll_arcsec: Quantiles,
    pub boresight_percentiles_arcsec: Vec<f64>,
    pub roll_percentiles_arcsec: Vec<f64>,
    pub rms_arcsec: [f64; 3],
    pub nees_mean: f64,
    pub nees_sigma: f64,
    pub rms_px: f64,
}

/// Quantiles of a distribution.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[expect(missing_docs, reason = "docs/json.md describes the fields")]
pub struct Quantiles {
    pub p50: f64,
    pub p68: f64,
    pub p95: f64,
    pub p99: f64,
    pub max: f64,
}

impl Quantiles {
    /// Quantiles of `sorted` values; none if there are none.
    fn of(sorted: &[f64]) -> Option<Self> {
        let at = |share: f64| Some(to_significant(quantile(sorted, share)?, 6));
        Some(Self {
            p50: at(0.5)?,
            p68: at(0.683)?,
            p95: at(0.95)?,
            p99: at(0.99)?,
            max: at(1.0)?,
        })
    }
}

fn percentiles(sorted: &[f64]) -> Vec<f64> {
    let percentile = |percent: u32| quantile(sorted, f64::from(percent) / 100.0);
    let percentiles = (0..=100).filter_map(percentile);
    percentiles.map(|value| to_significant(value, 6)).collect()
}

/// Accumulates rows one at a time.
pub struct Accumulator {
    facts: RunFacts,
    frames: usize,
    detection: DetectionSummary,
    identification: Identifications,
    completeness: CompletenessTable,
    centroids: Centroids,
    /// Pulls of x, y and flux; of the rotations about x, y and the boresight; of the focal length;
    /// of the zero point.
    pulls: [RunningStatistics; 10],
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
    zero_point: RunningStatistics,
    notes: BTreeMap<String, u64>,
}

impl Accumulator {
    /// An accumulator for a run with this predicted limit.
    pub fn new(facts: RunFacts, limit_vmag: f64) -> Self {
        let magnitudes = || RunningStatistics::new(0.1, 2.0);
        Self {
            facts,
            frames: 0,
            detection: DetectionSummary::default(),
            identification: Identifications::default(),
            completeness: CompletenessTable::around(limit_vmag),
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
            zero_point: magnitudes(),
            notes: BTreeMap::new(),
        }
    }

    /// Adds a frame.
    pub fn add_frame(&mut self, row: &FrameRecord) {
        self.frames += 1;
        let sums = &mut self.detection;
        sums.detected += row.detected;
        sums.rejected += row.rejected;
        sums.blends += row.blends;
        sums.split += row.split;
        sums.named += row.named;
        sums.misnamed += row.misnamed;
        sums.misnamed_companions += row.misnamed_companions;
        sums.false_detections += row.false_detections;
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
        for code in row.notes.iter().flat_map(|codes| codes.split(' ')) {
            *self.notes.entry(code.to_owned()).or_default() += 1;
        }
        if row.status == Answer::Right {
            self.add_photometry(row);
        }
        self.add_attitude(row);
    }

    fn add_photometry(&mut self, row: &FrameRecord) {
        let zero_point_error_mag = row.zero_point_error_mag;
        if let Some(error) = zero_point_error_mag {
            self.zero_point.add(error);
        }
        let limit_error_mag = row
            .measured_limit_vmag
            .map(|limit| limit - row.predicted_limit_vmag);
        let errors = [
            (zero_point_error_mag, row.zero_point_sigma_mag),
            (row.linearity.map(|slope| slope - 1.0), row.linearity_sigma),
            (limit_error_mag, row.measured_limit_sigma_mag),
        ];
        for (pull, (error, sigma)) in self.pulls[7..].iter_mut().zip(errors) {
            pull.add_pull(error, sigma);
        }
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
        self.boresight_arcsec.push(libm::hypot(x, y));
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

    /// Adds a star.
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
            minus(row.x, row.true_x_px),
            minus(row.y, row.true_y_px),
            minus(row.flux_e, row.true_flux_e),
        ];
        self.centroids.add(row, errors, is_sure);
        if is_sure {
            let sigmas = [row.sigma_x, row.sigma_y, row.sigma_flux_e];
            for (pull, (error, sigma)) in self.pulls.iter_mut().zip(errors.into_iter().zip(sigmas))
            {
                pull.add_pull(error, sigma);
            }
        }
    }

    /// The summary.
    pub fn finish(mut self) -> ValidationSummary {
        let attitude = self.attitude();
        let detection = self.detection();
        let pulls = self.pulls.map(|p| p.pull());
        let [
            x,
            y,
            flux,
            attitude_x,
            attitude_y,
            roll,
            focal_length,
            zero_point,
            linearity,
            frame_limit,
        ] = pulls;
        let faintest_sigma = self.faintest.count().max(1) as f64;
        let expected_sigma = (self.faintest_variance_sum / faintest_sigma).sqrt();
        ValidationSummary {
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
                zero_point,
                linearity,
                frame_limit,
            },
            attitude,
            faintest: self.faintest.difference(Some(expected_sigma)),
            frame_limit: self.frame_limit.difference(None),
            background: self.background.difference(None),
            noise_ratio: self.noise_ratio.difference(None),
            zero_point: self.zero_point.difference(None),
            notes: self.notes,
            facts: self.facts,
        }
    }

    fn detection(&self) -> DetectionSummary {
        let count = self.detection.false_detections;
        let pixels = self.frames * self.facts.width_px * self.facts.height_px;
        let interval = Interval::of(count as usize, pixels);
        let per_mpx = |part: f64| to_significant(part * 1e6, 4);
        DetectionSummary {
            false_per_mpx: per_mpx(count as f64 / pixels.max(1) as f64),
            false_low_per_mpx: per_mpx(interval.low),
            false_high_per_mpx: per_mpx(interval.high),
            ..self.detection
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
