//! What happens while a frame is exposed: how the camera turns, and what is in the sky besides stars.

use crate::camera::data_sheet::{Key, Limits, key};
use nalgebra::Vector3;
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, UnitSphere};

/// What happens while a frame is exposed. The default is a camera at rest under an even sky, and nothing besides stars.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scene {
    /// Angular rate of the camera about its x axis, in degrees a second.
    pub rate_x_deg_s: f64,
    /// About its y axis.
    pub rate_y_deg_s: f64,
    /// About its boresight.
    pub rate_z_deg_s: f64,
    /// A tumbling satellite: angular rate about an axis that is another one in each frame, in degrees a second.
    pub tumble_deg_s: f64,
    /// A rolling ship: amplitude of its swing about the camera's y axis, in degrees; each frame meets it at another phase.
    pub swing_deg: f64,
    /// Period of that swing, in seconds.
    pub swing_period_s: f64,
    /// How much brighter than in the centre the sky is at the frame's border, in the direction of [`Self::sky_gradient_deg`],
    /// relative to the centre; as much darker on the opposite side.
    pub sky_gradient: f64,
    /// Where the sky is brighter: degrees from image-up towards the right.
    pub sky_gradient_deg: f64,
    /// Angle between boresight and Moon, in degrees, where there is one above the horizon.
    pub moon_distance_deg: Option<f64>,
    /// Where the Moon is: degrees from image-up towards the right.
    pub moon_direction_deg: f64,
    /// Phase angle of the Moon, in degrees: 0 is full, 90 half, 180 new.
    pub moon_phase_deg: f64,
    /// Zenith distance of the Moon, in degrees.
    pub moon_zenith_distance_deg: f64,
    /// Extinction where clouds are thickest, in magnitudes.
    pub cloud_mag: f64,
    /// Size of clouds, in pixels.
    pub cloud_size_px: f64,
    /// How much light the thickest cloud adds to the sky, relative to the clear sky.
    pub cloud_light: f64,
    /// Cosmic rays on a square centimetre in a second.
    pub cosmic_rays_cm2_s: f64,
    /// Electrons that one leaves on a micrometre of its way.
    pub cosmic_ray_e_um: f64,
    /// Trails of satellites on a frame, on average.
    pub trails: f64,
    /// V magnitude of such a satellite.
    pub trail_vmag: f64,
    /// How fast it moves, in degrees a second.
    pub trail_rate_deg_s: f64,
    /// False stars on a frame, on average.
    pub false_stars: f64,
    /// V magnitude of the faintest false star; the camera's limit where nothing is said.
    pub false_star_vmag: Option<f64>,
    /// Part of the catalogue's stars that are not in the sky.
    pub missing: f64,
    /// Standard deviation of the stars' magnitudes about those of the catalogue.
    pub vmag_sigma: f64,
    /// The faintest V magnitude of a star that is drawn, where there is one.
    pub faintest_vmag: Option<f64>,
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
            cosmic_rays_cm2_s: 0.0,
            cosmic_ray_e_um: 80.0,
            trails: 0.0,
            trail_vmag: 4.0,
            trail_rate_deg_s: 0.5,
            false_stars: 0.0,
            false_star_vmag: None,
            missing: 0.0,
            vmag_sigma: 0.0,
            faintest_vmag: None,
        }
    }
}

impl Scene {
    /// How fast the boresight typically moves, in radians a second.
    pub(super) fn typical_rate_rad_s(&self) -> f64 {
        // The mean over directions of a sine, and over phases of a cosine.
        const SINE: f64 = std::f64::consts::FRAC_PI_4;
        const COSINE: f64 = std::f64::consts::FRAC_2_PI;
        let swing_deg_s = COSINE * std::f64::consts::TAU * self.swing_deg / self.swing_period_s;
        let tumble_deg_s = SINE * self.tumble_deg_s;
        let steady_deg_s = self.rate_x_deg_s.hypot(self.rate_y_deg_s);
        steady_deg_s
            .hypot(swing_deg_s)
            .hypot(tumble_deg_s)
            .to_radians()
    }

    /// The fastest that the camera may turn in any frame, in degrees a second.
    pub(super) fn largest_rate_deg_s(&self) -> f64 {
        let steady = Vector3::new(self.rate_x_deg_s, self.rate_y_deg_s, self.rate_z_deg_s);
        let swing_deg_s = std::f64::consts::TAU * self.swing_deg / self.swing_period_s;
        steady.norm() + self.tumble_deg_s.abs() + swing_deg_s
    }

