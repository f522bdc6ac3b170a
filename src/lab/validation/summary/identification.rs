//! Rates of right, wrong and no identification.

use crate::base::format::to_decimals;
use crate::lab::robustness::{Answer, Answers};
use serde::Serialize;

/// Lower ends of the bins, in stars brighter than the limit.
const FROM_STARS: [u64; 11] = [0, 4, 6, 8, 10, 15, 20, 30, 50, 100, 200];

/// Rates of right, wrong and no identification, in percent, with 95 % intervals (Clopper &
/// Pearson).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct IdentificationSummary {
    /// All frames.
    #[serde(flatten)]
    pub all: IdentificationBin,
    /// By the number of stars brighter than the predicted limit, without empty bins.
    pub by_stars: Vec<IdentificationBin>,
}

/// Frames by number of stars.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[expect(missing_docs, reason = "docs/json.md describes the fields")]
pub struct IdentificationBin {
    pub from_stars: u64,
    pub to_stars: u64,
    pub frames: usize,
    pub right: usize,
    pub wrong: usize,
    pub none: usize,
    pub right_percent: f64,
    pub right_low_percent: f64,
    pub right_high_percent: f64,
    pub wrong_high_percent: f64,
}

impl IdentificationBin {
    fn new([from_stars, to_stars]: [u64; 2], answers: Answers) -> Self {
        let percent = |share: f64| to_decimals(100.0 * share, 4);
        let interval = answers.right_interval();
        Self {
            from_stars,
            to_stars,
            frames: answers.all(),
            right: answers.right,
            wrong: answers.wrong,
            none: answers.none,
            right_percent: percent(answers.right_share()),
            right_low_percent: percent(interval.low),
            right_high_percent: percent(interval.high),
            wrong_high_percent: percent(answers.wrong_interval().high),
        }
    }
}

/// Answers by the number of stars.
#[derive(Default)]
pub(super) struct Identifications {
    all: Answers,
    by_stars: [Answers; FROM_STARS.len()],
    most_stars: u64,
}

impl Identifications {
    pub(super) fn add(&mut self, stars: u64, answer: Answer) {
        let bin = FROM_STARS.partition_point(|from| *from <= stars) - 1;
        self.all.add(answer);
        self.by_stars[bin].add(answer);
        self.most_stars = self.most_stars.max(stars);
    }

    pub(super) fn finish(self) -> IdentificationSummary {
        let bin = |(bin, answers): (usize, &Answers)| {
            let next = FROM_STARS.get(bin + 1).map(|from| from - 1);
            let to_stars = next.unwrap_or(self.most_stars);
            IdentificationBin::new([FROM_STARS[bin], to_stars], *answers)
        };
        let bins = self.by_stars.iter().enumerate().map(bin);
        IdentificationSummary {
            all: IdentificationBin::new([0, self.most_stars], self.all),
            by_stars: bins.filter(|bin| bin.frames > 0).collect(),
        }
    }
}
