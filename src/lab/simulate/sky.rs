//! Sky brightness in each pixel, and what skyline, clouds and lens let through.

use super::image::ElectronImage;
use super::lights::{moon_direction, moon_vmag};
use super::milky_way::MilkyWay;
use super::scene::Scene;
use super::skyline::{Skyline, zenith_of};
use crate::base::coords::{Camera, PixelPoint, UnitVector};
use crate::base::statistics::normal_quantile;
use crate::camera::CameraModel;
use crate::camera::data_sheet::lens_transmission;
use crate::ephemeris::observer::airmass::{airmass_kasten_young, airmass_krisciunas_schaefer};
use crate::predict::{REFERENCE_NM, Scenario};
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::FRAC_PI_2;

/// Grid step on which moonlight is computed, in pixels. Clouds use a step of their size over
/// 32, at most this. Values between grid points are interpolated.
const GRID_PX: usize = 16;
/// Number of waves that clouds are composed of.
const WAVES: usize = 16;

/// The sky of one frame, relative to the uniform one of the scenario.
pub(super) struct SimulatedSky<'a> {
    camera: &'a CameraModel,
    vignetting: f64,
    /// Change of the brightness per pixel along x and y.
    slope: [f64; 2],
    clouds: Option<CloudField>,
    moonlight: Option<Moonlight>,
    skyline: Option<Skyline>,
    altitudes: Option<Altitudes>,
    milky_way: Option<MilkyWay>,
    stray_light: f64,
}

/// Parts of the light at a place.
struct LightParts {
    /// Change by the gradient.
    gradient: f64,
    /// Airglow.
    glow: f64,
    /// Moonlight and light of clouds, over the airglow.
    moon: f64,
    cloud: f64,
    milky_way: f64,
}

impl LightParts {
    fn light(&self) -> f64 {
        self.gradient.max(0.0) * self.glow * (1.0 + self.moon + self.cloud) + self.milky_way
    }
}

impl<'a> SimulatedSky<'a> {
    pub(super) fn new(
        scenario: &Scenario,
        scene: &Scene,
        camera: &'a CameraModel,
        random: &mut ChaCha8Rng,
    ) -> Self {
        let (sin, cos) = libm::sincos(scene.sky_gradient_deg.to_radians());
        // The gradient reaches its stated value at the border in its direction.
        let [half_x, half_y] = [camera.width_px / 2.0, camera.height_px / 2.0];
        let to_border_px = half_x * sin.abs() + half_y * cos.abs();
        let steepness = scene.sky_gradient / to_border_px;
        // Always drawn, so that later random numbers do not depend on the scene.
        let clouds = CloudField::new(scene, camera, random);
        Self {
            camera,
            vignetting: scenario.camera.imperfections.vignetting,
            slope: [steepness * sin, -steepness * cos],
            clouds: (scene.cloud_mag > 0.0 || scene.cloud_light > 0.0).then_some(clouds),
            moonlight: Moonlight::new(scenario, scene, camera),
            skyline: Skyline::new(scenario, scene, camera, random.clone()),
            altitudes: (scene.by_altitude > 0.0).then(|| Altitudes::new(scenario, camera)),
            milky_way: None,
            stray_light: scene.stray_light,
        }
    }

    /// The same, where the zenith is known and not that of the scenario.
    pub(super) fn under(mut self, zenith: Option<UnitVector<Camera>>) -> Self {
        if let (Some(altitudes), Some(zenith)) = (&mut self.altitudes, zenith) {
            altitudes.zenith = zenith;
        }
        self
    }

    /// The same with the Milky Way.
    pub(super) fn with(self, milky_way: Option<MilkyWay>) -> Self {
        Self { milky_way, ..self }
    }

    /// Fraction of a star's light that skyline, clouds and lens transmit at `place`.
    pub(super) fn transmission(&self, place: &PixelPoint) -> f64 {
        let skyline = self.skyline.as_ref();
        if skyline.is_some_and(|skyline| skyline.hides_place(place)) {
            return 0.0;
        }
        let clouds = self
            .clouds
            .as_ref()
            .map_or(1.0, |clouds| clouds.transmission(place));
        let air = self
            .altitudes
            .as_ref()
            .map_or(1.0, |altitudes| altitudes.transmission(place, self.camera));
        clouds * air * self.lens(place)
    }

