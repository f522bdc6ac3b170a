//! What a frame is taken of, and how the camera is set: drawn at random.

use crate::base::coords::{Camera, Rotation, UnitVector};
use crate::base::epoch::ObservationDate;
use crate::base::units::{DEG_PER_RAD, RAD_PER_DEG};
use crate::ephemeris::observer::Site;
use crate::ephemeris::places::StarPlaces;
use crate::ephemeris::solar_system::moon_and_sun;
use crate::lab::StudyError;
use crate::lab::simulate::{Pointing, Scene, Setup, Simulator, camera_of};
use crate::night::Almanac;
use crate::predict::{Budget, Extinction, SkyBrightness};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Modified Julian Dates of 2020-01-01 and 2030-01-01.
const YEARS_MJD: [f64; 2] = [58_849.0, 62_502.0];
/// V magnitudes per square arcsecond of the zenith, without Moon and clouds.
const SKY_MAG_ARCSEC2: [f64; 2] = [17.0, 22.0];
const EXTINCTION_MAG: [f64; 2] = [0.1, 0.35];
const EXPOSURES_S: [f64; 2] = [1.0, 60.0];
const BITS: [u32; 5] = [8, 10, 12, 14, 16];
/// Level of the sky over full scale.
const LEVELS: [f64; 2] = [0.03, 0.4];
/// Largest share of the full well that the sky fills: a camera's exposure control sees to it.
const MOST_OF_WELL: f64 = 0.5;
/// Bias over full scale.
const BIASES: [f64; 2] = [0.02, 0.06];
/// Light outside the lens's circle over the mean of the sky.
const STRAY_LIGHT: [f64; 2] = [0.0, 0.04];
/// Extinction by the thickest clouds, in magnitudes.
const CLOUDS_MAG: [f64; 4] = [0.5, 1.0, 2.0, 4.0];
const CLOUD_SHARES: [f64; 2] = [0.1, 0.9];
/// Sizes of clouds over the diameter of the sky.
const CLOUD_SIZES: [f64; 3] = [1.0 / 16.0, 1.0 / 8.0, 1.0 / 4.0];
/// Light of the thickest clouds over that of the clear sky.
const CLOUDS_LIGHT: [f64; 3] = [0.0, 0.5, 1.5];
/// Standard deviation of stars about their catalogue magnitudes: errors of the catalogue, and variables.
const STAR_SIGMA_MAG: f64 = 0.03;
/// Frames with clouds among three.
const CLOUDY_OF_THREE: u32 = 2;

/// What a frame is taken of, and how the camera is set.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrialConditions {
    /// Seed of the frame's own random numbers.
    pub seed: u64,
    /// Modified Julian Date.
    pub mjd: f64,
    /// Position angle of image-up, in degrees.
    pub roll_deg: f64,
    /// V magnitudes per square arcsecond of the zenith, without Moon and clouds.
    pub sky_mag_arcsec2: f64,
    /// Extinction, in magnitudes per airmass.
    pub true_extinction_mag: f64,
    /// Exposure, in seconds.
    pub exposure_s: f64,
    /// Bits of the converter.
    pub bits: u32,
    /// Electrons of a gray level.
    pub gain_e_per_adu: f64,
    /// Level without light, in ADU.
    pub bias_adu: f64,
    /// Whether the camera's description is given.
    pub bias_known: bool,
    /// The clouds.
    pub clouds: CloudConditions,
    /// The Moon.
    pub moon: Moon,
    /// Light that the lens scatters outside its circle, over the mean of the sky.
    pub stray_light: f64,
}

/// Clouds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CloudConditions {
    /// Extinction by the thickest, in magnitudes; 0 without clouds.
    pub mag: f64,
    /// Share of the sky that they cover on average.
    pub share: f64,
    /// Their size, in pixels.
    pub size_px: f64,
    /// Light of the thickest over that of the clear sky.
    pub light: f64,
}

impl CloudConditions {
    fn none(size_px: f64) -> Self {
        Self {
            mag: 0.0,
            share: 0.0,
            size_px,
            light: 0.0,
        }
    }
}

/// The Moon.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moon {
    /// Its altitude, in degrees.
    pub altitude_deg: f64,
    /// Illuminated share of its disk.
    pub illuminated: f64,
}

impl TrialConditions {
    /// Those of a frame of this camera; `site` is where it is taken.
    ///
    /// # Errors
    /// [`StudyError`] if the camera cannot be simulated.
    pub(super) fn draw(
        setup: &Setup,
        site: Site,
        random: &mut ChaCha8Rng,
    ) -> Result<Self, StudyError> {
        let camera = &setup.scenario.camera;
        let sky_px = 2.0 * camera_of(camera).field_radius_px();
        let (date, almanac) = dark_hour(random, site);
        let clouds = if random.random_ratio(CLOUDY_OF_THREE, 3) {
            CloudConditions {
                mag: one_of(&CLOUDS_MAG, random),
                share: between(CLOUD_SHARES, random),
                size_px: one_of(&CLOUD_SIZES, random) * sky_px,
                light: one_of(&CLOUDS_LIGHT, random),
            }
        } else {
            CloudConditions::none(sky_px)
        };
        let seed = random.random();
        let mut drawn = Self {
            seed,
            mjd: date.modified_julian_date().unwrap_or(f64::NAN),
            roll_deg: between([0.0, 360.0], random),
            sky_mag_arcsec2: between(SKY_MAG_ARCSEC2, random),
            true_extinction_mag: between(EXTINCTION_MAG, random),
            exposure_s: evenly_in_ratio(EXPOSURES_S, random),
            bits: one_of(&BITS, random),
            gain_e_per_adu: camera.gain_e_per_adu,
            bias_adu: camera.bias_adu,
            bias_known: random.random(),
            clouds,
            moon: Moon {
                altitude_deg: almanac.moon_altitude_deg,
                illuminated: almanac.moon_illuminated,
            },
            stray_light: between(STRAY_LIGHT, &mut ChaCha8Rng::seed_from_u64(seed)),
        };
        drawn.set_camera(setup, site, random)?;
        Ok(drawn)
    }

