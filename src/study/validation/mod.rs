//! Frames at random attitudes through the whole pipeline, each result against the truth and against what theory allows.
//!
//! ([`Protocol`], [`IndexedCatalog`](crate::identify::IndexedCatalog)) → for each number a [`Trial`]: a [`FrameRecord`] and its [`StarRecord`]s → [`Summary`]
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

mod judge;
mod light;
mod parameter_study;
mod record;
mod spot;
pub mod store;
mod summary;
mod text;

pub use light::Light;
pub use parameter_study::{StudyParameter, StudyRow};
pub use record::{FrameRecord, Kind, Named, StarRecord};
pub use summary::{
    Accumulator, AttitudeSummary, CentroidBin, CentroidSummary, CompletenessBin,
    CompletenessSummary, DetectionSummary, DifferenceSummary, Histogram, IdentificationBin,
    IdentificationSummary, Pull, PullSummary, Quantiles, RunFacts, Summary,
};

use crate::base::coords::{Camera, Icrs, Rotation};
use crate::detect::{DetectConfig, DetectError};
use crate::frame::{Frame, FrameError};
use crate::identify::IndexedCatalog;
use crate::model::sensitivity::{Budget, Detector, Rule, ScenarioError};
use crate::model::simulate::{Pointing, Setup, Simulator, Truth};
use crate::photometry::comparison::StatedCamera;
use crate::pipeline::{Context, Solution, Workspace, solve_frame};
use crate::study::robustness::random_rotation;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use spot::Spots;
use std::time::Instant;

/// The table of stars goes so far beyond the predicted limit.
pub const BEYOND_LIMIT_MAG: f64 = 1.5;

/// Why frames cannot be validated.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ValidationError {
    /// The scenario makes no sense.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// The detector finds noise more often than not.
    #[error("there is no limiting magnitude: noise alone is detected at half of all places")]
    NoLimit,
    /// No such frame can be.
    #[error("simulating a frame")]
    Simulate(#[from] FrameError),
    /// No such frame can be examined.
    #[error("detecting stars in a simulated frame")]
    Detect(#[from] DetectError),
}

/// What is simulated, and what the pipeline is told of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Protocol {
    /// Camera, sky and exposure, and what happens meanwhile.
    pub setup: Setup,
    /// Whether the pipeline has the camera's description, which gives it the scale.
    pub scale_known: bool,
    /// Seed of the random numbers.
    pub seed: u64,
}

/// A [`Protocol`], ready for any number of frames.
pub struct Validator<'a> {
    context: Context<'a>,
    protocol: Protocol,
    simulator: Simulator<'a>,
    budget: Budget,
    detector: Detector,
    spots: Spots,
}

/// What came of one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// Of the frame.
    pub frame: FrameRecord,
    /// Of its stars, bright ones first, and then of what was detected and is no star.
    pub stars: Vec<StarRecord>,
    /// Time for the simulation, in milliseconds.
    pub simulate_ms: f64,
    /// Time for the pipeline.
    pub process_ms: f64,
}

/// A frame before it is examined.
struct Simulated {
    frame: Frame,
    truth: Truth,
    icrs_to_camera: Rotation<Icrs, Camera>,
    seed: u64,
}

/// The seed of the random numbers in the pixels of the frame with this number, and its attitude, in a run with this `seed`.
pub fn draw(seed: u64, number: u64) -> (u64, Rotation<Icrs, Camera>) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(number);
    let icrs_to_camera = random_rotation(&mut random);
    (random.random(), icrs_to_camera)
}

impl<'a> Validator<'a> {
    /// Makes ready what all frames have in common.
    ///
    /// # Errors
    /// [`ValidationError::Scenario`], [`ValidationError::NoLimit`] where nothing can be predicted.
    pub fn new(
        indexed: &'a IndexedCatalog<'a>,
        protocol: &Protocol,
    ) -> Result<Self, ValidationError> {
        let Setup { scenario, scene } = &protocol.setup;
        protocol.setup.check()?;
        let simulator = Simulator::new(scenario, scene, indexed.catalog().stars())?;
        let scenario = &simulator.evened();
        let budget = Budget::checked(scenario)?;
        let detector = Detector::new(Rule::MatchedFilter, scenario, &budget);
        if !detector.vmag_at(0.5).is_finite() {
            return Err(ValidationError::NoLimit);
        }
        let sheet = &scenario.camera;
        let camera = protocol.scale_known.then(|| StatedCamera {
            sheet: sheet.clone(),
            zenith_distance_deg: None,
            extinction: None,
        });
        Ok(Self {
            simulator,
            context: Context {
                detect: DetectConfig {
                    false_alarms_per_mpx: scenario.conditions.false_alarms_per_mpx,
                    ..DetectConfig::default()
                },
                // The exposure is kept from it: what it would predict with it is predicted here, once for all frames.
                camera,
                ..Context::new(indexed)
            },
            spots: Spots::of(scenario, &budget),
            protocol: protocol.clone(),
            budget,
            detector,
        })
    }

    /// V magnitude at which half of the stars should be detected.
    pub fn limit_vmag(&self) -> f64 {
        self.detector.vmag_at(0.5)
    }

    /// What a summary says of the run besides what is in its tables.
    pub fn facts(&self) -> RunFacts {
        let scenario = &self.protocol.setup.scenario;
        RunFacts {
            camera: scenario.camera.name.clone(),
            width_px: scenario.camera.width_px,
            height_px: scenario.camera.height_px,
            seed: self.protocol.seed,
            scale_known: self.protocol.scale_known,
            false_alarms_per_mpx: scenario.conditions.false_alarms_per_mpx,
        }
    }

    /// The seed of the random numbers in the pixels of the frame with this number, and its attitude.
    pub fn draw(&self, number: u64) -> (u64, Rotation<Icrs, Camera>) {
        draw(self.protocol.seed, number)
    }

    /// Simulates the frame with this number, examines it, and holds what comes of it against the truth.
    ///
    /// # Errors
    /// [`ValidationError::Simulate`], [`ValidationError::Detect`] for a detector that no frame can be of.
    pub fn run_one(
        &self,
        number: u64,
        workspace: &mut Workspace,
    ) -> Result<Trial, ValidationError> {
        let start = Instant::now();
        let simulated = self.simulate(number)?;
        let simulate_ms = start.elapsed().as_secs_f64() * 1e3;
        let start = Instant::now();
        let solution = solve_frame(&simulated.frame, &self.context, workspace)?;
        let process_ms = start.elapsed().as_secs_f64() * 1e3;
        let (frame, stars) = self.judged(number, &simulated, &solution);
        Ok(Trial {
            frame,
            stars,
            simulate_ms,
            process_ms,
        })
    }

    /// The one place that knows how frames are made.
    fn simulate(&self, number: u64) -> Result<Simulated, ValidationError> {
        let (seed, icrs_to_camera) = self.draw(number);
        let pointing = Pointing {
            icrs_to_camera,
            years_since_j2000: 0.0,
        };
        let (frame, truth) = self.simulator.frame(&pointing, seed)?;
        Ok(Simulated {
            frame,
            truth,
            icrs_to_camera,
            seed,
        })
    }

    fn judged(
        &self,
        number: u64,
        simulated: &Simulated,
        solution: &Solution,
    ) -> (FrameRecord, Vec<StarRecord>) {
        judge::Judge::new(self, number, simulated, solution).records()
    }
}
