//! The report of an experiment.

use super::published::Published;
use super::summary::SimulatedReport;
use super::table::TableReport;
use crate::base::format::to_decimals;
use crate::model::sensitivity::{Budget, Detector};
use serde::Serialize;

/// Version of the JSON described here.
pub const SCHEMA: u32 = 1;

/// The report of an experiment.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ExperimentReport {
    /// [`SCHEMA`].
    pub schema: u32,
    /// Number of the experiment in the paper.
    pub experiment: u8,
    /// Date of its frame, ISO 8601, in UTC.
    pub date: String,
    /// Latitude of the site, in degrees, north positive.
    pub site_lat_deg: f64,
    /// Longitude of the site, in degrees, east positive.
    pub site_lon_deg: f64,
    /// Exposure, in seconds.
    pub exposure_s: f64,
    /// The limiting magnitudes.
    pub limit: LimitReport,
    /// The stars of the paper's table.
    pub table: TableReport,
    /// Simulated frames like the paper's; `None` where its stars are not identified, so that the
    /// pointing is unknown.
    pub simulated: Option<SimulatedReport>,
}

/// Limiting magnitudes, in V.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LimitReport {
    /// From the paper's equations.
    pub limit_vmag: f64,
    /// As printed in the paper.
    pub paper_limit_vmag: f64,
    /// The faintest star of the paper's table.
    pub paper_faintest_vmag: f64,
    /// Of this detector, which finds half of the stars of this magnitude.
    pub detector_limit_vmag: f64,
}

impl ExperimentReport {
    /// Whether the paper's stars and all simulated frames are identified.
    pub fn is_identified(&self) -> bool {
        let all = |simulated: &SimulatedReport| simulated.frames_identified == simulated.frames;
        self.simulated.as_ref().is_some_and(all)
    }
}

impl LimitReport {
    pub(super) fn new(published: &Published, budget: &Budget, detector: &Detector) -> Self {
        Self {
            limit_vmag: to_decimals(budget.limit_vmag, 3),
            paper_limit_vmag: published.limit_vmag,
            paper_faintest_vmag: published.faintest_vmag,
            detector_limit_vmag: to_decimals(detector.vmag_at(0.5), 3),
        }
    }
}
