//! Numbers of answers, and the intervals of their rates.

use super::interval::Interval;
use crate::base::coords::{Camera, Icrs, PixelPoint, Rotation};
use crate::camera::CameraModel;
use crate::identify::Identification;
use serde::{Deserialize, Serialize};

/// The answer of an identification, compared with the truth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Answer {
    /// Identified correctly.
    Right,
    /// Identified as another field.
    Wrong,
    /// Not identified.
    #[default]
    None,
}

impl Answer {
    /// Compares `found` with the true `camera` and attitude.
    pub fn of(
        found: &Identification,
        camera: &CameraModel,
        icrs_to_camera: &Rotation<Icrs, Camera>,
    ) -> Self {
        /// Largest error of a right answer at the centre and the corners, as a share of the frame's
        /// width. Wrong answers are nearly always off by more than the whole width.
        const TOLERANCE: f64 = 0.01;
        let (right, bottom) = (camera.width_px - 1.0, camera.height_px - 1.0);
        let corners = [(0.0, 0.0), (right, 0.0), (0.0, bottom), (right, bottom)];
        let tolerance_rad = TOLERANCE * camera.width_px / camera.focal_length_px();
        let is_right = |pixel: PixelPoint| {
            let Some(truth) = camera.direction_of(&pixel) else {
                return true;
            };
            let truth = icrs_to_camera.inverse().apply(&truth);
            let direction = found.camera.direction_of(&pixel);
            let direction = direction.map(|d| found.icrs_to_camera.inverse().apply(&d));
            direction.is_some_and(|d| d.angle_to(&truth) <= tolerance_rad)
        };
        let corners = corners.map(|(x, y)| PixelPoint::new(x, y));
        if is_right(camera.centre()) && corners.into_iter().all(is_right) {
            Self::Right
        } else {
            Self::Wrong
        }
    }
}

/// Numbers of right, wrong and missing answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Answers {
    /// Right ones.
    pub right: usize,
    /// Wrong ones.
    pub wrong: usize,
    /// Those without an answer.
    pub none: usize,
}

impl Answers {
    /// Counts an answer.
    pub fn add(&mut self, answer: Answer) {
        *match answer {
            Answer::Right => &mut self.right,
            Answer::Wrong => &mut self.wrong,
            Answer::None => &mut self.none,
        } += 1;
    }

    /// Number of all.
    pub fn all(self) -> usize {
        self.right + self.wrong + self.none
    }

    /// Share of right answers; 0 without any.
    pub fn right_share(self) -> f64 {
        self.right as f64 / self.all().max(1) as f64
    }

    /// Confidence interval of the probability of a right answer.
    pub fn right_interval(self) -> Interval {
        Interval::of(self.right, self.all())
    }

    /// Confidence interval of the probability of a wrong answer.
    pub fn wrong_interval(self) -> Interval {
        Interval::of(self.wrong, self.all())
    }
}

impl FromIterator<Answer> for Answers {
    fn from_iter<I: IntoIterator<Item = Answer>>(answers: I) -> Self {
        let mut counts = Self::default();
        answers.into_iter().for_each(|answer| counts.add(answer));
        counts
    }
}