    /// Fills `image` with the sky, where `sky_e` is that of the uniform sky, in electrons.
    pub(super) fn expose(&self, image: &mut ElectronImage, sky_e: f64) {
        let is_pinhole = self.camera.is_pinhole();
        let is_even = is_pinhole
            && self.vignetting == 0.0
            && self.slope == [0.0; 2]
            && self.altitudes.is_none()
            && self.milky_way.is_none();
        let is_open = self.clouds.is_none() && self.skyline.is_none();
        if is_even && is_open && self.moonlight.is_none() {
            return image.pixels_mut().fill(sky_e);
        }
        let moon = self
            .moonlight
            .as_ref()
            .map(|moon| CoarseGrid::sample(image, GRID_PX, |place| moon.at(self.camera, place)));
        let clouds = self.clouds.as_ref().filter(|clouds| clouds.light > 0.0);
        let clouds = clouds.map(|clouds| {
            let grid = CoarseGrid::sample(image, clouds.grid_px(), |place| clouds.height(place));
            (clouds.light, grid)
        });
        let altitudes = self.altitudes.as_ref();
        let glow = altitudes.map(|altitudes| {
            CoarseGrid::sample(image, GRID_PX, |place| altitudes.glow(place, self.camera))
        });
        let milky_way = self.milky_way.as_ref();
        let milky_way = milky_way.map(|milky_way| {
            CoarseGrid::sample(image, GRID_PX, |place| self.starlight(milky_way, place))
        });
        let centre = self.camera.centre();
        for (y, row) in image.rows_mut() {
            let gradient_y = 1.0 + self.slope[1] * (y as f64 - centre.y);
            for (x, pixel) in row.iter_mut().enumerate() {
                let place = PixelPoint::new(x as f64, y as f64);
                if !is_pinhole && self.camera.direction_of(&place).is_none() {
                    *pixel = 0.0;
                    continue;
                }
                if let Some(skyline) = self.skyline.as_ref().filter(|line| line.hides(x, y)) {
                    *pixel = sky_e * skyline.light * self.lens(&place);
                    continue;
                }
                let gradient = gradient_y + self.slope[0] * (place.x - centre.x);
                let moon = moon.as_ref().map_or(0.0, |grid| grid.at(x, y));
                let cloud = clouds.as_ref().map_or(0.0, |(light, grid)| {
                    light * CloudField::thickness_of(grid.at(x, y))
                });
                let parts = LightParts {
                    gradient,
                    glow: glow.as_ref().map_or(1.0, |grid| grid.at(x, y)),
                    moon,
                    cloud,
                    milky_way: milky_way.as_ref().map_or(0.0, |grid| grid.at(x, y)),
                };
                *pixel = sky_e * parts.light() * self.lens(&place);
            }
        }
        if self.stray_light > 0.0 {
            self.scatter(image);
        }
    }

    /// Scatters light to where the lens images nothing.
    fn scatter(&self, image: &mut ElectronImage) {
        let lit = || image.pixels().iter().filter(|pixel| **pixel > 0.0);
        let stray_e = self.stray_light * lit().sum::<f64>() / lit().count().max(1) as f64;
        let unlit = image.pixels_mut().iter_mut().filter(|pixel| **pixel == 0.0);
        unlit.for_each(|pixel| *pixel = stray_e);
    }

    /// Magnitudes by which clouds dim stars at `place`.
    pub(super) fn clouds_mag(&self, place: &PixelPoint) -> f64 {
        let clouds = self.clouds.as_ref();
        clouds.map_or(0.0, |clouds| clouds.dims_by_mag(place))
    }

