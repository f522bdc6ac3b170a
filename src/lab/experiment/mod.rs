//! Can the two experiments of Tong, Li & Wang 2014 be reproduced? Their limits, stars and frames.
//!
//! ([`Published`], [`IndexedCatalog`]) → [`ExperimentRun`] with its [`ExperimentReport`]
//!
//! 1. The limiting magnitude of the sensitivity model in the paper's reading is compared with the
//!    printed one, and with that of this detector.
//! 2. The centroids of the paper's table are identified without priors but time and site, and the
//!    identified stars are compared with the paper's.
//! 3. Frames are simulated with the experiment's camera, sky and exposure, at the pointing and
//!    pixel scale of its table, each with its own subpixel shift and noise, and solved without
//!    priors. The faintest identified star of each is compared with the expected one for the stars
//!    on the frame.
//!
//! Caveats: the simulated stars are those of the catalogue used to identify them; the true sky has
//! more faint stars, which would disturb. Pixels are square with the scale of the paper's table,
//! which is not that of the stated pixel pitches. The extinction is that of the stated zenith
//! distance, though it contradicts site, time and pointing.
//!
//! # Reference
//! Tong, Li & Wang 2014, Acta Optica Sinica 34, 1004003, doi 10.3788/AOS201434.1004003.

mod published;
mod report;
mod simulated;
mod summary;
mod table;
mod text;

pub use published::{Published, PublishedStar};
pub use report::{ExperimentReport, LimitReport, SCHEMA};
pub use summary::{DetectionBin, ExpectedFaintest, FoundFaintest, SimulatedReport};
pub use table::{FieldReport, TableReport, TableStar};

use crate::frame::Frame;
use crate::identify::{DateSource, FrameDate, IndexedCatalog, Priors};
use crate::lab::StudyError;
use crate::lab::simulate::{Pointing, Scene, Simulator};
use crate::predict::{Budget, Detector, Rule, Scenario};
use crate::solve::{Context, Solution, Workspace, solve_centroids};
use simulated::Simulation;

/// Number of simulated frames, and their seed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TrialSettings {
    /// Frames to simulate.
    pub count: u64,
    /// Seed of the random numbers.
    pub seed: u64,
}

/// The result of an experiment.
#[derive(Debug)]
pub struct ExperimentRun {
    /// The report.
    pub report: ExperimentReport,
    /// The first simulated frame with its solution; `None` where the paper's table was not
    /// identified.
    pub first: Option<(Frame<'static>, Solution)>,
}

/// Runs the experiment, its frames on the threads of the current pool; `done` is called after each.
///
/// # Errors
/// [`StudyError`], which does not occur with the paper's cameras.
pub fn run(
    published: &Published,
    indexed: &IndexedCatalog,
    trials: TrialSettings,
    done: &(dyn Fn() + Sync),
) -> Result<ExperimentRun, StudyError> {
    let scenario = Scenario::of(published.preset);
    let budget = Budget::new(&scenario);
    let detector = Detector::new(Rule::MatchedFilter, &scenario, &budget);
    let context = context(published, indexed);
    let solution = solve_centroids(
        &table::centroids(published, &scenario),
        &context,
        &mut Workspace::new(),
    )?;
    let mut report = ExperimentReport {
        schema: SCHEMA,
        experiment: published.number,
        date: published.date.to_iso(),
        site_lat_deg: published.site.lat_deg(),
        site_lon_deg: published.site.lon_deg(),
        exposure_s: scenario.conditions.exposure_s,
        limit: LimitReport::new(published, &budget, &detector),
        table: TableReport::new(published, &scenario, &solution, indexed.catalog()),
        simulated: None,
    };
    let Some(found) = solution.outcome.identification() else {
        return Ok(ExperimentRun {
            report,
            first: None,
        });
    };
    let stars = indexed.catalog().stars();
    let simulator = Simulator::new(&scenario, &Scene::default(), stars)?;
    let simulation = Simulation {
        scenario: &scenario,
        simulator: &simulator.with_camera(found.camera),
        detectors: [
            &detector,
            &Detector::new(Rule::PeakPixel, &scenario, &budget),
        ],
        pointing: &Pointing {
            icrs_to_camera: found.icrs_to_camera,
            places: found.places,
        },
        context: &context,
        seed: trials.seed,
    };
    let simulated = simulation.run(trials.count, done)?;
    report.simulated = Some(SimulatedReport::new(&simulated, &detector, trials.seed));
    let (frame, _) = simulation.frame(0)?;
    let solution = simulation.solve(&frame, &mut Workspace::new())?;
    Ok(ExperimentRun {
        report,
        first: Some((frame, solution)),
    })
}

/// The context of the identification: date and site are known.
fn context<'a>(published: &Published, indexed: &'a IndexedCatalog<'a>) -> Context<'a> {
    let date = FrameDate::stated(published.date, DateSource::User);
    Context {
        priors: Priors {
            date: Some(date),
            site: Some(published.site),
            ..Priors::default()
        },
        ..Context::new(indexed)
    }
}
