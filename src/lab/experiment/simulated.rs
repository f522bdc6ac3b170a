//! Frames simulated with the experiment's camera, sky and pointing, and their solutions.

use crate::base::coords::{Camera, Icrs, Rotation};
use crate::camera::CameraModel;
use crate::catalog::{Catalog, StarIndex};
use crate::frame::Frame;
use crate::identify::{Identification, StarMatch};
use crate::lab::StudyError;
use crate::lab::simulate::{Pointing, Simulator, Truth};
use crate::lab::trials::{self, is_star_like, random_of};
use crate::lab::validation::LightMap;
use crate::predict::{Detector, Faintest, Scenario};
use crate::solve::{Context, Solution, Workspace, solve_frame};
use nalgebra::Vector3;
use rand::Rng;

/// Largest shift of the pointing along each axis, in pixels.
pub(super) const SHIFT_PX: f64 = 0.5;

/// The simulation of frames like the paper's.
pub(super) struct Simulation<'a> {
    pub scenario: &'a Scenario,
    pub simulator: &'a Simulator<'a>,
    /// This detector, and the paper's rule of the brightest pixel.
    pub detectors: [&'a Detector; 2],
    pub pointing: &'a Pointing,
    pub context: &'a Context<'a>,
    pub seed: u64,
}

/// The result of one simulated frame.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ExperimentFrameResult {
    /// The catalogue stars on the frame, also those too faint to be found.
    pub stars: Vec<StarResult>,
    /// The expected faintest star: for this detector, and by the paper's rule.
    pub expected: [Option<Faintest>; 2],
    /// The identified stars; `None` where the frame is not identified.
    pub identified: Option<IdentifiedStars>,
}

/// The result of one star.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct StarResult {
    pub v_mag: f64,
    /// Whether a star-like detection has more of its light from this star than from all others.
    pub detected: bool,
    /// Whether it was identified.
    pub identified: bool,
}

/// The identified stars of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct IdentifiedStars {
    /// Number of stars identified at the light of another star, or of none.
    pub wrong: usize,
    /// V magnitude of the faintest identified star.
    pub faintest_vmag: f64,
    /// Whether that star is wrong.
    pub faintest_is_wrong: bool,
}

impl Simulation<'_> {
    /// Simulates and solves `frames` frames on the threads of the current pool, in order.
    pub(super) fn run(
        &self,
        frames: u64,
        done: &(dyn Fn() + Sync),
    ) -> Result<Vec<ExperimentFrameResult>, StudyError> {
        trials::run(frames, done, |number, workspace: &mut Workspace| {
            let (frame, truth) = self.frame(number)?;
            let solution = self.solve(&frame, workspace)?;
            Ok(self.evaluate(&truth, &solution, self.context.indexed.catalog()))
        })
    }

    /// Frame number `number`; its random numbers depend only on the seed and this number.
    pub(super) fn frame(&self, number: u64) -> Result<(Frame<'static>, Truth), StudyError> {
        let mut random = random_of(self.seed, number);
        let shift_px = [0, 1].map(|_| random.random_range(-SHIFT_PX..SHIFT_PX));
        let pointing = Pointing {
            icrs_to_camera: shifted(self.pointing, self.simulator.camera(), shift_px),
            ..self.pointing.clone()
        };
        Ok(self.simulator.frame(&pointing, random.random())?)
    }

    pub(super) fn solve(
        &self,
        frame: &Frame,
        workspace: &mut Workspace,
    ) -> Result<Solution, StudyError> {
        Ok(solve_frame(frame, self.context, workspace)?)
    }

    fn evaluate(
        &self,
        truth: &Truth,
        solution: &Solution,
        catalog: &Catalog,
    ) -> ExperimentFrameResult {
        let light = LightMap::of(self.scenario, truth);
        let owners: Vec<StarIndex> = solution
            .sources
            .iter()
            .filter(|source| is_star_like(source))
            .filter_map(|source| light.owner(&source.position))
            .filter_map(|star| star.catalog)
            .collect();
        let found = solution.outcome.identification();
        let named = |star: StarIndex| {
            found.is_some_and(|found| found.matches.iter().any(|m| m.star == star))
        };
        let stars = truth.stars.iter().map(|star| StarResult {
            v_mag: star.v_mag,
            detected: star.catalog.is_some_and(|star| owners.contains(&star)),
            identified: star.catalog.is_some_and(named),
        });
        let v_mags = || truth.stars.iter().map(|star| star.v_mag);
        ExperimentFrameResult {
            stars: stars.collect(),
            expected: self
                .detectors
                .map(|detector| Faintest::among(v_mags(), detector)),
            identified: found.and_then(|found| identified(found, solution, &light, catalog)),
        }
    }
}

/// The attitude that moves all stars by `dx`, `dy` pixels near the frame's centre.
fn shifted(
    pointing: &Pointing,
    camera: &CameraModel,
    [dx, dy]: [f64; 2],
) -> Rotation<Icrs, Camera> {
    let radian = |px: f64| px / camera.focal_length_px();
    let dx = if camera.mirrored { -dx } else { dx };
    pointing
        .icrs_to_camera
        .then_turn(Vector3::new(-radian(dy), radian(dx), 0.0))
}

/// Evaluates the identified stars.
fn identified(
    found: &Identification,
    solution: &Solution,
    light: &LightMap,
    catalog: &Catalog,
) -> Option<IdentifiedStars> {
    let is_wrong = |m: &StarMatch| {
        let owner = light.owner(&solution.source(m.source).position);
        owner.is_none_or(|star| star.catalog != Some(m.star))
    };
    // The catalogue is sorted by magnitude.
    let faintest = found.matches.iter().max_by_key(|m| m.star)?;
    Some(IdentifiedStars {
        wrong: found.matches.iter().filter(|m| is_wrong(m)).count(),
        faintest_vmag: f64::from(catalog.star(faintest.star).v_mag),
        faintest_is_wrong: is_wrong(faintest),
    })
}
