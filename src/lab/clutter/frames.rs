//! Makes the frames of a study, each with its truth.

use super::canvas::ClutterCanvas;
use super::kind::ClutterKind;
use super::{no_sky, recording, scenery};
use crate::base::units::{DEG_PER_RAD, RAD_PER_DEG};
use crate::ephemeris::places::StarPlaces;
use crate::frame::{Frame, FrameMetadata};
use crate::identify::IndexedCatalog;
use crate::lab::StudyError;
use crate::lab::robustness::random_rotation;
use crate::lab::simulate::{Pointing, Setup, Simulator, TrueStar, Truth};
use crate::lab::trials::random_of;
use crate::predict::{Budget, Detector, Rule, Scenario, ScenarioError};
use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// A frame of a study.
#[derive(Debug, Clone)]
pub struct ClutteredFrame {
    /// The frame.
    pub frame: Frame<'static>,
    /// What is on it; `None` where it shows no sky.
    pub sky: Option<FrameTruth>,
}

/// The sky on a frame.
#[derive(Debug, Clone)]
pub struct FrameTruth {
    /// Where the camera pointed.
    pub pointing: Pointing,
    /// The stars that nothing hides, without false ones.
    pub truth: Truth,
}

/// Makes the frames of one kind.
pub struct FrameMaker<'a> {
    kind: ClutterKind,
    pub(super) scenario: Scenario,
    pub(super) simulator: Simulator<'a>,
    /// V magnitude at which half of the stars are detected, without clutter.
    pub(super) limit_vmag: f64,
}

impl<'a> FrameMaker<'a> {
    /// Prepares what all frames of `kind` have in common.
    ///
    /// # Errors
    /// [`StudyError::Scenario`], [`StudyError::Simulate`].
    pub fn new(
        kind: ClutterKind,
        setup: &Setup,
        indexed: &'a IndexedCatalog<'a>,
    ) -> Result<Self, StudyError> {
        setup.check()?;
        let catalog = indexed.catalog();
        let plain = Simulator::new(&setup.scenario, &setup.scene, catalog.stars())?;
        let setup = with_clutter(kind, setup, &plain, indexed)?;
        setup.check()?;
        Ok(Self {
            kind,
            simulator: Simulator::new(&setup.scenario, &setup.scene, catalog.stars())?,
            limit_vmag: limit_vmag(&setup.scenario)?,
            scenario: setup.scenario,
        })
    }

    /// The frame with this number in a study with this `seed`.
    ///
    /// # Errors
    /// [`StudyError`] where it cannot be simulated or recorded.
    pub fn frame(&self, seed: u64, number: u64) -> Result<ClutteredFrame, StudyError> {
        /// More frames than any study has.
        const KIND_STRIDE: u64 = 1 << 40;
        let mut random = random_of(seed, self.kind as u64 * KIND_STRIDE + number);
        if !self.kind.is_sky() {
            let frame = no_sky::picture(self.kind, &mut random)?;
            return Ok(ClutteredFrame { frame, sky: None });
        }
        let pointing = Pointing {
            icrs_to_camera: random_rotation(&mut random),
            places: StarPlaces::default(),
        };
        let (mut frame, mut truth) = self.simulator.frame(&pointing, random.random())?;
        // It would tell the scale.
        frame.metadata = FrameMetadata::default();
        let mut canvas = ClutterCanvas::new(frame.width, frame.height);
        let frame = self.with_clutter(frame, &mut canvas, &mut random)?;
        truth.stars.retain_mut(|star| self.is_seen(star, &canvas));
        let sky = Some(FrameTruth { pointing, truth });
        Ok(ClutteredFrame { frame, sky })
    }

    /// Whether a star may be detected beside what stands before it; dims it to the light that is
    /// left. A bright star is seen through leaves that hide its centre.
    fn is_seen(&self, star: &mut TrueStar, canvas: &ClutterCanvas) -> bool {
        /// Magnitudes beyond the limit at which a star may still be detected.
        const BEYOND_LIMIT_MAG: f64 = 1.0;
        let sigma_px = self.scenario.camera.spot_sigma_px.max(0.3);
        let seen = canvas.share_seen(&star.position, sigma_px);
        if seen < 1.0 {
            star.v_mag -= 2.5 * libm::log10(seen);
        }
        star.catalog.is_some() && (seen >= 0.5 || star.v_mag <= self.limit_vmag + BEYOND_LIMIT_MAG)
    }

