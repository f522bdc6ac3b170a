//! Frames at random attitudes through the whole pipeline, each result against the truth and against what theory allows.
//!
//! ([`Protocol`], [`IndexedCatalog`](crate::identify::IndexedCatalog)) → for each number a [`ValidatedFrame`]: a [`FrameRecord`] and its [`StarRecord`]s → [`Summary`]
//!
//! 1. The attitude is uniform over all rotations; the frame is simulated with the stars of the catalogue, and processed as
//!    `starpipe process` does. Its random numbers depend on the seed and its own number only: the same on any number of threads.
//! 2. The answer is right, wrong or none, by where the centre and the corners point.
//! 3. Each detection is the star's to which more than half of the light there is due. It is held against the star's true place
//!    and light, and against the Cramér-Rao bound.
//! 4. The attitude is held against the true one about the camera's axes, in units of its stated covariance.
//! 5. What is found of the stars of each magnitude is held against the predicted completeness, and the faintest star named
//!    against the faintest to be expected of the very stars on the frame.
//!
//! Caveats: those of [`crate::model::simulate`]; the stars are those of the catalogue that they are identified with. Stars are *isolated*
//! where they are whole on the frame, no other star that may be detected is near, and the light of the others there does not matter; what is said of
//! centroids, pulls and completeness is of these.
//!
//! # Reference
//! Bar-Shalom, Li & Kirubarajan 2001, Estimation with Applications to Tracking and Navigation, section 5.4 (consistency).

mod evaluation;
mod light;
mod parameter_study;
mod record;
pub mod store;
mod summary;
mod text;
mod theory;
mod validator;

pub use light::LightMap;
pub use parameter_study::{StudyParameter, StudyRow};
pub use record::{BEYOND_LIMIT_MAG, FrameRecord, Named, RowKind, StarRecord};
pub use summary::{
    Accumulator, AttitudeSummary, CentroidBin, CentroidSummary, CompletenessBin,
    CompletenessSummary, DetectionSummary, DifferenceSummary, Histogram, IdentificationBin,
    IdentificationSummary, Pull, PullSummary, Quantiles, RunFacts, Summary,
};
pub use validator::{Protocol, ValidationError, Validator, draw};

use crate::pipeline::{Workspace, solve_frame};
use evaluation::Evaluation;
use std::time::Instant;

/// What came of one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct ValidatedFrame {
    /// Of the frame.
    pub frame: FrameRecord,
    /// Of its stars, bright ones first, and then of what was detected and is no star.
    pub stars: Vec<StarRecord>,
    /// Time for the simulation, in milliseconds.
    pub simulate_ms: f64,
    /// Time for the pipeline.
    pub process_ms: f64,
}

impl Validator<'_> {
    /// Simulates the frame with this number, examines it, and holds what comes of it against the truth.
    ///
    /// # Errors
    /// [`ValidationError::Simulate`], [`ValidationError::Detect`] for a detector that no frame can be of.
    pub fn run_one(
        &self,
        number: u64,
        workspace: &mut Workspace,
    ) -> Result<ValidatedFrame, ValidationError> {
        let start = Instant::now();
        let simulated = self.simulate(number)?;
        let simulate_ms = start.elapsed().as_secs_f64() * 1e3;
        let start = Instant::now();
        let solution = solve_frame(&simulated.frame, &self.context, workspace)?;
        let process_ms = start.elapsed().as_secs_f64() * 1e3;
        let (frame, stars) = Evaluation::new(self, number, &simulated, &solution).records();
        Ok(ValidatedFrame {
            frame,
            stars,
            simulate_ms,
            process_ms,
        })
    }
}