    /// The camera's angular velocity about its own axes in one frame, in radians a second.
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

/// Angular rates that make sense, in degrees a second.
const RATES_DEG_S: Limits = Limits::FromTo(-360.0, 360.0);
/// Directions.
const ANGLES_DEG: Limits = Limits::FromTo(-360.0, 360.0);
/// Magnitudes that make sense: from the Sun to what no telescope sees.
const MAGNITUDES: Limits = Limits::FromTo(-27.0, 40.0);

/// The numbers of [`Scene`] by name. None has to be given.
pub const SCENE_KEYS: &[Key<Scene>] = &[
    key!(
        rate_x_deg_s,
        RATES_DEG_S,
        "angular rate of the camera about its x axis, in degrees a second"
    ),
    key!(
        rate_y_deg_s,
        RATES_DEG_S,
        "angular rate about its y axis, in degrees a second"
    ),
    key!(
        rate_z_deg_s,
        RATES_DEG_S,
        "angular rate about its boresight, in degrees a second"
    ),
    key!(
        tumble_deg_s,
        RATES_DEG_S,
        "tumbling satellite: angular rate about a random axis, in degrees a second"
    ),
    key!(
        swing_deg,
        Limits::FromTo(0.0, 180.0),
        "rolling ship: amplitude of the swing about the y axis, in degrees"
    ),
    key!(
        swing_period_s,
        Limits::Positive,
        "period of that swing, in seconds"
    ),
    key!(
        sky_gradient,
        Limits::FromTo(0.0, 1.0),
        "how much brighter the sky is at one border than in the centre, as a part"
    ),
    key!(
        sky_gradient_deg,
        ANGLES_DEG,
        "where it is brighter, in degrees from image-up towards the right"
    ),
    optional_key!(
        moon_distance_deg,
        Limits::FromTo(0.0, 180.0),
        "angle between boresight and Moon, in degrees; no Moon without it"
    ),
    key!(
        moon_direction_deg,
        ANGLES_DEG,
        "where the Moon is, in degrees from image-up towards the right"
    ),
    key!(
        moon_phase_deg,
        Limits::FromTo(0.0, 180.0),
        "phase angle of the Moon, in degrees: 0 full, 180 new"
    ),
    key!(
        moon_zenith_distance_deg,
        Limits::FromToBelow(0.0, 90.0),
        "zenith distance of the Moon, in degrees"
    ),
    key!(
        cloud_mag,
        Limits::FromTo(0.0, 30.0),
        "extinction where clouds are thickest, in magnitudes"
    ),
    key!(cloud_size_px, Limits::Positive, "size of clouds, in pixels"),
    key!(
        cloud_light,
        Limits::NotNegative,
        "light that the thickest cloud adds, relative to the clear sky"
    ),
    key!(
        cosmic_rays_cm2_s,
        Limits::FromTo(0.0, 1e6),
        "cosmic rays on a square centimetre in a second"
    ),
    key!(
        cosmic_ray_e_um,
        Limits::Positive,
        "electrons that a cosmic ray leaves on a micrometre of its way"
    ),
    key!(
        trails,
        Limits::FromTo(0.0, 1e4),
        "trails of satellites on a frame, on average"
    ),
    key!(trail_vmag, MAGNITUDES, "V magnitude of such a satellite"),
    key!(
        trail_rate_deg_s,
        Limits::Positive,
        "how fast it moves, in degrees a second"
    ),
    key!(
        false_stars,
        Limits::FromTo(0.0, 1e6),
        "false stars on a frame, on average"
    ),
    optional_key!(
        false_star_vmag,
        MAGNITUDES,
        "V magnitude of the faintest false star (else the camera's limit)"
    ),
    key!(
        missing,
        Limits::FromTo(0.0, 1.0),
        "part of the catalogue's stars that are not in the sky"
    ),
    key!(
        vmag_sigma,
        Limits::FromTo(0.0, 10.0),
        "standard deviation of the stars' magnitudes about the catalogue's"
    ),
    optional_key!(
        faintest_vmag,
        MAGNITUDES,
        "V magnitude of the faintest star that is drawn (else the catalogue's)"
    ),
];
