//! Which triangles a search tries, and how much it does.
//!
//! All limits count work, never time: the answer to a frame is the same on every machine.

use crate::identify::Effort;

/// Most hypotheses of a search: those that are tested one by one, and the votes.
pub const MAX_HYPOTHESES: u64 = MAX_TESTED + Effort::Thorough.work(WORK) / WORK_OF_VOTE + MAX_LAST;
/// Most hypotheses that are tested one by one.
const MAX_TESTED: u64 = 2_000;
/// Votes of the last triangle may come on top.
const MAX_LAST: u64 = 1_000_000;
/// A vote takes as long as so many catalogue triangles that are looked at.
pub const WORK_OF_VOTE: u64 = 3;
/// Work of a search of the brightest stars, and of another choice of stars.
const WORK: u64 = 850_000;
const WORK_OF_OTHERS: u64 = 400_000;
/// Work where an answer is wanted at once or not at all.
const WORK_AT_ONCE: u64 = 60_000;
const MAX_FITTED_AT_ONCE: u64 = 100;
/// The same in each window.
const WORK_OF_WINDOW: u64 = 60_000;

/// Some of the triangles of the brightest stars.
pub struct SearchPass {
    /// Number of stars that form triangles, the brightest.
    pub stars: usize,
    /// Relative error of a triangle's sides caused by lens distortion.
    pub tolerance: f64,
    /// Probability that another observed star confirms a true hypothesis. Some are false, and some
    /// are not in the catalogue.
    pub true_confirmation: f64,
    /// Largest longest side of a triangle, in units of the frame's diagonal.
    pub largest_side: f64,
}

/// What a search tries.
#[derive(Clone, Copy)]
pub struct SearchPlan {
    /// The passes, one after the other, whose triangles are tested.
    pub passes: &'static [SearchPass],
    /// The passes whose triangles vote, after these: each with those of the pass before.
    pub votes: &'static [SearchPass],
    /// Maximum number of hypotheses that are tested one by one.
    pub max_tested: u64,
    /// Maximum work: the number of catalogue triangles of the right shape, and of votes, which count
    /// [`WORK_OF_VOTE`] each.
    pub max_work: u64,
    /// Maximum number of hypotheses that are fitted.
    pub max_fitted: u64,
}

impl SearchPlan {
    /// Nothing: others follow.
    pub const NOTHING: Self = Self {
        passes: &[],
        votes: &[],
        max_tested: 0,
        max_work: 0,
        max_fitted: 0,
    };

    /// The plan for the brightest stars of the frame, before others: none of them votes.
    pub const fn quick(effort: Effort) -> Self {
        Self {
            passes: &PASSES,
            votes: &[],
            ..Self::votes(effort)
        }
    }

    /// The plan for the brightest stars of the frame where an answer is wanted at once or not at all.
    pub const fn at_once() -> Self {
        Self {
            passes: &PASSES,
            votes: &VOTES_AT_ONCE,
            max_tested: MAX_TESTED,
            max_work: WORK_AT_ONCE,
            max_fitted: MAX_FITTED_AT_ONCE,
        }
    }

    /// The plan for the brightest stars of the frame, which only vote.
    pub const fn votes(effort: Effort) -> Self {
        Self {
            passes: &[],
            votes: &VOTES,
            max_tested: MAX_TESTED,
            max_work: effort.work(WORK),
            max_fitted: u64::MAX,
        }
    }

    /// The plan for another choice of stars, which only vote.
    pub const fn other_stars(effort: Effort) -> Self {
        Self {
            max_work: effort.work(WORK_OF_OTHERS),
            ..Self::votes(effort)
        }
    }

    /// The plan for the stars of a coarser frame.
    pub const fn coarse(effort: Effort) -> Self {
        Self {
            passes: &PASSES,
            ..Self::other_stars(effort)
        }
    }

    /// A window of the frame that is not in its middle.
    pub const fn window(effort: Effort) -> Self {
        Self {
            max_work: effort.work(WORK_OF_WINDOW),
            ..Self::coarse(effort)
        }
    }

    /// The plan for stars below brighter detections, which only vote. Small triangles are enough: the
    /// index lists them down to fainter stars than large ones.
    pub const fn tier(effort: Effort) -> Self {
        Self {
            votes: &TIER_VOTES,
            ..Self::other_stars(effort)
        }
    }
}

/// The passes: the usual frame, a distorting lens.
pub const PASSES: [SearchPass; 2] = [
    SearchPass {
        stars: 12,
        tolerance: 0.0025,
        true_confirmation: 0.6,
        largest_side: f64::INFINITY,
    },
    SearchPass {
        stars: 10,
        tolerance: 0.008,
        true_confirmation: 0.6,
        largest_side: f64::INFINITY,
    },
];

/// The triangles that vote, of more and more stars: many may be false.
const VOTES: [SearchPass; 7] = [
    votes_of(14, f64::INFINITY),
    votes_of(20, f64::INFINITY),
    votes_of(26, f64::INFINITY),
    votes_of(40, f64::INFINITY),
    votes_of(60, f64::INFINITY),
    votes_of(100, f64::INFINITY),
    votes_of(160, f64::INFINITY),
];
const VOTES_AT_ONCE: [SearchPass; 2] = [votes_of(14, f64::INFINITY), votes_of(20, f64::INFINITY)];
const TIER_VOTES: [SearchPass; 2] = [votes_of(30, 0.35), votes_of(60, 0.35)];

const fn votes_of(stars: usize, largest_share: f64) -> SearchPass {
    SearchPass {
        stars,
        tolerance: 0.0025,
        true_confirmation: 0.25,
        largest_side: largest_share,
    }
}
