//! What studies with simulated frames have in common: trials with random numbers of their own on all threads, and
//! why they fail.

use crate::centroids::CentroidListError;
use crate::detect::DetectError;
use crate::frame::FrameError;
use crate::predict::ScenarioError;
use crate::solve::{Source, Workspace};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Why a study is impossible.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StudyError {
    /// The scenario is invalid.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// There is no limit: noise alone is detected more often than not.
    #[error(
        "there is no limiting magnitude: noise alone is detected at half or more of all positions"
    )]
    NoLimit,
    /// A frame cannot be simulated or recorded.
    #[error("simulating a frame")]
    Simulate(#[from] FrameError),
    /// A frame cannot be processed.
    #[error("detecting stars in a simulated frame")]
    Detect(#[from] DetectError),
    /// A published list is not of its camera.
    #[error("reading the paper's centroids")]
    List(#[from] CentroidListError),
}

/// The random numbers of a trial. They depend on the study's seed and the trial's number only.
pub(super) fn random_of(seed: u64, number: u64) -> ChaCha8Rng {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(number);
    random
}

/// Results of `count` trials in their order, from the threads of the current pool; `done` is called after each.
pub(super) fn run<R: Send, C: FromParallelIterator<R>>(
    count: u64,
    done: &(dyn Fn() + Sync),
    trial: impl Fn(u64, &mut Workspace) -> R + Sync,
) -> C {
    let trial = |workspace: &mut Workspace, number| {
        let result = trial(number, workspace);
        done();
        result
    };
    let numbers = (0..count).into_par_iter();
    numbers.map_init(Workspace::new, trial).collect()
}

/// Whether a source may be a star.
pub(super) fn is_star_like(source: &Source) -> bool {
    source.measured.is_some_and(|m| m.flags.is_star_like())
}
