//! What happens during the exposure: motion of the camera, and everything in the sky besides stars.

use crate::camera::data_sheet::{Key, NumberRange, key};
use nalgebra::Vector3;
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, UnitSphere};

/// What happens during the exposure. The default is a camera at rest under a uniform sky, with
/// nothing besides stars.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Scene {
    /// Angular rate about the camera's x axis, in degrees per second.
    pub rate_x_deg_s: f64,
    /// Angular rate about its y axis, in degrees per second.
    pub rate_y_deg_s: f64,
    /// Angular rate about its boresight, in degrees per second.
    pub rate_z_deg_s: f64,
    /// Tumbling satellite: angular rate about an axis that is random for each frame, in degrees per
    /// second.
    pub tumble_deg_s: f64,
    /// Rolling ship: amplitude of the swing about the camera's y axis, in degrees; its phase is
    /// random for each frame.
    pub swing_deg: f64,
    /// Period of that swing, in seconds.
    pub swing_period_s: f64,
    /// Relative increase of the sky brightness from the centre to the border, in the direction of
    /// [`Self::sky_gradient_deg`]; decrease on the opposite side.
    pub sky_gradient: f64,
    /// Direction of the brighter side, in degrees from image-up towards the right.
    pub sky_gradient_deg: f64,
    /// Angle between boresight and Moon, in degrees; none without a Moon.
    pub moon_distance_deg: Option<f64>,
    /// Direction of the Moon, in degrees from image-up towards the right.
    pub moon_direction_deg: f64,
    /// Phase angle of the Moon, in degrees: 0 is full, 90 half, 180 new.
    pub moon_phase_deg: f64,
    /// Zenith distance of the Moon, in degrees.
    pub moon_zenith_distance_deg: f64,
    /// Extinction where clouds are thickest, in magnitudes.
    pub cloud_mag: f64,
    /// Size of clouds, in pixels.
    pub cloud_size_px: f64,
    /// Light that the thickest cloud adds, relative to the clear sky.
    pub cloud_light: f64,
    /// Share of the sky that clouds cover on average; half by default.
    pub cloud_share: Option<f64>,
    /// With it clouds are one bank: how far from the frame's centre its front is, towards
    /// [`Self::cloud_bank_deg`], in pixels.
    pub cloud_bank_px: Option<f64>,
    /// Where the bank comes from, in degrees from image-up towards the right; from above by default.
    pub cloud_bank_deg: Option<f64>,
    /// Width of the bank, in pixels; it has no end by default.
    pub cloud_bank_width_px: Option<f64>,
    /// Altitude up to which trees and houses hide the sky, in degrees; none without them. The zenith
    /// lies image-up from the centre, at the zenith distance of the scenario.
    pub skyline_deg: Option<f64>,
    /// Standard deviation of that altitude along the horizon, in degrees.
    pub skyline_relief_deg: f64,
    /// Brightness of trees and houses relative to the clear sky.
    pub skyline_light: f64,
    /// Mean number of lamps at the horizon, at or below the altitude of the skyline.
    pub lamps: f64,
    /// V magnitude of a lamp.
    pub lamp_vmag: f64,
    /// Cosmic rays per cm² and second.
    pub cosmic_rays_cm2_s: f64,
    /// Electrons that a cosmic ray leaves per micrometre of its path.
    pub cosmic_ray_e_um: f64,
    /// Mean number of satellite trails on a frame.
    pub trails: f64,
    /// V magnitude of a satellite.
    pub trail_vmag: f64,
    /// Angular rate of a satellite, in degrees per second.
    pub trail_rate_deg_s: f64,
    /// Whether air and airglow grow thicker towards the horizon, and the sky's light is that of each pixel's
    /// solid angle: 1, or 0 for the same over the frame.
    pub by_altitude: f64,
    /// Mean number of false stars on a frame.
    pub false_stars: f64,
    /// V magnitude of the faintest false star; the camera's limit by default.
    pub false_star_vmag: Option<f64>,
    /// Fraction of the catalogue stars that are missing in the sky.
    pub missing: f64,
    /// Standard deviation of true about catalogue magnitudes.
    pub vmag_sigma: f64,
    /// V magnitude of the faintest star that is drawn; no limit by default.
    pub faintest_vmag: Option<f64>,
    /// Light of the Milky Way's faint stars over what it is; none by default.
    pub milky_way: Option<f64>,
    /// Light that a lens scatters outside its circle, over the mean of the sky in it.
    pub stray_light: f64,
}

