//! Which triangles a search tries, and how many hypotheses.

/// Most hypotheses of a search: those that are tested one by one, and the votes.
pub const MAX_HYPOTHESES: u64 = MAX_TESTED + MAX_VOTES;
const MAX_TESTED: u64 = 10_000;
const MAX_VOTES: u64 = 1_000_000;
/// A vote takes as long as so many catalogue triangles that are looked at.
pub const WORK_OF_VOTE: u64 = 3;

/// One sweep over the triangles of the brightest stars.
pub struct SearchPass {
    /// Number of stars that form triangles, the brightest.
    pub stars: usize,
    /// Relative error of a triangle's sides caused by lens distortion.
    pub tolerance: f64,
    /// Probability that another observed star confirms a true hypothesis. Some are false, and some
    /// are not in the catalogue.
    pub true_confirmation: f64,
    /// Largest longest side of a triangle, in units of the frame's diagonal.
    pub largest_share: f64,
}

/// What a search tries.
#[derive(Clone, Copy)]
pub struct SearchPlan {
    /// The passes, one after the other.
    pub passes: &'static [SearchPass],
    /// The passes whose triangles vote, after these: votes add up, and are counted after each.
    pub votes: &'static [SearchPass],
    /// Maximum number of hypotheses.
    pub max_hypotheses: u64,
    /// Maximum work: the number of catalogue triangles of the right shape, and of votes, which count
    /// [`WORK_OF_VOTE`] each.
    pub max_work: u64,
}

/// The plan for the brightest stars, of the frame or of each of its parts.
pub const BRIGHTEST: SearchPlan = SearchPlan {
    passes: &PASSES,
    votes: &VOTES,
    max_hypotheses: MAX_TESTED,
    max_work: 1_600_000,
};

/// The plan for further choices of the brightest stars: they only vote.
pub const AGAIN: SearchPlan = SearchPlan {
    passes: &[],
    ..BRIGHTEST
};

/// The plan for stars below brighter detections. Small triangles are enough: the index lists them
/// down to fainter stars than large ones.
pub const TIER: SearchPlan = SearchPlan {
    passes: &[],
    votes: &TIER_VOTES,
    max_hypotheses: 0,
    max_work: 500_000,
};

/// The triangles of a tier that vote.
pub const TIER_VOTES: [SearchPass; 1] = [SearchPass {
    stars: 30,
    tolerance: 0.0025,
    true_confirmation: 0.35,
    largest_share: 0.35,
}];

/// The passes: the usual frame, a distorting lens.
pub const PASSES: [SearchPass; 2] = [
    SearchPass {
        stars: 12,
        tolerance: 0.0025,
        true_confirmation: 0.6,
        largest_share: f64::INFINITY,
    },
    SearchPass {
        stars: 10,
        tolerance: 0.008,
        true_confirmation: 0.6,
        largest_share: f64::INFINITY,
    },
];

/// The triangles that vote: of many stars, among which many may be false.
pub const VOTES: [SearchPass; 3] = [
    SearchPass {
        stars: 14,
        tolerance: 0.0025,
        true_confirmation: 0.25,
        largest_share: f64::INFINITY,
    },
    SearchPass {
        stars: 20,
        tolerance: 0.0025,
        true_confirmation: 0.25,
        largest_share: f64::INFINITY,
    },
    SearchPass {
        stars: 26,
        tolerance: 0.0025,
        true_confirmation: 0.25,
        largest_share: f64::INFINITY,
    },
];
