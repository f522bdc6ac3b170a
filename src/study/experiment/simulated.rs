//! Frames simulated with the experiment's camera, sky and pointing, and what the pipeline finds in them.

use super::ExperimentError;
use crate::base::coords::{Camera, Icrs, Rotation};
use crate::camera::CameraModel;
use crate::frame::Frame;
use crate::identify::{Identification, StarMatch};
use crate::model::sensitivity::{Detector, Faintest, Scenario};
use crate::model::simulate::{Pointing, Simulator, Truth};
use crate::pipeline::{Context, Solution, Source, Workspace, solve_frame};
use crate::sky::catalog::{Catalog, StarIndex};
use crate::study::validation::LightMap;
use nalgebra::Vector3;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// The pointing of a trial is moved by up to so many pixels along each axis.
pub(super) const SHIFT_PX: f64 = 0.5;

/// What is simulated, again and again.
pub(super) struct Protocol<'a> {
    pub scenario: &'a Scenario,
    pub simulator: &'a Simulator<'a>,
    /// The detector as built, and the paper's rule of the brightest pixel.
    pub detectors: [&'a Detector; 2],
    pub pointing: &'a Pointing,
    pub context: &'a Context<'a>,
    pub seed: u64,
}

/// What became of one simulated frame.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Trial {
    /// The catalogue's stars on it, faint ones without a chance included.
    pub stars: Vec<StarTrial>,
    /// What is to be expected of the faintest: of the detector as built, and by the paper's rule.
    pub expected: [Option<Faintest>; 2],
    /// What was identified; none where the frame was not.
    pub identified: Option<Identified>,
}

/// What became of a star.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct StarTrial {
    pub v_mag: f64,
    /// There is a detection that may be a star, whose light is more this star's than all others'.
    pub detected: bool,
    /// It was named.
    pub identified: bool,
}

/// What was identified in a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Identified {
    /// Stars named at the light of another star, or of none.
    pub wrong: usize,
    /// V of the faintest star named.
    pub faintest_vmag: f64,
    /// Whether that one is wrong.
    pub faintest_is_wrong: bool,
}

impl Protocol<'_> {
    /// So many trials on the threads of the current pool, in their order.
    pub(super) fn run(
        &self,
        trials: u64,
        done: &(dyn Fn() + Sync),
    ) -> Result<Vec<Trial>, ExperimentError> {
        (0..trials)
            .into_par_iter()
            .map_init(Workspace::new, |workspace, number| {
                let (frame, truth) = self.frame(number)?;
                let solution = self.solve(&frame, workspace)?;
                done();
                Ok(self.judged(&truth, &solution, self.context.indexed.catalog()))
            })
            .collect()
    }

    /// The frame of one trial; its random numbers depend on the seed and its own number only.
    pub(super) fn frame(&self, number: u64) -> Result<(Frame, Truth), ExperimentError> {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        random.set_stream(number);
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
    ) -> Result<Solution, ExperimentError> {
        Ok(solve_frame(frame, self.context, workspace)?)
    }

    fn judged(&self, truth: &Truth, solution: &Solution, catalog: &Catalog) -> Trial {
        let light = LightMap::of(self.scenario, truth);
        let star_like = |source: &&Source| source.measured.is_some_and(|m| m.flags.is_star_like());
        let owners: Vec<StarIndex> = solution
            .sources
            .iter()
            .filter(star_like)
            .filter_map(|source| light.owner(&source.position))
            .filter_map(|star| star.catalog)
            .collect();
        let found = solution.outcome.identification();
        let named = |star: StarIndex| {
            found.is_some_and(|found| found.matches.iter().any(|m| m.star == star))
        };
        let trials = truth.stars.iter().map(|star| StarTrial {
            v_mag: star.v_mag,
            detected: star.catalog.is_some_and(|star| owners.contains(&star)),
            identified: star.catalog.is_some_and(named),
        });
        let v_mags = || truth.stars.iter().map(|star| star.v_mag);
        Trial {
            stars: trials.collect(),
            expected: self
                .detectors
                .map(|detector| Faintest::among(v_mags(), detector)),
            identified: found.and_then(|found| identified(found, solution, &light, catalog)),
        }
    }
}

/// The attitude with which every star falls so many pixels further along x and y, near the frame's centre.
fn shifted(
    pointing: &Pointing,
    camera: &CameraModel,
    [dx, dy]: [f64; 2],
) -> Rotation<Icrs, Camera> {
    let radian = |px: f64| px / camera.focal_length_px;
    let dx = if camera.mirrored { -dx } else { dx };
    pointing
        .icrs_to_camera
        .then_turn(Vector3::new(-radian(dy), radian(dx), 0.0))
}

/// What was named, rightly and wrongly.
fn identified(
    found: &Identification,
    solution: &Solution,
    light: &LightMap,
    catalog: &Catalog,
) -> Option<Identified> {
    let is_wrong = |m: &StarMatch| {
        let owner = light.owner(&solution.source(m.source).position);
        owner.is_none_or(|star| star.catalog != Some(m.star))
    };
    // The catalogue is in the order of magnitude.
    let faintest = found.matches.iter().max_by_key(|m| m.star)?;
    Some(Identified {
        wrong: found.matches.iter().filter(|m| is_wrong(m)).count(),
        faintest_vmag: f64::from(catalog.star(faintest.star).v_mag),
        faintest_is_wrong: is_wrong(faintest),
    })
}
