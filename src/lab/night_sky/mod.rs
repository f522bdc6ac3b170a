//! How accurate is what `starpipe sky` measures? Simulated all-sky frames, compared with the truth in each
//! cell.
//!
//! [`SkyStudy`] → for each number a [`SkyTrial`] ([`TrialFrameRow`], [`TrialCellRow`]s) → [`SkySummary`]
//!
//! 1. Draw a night and its sky, and how the camera is set ([`TrialConditions`]); the Moon is where the ephemeris
//!    has it. The camera looks at the zenith.
//! 2. Simulate the frame, and measure it as `starpipe sky` does, with or without the camera's description.
//! 3. Compare each cell with the sky that was drawn (`truth`): its light between the stars, with the halos of
//!    bright lights in the lens, and the clouds.
//!
//! Random numbers depend on the seed and the frame's number only. Caveats: those of
//! [`crate::lab::simulate`]; all magnitudes are V.

mod conditions;
mod summary;
mod text;
mod trial;
mod truth;

pub use conditions::{CloudConditions, Moon, TrialConditions};
pub use summary::{ClearTenth, GroupRow, SkySummary};
pub use trial::{SkyTrial, TrialCellRow, TrialFrameRow};

use crate::detect::DetectConfig;
use crate::ephemeris::observer::Site;
use crate::identify::{DateSource, FrameDate, IndexedCatalog, Priors};
use crate::lab::StudyError;
use crate::lab::simulate::{Setup, Simulator};
use crate::lab::trials::random_of;
use crate::photometry::comparison::ObservingSetup;
use crate::solve::{Context, Workspace, solve_frame};
use truth::TrueNightSky;

/// Simulates and measures skies over one camera.
pub struct SkyStudy<'a> {
    /// The stars.
    pub indexed: &'a IndexedCatalog<'a>,
    /// The camera. Its conditions, gain, bits and bias are drawn.
    pub setup: Setup,
    /// Where the frames are taken.
    pub site: Site,
    /// Seed of the random numbers.
    pub seed: u64,
}

impl SkyStudy<'_> {
    /// Simulates the frame with this number, measures it, and compares the result with the truth.
    ///
    /// # Errors
    /// [`StudyError::Scenario`], [`StudyError::Simulate`]; [`StudyError::Detect`] for an
    /// unsupported detector size.
    pub fn run_one(&self, number: u64, workspace: &mut Workspace) -> Result<SkyTrial, StudyError> {
        let mut random = random_of(self.seed, number);
        let conditions = TrialConditions::draw(&self.setup, self.site, &mut random)?;
        let setup = conditions.applied_to(&self.setup, self.site);
        setup.check()?;
        let stars = self.indexed.catalog().stars();
        let simulator = Simulator::new(&setup.scenario, &setup.scene, stars)?;
        let pointing = conditions.pointing(self.site);
        let (frame, _) = simulator.frame(&pointing, conditions.seed)?;
        let context = self.context(&conditions, &setup);
        let solution = solve_frame(&frame, &context, workspace)?;
        let spot_sigma_px = setup.scenario.camera.spot_sigma_px;
        let truth = TrueNightSky::new(&simulator, &pointing, &conditions, self.site, spot_sigma_px);
        Ok(SkyTrial::new(number, &conditions, &solution, &truth))
    }

    fn context(&self, conditions: &TrialConditions, setup: &Setup) -> Context<'_> {
        let sheet = &setup.scenario.camera;
        Context {
            detect: DetectConfig::default(),
            camera: conditions.bias_known.then(|| ObservingSetup {
                sheet: sheet.clone(),
                zenith_distance_deg: None,
                extinction: None,
            }),
            priors: Priors {
                date: Some(FrameDate::stated(conditions.date(), DateSource::User)),
                site: Some(self.site),
                exposure_s: Some(conditions.exposure_s),
                ..Priors::default()
            },
            measure_sky: true,
            ..Context::new(self.indexed)
        }
    }
}