    /// Light at `place` over that of the uniform sky of the scenario, as [`expose`](Self::expose) draws it,
    /// but without interpolation, skyline and vignetting; `None` where the lens images nothing.
    pub(super) fn light(&self, place: &PixelPoint) -> Option<f64> {
        self.camera.direction_of(place)?;
        let centre = self.camera.centre();
        let [x, y] = [place.x - centre.x, place.y - centre.y];
        let gradient = 1.0 + self.slope[0] * x + self.slope[1] * y;
        let moon = self.moonlight.as_ref();
        let moon = moon.map_or(0.0, |moon| moon.at(self.camera, place));
        let cloud = self.clouds.as_ref().map_or(0.0, |clouds| {
            clouds.light * CloudField::thickness_of(clouds.height(place))
        });
        let altitudes = self.altitudes.as_ref();
        let milky_way = self.milky_way.as_ref();
        let parts = LightParts {
            gradient,
            glow: altitudes.map_or(1.0, |altitudes| altitudes.glow(place, self.camera)),
            moon,
            cloud,
            milky_way: milky_way.map_or(0.0, |milky_way| self.starlight(milky_way, place)),
        };
        Some(parts.light())
    }

    /// Light of the Milky Way that air and clouds let through.
    fn starlight(&self, milky_way: &MilkyWay, place: &PixelPoint) -> f64 {
        let clouds = self.clouds.as_ref();
        let clouds = clouds.map_or(1.0, |clouds| clouds.transmission(place));
        let altitudes = self.altitudes.as_ref();
        let air = altitudes.map_or(1.0, |altitudes| {
            altitudes.transmission(place, self.camera) * altitudes.solid_angle(place, self.camera)
        });
        clouds * air * milky_way.at(self.camera, place)
    }

    /// Transmission of the lens relative to the centre.
    pub(super) fn lens(&self, place: &PixelPoint) -> f64 {
        lens_transmission(self.vignetting, self.camera.off_centre_sq(place))
    }
}

/// Values on a grid over the frame, interpolated between.
struct CoarseGrid {
    step_px: usize,
    columns: usize,
    values: Vec<f64>,
}

impl CoarseGrid {
    fn sample(image: &ElectronImage, step_px: usize, value: impl Fn(&PixelPoint) -> f64) -> Self {
        let [columns, rows] = [image.width(), image.height()].map(|side| side / step_px + 2);
        let places = (0..columns * rows).map(|i| {
            let at = |step: usize| (step * step_px) as f64;
            PixelPoint::new(at(i % columns), at(i / columns))
        });
        Self {
            step_px,
            columns,
            values: places.map(|place| value(&place)).collect(),
        }
    }

    fn at(&self, x: usize, y: usize) -> f64 {
        let step = self.step_px;
        let part = |i: usize| (i % step) as f64 / step as f64;
        let first = y / step * self.columns + x / step;
        let along = |at: usize| self.values[at] + part(x) * (self.values[at + 1] - self.values[at]);
        let (above, below) = (along(first), along(first + self.columns));
        above + part(y) * (below - above)
    }
}

/// Clouds: a random field composed of waves.
struct CloudField {
    extinction_mag: f64,
    /// Light of the thickest cloud relative to the clear sky.
    light: f64,
    size_px: f64,
    /// What is added to the field, so that the stated share of it is above 0.
    raised: f64,
    /// Wave number along x and y in 1/px, and phase.
    waves: [[f64; 3]; WAVES],
    bank: Option<Bank>,
}

/// One bank of clouds between two straight edges.
struct Bank {
    /// The frame's centre.
    centre: PixelPoint,
    /// Where it comes from, along x and y.
    from: [f64; 2],
    /// How far the front is from the centre, and the end behind it.
    front_px: f64,
    width_px: f64,
    /// Distance from an edge at which the cloud is thickest.
    edge_px: f64,
}

impl Bank {
    fn new(scene: &Scene, camera: &CameraModel) -> Option<Self> {
        /// Sizes of a cloud.
        const EDGE: f64 = 0.1;
        let (sin, cos) = libm::sincos(scene.cloud_bank_deg.unwrap_or(0.0).to_radians());
        Some(Self {
            centre: camera.centre(),
            from: [sin, -cos],
            front_px: scene.cloud_bank_px?,
            width_px: scene.cloud_bank_width_px.unwrap_or(f64::INFINITY),
            edge_px: EDGE * scene.cloud_size_px,
        })
    }

