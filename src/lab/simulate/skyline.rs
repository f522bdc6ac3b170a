//! Trees and houses that hide the sky near the horizon.

use super::scene::Scene;
use crate::base::coords::{Camera, PixelPoint, UnitVector};
use crate::camera::CameraModel;
use crate::predict::Scenario;
use nalgebra::Vector3;
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Stream of random numbers, so that a skyline changes nothing else of a frame.
const STREAM: u64 = 2;
/// Number of waves around the horizon that the skyline is composed of.
const WAVES: usize = 48;
/// Share of the trees' pixels that show the sky between leaves, at their edge.
const GAPS_AT_EDGE: f64 = 0.5;
/// Depth behind the edge at which gaps are fewer by a factor e, in degrees.
const GAP_DEPTH_DEG: f64 = 1.5;

/// The direction of the zenith in camera axes: image-up from the centre.
pub(super) fn zenith_of(scenario: &Scenario) -> UnitVector<Camera> {
    let (sin, cos) = libm::sincos(scenario.conditions.zenith_distance_deg.to_radians());
    UnitVector::from_unit(Vector3::new(0.0, -sin, cos))
}

/// Two directions of the horizon at a right angle.
pub(super) fn horizon_of(zenith: &UnitVector<Camera>) -> [Vector3<f64>; 2] {
    let zenith = zenith.as_vector();
    let first = zenith.cross(&Vector3::x()).normalize();
    [first, zenith.cross(&first)]
}

/// The pixels that show trees and houses.
pub(super) struct Skyline {
    width: usize,
    hidden: Vec<bool>,
    /// Their brightness relative to the clear sky.
    pub light: f64,
}

impl Skyline {
    /// The skyline of a scene; `None` without one. Its random numbers are of a stream of its own.
    pub(super) fn new(
        scenario: &Scenario,
        scene: &Scene,
        camera: &CameraModel,
        mut random: ChaCha8Rng,
    ) -> Option<Self> {
        random.set_stream(STREAM);
        let phases = std::array::from_fn(|_| random.random_range(0.0..TAU));
        let outline = Outline {
            zenith: zenith_of(scenario),
            altitude_deg: scene.skyline_deg?,
            relief_deg: scene.skyline_relief_deg,
            phases,
        };
        let [width, height] = [camera.width_px, camera.height_px].map(|side| side as usize);
        let mut is_hidden = |index: usize| {
            let place = PixelPoint::new((index % width) as f64, (index / width) as f64);
            let depth_deg = camera.direction_of(&place).map(|d| outline.depth_deg(&d));
            depth_deg.is_some_and(|depth_deg| {
                let gaps = GAPS_AT_EDGE * libm::exp(-depth_deg / GAP_DEPTH_DEG);
                depth_deg > 0.0 && random.random::<f64>() > gaps
            })
        };
        Some(Self {
            width,
            hidden: (0..width * height).map(&mut is_hidden).collect(),
            light: scene.skyline_light,
        })
    }

    /// Whether a pixel shows no sky.
    pub(super) fn hides(&self, x: usize, y: usize) -> bool {
        self.hidden[y * self.width + x]
    }

    /// Whether the pixel at `place`, or that of the frame nearest to it, shows no sky.
    pub(super) fn hides_place(&self, place: &PixelPoint) -> bool {
        let nearest = |at: f64, side: usize| (at.round().max(0.0) as usize).min(side - 1);
        let height = self.hidden.len() / self.width;
        self.hides(nearest(place.x, self.width), nearest(place.y, height))
    }
}

/// The outline of trees and houses.
struct Outline {
    zenith: UnitVector<Camera>,
    altitude_deg: f64,
    /// Standard deviation of their altitude along the horizon.
    relief_deg: f64,
    phases: [f64; WAVES],
}

impl Outline {
    /// How far below it a direction lies, in degrees.
    fn depth_deg(&self, direction: &UnitVector<Camera>) -> f64 {
        let [x, y] = horizon_of(&self.zenith).map(|axis| axis.dot(direction.as_vector()));
        let azimuth_rad = libm::atan2(y, x);
        // The longest wave is the highest. The variances 1 / 2n² of all add up to π² / 12.
        let wave = |(n, phase): (usize, &f64)| {
            let n = (n + 1) as f64;
            libm::cos(n * azimuth_rad + phase) / n
        };
        let waves: f64 = self.phases.iter().enumerate().map(wave).sum();
        let outline_deg = self.altitude_deg + self.relief_deg * waves * 12.0_f64.sqrt() / PI;
        let altitude_rad = FRAC_PI_2 - self.zenith.angle_to(direction);
        outline_deg - altitude_rad.to_degrees()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::data_sheet::Preset;
    use rand::SeedableRng;

    fn hidden(scene: &Scene, zenith_distance_deg: f64) -> Option<Skyline> {
        let mut scenario = Scenario::of(Preset::NanosatTracker);
        scenario.conditions.zenith_distance_deg = zenith_distance_deg;
        let camera = CameraModel::pinhole(400.0, 300.0, 300.0, false);
        let random = ChaCha8Rng::seed_from_u64(1);
        Skyline::new(&scenario, scene, &camera, random)
    }

    #[test]
    fn trees_stand_below_and_leave_gaps_at_their_edge() {
        assert!(hidden(&Scene::default(), 80.0).is_none());
        let scene = Scene {
            skyline_deg: Some(10.0),
            ..Scene::default()
        };
        let skyline = hidden(&scene, 80.0).unwrap();
        // The outline crosses the centre; the lower half is hidden, its edge in part.
        let share = |rows: std::ops::Range<usize>| {
            let count = 400 * rows.len();
            let all = rows.flat_map(|y| (0..400).map(move |x| (x, y)));
            all.filter(|&(x, y)| skyline.hides(x, y)).count() as f64 / count as f64
        };
        assert_eq!(share(0..100), 0.0);
        assert!(share(250..300) > 0.99);
        let edge = share(153..158);
        assert!(0.4 < edge && edge < 0.9, "{edge}");
        assert!(skyline.hides_place(&PixelPoint::new(200.0, 400.0)));
        assert!(!skyline.hides_place(&PixelPoint::new(-9.0, -9.0)));
    }

    #[test]
    fn relief_is_the_standard_deviation_of_the_outline() {
        let outline = Outline {
            zenith: UnitVector::BORESIGHT,
            altitude_deg: 20.0,
            relief_deg: 4.0,
            phases: std::array::from_fn(|n| (n * n) as f64),
        };
        let heights: Vec<f64> = (0..3600)
            .map(|step| {
                let (sin, cos) = libm::sincos(f64::from(step) / 3600.0 * TAU);
                outline.depth_deg(&UnitVector::from_unit(Vector3::new(cos, sin, 0.0)))
            })
            .collect();
        let mean = heights.iter().sum::<f64>() / 3600.0;
        let variance = heights.iter().map(|h| (h - mean).powi(2)).sum::<f64>() / 3600.0;
        assert!((mean - 20.0).abs() < 1e-6, "{mean}");
        assert!((variance.sqrt() - 4.0).abs() < 0.05, "{}", variance.sqrt());
    }
}