    /// Sets exposure, gain and bias as a camera's control would: the sky is at a drawn level, and does not
    /// fill the wells.
    fn set_camera(
        &mut self,
        setup: &Setup,
        site: Site,
        random: &mut ChaCha8Rng,
    ) -> Result<(), StudyError> {
        let level = evenly_in_ratio(LEVELS, random);
        let bias = between(BIASES, random);
        let well_e = setup.scenario.camera.full_well_e;
        let sky_e = sky_e(&self.applied_to(setup, site))? * (1.0 + self.clouds.light);
        let part = (MOST_OF_WELL * well_e / sky_e).min(1.0);
        self.exposure_s *= part;
        let full_adu = f64::from(2u32.pow(self.bits) - 1);
        // At a larger gain the converter would not end with the well.
        self.gain_e_per_adu = (part * sky_e / level).min(well_e) / full_adu;
        self.bias_adu = (bias * full_adu).round();
        Ok(())
    }

    /// The date.
    ///
    /// # Panics
    /// If the conditions were not drawn.
    pub(super) fn date(&self) -> ObservationDate {
        ObservationDate::from_modified_julian_date(self.mjd).expect("drawn from a date")
    }

    /// A camera that looks at the zenith of `site`.
    ///
    /// # Panics
    /// If the conditions were not drawn.
    pub(super) fn pointing(&self, site: Site) -> Pointing {
        let places = StarPlaces::at(&self.date(), Some(site), None);
        let zenith = places.zenith().expect("the time of a drawn date is known");
        Pointing {
            icrs_to_camera: Rotation::looking_at(zenith, self.roll_deg * RAD_PER_DEG),
            places,
        }
    }

    /// The camera under this sky.
    pub(super) fn applied_to(&self, base: &Setup, site: Site) -> Setup {
        let mut setup = base.clone();
        let camera = &mut setup.scenario.camera;
        camera.gain_e_per_adu = self.gain_e_per_adu;
        camera.bits = self.bits;
        camera.bias_adu = self.bias_adu;
        let conditions = &mut setup.scenario.conditions;
        conditions.exposure_s = self.exposure_s;
        conditions.zenith_distance_deg = 0.0;
        conditions.sky = SkyBrightness::MagArcsec2(self.sky_mag_arcsec2);
        conditions.extinction = Extinction::MagPerAirmass(self.true_extinction_mag);
        let scene = &mut setup.scene;
        scene.vmag_sigma = STAR_SIGMA_MAG;
        scene.by_altitude = 1.0;
        scene.milky_way = Some(1.0);
        scene.stray_light = self.stray_light;
        scene.cloud_mag = self.clouds.mag;
        scene.cloud_share = Some(self.clouds.share);
        scene.cloud_size_px = self.clouds.size_px;
        scene.cloud_light = self.clouds.light;
        if let Some(direction) = self.moon_direction(site) {
            self.add_moon(scene, &direction);
        }
        setup
    }

    /// Where the Moon is, if it is above the horizon.
    pub(super) fn moon_direction(&self, site: Site) -> Option<UnitVector<Camera>> {
        let (body, _) = moon_and_sun(&self.date(), Some(site));
        let Pointing {
            icrs_to_camera,
            places,
        } = self.pointing(site);
        let direction = icrs_to_camera.apply(&places.apparent(&body.direction));
        (self.moon.altitude_deg > 0.0).then_some(direction)
    }

    fn add_moon(&self, scene: &mut Scene, direction: &UnitVector<Camera>) {
        let [right, down, ahead] = *direction.as_vector().as_ref();
        scene.moon_distance_deg = Some(libm::acos(ahead.clamp(-1.0, 1.0)) * DEG_PER_RAD);
        scene.moon_direction_deg = libm::atan2(right, -down) * DEG_PER_RAD;
        scene.moon_zenith_distance_deg = 90.0 - self.moon.altitude_deg;
        scene.moon_phase_deg = libm::acos(2.0 * self.moon.illuminated - 1.0) * DEG_PER_RAD;
    }
}

/// Electrons of the mean sky in a pixel, without clouds.
fn sky_e(setup: &Setup) -> Result<f64, StudyError> {
    setup.check()?;
    let simulator = Simulator::new(&setup.scenario, &setup.scene, &[])?;
    Ok(Budget::checked(&simulator.uniform_scenario())?.background_e)
}

/// A date at which it is night.
fn dark_hour(random: &mut ChaCha8Rng, site: Site) -> (ObservationDate, Almanac) {
    loop {
        let date = ObservationDate::from_modified_julian_date(between(YEARS_MJD, random));
        let night = date.and_then(|date| Some((date, Almanac::at(&date, site)?)));
        if let Some(found) = night.filter(|(_, almanac)| almanac.twilight() == "night") {
            return found;
        }
    }
}

fn between([from, to]: [f64; 2], random: &mut ChaCha8Rng) -> f64 {
    random.random_range(from..to)
}

/// Between two values, with the same chance for equal ratios.
fn evenly_in_ratio(values: [f64; 2], random: &mut ChaCha8Rng) -> f64 {
    libm::exp(between(values.map(libm::log), random))
}

fn one_of<T: Copy>(values: &[T], random: &mut ChaCha8Rng) -> T {
    values[random.random_range(0..values.len())]
}
