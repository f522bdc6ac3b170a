//! How often is an identification right, wrong, or not possible? The usual Monte Carlo protocol.
//!
//! [`TrialProtocol`] → for each trial a list of centroids drawn from the catalogue → identification as
//! in `starpipe identify` → [`TrialResult`] → [`TrialResults`] → [`CaseResult`]
//!
//! 1. The attitude is uniform over all rotations; the camera is a pinhole.
//! 2. The stars of a frame are the catalogue stars whose observed magnitude lies above a limit. The
//!    limit is the same over the whole sky, so rich and poor fields are as frequent as on the sky.
//! 3. Positions and magnitudes get Gaussian errors. Some stars are removed whatever their
//!    brightness, and false stars are added uniformly, with the magnitudes of true ones.
//! 4. The scale prior is off by up to its stated error, or there is none.
//! 5. A trial is right, wrong or without an answer. Its random numbers depend only on the seed and
//!    its own number: results do not depend on the number of threads, and all rows of a table have
//!    the same attitudes.
//!
//! Caveats: the stars come from the catalogue that is searched, so only the false stars stand for
//! stars that it lacks; double stars are not merged.
//!
//! # Reference
//! Rijlaarsdam, Yous, Byrne, Oddenino, Furano, Moloney 2020, Sensors 20, 2579 (what to report and
//! to state with it).

mod answers;
mod centroids;
mod interval;
mod protocol;
mod table;
mod trial;

pub use answers::{Answer, Answers};
pub use centroids::{SimulatedCentroids, random_rotation};
pub use interval::Interval;
pub use protocol::{Mirrored, TrialProtocol};
pub use table::{CaseResult, ProtocolCase, VariedParameter, standard_cases};
pub use trial::{TrialResult, TrialResults};

use crate::ephemeris::places::StarPlaces;
use crate::identify::{IndexedCatalog, identify};
use crate::lab::trials::{self, random_of};
use crate::solve::Workspace;
use std::time::Instant;

/// Runs `trials` trials of `protocol` on the threads of the current pool; `done` is called after
/// each.
pub fn run(
    indexed: &IndexedCatalog,
    protocol: &TrialProtocol,
    trials: u64,
    seed: u64,
    done: &(dyn Fn() + Sync),
) -> TrialResults {
    let trial = |trial: u64, _: &mut Workspace| run_one(indexed, protocol, seed, trial);
    TrialResults::new(trials::run(trials, done, trial))
}

/// Runs only the trial number `trial`.
pub fn run_one(
    indexed: &IndexedCatalog,
    protocol: &TrialProtocol,
    seed: u64,
    trial: u64,
) -> TrialResult {
    let mut rng = random_of(seed, trial);
    let centroids = SimulatedCentroids::draw(protocol, indexed, &mut rng);
    let priors = protocol.priors(&mut rng);
    let start = Instant::now();
    let field = centroids.list.star_field(StarPlaces::default());
    let found = identify(&field, &priors, indexed);
    let time_ms = start.elapsed().as_secs_f64() * 1e3;
    TrialResult::new(&centroids, found.as_ref().ok(), time_ms)
}