impl Default for Scene {
    fn default() -> Self {
        Self {
            rate_x_deg_s: 0.0,
            rate_y_deg_s: 0.0,
            rate_z_deg_s: 0.0,
            tumble_deg_s: 0.0,
            swing_deg: 0.0,
            swing_period_s: 10.0,
            sky_gradient: 0.0,
            sky_gradient_deg: 0.0,
            moon_distance_deg: None,
            moon_direction_deg: 0.0,
            moon_phase_deg: 0.0,
            moon_zenith_distance_deg: 45.0,
            cloud_mag: 0.0,
            cloud_size_px: 200.0,
            cloud_light: 0.0,
            cloud_share: None,
            cloud_bank_px: None,
            cloud_bank_deg: None,
            cloud_bank_width_px: None,
            skyline_deg: None,
            skyline_relief_deg: 3.0,
            skyline_light: 0.2,
            lamps: 0.0,
            lamp_vmag: -9.0,
            cosmic_rays_cm2_s: 0.0,
            cosmic_ray_e_um: 80.0,
            trails: 0.0,
            trail_vmag: 4.0,
            trail_rate_deg_s: 0.5,
            by_altitude: 0.0,
            false_stars: 0.0,
            false_star_vmag: None,
            missing: 0.0,
            vmag_sigma: 0.0,
            faintest_vmag: None,
            milky_way: None,
            stray_light: 0.0,
        }
    }
}

impl Scene {
    /// Typical angular rate of the boresight, in radians per second.
    pub(super) fn typical_rate_rad_s(&self) -> f64 {
        // Mean of a sine over directions, and of a cosine over phases.
        const SINE: f64 = std::f64::consts::FRAC_PI_4;
        const COSINE: f64 = std::f64::consts::FRAC_2_PI;
        let swing_deg_s = COSINE * std::f64::consts::TAU * self.swing_deg / self.swing_period_s;
        let tumble_deg_s = SINE * self.tumble_deg_s;
        let steady_deg_s = libm::hypot(self.rate_x_deg_s, self.rate_y_deg_s);
        libm::hypot(libm::hypot(steady_deg_s, swing_deg_s), tumble_deg_s).to_radians()
    }

    /// Largest angular rate in any frame, in degrees per second.
    pub(super) fn largest_rate_deg_s(&self) -> f64 {
        let steady = Vector3::new(self.rate_x_deg_s, self.rate_y_deg_s, self.rate_z_deg_s);
        let swing_deg_s = std::f64::consts::TAU * self.swing_deg / self.swing_period_s;
        steady.norm() + self.tumble_deg_s.abs() + swing_deg_s
    }

    /// Angular velocity about the camera axes in one frame, in radians per second.
    pub(super) fn angular_rate_rad_s(&self, random: &mut ChaCha8Rng) -> Vector3<f64> {
        let steady = Vector3::new(self.rate_x_deg_s, self.rate_y_deg_s, self.rate_z_deg_s);
        let axis = Vector3::from(UnitSphere.sample(random));
        let phase = random.random_range(0.0..std::f64::consts::TAU);
        let swing_deg_s =
            std::f64::consts::TAU * self.swing_deg / self.swing_period_s * libm::cos(phase);
        let rate_deg_s = steady + self.tumble_deg_s * axis + swing_deg_s * Vector3::y();
        rate_deg_s.map(f64::to_radians)
    }
}

macro_rules! optional_key {
    ($name:ident, $limits:expr, $about:literal) => {
        Key {
            name: stringify!($name),
            about: $about,
            limits: $limits,
            get: |scene| scene.$name,
            set: |scene, value| scene.$name = Some(value),
        }
    };
}

/// Valid angular rates, in degrees per second.
const RATES_DEG_S: NumberRange = NumberRange::FromTo(-360.0, 360.0);
/// Valid directions, in degrees.
const ANGLES_DEG: NumberRange = NumberRange::FromTo(-360.0, 360.0);
/// Valid magnitudes: from the Sun to beyond any telescope.
const MAGNITUDES: NumberRange = NumberRange::FromTo(-27.0, 40.0);

