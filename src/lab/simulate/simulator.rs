//! Simulates frames of one camera, sky and scene.

use super::camera::{Pointing, camera_of};
use super::color_camera::ColorCamera;
use super::equivalent_spot::make_gaussian;
use super::image::ElectronImage;
use super::lights::{BrightLight, lights};
use super::milky_way::MilkyWay;
use super::motion::StarMotion;
use super::pattern::DetectorPattern;
use super::poisson::PoissonTable;
use super::readout::{Readout, collect};
use super::scene::Scene;
use super::sky::SimulatedSky;
use super::spot::SpotRenderer;
use super::stars::StarSampler;
use super::strays::{self, CosmicRay, Trail};
use super::true_sky::TrueSky;
use super::truth::{TrueStar, Truth};
use crate::base::coords::PixelPoint;
use crate::camera::CameraModel;
use crate::catalog::Star;
use crate::frame::{self, Frame, FrameError};
use crate::predict::{Scenario, SkyBrightness, StarLight};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Streams of random numbers of one frame: the content of the scene does not change the noise.
#[derive(Clone, Copy)]
enum FrameStream {
    Noise,
    Scene,
    /// [`Skyline`](super::skyline) has number 2.
    Lights = 3,
}

fn random(seed: u64, stream: FrameStream) -> ChaCha8Rng {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(stream as u64);
    random
}

/// A camera, sky and scene, ready to simulate any number of frames.
///
/// # Example
/// ```
/// use starpipe::ephemeris::places::StarPlaces;
/// use starpipe::camera::data_sheet::DataSheet;
/// use starpipe::predict::Scenario;
/// use starpipe::lab::simulate::{Pointing, Setup, Simulator};
/// use starpipe::{Catalog, Rotation, UnitVector};
///
/// let camera = DataSheet::read("fixtures/regression/narrow.toml")?;
/// let setup = Setup::new(Scenario::new(camera));
/// setup.check()?;
/// let stars = Catalog::built_in().stars();
/// let simulator = Simulator::new(&setup.scenario, &setup.scene, stars)?;
/// let pointing = Pointing {
///     icrs_to_camera: Rotation::looking_at(&UnitVector::from_ra_dec(1.46, -0.02), 0.0),
///     places: StarPlaces::of_catalog(26.0),
/// };
/// let (frame, truth) = simulator.frame(&pointing, 1)?;
/// assert_eq!((frame.width, frame.height), (320, 240));
/// // The belt of Orion is in the field.
/// assert_eq!(truth.stars.iter().filter(|star| star.v_mag < 2.5).count(), 3);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Simulator<'a> {
    scenario: Scenario,
    scene: Scene,
    stars: &'a [Star],
    camera: CameraModel,
    light: StarLight,
    pattern: DetectorPattern,
    /// Distribution of the counts in a pixel with sky and dark current only.
    uniform: Option<PoissonTable>,
}

impl<'a> Simulator<'a> {
    /// A simulator of `scenario` and `scene`, which pass [`Setup::check`](super::Setup::check),
    /// with the catalogue's `stars`.
    ///
    /// All stars are drawn, however faint: the catalogue should be deeper than the camera's limit.
    ///
    /// # Errors
    /// [`FrameError::TooSmall`], [`FrameError::TooLarge`] for an unsupported detector size.
    pub fn new(scenario: &Scenario, scene: &Scene, stars: &'a [Star]) -> Result<Self, FrameError> {
        let sheet = &scenario.camera;
        frame::check_size(sheet.width_px, sheet.height_px)?;
        let light = StarLight::new(scenario);
        let budget = light.budget();
        Ok(Self {
            scenario: scenario.clone(),
            scene: *scene,
            stars,
            camera: camera_of(sheet),
            pattern: DetectorPattern::generate(sheet),
            uniform: PoissonTable::new(budget.background_e + budget.dark_e),
            light,
        })
    }

    /// Replaces the camera model, for example by one fitted to a real frame. It must have the size
    /// of the detector.
    #[must_use]
    pub fn with_camera(mut self, camera: CameraModel) -> Self {
        self.camera = camera;
        self
    }

    /// The camera model.
    pub fn camera(&self) -> &CameraModel {
        &self.camera
    }

    /// The scenario without structure that is most similar to what is simulated: with the mean
    /// brightness of its sky, the typical motion of its stars, and the Gaussian spot that is as
    /// detectable as its spots. The predictions of the
    /// sensitivity model refer to it.
    pub fn uniform_scenario(&self) -> Scenario {
        let mut uniform = self.scenario.clone();
        let conditions = &mut uniform.conditions;
        let turn_rad = self.scene.typical_rate_rad_s() * conditions.exposure_s;
        let motion_px = turn_rad * self.camera.focal_length_px();
        conditions.motion_px = libm::hypot(conditions.motion_px, motion_px);
        let none = Scene {
            sky_gradient: 0.0,
            cloud_mag: 0.0,
            cloud_light: 0.0,
            skyline_deg: None,
            ..self.scene
        };
        let mut random = random(0, FrameStream::Scene);
        let mut image = self.image();
        SimulatedSky::new(&self.scenario, &none, &self.camera, &mut random).expose(&mut image, 1.0);
        let sky_mag = conditions.sky.mag_arcsec2() - 2.5 * libm::log10(mean(image.pixels()));
        conditions.sky = SkyBrightness::MagArcsec2(sky_mag);
        make_gaussian(&mut uniform.camera);
        uniform
    }

