//! What all frames of a validation have in common, and how each is simulated.

use super::summary::RunFacts;
use super::theory::Theory;
use crate::base::coords::{Camera, Icrs, Rotation};
use crate::detect::{DetectConfig, DetectError};
use crate::frame::{Frame, FrameError};
use crate::identify::IndexedCatalog;
use crate::model::sensitivity::{Budget, Detector, Rule, ScenarioError};
use crate::model::simulate::{Pointing, Setup, Simulator, Truth};
use crate::photometry::comparison::StatedCamera;
use crate::pipeline::Context;
use crate::study::robustness::random_rotation;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

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
    pub(super) context: Context<'a>,
    pub(super) protocol: Protocol,
    pub(super) simulator: Simulator<'a>,
    pub(super) budget: Budget,
    pub(super) detector: Detector,
    pub(super) theory: Theory,
}

/// A frame before it is examined.
pub(super) struct Simulated {
    pub(super) frame: Frame,
    pub(super) truth: Truth,
    pub(super) icrs_to_camera: Rotation<Icrs, Camera>,
    pub(super) seed: u64,
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
        let scenario = &simulator.uniform_scenario();
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
            theory: Theory::of(scenario, &budget),
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

    /// The one place that knows how frames are made.
    pub(super) fn simulate(&self, number: u64) -> Result<Simulated, ValidationError> {
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
}
