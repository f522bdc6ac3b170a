//! How accurate is the whole pipeline? Simulated frames at random attitudes, compared with the
//! truth and with theory.
//!
//! [`ValidationProtocol`], [`IndexedCatalog`](crate::identify::IndexedCatalog) → [`Validator`] → for each
//! number a [`ValidatedFrame`] ([`FrameRecord`], [`StarRecord`]s) → [`ValidationSummary`]
//!
//! 1. Draw an attitude uniformly over all rotations, simulate the frame with the stars of the
//!    catalogue, and process it as `starpipe process` does. Random numbers depend on the seed and
//!    the frame's number only, so results do not depend on the number of threads.
//! 2. Classify the answer as right, wrong or none, by the directions of the centre and the corners.
//! 3. Assign each detection to the star that contributes more than half of the light there. Compare
//!    it with the star's true position and flux, and with the Cramér-Rao bound.
//! 4. Compare the attitude with the truth about the camera axes, in units of its stated covariance.
//! 5. Compare the detected fraction of the stars of each magnitude with the predicted completeness,
//!    and the faintest named star with the expectation for the stars on the frame.
//!
//! Caveats: those of [`crate::lab::simulate`]; and the simulated stars are those of the catalogue
//! used for identification. Statistics of centroids, pulls and completeness are of *isolated*
//! stars: entirely on the frame, without another detectable star nearby, and with negligible light
//! of other stars.
//!
//! # Reference
//! Bar-Shalom, Li & Kirubarajan 2001, Estimation with Applications to Tracking and Navigation,
//! section 5.4 (consistency).

mod evaluation;
mod light;
mod parameter_study;
mod record;
mod run_identity;
mod run_tables;
mod suite;
mod summary;
mod text;
mod theory;
mod validator;

pub use light::LightMap;
pub use parameter_study::{StudyParameter, StudyRow};
pub use record::{BEYOND_LIMIT_MAG, FrameRecord, NameResult, RowKind, StarRecord};
pub use run_identity::claim_directory;
pub use run_tables::{FRAMES_PER_PART, FrameLines, RunTables};
pub use suite::{HARD_SUITE, HardCase, HardRow};
pub use summary::{
    Accumulator, AttitudeSummary, CentroidBin, CentroidSummary, CompletenessBin,
    CompletenessSummary, DetectionSummary, DifferenceSummary, Histogram, IdentificationBin,
    IdentificationSummary, Pull, PullSummary, Quantiles, RunFacts, ValidationSummary,
};
pub use validator::{ValidationProtocol, Validator, draw};

use crate::lab::StudyError;
use crate::solve::{Workspace, solve_frame};
use evaluation::Evaluation;
use std::time::Instant;

/// A simulated frame, compared with the truth.
#[derive(Debug, Clone, PartialEq)]
pub struct ValidatedFrame {
    /// Results of the frame.
    pub frame: FrameRecord,
    /// Results of its true stars, then of detections that are no star.
    pub stars: Vec<StarRecord>,
    /// Duration of the simulation, in milliseconds.
    pub simulate_ms: f64,
    /// Duration of the pipeline, in milliseconds.
    pub process_ms: f64,
}

impl Validator<'_> {
    /// Simulates the frame with this number, processes it, and compares the result with the truth.
    ///
    /// # Errors
    /// [`StudyError::Simulate`], [`StudyError::Detect`] for an unsupported detector size.
    pub fn run_one(
        &self,
        number: u64,
        workspace: &mut Workspace,
    ) -> Result<ValidatedFrame, StudyError> {
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