    fn with_clutter(
        &self,
        frame: Frame<'static>,
        canvas: &mut ClutterCanvas,
        random: &mut ChaCha8Rng,
    ) -> Result<Frame<'static>, StudyError> {
        match self.kind {
            ClutterKind::Foliage => scenery::foliage(canvas, random),
            ClutterKind::Edges => {
                scenery::roofs(canvas, random);
                if random.random_bool(0.5) {
                    canvas.turn();
                }
            }
            ClutterKind::Reflections => scenery::ghosts(canvas, random),
            _ => (),
        }
        let frame = recording::behind(frame, canvas, random);
        Ok(match self.kind {
            ClutterKind::Reflections => recording::mirrored_in_window(frame, random),
            ClutterKind::BlackLevel => recording::cut_off(frame, random),
            ClutterKind::Jpeg => recording::as_jpeg(&frame, random)?,
            _ => frame,
        })
    }
}

/// V magnitude at which half of the stars are detected.
fn limit_vmag(scenario: &Scenario) -> Result<f64, ScenarioError> {
    let budget = Budget::checked(scenario)?;
    Ok(Detector::new(Rule::MatchedFilter, scenario, &budget).vmag_at(0.5))
}

/// `setup` with the clutter that the simulator draws itself.
fn with_clutter(
    kind: ClutterKind,
    setup: &Setup,
    plain: &Simulator,
    indexed: &IndexedCatalog,
) -> Result<Setup, ScenarioError> {
    /// Extinction and light of the thickest clouds, and their size as a share of the frame.
    const CLOUD: (f64, f64, f64) = (2.5, 3.0, 0.25);
    /// Cosmic rays on a million pixels, as in an exposure of minutes on the ground or of a second in
    /// orbit. Their charge is that of their way through the detector.
    const COSMIC_RAYS_PER_MPX: f64 = 50.0;
    const CM2_PER_UM2: f64 = 1e-8;
    /// Mean length of trails, in pixels: over all axes of the turn it is π/4 of the longest.
    const TRAIL_PX: f64 = 5.0;
    let mut setup = setup.clone();
    let camera = plain.camera();
    let scene = &mut setup.scene;
    match kind {
        ClutterKind::Clouds => {
            let (extinction_mag, light, share) = CLOUD;
            (scene.cloud_mag, scene.cloud_light) = (extinction_mag, light);
            scene.cloud_size_px = share * camera.width_px;
        }
        ClutterKind::Trails => {
            let turn_rad = TRAIL_PX / std::f64::consts::FRAC_PI_4 / camera.focal_length_px();
            let exposure_s = setup.scenario.conditions.exposure_s;
            scene.tumble_deg_s = turn_rad * DEG_PER_RAD / exposure_s;
        }
        ClutterKind::FalseStars => {
            let limit_vmag = limit_vmag(&setup.scenario)?;
            let stars = indexed.catalog().stars();
            let bright = stars.partition_point(|star| f64::from(star.v_mag) <= limit_vmag);
            let sphere_sq_deg = 4.0 * std::f64::consts::PI / RAD_PER_DEG.powi(2);
            let frame_sq_deg = camera.solid_angle_sr() * DEG_PER_RAD.powi(2);
            scene.false_stars += bright as f64 * frame_sq_deg / sphere_sq_deg;
        }
        ClutterKind::Blends => setup.scenario.camera.focal_length_mm /= 2.0,
        ClutterKind::HotPixels => add_hot_pixels(&mut setup.scenario)?,
        ClutterKind::CosmicRays => {
            let sheet = &setup.scenario.camera;
            let pixel_cm2 = sheet.pitch_x_um * sheet.pitch_y_um * CM2_PER_UM2;
            let px_s = 1e6 / COSMIC_RAYS_PER_MPX * setup.scenario.conditions.exposure_s;
            scene.cosmic_rays_cm2_s += 1.0 / (pixel_cm2 * px_s);
        }
        _ => (),
    }
    Ok(setup)
}

/// Adds hot pixels to the camera. Their dark current is exponentially distributed, as in the
/// simulator, so that many are hidden by the noise and a few are saturated.
fn add_hot_pixels(scenario: &mut Scenario) -> Result<(), ScenarioError> {
    /// Hot pixels in a million, as in an uncooled sensor.
    const PER_MPX: f64 = 300.0;
    /// Mean charge of a hot pixel in an exposure, in units of a pixel's noise without stars.
    const MEAN_CHARGE: f64 = 50.0;
    let noise_e = Budget::checked(scenario)?.background_noise_e;
    let exposure_s = scenario.conditions.exposure_s;
    let made = &mut scenario.camera.imperfections;
    made.hot_pixels_per_mpx += PER_MPX;
    made.hot_pixel_e_s = MEAN_CHARGE * noise_e / exposure_s;
    Ok(())
}
