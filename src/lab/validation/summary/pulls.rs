//! Mean, scatter and tails of many values.

use crate::base::format::{to_decimals, to_significant};
use serde::Serialize;

/// Pulls: errors in units of their stated standard errors. If those are right, a pull has mean 0,
/// standard deviation 1, and 4.55 % beyond 2.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[expect(missing_docs, reason = "docs/json.md describes the fields")]
pub struct PullSummary {
    pub x: Pull,
    pub y: Pull,
    pub flux: Pull,
    pub attitude_x: Pull,
    pub attitude_y: Pull,
    pub roll: Pull,
    pub focal_length: Pull,
    pub zero_point: Pull,
    pub linearity: Pull,
    pub frame_limit: Pull,
}

/// Statistics of one pull.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[expect(missing_docs, reason = "docs/json.md describes the fields")]
pub struct Pull {
    pub count: usize,
    pub mean: f64,
    pub sd: f64,
    pub beyond_2_percent: f64,
    pub beyond_3_percent: f64,
    pub beyond_5_percent: f64,
    pub histogram: Histogram,
}

/// Histogram of values.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Histogram {
    /// Lower edge of the first bin; values below are not counted.
    pub from: f64,
    /// Width of a bin.
    pub step: f64,
    /// Number of values per bin.
    pub counts: Vec<usize>,
}

/// Statistics of measured minus expected values.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[expect(missing_docs, reason = "docs/json.md describes the fields")]
pub struct DifferenceSummary {
    pub count: usize,
    pub mean: f64,
    pub mean_sigma: f64,
    pub sd: f64,
    pub expected_sd: Option<f64>,
    pub histogram: Histogram,
}

/// Running mean, variance, tails and histogram.
pub(super) struct RunningStatistics {
    count: usize,
    mean: f64,
    /// Sum of squared deviations from the mean.
    squares: f64,
    beyond: [usize; 3],
    step: f64,
    /// Histogram, symmetric about 0.
    counts: Vec<usize>,
}

const TAILS: [f64; 3] = [2.0, 3.0, 5.0];

impl RunningStatistics {
    /// Statistics with a histogram from −`reach` to `reach`.
    pub(super) fn new(step: f64, reach: f64) -> Self {
        let bins = (2.0 * reach / step).round() as usize;
        Self {
            count: 0,
            mean: 0.0,
            squares: 0.0,
            beyond: [0; 3],
            step,
            counts: vec![0; bins],
        }
    }

    /// Adds a finite value (Welford 1962, Technometrics 4, 419).
    pub(super) fn add(&mut self, value: f64) {
        if !value.is_finite() {
            return;
        }
        self.count += 1;
        let off = value - self.mean;
        self.mean += off / self.count as f64;
        self.squares += off * (value - self.mean);
        for (count, tail) in self.beyond.iter_mut().zip(TAILS) {
            *count += usize::from(value.abs() > tail);
        }
        let bin = (value / self.step).floor() + (self.counts.len() / 2) as f64;
        if bin >= 0.0
            && let Some(count) = self.counts.get_mut(bin as usize)
        {
            *count += 1;
        }
    }

    pub(super) fn add_pull(&mut self, error: Option<f64>, sigma: Option<f64>) {
        if let (Some(error), Some(sigma)) = (error, sigma) {
            self.add(error / sigma);
        }
    }

    pub(super) fn count(&self) -> usize {
        self.count
    }

    fn sd(&self) -> f64 {
        (self.squares / self.count.saturating_sub(1).max(1) as f64).sqrt()
    }

    fn histogram(&self) -> Histogram {
        Histogram {
            from: to_decimals(-self.step * (self.counts.len() / 2) as f64, 6),
            step: self.step,
            counts: self.counts.clone(),
        }
    }

    pub(super) fn pull(self) -> Pull {
        let percent =
            |count: usize| to_decimals(100.0 * count as f64 / self.count.max(1) as f64, 4);
        Pull {
            count: self.count,
            mean: to_decimals(self.mean, 4),
            sd: to_decimals(self.sd(), 4),
            beyond_2_percent: percent(self.beyond[0]),
            beyond_3_percent: percent(self.beyond[1]),
            beyond_5_percent: percent(self.beyond[2]),
            histogram: self.histogram(),
        }
    }

    pub(super) fn difference(self, expected_sd: Option<f64>) -> DifferenceSummary {
        let of_mean = self.sd() / (self.count.max(1) as f64).sqrt();
        DifferenceSummary {
            count: self.count,
            mean: to_significant(self.mean, 5),
            mean_sigma: to_significant(of_mean, 3),
            sd: to_significant(self.sd(), 5),
            expected_sd: expected_sd.map(|sd| to_significant(sd, 5)),
            histogram: self.histogram(),
        }
    }
}
