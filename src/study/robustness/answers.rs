//! Numbers of answers, and the intervals of their rates.

use super::interval::Interval;
use super::trial::Answer;

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
