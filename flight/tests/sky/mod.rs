//! A sky, and a camera that photographs it: independent of what is tested, star by star and pixel by pixel.

#![allow(dead_code, reason = "each test uses a part of it")]
#![allow(
    clippy::disallowed_methods,
    reason = "tests may differ in the last bit"
)]

use nalgebra::{Matrix3, Rotation3, Vector3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal, Poisson, StandardNormal};
use starpipe_flight::{Camera, Config, Sensor, Star};

const LIGHT_KM_S: f64 = 299_792.458;

/// The stars brighter than V 6.5.
pub fn stars() -> Vec<Star> {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../catalogs/sky2000-bright.csv"
    );
    let text = std::fs::read_to_string(path).expect("the bright stars are beside this package");
    text.lines().skip(1).filter_map(star).collect()
}

fn star(line: &str) -> Option<Star> {
    let fields: Vec<&str> = line.split(',').collect();
    let number = |at: usize| fields[at].trim().parse::<f64>().ok();
    let ra = (number(6)? + number(7)? / 60.0 + number(8)? / 3600.0) * 15.0_f64.to_radians();
    let sign = if fields[9] == "-" { -1.0 } else { 1.0 };
    let dec = sign * (number(10)? + number(11)? / 60.0 + number(12)? / 3600.0).to_radians();
    // Seconds of time and of arc a year.
    let east_mas = number(14).unwrap_or(0.0) * 15e3 * dec.cos();
    let north_mas = number(15).unwrap_or(0.0) * 1e3;
    Some(Star {
        direction: Vector3::new(dec.cos() * ra.cos(), dec.cos() * ra.sin(), dec.sin()),
        motion_mas: [east_mas.round() as i16, north_mas.round() as i16],
        v_mag: number(17).or_else(|| number(18))?,
        id: number(0)? as u32,
    })
}

/// A camera of `fov_deg` by `fov_deg` with 1024 × 1024 pixels.
pub fn config(fov_deg: f64) -> Config {
    let side = 1024_u32;
    let focal_length_px = 0.5 * f64::from(side) / (0.5 * fov_deg.to_radians()).tan();
    Config {
        camera: Camera {
            width_px: side,
            height_px: side,
            focal_length_px,
            center_px: [515.3, 507.8],
            radial: [-0.05, 0.01, 0.0],
            mirrored: 0,
        },
        sensor: Sensor {
            zero_point_mag: 16.6,
            exposure_s: 0.2,
            gain_e_per_adu: 2.0,
            read_noise_e: 8.0,
            background_e_s: 100.0,
            saturation_adu: 4095.0,
            row_time_s: 0.0,
        },
        spot_sigma_px: 0.9,
        detection_sigma: 5.0,
        position_floor_px: 0.005,
        scale_error: 1e-4,
        max_log10_false_alarm: -7.0,
        max_stars: 64,
    }
}

/// A moving camera, and what its sky is like.
pub struct Scene<'a> {
    pub config: &'a Config,
    pub stars: &'a [Star],
    /// ICRS to camera, in the middle of the exposure of the middle row.
    pub attitude: Matrix3<f64>,
    pub rate_rad_s: Vector3<f64>,
    pub velocity_km_s: Vector3<f64>,
    /// Years since the epoch of the stars.
    pub years: f64,
}