    fn height(&self, place: &PixelPoint) -> f64 {
        let [x, y] = self.from;
        let along_px = x * (place.x - self.centre.x) + y * (place.y - self.centre.y);
        let behind_px = along_px - self.front_px;
        behind_px.min(self.width_px - behind_px) / self.edge_px
    }
}

impl CloudField {
    fn new(scene: &Scene, camera: &CameraModel, random: &mut ChaCha8Rng) -> Self {
        let mut wave = || {
            let angle = random.random_range(0.0..std::f64::consts::TAU);
            let length_px = scene.cloud_size_px * random.random_range(1.0..3.0);
            let number = std::f64::consts::TAU / length_px;
            let phase = random.random_range(0.0..std::f64::consts::TAU);
            let (sin, cos) = libm::sincos(angle);
            [number * cos, number * sin, phase]
        };
        Self {
            extinction_mag: scene.cloud_mag,
            light: scene.cloud_light,
            size_px: scene.cloud_size_px,
            raised: scene.cloud_share.map_or(0.0, normal_quantile),
            waves: std::array::from_fn(|_| wave()),
            bank: Bank::new(scene, camera),
        }
    }

    /// Grid step for interpolation of the height.
    fn grid_px(&self) -> usize {
        const GRIDS_IN_A_CLOUD: f64 = 32.0;
        ((self.size_px / GRIDS_IN_A_CLOUD) as usize).clamp(1, GRID_PX)
    }

    /// The random field; there is a cloud where it is above 0.
    fn height(&self, place: &PixelPoint) -> f64 {
        if let Some(bank) = &self.bank {
            return bank.height(place);
        }
        let wave = |[a, b, phase]: [f64; 3]| libm::cos(a * place.x + b * place.y + phase);
        let sum: f64 = self.waves.map(wave).iter().sum();
        // The sum has a variance of half the number of waves: by default half of the sky is clear, a
        // sixth fully covered.
        sum / (WAVES as f64 / 2.0).sqrt() + self.raised
    }

    /// Relative thickness from 0 (clear) to 1 (thickest).
    fn thickness_of(height: f64) -> f64 {
        height.clamp(0.0, 1.0)
    }

    fn dims_by_mag(&self, place: &PixelPoint) -> f64 {
        self.extinction_mag * Self::thickness_of(self.height(place))
    }

    fn transmission(&self, place: &PixelPoint) -> f64 {
        libm::pow(10.0, -0.4 * self.dims_by_mag(place))
    }
}

/// Air and airglow by altitude.
struct Altitudes {
    zenith: UnitVector<Camera>,
    /// Part of the light that one airmass transmits.
    transmission: f64,
    /// Airmass for which the scenario's light is.
    airmass: f64,
    /// Airglow, and the solid angle of a pixel, for which the scenario's sky is.
    glow: f64,
    solid_angle_sr: f64,
}

impl Altitudes {
    fn new(scenario: &Scenario, camera: &CameraModel) -> Self {
        let conditions = &scenario.conditions;
        let zenith_rad = conditions.zenith_distance_deg.to_radians();
        let transmission = conditions.extinction.zenith_transmission(REFERENCE_NM);
        Self {
            zenith: zenith_of(scenario),
            transmission,
            airmass: airmass_kasten_young(zenith_rad),
            glow: Self::airglow(zenith_rad, transmission),
            solid_angle_sr: solid_angle_sr(camera, &camera.axis()).unwrap_or(f64::NAN),
        }
    }

    /// # Reference
    /// Krisciunas & Schaefer 1991, PASP 103, 1033, eq. (2).
    fn airglow(zenith_rad: f64, transmission: f64) -> f64 {
        let airmass = airmass_krisciunas_schaefer(zenith_rad);
        airmass * libm::pow(transmission, airmass - 1.0)
    }

    fn zenith_rad(&self, place: &PixelPoint, camera: &CameraModel) -> Option<f64> {
        let zenith_rad = self.zenith.angle_to(&camera.direction_of(place)?);
        Some(zenith_rad.min(FRAC_PI_2))
    }