    /// Electrons of its stars.
    pub fn light(&self) -> &StarLight {
        &self.light
    }

    /// A frame at a `pointing`, and its ground truth.
    ///
    /// # Errors
    /// None for a valid simulator.
    pub fn frame(
        &self,
        pointing: &Pointing,
        seed: u64,
    ) -> Result<(Frame<'static>, Truth), FrameError> {
        self.exposed(seed, Some(pointing), |sampler, reach_px, random| {
            sampler.on_frame(pointing, self.stars, reach_px, random)
        })
    }

    /// The true sky of the frame at a `pointing` with this `seed`.
    pub(crate) fn true_sky(&self, pointing: &Pointing, seed: u64) -> TrueSky<'_> {
        let mut random = random(seed, FrameStream::Scene);
        // As for a frame: what is drawn before the clouds.
        self.scene.angular_rate_rad_s(&mut random);
        TrueSky {
            sky: self.sky(Some(pointing), &mut random),
            lights: self.lights(seed),
            camera: &self.camera,
            mag_arcsec2: self.scenario.conditions.sky.mag_arcsec2(),
            sky_e: self.light.budget().background_e,
        }
    }

    fn sky(&self, pointing: Option<&Pointing>, random: &mut ChaCha8Rng) -> SimulatedSky<'_> {
        let mag_arcsec2 = self.scenario.conditions.sky.mag_arcsec2();
        let milky_way =
            pointing.and_then(|pointing| MilkyWay::new(&self.scene, pointing, mag_arcsec2));
        let zenith = pointing.and_then(|pointing| {
            let zenith = pointing.places.zenith()?;
            Some(pointing.icrs_to_camera.apply(zenith))
        });
        SimulatedSky::new(&self.scenario, &self.scene, &self.camera, random)
            .under(zenith)
            .with(milky_way)
    }

    fn lights(&self, seed: u64) -> Vec<BrightLight> {
        let random = random(seed, FrameStream::Lights);
        lights(
            (&self.scenario, &self.scene),
            &self.camera,
            &self.light,
            random,
        )
    }

    /// A frame of stars at these positions, with these V magnitudes and the scenario's temperature,
    /// instead of the catalogue's.
    ///
    /// # Errors
    /// As [`Self::frame`].
    pub fn star_field(
        &self,
        stars: &[(PixelPoint, f64)],
        seed: u64,
    ) -> Result<(Frame<'static>, Truth), FrameError> {
        self.exposed(seed, None, |sampler, _, _| {
            let star = |(number, &(position, v_mag)): (usize, &(PixelPoint, f64))| TrueStar {
                number,
                catalog: None,
                position,
                v_mag,
                electrons: self.light.electrons(v_mag, None) * sampler.sky.transmission(&position),
            };
            stars.iter().enumerate().map(star).collect()
        })
    }

    /// A dark frame.
    ///
    /// # Errors
    /// As [`Self::frame`].
    pub fn dark(&self, seed: u64) -> Result<Frame<'static>, FrameError> {
        self.evenly_lit(0.0, seed)
    }

    /// A flat-field frame: uniform light that leaves this number of electrons in a pixel at the
    /// centre.
    ///
    /// # Errors
    /// As [`Self::frame`].
    pub fn evenly_lit(&self, electrons: f64, seed: u64) -> Result<Frame<'static>, FrameError> {
        let none = Scene::default();
        let sky = SimulatedSky::new(
            &self.scenario,
            &none,
            &self.camera,
            &mut random(seed, FrameStream::Scene),
        );
        let mut image = self.image();
        sky.expose(&mut image, electrons);
        self.read_out(image, &[], seed)
    }

    fn image(&self) -> ElectronImage {
        let sheet = &self.scenario.camera;
        ElectronImage::new(sheet.width_px, sheet.height_px, 0.0)
    }

    /// A frame of the stars that `seen` returns; its second argument is the radius beyond a
    /// position that a star's light reaches, in pixels.
    fn exposed(
        &self,
        seed: u64,
        pointing: Option<&Pointing>,
        seen: impl FnOnce(&StarSampler, f64, &mut ChaCha8Rng) -> Vec<TrueStar>,
    ) -> Result<(Frame<'static>, Truth), FrameError> {
        let (sheet, scene) = (&self.scenario.camera, &self.scene);
        let conditions = &self.scenario.conditions;
        let exposure_s = conditions.exposure_s;
        let budget = self.light.budget();
        let mut random = random(seed, FrameStream::Scene);
        let angular_rate_rad_s = scene.angular_rate_rad_s(&mut random);
        let turn_rad = angular_rate_rad_s * exposure_s;
        let motion = StarMotion::new(&self.camera, turn_rad, conditions.motion_px);
        let sky = self.sky(pointing, &mut random);
        let mut image = self.image();
        sky.expose(&mut image, budget.background_e);
        let background_e = mean(image.pixels()) + budget.dark_e;
        let mut spot = SpotRenderer::new(sheet);
        let sampler = StarSampler {
            camera: &self.camera,
            scene,
            light: &self.light,
            sky: &sky,
        };
        let reach_px = spot.reach_px() + motion.longest_px() / 2.0;
        let stars = seen(&sampler, reach_px, &mut random);
        for star in &stars {
            motion.along(&star.position, spot.sigma_px(), |place, part| {
                spot.add(&mut image, place, star.electrons * part);
            });
        }
        let trails = strays::trails(scene, &self.camera, exposure_s, &mut random);
        for trail in &trails {
            self.draw_trail(trail, &sky, &mut image, &mut spot);
        }
        for light in self.lights(seed) {
            light.draw(&mut image);
        }
        let cosmic_rays = strays::cosmic_rays(scene, sheet, &self.camera, exposure_s, &mut random);
        let frame = self.read_out(image, &cosmic_rays, seed)?;
        let on_frame = |star: &TrueStar| self.camera.contains(&star.position);
        let (stars, beyond) = stars.into_iter().partition(on_frame);
        let truth = Truth {
            stars,
            beyond,
            trails,
            cosmic_rays,
            background_e,
            angular_rate_rad_s,
            motion_px: motion.of_centre_px(),
        };
        Ok((frame, truth))
    }

    fn draw_trail(
        &self,
        trail: &Trail,
        sky: &SimulatedSky,
        image: &mut ElectronImage,
        spot: &mut SpotRenderer,
    ) {
        /// Distance of the spots that a trail is made of, in standard deviations.
        const STEP_SIGMAS: f64 = 0.25;
        let electrons = self.light.electrons(self.scene.trail_vmag, None);
        let steps = (trail.length_px() / (STEP_SIGMAS * spot.sigma_px()))
            .ceil()
            .max(1.0);
        for step in 0..steps as usize {
            let place = trail.at((step as f64 + 0.5) / steps);
            let part_e = sky.transmission(&place) * electrons / steps;
            spot.add(image, &place, part_e);
        }
    }

    /// The frame for an image of expected electrons of light.
    fn read_out(
        &self,
        mut image: ElectronImage,
        cosmic_rays: &[CosmicRay],
        seed: u64,
    ) -> Result<Frame<'static>, FrameError> {
        let sheet = &self.scenario.camera;
        self.convert(image.pixels_mut());
        let mut random = random(seed, FrameStream::Noise);
        collect(image.pixels_mut(), self.uniform.as_ref(), &mut random);
        for ray in cosmic_rays {
            ray.along(|x, y, electrons| {
                let on_frame =
                    |at: i64, side: usize| usize::try_from(at).ok().filter(|at| *at < side);
                if let Some((x, y)) = on_frame(x, image.width()).zip(on_frame(y, image.height())) {
                    image.row_mut(y)[x] += electrons;
                }
            });
        }
        let readout = Readout::from_sheet(sheet);
        let pixels = readout.grey_levels(image.pixels_mut(), &self.pattern, &mut random);
        let frame = Frame::new(sheet.width_px, sheet.height_px, pixels)?;
        let white_adu = sheet.saturation_adu();
        let frame = frame.with_levels(1.0, Some(white_adu as f32));
        let budget = self.light.budget();
        let level_adu =
            sheet.bias_adu + (budget.background_e + budget.dark_e) / sheet.gain_e_per_adu;
        let noise_adu = budget.background_noise_e / sheet.gain_e_per_adu;
        match ColorCamera::new(&sheet.imperfections, level_adu, noise_adu, white_adu) {
            Some(camera) => camera.record(&frame),
            None => Ok(frame),
        }
    }

    /// Applies the pixel response and adds the dark current.
    fn convert(&self, pixels: &mut [f64]) {
        if let Some(response) = &self.pattern.response {
            for (pixel, response) in pixels.iter_mut().zip(response) {
                *pixel *= f64::from(*response);
            }
        }
        let exposure_s = self.scenario.conditions.exposure_s;
        match &self.pattern.dark_current_e_s {
            Some(dark) => {
                for (pixel, dark_e_s) in pixels.iter_mut().zip(dark) {
                    *pixel += f64::from(*dark_e_s) * exposure_s;
                }
            }
            None => {
                let dark_e = self.light.budget().dark_e;
                pixels.iter_mut().for_each(|pixel| *pixel += dark_e);
            }
        }
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// A frame of stars at these positions with these V magnitudes, and nothing else.
///
/// # Errors
/// As [`Simulator::new`].
pub fn star_field(
    scenario: &Scenario,
    stars: &[(PixelPoint, f64)],
    seed: u64,
) -> Result<Frame<'static>, FrameError> {
    let simulator = Simulator::new(scenario, &Scene::default(), &[])?;
    Ok(simulator.star_field(stars, seed)?.0)
}

#[cfg(test)]
mod tests;
