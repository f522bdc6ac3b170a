//! What all frames of a validation have in common, and the simulation of each.

use super::summary::RunFacts;
use super::theory::SpotTheory;
use crate::base::coords::{Camera, Icrs, Rotation, UnitVector};
use crate::base::epoch::ObservationDate;
use crate::detect::DetectConfig;
use crate::ephemeris::observer::Site;
use crate::ephemeris::places::StarPlaces;
use crate::frame::Frame;
use crate::identify::{DateSource, FrameDate, IndexedCatalog, Priors};
use crate::lab::StudyError;
use crate::lab::robustness::random_rotation;
use crate::lab::simulate::{Pointing, Setup, Simulator, Truth};
use crate::lab::trials::random_of;
use crate::photometry::comparison::ObservingSetup;
use crate::predict::{Budget, Detector, Rule};
use crate::solve::Context;
use rand::Rng;

/// What is simulated, and what the pipeline knows about it.
#[derive(Debug, Clone, PartialEq)]
pub struct ValidationProtocol {
    /// Camera, sky, exposure and scene.
    pub setup: Setup,
    /// Whether the pipeline is given the camera's data sheet, and thereby the scale.
    pub scale_known: bool,
    /// Where the frames are taken, if not in space.
    pub site: Option<Site>,
    /// Seed of the random numbers.
    pub seed: u64,
}

/// Simulates and processes the frames of a [`ValidationProtocol`].
pub struct Validator<'a> {
    pub(super) context: Context<'a>,
    pub(super) protocol: ValidationProtocol,
    pub(super) simulator: Simulator<'a>,
    pub(super) budget: Budget,
    pub(super) detector: Detector,
    pub(super) theory: SpotTheory,
    places: StarPlaces,
}

/// A simulated frame, not yet processed.
pub(super) struct UnprocessedFrame {
    pub(super) frame: Frame<'static>,
    pub(super) truth: Truth,
    pub(super) pointing: Pointing,
    pub(super) seed: u64,
}

/// Pixel seed and attitude of the frame with this number, in a run with this `seed`.
pub fn draw(seed: u64, number: u64) -> (u64, Rotation<Icrs, Camera>) {
    let mut random = random_of(seed, number);
    let icrs_to_camera = random_rotation(&mut random);
    (random.random(), icrs_to_camera)
}

/// A drawn attitude, with the boresight moved along its vertical so that it is uniformly distributed up to
/// 70° from the zenith.
fn raised(drawn: Rotation<Icrs, Camera>, zenith: &UnitVector<Icrs>) -> Rotation<Icrs, Camera> {
    const LEAST_COSINE: f64 = 0.342;
    let boresight = drawn.boresight();
    let cosine = boresight.dot(zenith);
    let away = boresight.as_vector() - zenith.as_vector() * cosine;
    let raised = LEAST_COSINE + (1.0 - LEAST_COSINE) * (1.0 + cosine) / 2.0;
    let sine = (1.0 - raised * raised).sqrt();
    let moved = zenith.as_vector() * raised + away.normalize() * sine;
    drawn.turned_to(&UnitVector::from_vector(moved))
}

impl<'a> Validator<'a> {
    /// Prepares what all frames have in common.
    ///
    /// # Errors
    /// [`StudyError::Scenario`]; [`StudyError::NoLimit`] if there is no limit to predict.
    pub fn new(
        indexed: &'a IndexedCatalog<'a>,
        protocol: &ValidationProtocol,
    ) -> Result<Self, StudyError> {
        let Setup { scenario, scene } = &protocol.setup;
        protocol.setup.check()?;
        let simulator = Simulator::new(scenario, scene, indexed.catalog().stars())?;
        let scenario = &simulator.uniform_scenario();
        let budget = Budget::checked(scenario)?;
        let detector = Detector::new(Rule::MatchedFilter, scenario, &budget);
        if !detector.vmag_at(0.5).is_finite() {
            return Err(StudyError::NoLimit);
        }
        let sheet = &scenario.camera;
        let camera = protocol.scale_known.then(|| ObservingSetup {
            sheet: sheet.clone(),
            zenith_distance_deg: None,
            extinction: None,
        });
        // A frame without a date would lack aberration.
        let date = ObservationDate::J2000;
        Ok(Self {
            simulator,
            context: Context {
                detect: DetectConfig {
                    false_alarms_per_mpx: scenario.conditions.false_alarms_per_mpx,
                    ..DetectConfig::default()
                },
                // Without the exposure: the limit is predicted here, once for all frames.
                camera,
                priors: Priors {
                    date: Some(FrameDate::stated(date, DateSource::User)),
                    site: protocol.site,
                    ..Priors::default()
                },
                ..Context::new(indexed)
            },
            places: StarPlaces::at(&date, protocol.site, None),
            theory: SpotTheory::of(scenario, &budget),
            protocol: protocol.clone(),
            budget,
            detector,
        })
    }

    /// V magnitude of predicted 50 % completeness.
    pub fn limit_vmag(&self) -> f64 {
        self.detector.vmag_at(0.5)
    }

    /// What a summary says of the run, besides the contents of its tables.
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

    /// Pixel seed and attitude of the frame with this number.
    pub fn draw(&self, number: u64) -> (u64, Rotation<Icrs, Camera>) {
        draw(self.protocol.seed, number)
    }

    /// The frame with this number, to look at.
    ///
    /// # Errors
    /// [`StudyError::Simulate`].
    pub fn frame(&self, number: u64) -> Result<Frame<'static>, StudyError> {
        Ok(self.simulate(number)?.frame)
    }

    /// Simulates the frame with this number.
    pub(super) fn simulate(&self, number: u64) -> Result<UnprocessedFrame, StudyError> {
        let (seed, drawn) = self.draw(number);
        let places = self.places;
        let zenith = places.zenith();
        let icrs_to_camera = zenith.map_or(drawn, |zenith| raised(drawn, zenith));
        let pointing = Pointing {
            icrs_to_camera: places.apparent_attitude(&icrs_to_camera),
            places,
        };
        let (frame, truth) = self.simulator.frame(&pointing, seed)?;
        Ok(UnprocessedFrame {
            frame,
            truth,
            pointing,
            seed,
        })
    }
}