    /// What the air transmits over what it does in the scenario's direction.
    fn transmission(&self, place: &PixelPoint, camera: &CameraModel) -> f64 {
        let airmass = self.zenith_rad(place, camera).map(airmass_kasten_young);
        airmass.map_or(1.0, |airmass| {
            libm::pow(self.transmission, airmass - self.airmass)
        })
    }

    /// The sky's light in a pixel over that of the scenario.
    fn glow(&self, place: &PixelPoint, camera: &CameraModel) -> f64 {
        let glow = self
            .zenith_rad(place, camera)
            .map(|zenith_rad| Self::airglow(zenith_rad, self.transmission));
        glow.map_or(0.0, |glow| {
            glow / self.glow * self.solid_angle(place, camera)
        })
    }

    /// Solid angle of a pixel over that for which the scenario's sky is.
    fn solid_angle(&self, place: &PixelPoint, camera: &CameraModel) -> f64 {
        solid_angle_sr(camera, place).map_or(0.0, |of_pixel| of_pixel / self.solid_angle_sr)
    }
}

/// The solid angle of a pixel: the triangle of three of its corners, twice.
pub(super) fn solid_angle_sr(camera: &CameraModel, place: &PixelPoint) -> Option<f64> {
    let corner = |dx: f64, dy: f64| {
        let place = PixelPoint::new(place.x + dx, place.y + dy);
        Some(*camera.direction_of(&place)?.as_vector())
    };
    let first = corner(-0.5, -0.5)?;
    let [right, down] = [corner(0.5, -0.5)? - first, corner(-0.5, 0.5)? - first];
    Some(right.cross(&down).norm())
}

/// Moonlight scattered by the air.
struct Moonlight {
    /// Direction of the Moon in camera axes.
    direction: UnitVector<Camera>,
    /// Brightness for a scattering function of 1, relative to the sky.
    strength: f64,
}

impl Moonlight {
    /// # Reference
    /// Krisciunas & Schaefer 1991, PASP 103, 1033, eqs. (3), (15), (20), (21); brightness in
    /// nanolamberts by their eq. (1). Extinction is that of the scenario at 555 nm, and the airmass
    /// is constant over the frame.
    fn new(scenario: &Scenario, scene: &Scene, camera: &CameraModel) -> Option<Self> {
        let direction = moon_direction(scene, camera)?;
        let conditions = &scenario.conditions;
        let transmission = conditions.extinction.zenith_transmission(REFERENCE_NM);
        let through = |zenith_distance_deg: f64| {
            let airmass = airmass_krisciunas_schaefer(zenith_distance_deg.to_radians());
            libm::pow(transmission, airmass)
        };
        // Eq. (8) and (9) make eq. (20).
        let moon = libm::pow(10.0, -0.4 * (moon_vmag(scene) + 16.57))
            * through(scene.moon_zenith_distance_deg);
        let scattered = moon * (1.0 - through(conditions.zenith_distance_deg));
        let sky = 34.08 * libm::exp(20.7233 - 0.92104 * conditions.sky.mag_arcsec2());
        Some(Self {
            direction,
            strength: scattered / sky,
        })
    }

