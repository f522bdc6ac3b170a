//! The two experiments of Tong, Li & Wang 2014, done again: the limit, the stars, and frames like theirs.
//!
//! ([`Published`], [`IndexedCatalog`](crate::identify::IndexedCatalog)) → [`Run`] with its [`ExperimentReport`]
//!
//! 1. The limit of the sensitivity model in the paper's reading, beside what the paper prints; and that of the detector as
//!    built.
//! 2. The paper's table: its centroids are identified with nothing known but time and place, and the numbers that come out
//!    are held against the paper's.
//! 3. Frames are simulated with the experiment's camera, sky and exposure, at the pointing and the pixel scale of its
//!    table, each moved by a part of a pixel and with noise of its own, and go through the pipeline with nothing known. Of
//!    each the faintest star named is held against the faintest to be expected of the very stars that are on it.
//!
//! Caveats: the stars of the frames are those of the catalogue that they are identified with; the true sky has more
//! faint ones, and they would disturb. The pixels are square and have the scale of the paper's own table, which is not that of
//! the pitches that the paper states. The zenith distance, as stated, makes the extinction, though site, time and pointing
//! contradict it.
//!
//! # Reference
//! Tong, Li & Wang 2014, Acta Optica Sinica 34, 1004003, doi 10.3788/AOS201434.1004003.

mod published;
mod simulated;
mod summary;
mod table;
mod text;

pub use published::{Published, PublishedStar};
pub use summary::{CompletenessBin, ExpectedFaintest, FoundFaintest, SimulatedReport};
pub use table::{FieldReport, TableReport, TableStar};

use crate::base::format::to_decimals;
use crate::detect::DetectError;
use crate::frame::{Frame, FrameError};
use crate::identify::{DateSource, FrameDate, IndexedCatalog, Priors};
use crate::model::sensitivity::{Budget, Detector, Rule, Scenario};
use crate::model::simulate::{Pointing, Scene, Simulator};
use crate::pipeline::{Context, Solution, Workspace, solve_centroids};
use serde::Serialize;
use simulated::Protocol;

/// Version of the JSON described here.
pub const SCHEMA: u32 = 1;

/// Why an experiment cannot be done.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExperimentError {
    /// No such frame can be.
    #[error("simulating a frame")]
    Simulate(#[from] FrameError),
    /// No such frame can be examined.
    #[error("detecting stars in a simulated frame")]
    Detect(#[from] DetectError),
}

/// How often, and from which random numbers on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Trials {
    /// Frames to simulate.
    pub count: u64,
    /// Seed of the random numbers.
    pub seed: u64,
}

/// What came of an experiment.
#[derive(Debug)]
pub struct Run {
    /// What is told of it.
    pub report: ExperimentReport,
    /// The first frame simulated and what was found in it; none where the paper's table was not identified.
    pub first: Option<(Frame, Solution)>,
}

/// What is told of an experiment.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ExperimentReport {
    /// [`SCHEMA`].
    pub schema: u32,
    /// Its number in the paper.
    pub experiment: u8,
    /// When its frame was taken, ISO 8601, in UTC.
    pub date: String,
    /// Latitude of where it was taken, in degrees, north positive.
    pub site_lat_deg: f64,
    /// Longitude, in degrees, east positive.
    pub site_lon_deg: f64,
    /// Exposure, in seconds.
    pub exposure_s: f64,
    /// How faint stars may be.
    pub limit: LimitReport,
    /// The paper's stars.
    pub table: TableReport,
    /// Frames like the paper's; none where its stars are not identified, so that the pointing is not known.
    pub simulated: Option<SimulatedReport>,
}

/// How faint stars may be, in V.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LimitReport {
    /// By the paper's equations.
    pub limit_vmag: f64,
    /// The same as the paper prints it.
    pub paper_limit_vmag: f64,
    /// The faintest star of the paper's table.
    pub paper_faintest_vmag: f64,
    /// Of the detector as built: half of the stars of this magnitude are found.
    pub detector_limit_vmag: f64,
}

impl ExperimentReport {
    /// Whether the paper's stars and every simulated frame are identified.
    pub fn is_identified(&self) -> bool {
        let all = |simulated: &SimulatedReport| simulated.frames_identified == simulated.frames;
        self.simulated.as_ref().is_some_and(all)
    }

    /// The report as one line of JSON, without the line's end.
    ///
    /// # Errors
    /// [`serde_json::Error`], which these types give no occasion for.
    pub fn to_json_line(&self) -> Result<String, serde_json::Error> {
        serde_json::to_string(self)
    }
}

/// Does the experiment, its frames on the threads of the current pool; `done` is called after each.
///
/// # Errors
/// [`ExperimentError`], for which the paper's camera gives no occasion.
pub fn run(
    published: &Published,
    indexed: &IndexedCatalog,
    trials: Trials,
    done: &(dyn Fn() + Sync),
) -> Result<Run, ExperimentError> {
    let scenario = Scenario::of(published.preset);
    let budget = Budget::new(&scenario);
    let detector = Detector::new(Rule::MatchedFilter, &scenario, &budget);
    let priors = Priors {
        date: Some(FrameDate {
            date: published.date,
            source: DateSource::Option,
        }),
        site: Some(published.site),
        ..Priors::default()
    };
    let context = Context {
        priors,
        ..Context::new(indexed)
    };
    let solution = solve_centroids(&table::centroids(published, &scenario), &context);
    let mut report = ExperimentReport {
        schema: SCHEMA,
        experiment: published.number,
        date: published.date.to_iso(),
        site_lat_deg: published.site.lat_deg(),
        site_lon_deg: published.site.lon_deg(),
        exposure_s: scenario.conditions.exposure_s,
        limit: LimitReport {
            limit_vmag: to_decimals(budget.limit_vmag, 3),
            paper_limit_vmag: published.limit_vmag,
            paper_faintest_vmag: published.faintest_vmag,
            detector_limit_vmag: to_decimals(detector.vmag_at(0.5), 3),
        },
        table: TableReport::new(published, &scenario, &solution, indexed.catalog()),
        simulated: None,
    };
    let Some(found) = solution.outcome.identification() else {
        return Ok(Run {
            report,
            first: None,
        });
    };
    let stars = indexed.catalog().stars();
    let simulator = Simulator::new(&scenario, &Scene::default(), stars)?;
    let protocol = Protocol {
        scenario: &scenario,
        simulator: &simulator.with_camera(found.camera),
        detectors: [
            &detector,
            &Detector::new(Rule::PeakPixel, &scenario, &budget),
        ],
        pointing: &Pointing {
            icrs_to_camera: found.icrs_to_camera,
            years_since_j2000: published.date.years_since_j2000(),
        },
        context: &context,
        seed: trials.seed,
    };
    let simulated = protocol.run(trials.count, done)?;
    report.simulated = Some(SimulatedReport::new(&simulated, &detector, trials.seed));
    let (frame, _) = protocol.frame(0)?;
    let solution = protocol.solve(&frame, &mut Workspace::new())?;
    Ok(Run {
        report,
        first: Some((frame, solution)),
    })
}
