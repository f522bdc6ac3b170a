//! Results of trials, and their rates.

use super::answers::{Answer, Answers};
use super::centroids::SimulatedCentroids;
use crate::base::statistics::quantile;
use crate::identify::{Identification, StarMatch};

/// The result of one trial.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrialResult {
    /// The answer.
    pub answer: Answer,
    /// Number of true stars in the list.
    pub true_stars: usize,
    /// Number of identified centroids.
    pub named: usize,
    /// Number of centroids identified as the wrong star, or that are false stars.
    pub misnamed: usize,
    /// Time for the identification, in milliseconds.
    pub time_ms: f64,
}

impl TrialResult {
    /// Compares the answer with the truth.
    pub fn new(
        centroids: &SimulatedCentroids,
        found: Option<&Identification>,
        time_ms: f64,
    ) -> Self {
        let (answer, named, misnamed) = match found {
            None => (Answer::None, 0, 0),
            Some(found) => {
                let is_misnamed = |m: &&StarMatch| centroids.stars[m.source.get()] != Some(m.star);
                let misnamed = found.matches.iter().filter(is_misnamed).count();
                let answer = Answer::of(found, &centroids.camera, &centroids.icrs_to_camera);
                (answer, found.matches.len(), misnamed)
            }
        };
        Self {
            answer,
            true_stars: centroids.true_stars(),
            named,
            misnamed,
            time_ms,
        }
    }
}

/// The results of many trials.
#[derive(Debug, Clone, PartialEq)]
pub struct TrialResults {
    results: Vec<TrialResult>,
}

impl TrialResults {
    /// Collects `results`, by the number of the trial.
    pub fn new(results: Vec<TrialResult>) -> Self {
        Self { results }
    }

    /// The trials with at least `min` true stars.
    #[must_use]
    pub fn with_true_stars(&self, min: usize) -> Self {
        let has_enough = |result: &&TrialResult| result.true_stars >= min;
        Self::new(self.results.iter().filter(has_enough).copied().collect())
    }

    /// Number of trials.
    pub fn trials(&self) -> usize {
        self.results.len()
    }

    /// Their answers.
    pub fn answers(&self) -> Answers {
        self.results.iter().map(|result| result.answer).collect()
    }

    /// Numbers of identified and of wrongly identified centroids.
    pub fn names(&self) -> (usize, usize) {
        self.results
            .iter()
            .fold((0, 0), |sum, v| (sum.0 + v.named, sum.1 + v.misnamed))
    }

    /// The quantile `share` of the identification times, in milliseconds; 0 without trials.
    pub fn time_quantile_ms(&self, share: f64) -> f64 {
        let mut times: Vec<f64> = self.results.iter().map(|v| v.time_ms).collect();
        times.sort_unstable_by(f64::total_cmp);
        quantile(&times, share).unwrap_or(0.0)
    }
}
