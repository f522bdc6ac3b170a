//! The report of an experiment.

use super::published::Published;
use super::summary::SimulatedReport;
use super::table::TableReport;
use crate::base::format::to_decimals;
use crate::predict::{Budget, Detector};
use serde::Serialize;

/// Version of the JSON described here.
pub const SCHEMA: u32 = 1;

/// The report of an experiment.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[expect(missing_docs, reason = "docs/json.md describes the fields")]
pub struct ExperimentReport {
    pub schema: u32,
    pub experiment: u8,
    pub date: String,
    pub site_lat_deg: f64,
    pub site_lon_deg: f64,
    pub exposure_s: f64,
    pub limit: LimitReport,
    pub table: TableReport,
    pub simulated: Option<SimulatedReport>,
}

/// Limiting magnitudes, in V.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[expect(missing_docs, reason = "docs/json.md describes the fields")]
pub struct LimitReport {
    pub limit_vmag: f64,
    pub paper_limit_vmag: f64,
    pub paper_faintest_vmag: f64,
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