impl Scene<'_> {
    /// Where each star that is seen is, with its electrons: at a time since the middle of the exposure of the middle row.
    pub fn seen(&self, star: &Star, late_s: f64) -> Option<[f64; 2]> {
        let [x, y] = [star.direction.x, star.direction.y];
        let across = x.hypot(y);
        let (east, mas) = (
            Vector3::new(-y / across, x / across, 0.0),
            (1e-3_f64 / 3600.0).to_radians(),
        );
        let north = star.direction.cross(&east);
        let [to_east, to_north] = star
            .motion_mas
            .map(|motion| f64::from(motion) * mas * self.years);
        let place = (star.direction + east * to_east + north * to_north).normalize();
        let apparent = (place + self.velocity_km_s / LIGHT_KM_S).normalize();
        let turn = Rotation3::new(-self.rate_rad_s * late_s);
        let seen = turn.matrix() * (self.attitude * apparent);
        let camera = &self.config.camera;
        if seen.z < 0.3 {
            return None;
        }
        let [u, v] = [seen.x / seen.z, seen.y / seen.z];
        let square = u * u + v * v;
        let [a, b, c] = camera.radial;
        let stretch = 1.0 + a * square + b * square.powi(2) + c * square.powi(3);
        let hand = if camera.mirrored == 1 { -1.0 } else { 1.0 };
        let pixel = [
            camera.center_px[0] + hand * u * stretch * camera.focal_length_px,
            camera.center_px[1] + v * stretch * camera.focal_length_px,
        ];
        let far = pixel[0].abs().max(pixel[1].abs()) > 3.0 * f64::from(camera.width_px);
        (!far).then_some(pixel)
    }

    /// The photograph.
    pub fn image(&self, rng: &mut ChaCha8Rng) -> Vec<u16> {
        let Config {
            camera,
            sensor,
            spot_sigma_px,
            ..
        } = self.config;
        let [width, height] = [camera.width_px, camera.height_px].map(|side| side as usize);
        let mut electrons = vec![sensor.background_e_s * sensor.exposure_s; width * height];
        let steps = if self.rate_rad_s.norm() > 0.0 { 15 } else { 1 };
        for star in self.stars {
            let light = 10_f64.powf(-0.4 * (star.v_mag - sensor.zero_point_mag))
                * sensor.exposure_s
                / f64::from(steps);
            for step in 0..steps {
                let within_s =
                    sensor.exposure_s * ((f64::from(step) + 0.5) / f64::from(steps) - 0.5);
                let Some(middle) = self.seen(star, within_s) else {
                    continue;
                };
                let row_s = (middle[1] - 0.5 * (height as f64 - 1.0)) * sensor.row_time_s;
                let Some(place) = self.seen(star, within_s + row_s) else {
                    continue;
                };
                add_spot(
                    &mut electrons,
                    [width, height],
                    place,
                    light,
                    *spot_sigma_px,
                );
            }
        }
        let read = Normal::new(0.0, sensor.read_noise_e).unwrap();
        let level = |mean: f64, rng: &mut ChaCha8Rng| {
            let light = Poisson::new(mean.max(1e-9)).unwrap().sample(rng);
            let adu = (light + read.sample(rng)) / sensor.gain_e_per_adu + 100.0;
            adu.round().clamp(0.0, 4095.0) as u16
        };
        electrons.iter().map(|mean| level(*mean, rng)).collect()
    }
}

fn add_spot(
    electrons: &mut [f64],
    [width, height]: [usize; 2],
    [x, y]: [f64; 2],
    light: f64,
    sigma: f64,
) {
    let share = |pixel: usize, at: f64| {
        let edge = |offset: f64| {
            libm::erf((pixel as f64 + offset - at) / (sigma * std::f64::consts::SQRT_2))
        };
        0.5 * (edge(0.5) - edge(-0.5))
    };
    let reach = 5.0 * sigma + 1.0;
    let range = |at: f64, side: usize| {
        let from = (at - reach).ceil().max(0.0) as usize;
        let to = (at + reach).floor().min(side as f64 - 1.0);
        if to < 0.0 {
            1..1
        } else {
            from..to as usize + 1
        }
    };
    let columns: Vec<f64> = range(x, width).map(|column| share(column, x)).collect();
    for row in range(y, height) {
        let of_row = light * share(row, y);
        for (column, of_column) in range(x, width).zip(&columns) {
            electrons[row * width + column] += of_row * of_column;
        }
    }
}

/// An attitude with any direction and roll.
pub fn any_attitude(rng: &mut ChaCha8Rng) -> Matrix3<f64> {
    let axis = |rng: &mut ChaCha8Rng| Vector3::from_fn(|_, _| rng.sample::<f64, _>(StandardNormal));
    let z = axis(rng).normalize();
    let x = axis(rng).cross(&z).normalize();
    Matrix3::from_rows(&[x.transpose(), z.cross(&x).transpose(), z.transpose()])
}

pub fn rng(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

/// The rotation about the camera's axes from the truth to what was found, in radians.
pub fn error_rad(truth: &Matrix3<f64>, quaternion: [f64; 4]) -> Vector3<f64> {
    let [w, x, y, z] = quaternion;
    let found = nalgebra::UnitQuaternion::new_normalize(nalgebra::Quaternion::new(w, x, y, z));
    starpipe_flight::turn_between(truth, found.to_rotation_matrix().matrix())
}
