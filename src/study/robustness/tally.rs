//! From answers to rates.

use super::{Interval, Observation};
use crate::base::coords::{Camera, Icrs, PixelPoint, Rotation};
use crate::camera::CameraModel;
use crate::identify::{Identification, StarMatch};
use serde::{Deserialize, Serialize};

/// An answer is right if the centre and the corners of the frame point where they do, to this share of the
/// frame's width. A wrong identification is off by more than its width nearly always.
const RIGHT_WITHIN: f64 = 0.01;

/// What the answer to a trial was.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Answer {
    /// Identified, and rightly.
    Right,
    /// Identified as what it is not.
    Wrong,
    /// Not identified.
    None,
}

impl Answer {
    /// The answer that `found` is, where the frame is truly that of `camera` in this attitude.
    pub fn of(
        found: &Identification,
        camera: &CameraModel,
        icrs_to_camera: &Rotation<Icrs, Camera>,
    ) -> Self {
        let (right, bottom) = (camera.width_px - 1.0, camera.height_px - 1.0);
        let corners = [(0.0, 0.0), (right, 0.0), (0.0, bottom), (right, bottom)];
        let tolerance_rad = RIGHT_WITHIN * camera.fov_x_rad();
        let is_right = |pixel: PixelPoint| {
            let true_direction = icrs_to_camera.inverse().apply(&camera.direction_of(&pixel));
            let direction = found
                .icrs_to_camera
                .inverse()
                .apply(&found.camera.direction_of(&pixel));
            direction.angle_to(&true_direction) <= tolerance_rad
        };
        let corners = corners.map(|(x, y)| PixelPoint::new(x, y));
        if is_right(camera.centre()) && corners.into_iter().all(is_right) {
            Self::Right
        } else {
            Self::Wrong
        }
    }
}

/// What came of one trial.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Verdict {
    /// The answer.
    pub answer: Answer,
    /// True stars in the list.
    pub true_stars: usize,
    /// Centroids that were named.
    pub named: usize,
    /// Those of them that are another star, or none.
    pub misnamed: usize,
    /// Time for the identification, in milliseconds.
    pub time_ms: f64,
}

impl Verdict {
    /// Compares the answer with the truth.
    pub fn new(observation: &Observation, found: Option<&Identification>, time_ms: f64) -> Self {
        let (answer, named, misnamed) = match found {
            None => (Answer::None, 0, 0),
            Some(found) => {
                let is_wrong = |m: &&StarMatch| observation.stars[m.source.get()] != Some(m.star);
                let misnamed = found.matches.iter().filter(is_wrong).count();
                let answer = Answer::of(found, &observation.camera, &observation.icrs_to_camera);
                (answer, found.matches.len(), misnamed)
            }
        };
        Self {
            answer,
            true_stars: observation.true_stars(),
            named,
            misnamed,
            time_ms,
        }
    }
}

/// What came of many trials.
#[derive(Debug, Clone, PartialEq)]
pub struct Tally {
    verdicts: Vec<Verdict>,
}

impl Tally {
    /// The tally of `verdicts`.
    pub fn new(verdicts: Vec<Verdict>) -> Self {
        Self { verdicts }
    }

    /// The verdicts, by the number of the trial.
    pub fn verdicts(&self) -> &[Verdict] {
        &self.verdicts
    }

    /// The trials with so many true stars or more.
    #[must_use]
    pub fn with_true_stars(&self, least: usize) -> Self {
        let enough = |verdict: &&Verdict| verdict.true_stars >= least;
        Self::new(self.verdicts.iter().filter(enough).copied().collect())
    }

    /// How many trials there were.
    pub fn trials(&self) -> usize {
        self.verdicts.len()
    }

    /// How many had this answer.
    pub fn count(&self, answer: Answer) -> usize {
        self.verdicts.iter().filter(|v| v.answer == answer).count()
    }

    /// The interval of the probability of this answer.
    pub fn interval(&self, answer: Answer) -> Interval {
        Interval::of(self.count(answer), self.trials())
    }

    /// Centroids named, and those of them wrongly.
    pub fn names(&self) -> (usize, usize) {
        self.verdicts
            .iter()
            .fold((0, 0), |sum, v| (sum.0 + v.named, sum.1 + v.misnamed))
    }

    /// The time for an identification that this part of the trials did not exceed, in milliseconds; 0 without trials.
    pub fn time_quantile_ms(&self, part: f64) -> f64 {
        let mut times: Vec<f64> = self.verdicts.iter().map(|v| v.time_ms).collect();
        times.sort_unstable_by(f64::total_cmp);
        let last = times.len().saturating_sub(1);
        times
            .get((part * last as f64).round() as usize)
            .copied()
            .unwrap_or(0.0)
    }
}