    /// Brightness at `place`, relative to the sky.
    fn at(&self, camera: &CameraModel, place: &PixelPoint) -> f64 {
        let Some(direction) = camera.direction_of(place) else {
            return 0.0;
        };
        let angle_rad = direction.angle_to(&self.direction);
        let cosine = libm::cos(angle_rad);
        let rayleigh = libm::pow(10.0, 5.36) * (1.06 + cosine * cosine);
        let mie = libm::pow(10.0, 6.15 - angle_rad.to_degrees() / 40.0);
        self.strength * (rayleigh + mie)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::data_sheet::Preset;
    use crate::predict::{Extinction, SkyBrightness};
    use rand::SeedableRng;

    fn camera() -> CameraModel {
        CameraModel::pinhole(400.0, 300.0, 1000.0, false)
    }

    fn sky(scenario: &Scenario, scene: &Scene) -> Vec<f64> {
        let camera = camera();
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let mut image = ElectronImage::new(400, 300, 0.0);
        SimulatedSky::new(scenario, scene, &camera, &mut random).expose(&mut image, 100.0);
        image.into_pixels()
    }

    #[test]
    fn a_gradient_is_reached_at_the_border_it_points_to() {
        let scenario = Scenario::of(Preset::NanosatTracker);
        let scene = Scene {
            sky_gradient: 0.5,
            ..Scene::default()
        };
        let pixels = sky(&scenario, &scene);
        // Up: the first row is half a pixel inside the border.
        assert!((pixels[200] - 150.0).abs() < 0.5 && (pixels[299 * 400] - 50.0).abs() < 0.5);
        let right = Scene {
            sky_gradient_deg: 90.0,
            ..scene
        };
        let pixels = sky(&scenario, &right);
        assert!((pixels[399] - 150.0).abs() < 0.5 && (pixels[150 * 400] - 50.0).abs() < 0.5);
    }

    #[test]
    fn corners_lose_the_light_that_vignetting_says() {
        let mut scenario = Scenario::of(Preset::NanosatTracker);
        scenario.camera.imperfections.vignetting = 0.4;
        let pixels = sky(&scenario, &Scene::default());
        assert!((pixels[0] - 60.0).abs() < 0.4, "{}", pixels[0]);
        assert!((pixels[150 * 400 + 200] - 100.0).abs() < 0.01);
    }

    #[test]
    fn a_full_moon_is_as_bright_as_the_formula_says() {
        let mut scenario = Scenario::of(Preset::NanosatTracker);
        scenario.conditions.sky = SkyBrightness::MagArcsec2(21.587);
        scenario.conditions.extinction = Extinction::MagPerAirmass(0.172);
        scenario.conditions.zenith_distance_deg = 0.0;
        let scene = Scene {
            moon_distance_deg: Some(60.0),
            moon_zenith_distance_deg: 60.0,
            ..Scene::default()
        };
        let pixels = sky(&scenario, &scene);
        let change_mag = -2.5 * (pixels[150 * 400 + 200] / 100.0).log10();
        // f(60°) = 10^5.36 (1.06 + 0.25) + 10^(6.15 − 1.5) = 300107 + 44668 = 344775; I* =
        // 10^(−1.536) = 0.029107; X(60°) = (1 − 0.96 · 0.75)^−½ = 1.88982: 10^(−0.4 · 0.172 ·
        // 1.88982) = 0.74127; 1 − 10^(−0.0688) = 0.14649; B = 1089.8 nL; B0 = 34.08 exp(20.7233 −
        // 0.92104 · 21.587) = 79.0 nL: −2.5 log10(1 + 13.795) = −2.925.
        assert!((change_mag + 2.925).abs() < 0.01, "{change_mag}");
        // The sky brightens towards the Moon, which is up.
        assert!(pixels[200] > pixels[299 * 400 + 200]);
    }

    #[test]
    fn the_moon_is_where_it_is_in_the_image_in_a_mirror_as_well() {
        let scenario = Scenario::of(Preset::NanosatTracker);
        let scene = Scene {
            moon_distance_deg: Some(40.0),
            moon_direction_deg: 90.0,
            ..Scene::default()
        };
        for mirrored in [false, true] {
            let camera = CameraModel::pinhole(400.0, 300.0, 1000.0, mirrored);
            let mut image = ElectronImage::new(400, 300, 0.0);
            let mut random = ChaCha8Rng::seed_from_u64(1);
            SimulatedSky::new(&scenario, &scene, &camera, &mut random).expose(&mut image, 100.0);
            let row = image.row_mut(150);
            assert!(row[399] > 1.05 * row[0], "{} {}", row[0], row[399]);
        }
    }

    #[test]
    fn the_light_at_a_place_is_that_of_the_pixel_there() {
        let scenario = Scenario::of(Preset::NanosatTracker);
        let camera = camera();
        let scene = Scene {
            by_altitude: 1.0,
            moon_distance_deg: Some(25.0),
            cloud_mag: 1.0,
            cloud_light: 1.0,
            cloud_share: Some(0.7),
            sky_gradient: 0.3,
            ..Scene::default()
        };
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let sky = SimulatedSky::new(&scenario, &scene, &camera, &mut random);
        let mut image = ElectronImage::new(400, 300, 0.0);
        sky.expose(&mut image, 100.0);
        let mut clouded = 0;
        for i in (0..120_000).step_by(97) {
            let place = PixelPoint::new((i % 400) as f64, (i / 400) as f64);
            let expected = 100.0 * sky.light(&place).unwrap() * sky.lens(&place);
            let found = image.pixels()[i];
            assert!(
                (found / expected - 1.0).abs() < 0.01,
                "{place:?}: {found}, {expected}"
            );
            clouded += usize::from(sky.clouds_mag(&place) > 0.0);
        }
        assert!(clouded > 700, "{clouded}");
    }

    #[test]
    fn the_air_is_thinnest_towards_the_zenith() {
        let scenario = Scenario::of(Preset::NanosatTracker);
        let scene = Scene {
            by_altitude: 1.0,
            ..Scene::default()
        };
        let camera = CameraModel::pinhole(400.0, 300.0, 200.0, false);
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let toward = PixelPoint::new(350.0, 200.0);
        let zenith = camera.direction_of(&toward);
        let sky = SimulatedSky::new(&scenario, &scene, &camera, &mut random).under(zenith);
        let at_zenith = sky.transmission(&toward);
        for (x, y) in [(200.0, 150.0), (10.0, 10.0), (390.0, 290.0)] {
            let place = PixelPoint::new(x, y);
            assert!(sky.transmission(&place) < at_zenith, "{place:?}");
        }
    }

    #[test]
    fn small_clouds_light_the_sky_where_they_dim_the_stars() {
        let scenario = Scenario::of(Preset::NanosatTracker);
        let camera = camera();
        for cloud_size_px in [3.0, 20.0, 150.0, 1000.0] {
            let scene = Scene {
                cloud_mag: 1.0,
                cloud_light: 1.0,
                cloud_size_px,
                ..Scene::default()
            };
            let mut random = ChaCha8Rng::seed_from_u64(2);
            let sky = SimulatedSky::new(&scenario, &scene, &camera, &mut random);
            let mut image = ElectronImage::new(400, 300, 0.0);
            sky.expose(&mut image, 1.0);
            let off = |i: usize| {
                let place = PixelPoint::new((i % 400) as f64, (i / 400) as f64);
                let thickness = -2.5 * sky.transmission(&place).log10();
                (image.pixels()[i] - 1.0 - thickness).abs()
            };
            let most = (0..120_000).step_by(7).map(off).fold(0.0, f64::max);
            assert!(most < 0.01, "{cloud_size_px}: {most}");
        }
    }

    #[test]
    fn in_space_the_moon_lights_no_sky() {
        let mut scenario = Scenario::of(Preset::NanosatTracker);
        scenario.conditions.extinction = Extinction::MagPerAirmass(0.0);
        let scene = Scene {
            moon_distance_deg: Some(30.0),
            ..Scene::default()
        };
        assert!(
            sky(&scenario, &scene)
                .iter()
                .all(|e| (e - 100.0).abs() < 1e-9)
        );
    }

    #[test]
    fn clouds_take_light_of_stars_and_add_their_own() {
        let scenario = Scenario::of(Preset::NanosatTracker);
        let scene = Scene {
            cloud_mag: 2.0,
            cloud_size_px: 60.0,
            cloud_light: 1.0,
            ..Scene::default()
        };
        let camera = camera();
        let sky = SimulatedSky::new(
            &scenario,
            &scene,
            &camera,
            &mut ChaCha8Rng::seed_from_u64(1),
        );
        let places = (0..300).map(|i| PixelPoint::new(f64::from(i), f64::from(i)));
        let left: Vec<f64> = places.map(|place| sky.transmission(&place)).collect();
        let least = left.iter().copied().fold(1.0, f64::min);
        assert!((least - 10f64.powf(-0.8)).abs() < 0.05, "{least}");
        assert!(left.contains(&1.0));
        let mut image = ElectronImage::new(400, 300, 0.0);
        sky.expose(&mut image, 100.0);
        let most = image.pixels().iter().copied().fold(0.0, f64::max);
        assert!((most - 200.0).abs() < 2.0, "{most}");
    }
}