/// The numbers in [`Scene`] by name. All are optional.
pub const SCENE_KEYS: &[Key<Scene>] = &[
    key!(
        rate_x_deg_s,
        RATES_DEG_S,
        "angular rate of the camera about its x axis, in degrees per second"
    ),
    key!(
        rate_y_deg_s,
        RATES_DEG_S,
        "angular rate of the camera about its y axis, in degrees per second"
    ),
    key!(
        rate_z_deg_s,
        RATES_DEG_S,
        "angular rate of the camera about its boresight, in degrees per second"
    ),
    key!(
        tumble_deg_s,
        RATES_DEG_S,
        "tumbling satellite: angular rate about a random axis, in degrees per second"
    ),
    key!(
        swing_deg,
        NumberRange::FromTo(0.0, 180.0),
        "rolling ship: amplitude of the swing about the y axis, in degrees"
    ),
    key!(
        swing_period_s,
        NumberRange::Positive,
        "rolling ship: period of the swing, in seconds"
    ),
    key!(
        sky_gradient,
        NumberRange::FromTo(0.0, 1.0),
        "sky gradient: excess brightness at one border relative to the center, as a fraction"
    ),
    key!(
        sky_gradient_deg,
        ANGLES_DEG,
        "direction of the brighter border, in degrees from image-up toward the right"
    ),
    optional_key!(
        moon_distance_deg,
        NumberRange::FromTo(0.0, 180.0),
        "angle between boresight and Moon, in degrees (default: no Moon)"
    ),
    key!(
        moon_direction_deg,
        ANGLES_DEG,
        "direction of the Moon, in degrees from image-up toward the right"
    ),
    key!(
        moon_phase_deg,
        NumberRange::FromTo(0.0, 180.0),
        "phase angle of the Moon, in degrees: 0 full, 180 new"
    ),
    key!(
        moon_zenith_distance_deg,
        NumberRange::FromToBelow(0.0, 90.0),
        "zenith distance of the Moon, in degrees"
    ),
    key!(
        cloud_mag,
        NumberRange::FromTo(0.0, 30.0),
        "extinction of the thickest clouds, in magnitudes"
    ),
    key!(
        cloud_size_px,
        NumberRange::Positive,
        "size of clouds, in pixels"
    ),
    key!(
        cloud_light,
        NumberRange::NotNegative,
        "brightness that the thickest cloud adds, relative to the clear sky"
    ),
    optional_key!(
        cloud_share,
        NumberRange::FromTo(0.0, 1.0),
        "mean cloud cover, as a fraction (default: 0.5)"
    ),
    optional_key!(
        cloud_bank_px,
        NumberRange::FromTo(-1e6, 1e6),
        "a single bank of clouds: distance of its front from the center, in pixels"
    ),
    optional_key!(
        cloud_bank_deg,
        ANGLES_DEG,
        "direction that the bank of clouds comes from, in degrees from image-up toward the right (default: 0)"
    ),
    optional_key!(
        cloud_bank_width_px,
        NumberRange::Positive,
        "width of the bank of clouds, in pixels (default: unlimited)"
    ),
    optional_key!(
        skyline_deg,
        NumberRange::FromTo(-90.0, 90.0),
        "altitude up to which trees and houses hide the sky, in degrees (default: none)"
    ),
    key!(
        skyline_relief_deg,
        NumberRange::FromTo(0.0, 90.0),
        "standard deviation of the altitude of trees and houses along the horizon, in degrees"
    ),
    key!(
        skyline_light,
        NumberRange::NotNegative,
        "brightness of trees and houses, relative to the clear sky"
    ),
    key!(
        lamps,
        NumberRange::FromTo(0.0, 1000.0),
        "mean number of lamps at the horizon"
    ),
    key!(lamp_vmag, MAGNITUDES, "V magnitude of a lamp"),
    key!(
        cosmic_rays_cm2_s,
        NumberRange::FromTo(0.0, 1e6),
        "cosmic rays per square centimeter and second"
    ),
    key!(
        cosmic_ray_e_um,
        NumberRange::Positive,
        "electrons per micrometer of a cosmic ray's path"
    ),
    key!(
        trails,
        NumberRange::FromTo(0.0, 1e4),
        "mean number of satellite trails on a frame"
    ),
    key!(
        trail_vmag,
        MAGNITUDES,
        "V magnitude of a satellite with a trail"
    ),
    key!(
        trail_rate_deg_s,
        NumberRange::Positive,
        "angular speed of a satellite with a trail, in degrees per second"
    ),
    key!(
        by_altitude,
        NumberRange::FromTo(0.0, 1.0),
        "1: airmass and airglow increase toward the horizon; 0: they are constant over the frame"
    ),
    key!(
        false_stars,
        NumberRange::FromTo(0.0, 1e6),
        "mean number of false stars on a frame"
    ),
    optional_key!(
        false_star_vmag,
        MAGNITUDES,
        "V magnitude of the faintest false star (default: the camera's limit)"
    ),
    key!(
        missing,
        NumberRange::FromTo(0.0, 1.0),
        "fraction of the catalog stars that are missing in the sky"
    ),
    key!(
        vmag_sigma,
        NumberRange::FromTo(0.0, 10.0),
        "standard deviation of the stars' magnitudes about the catalog magnitudes"
    ),
    optional_key!(
        faintest_vmag,
        MAGNITUDES,
        "V magnitude of the faintest simulated star (default: the catalog's faintest)"
    ),
    optional_key!(
        milky_way,
        NumberRange::NotNegative,
        "brightness of the unresolved Milky Way, relative to the real one (default: none)"
    ),
    key!(
        stray_light,
        NumberRange::FromTo(0.0, 1.0),
        "light scattered by an all-sky lens outside its image circle, relative to the mean sky inside"
    ),
];
