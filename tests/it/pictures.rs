//! What a picture shows in which no stars are identified: each thing is drawn at several sizes, and named; what only
//! resembles it is not.
//!
//! `scripts/failures.py` draws more of them, with text and JPEG artifacts.

use crate::common::{Ran, starpipe};
use image::RgbImage;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use std::f64::consts::TAU;
use std::path::Path;

/// A picture as light in three colors, 1 at full scale.
struct Scene {
    width: usize,
    height: usize,
    light: Vec<[f64; 3]>,
    random: ChaCha8Rng,
}

impl Scene {
    fn new(width: usize, height: usize, sky: [f64; 3], seed: u64) -> Self {
        Self {
            width,
            height,
            light: vec![sky; width * height],
            random: ChaCha8Rng::seed_from_u64(seed),
        }
    }

    /// Adds light of one color.
    fn add(&mut self, color: [f64; 3], light: impl Fn(f64, f64) -> f64) {
        for (index, pixel) in self.light.iter_mut().enumerate() {
            let (x, y) = (index % self.width, index / self.width);
            let light = light(x as f64, y as f64);
            for (channel, color) in pixel.iter_mut().zip(color) {
                *channel += color * light;
            }
        }
    }

    fn spot(&mut self, [x, y]: [f64; 2], peak: f64, sigma: f64) {
        let reach = (4.0 * sigma) as usize + 1;
        let around = |at: f64, side: usize| {
            let at = at as usize;
            at.saturating_sub(reach)..(at + reach + 1).min(side)
        };
        for row in around(y.max(0.0), self.height) {
            for column in around(x.max(0.0), self.width) {
                let squared = (column as f64 - x).powi(2) + (row as f64 - y).powi(2);
                let light = peak * (-squared / (2.0 * sigma * sigma)).exp();
                let pixel = &mut self.light[row * self.width + column];
                pixel.iter_mut().for_each(|channel| *channel += light);
            }
        }
    }

    fn place(&mut self) -> [f64; 2] {
        [self.width, self.height].map(|side| self.random.random_range(20.0..side as f64 - 20.0))
    }

    /// Code and reason of the picture, with noise and eight bits.
    fn reason(&mut self) -> (String, String) {
        let noise = Normal::new(0.0, 0.008).unwrap();
        let levels = self.light.iter().map(|pixel| {
            pixel.map(|light| {
                let noisy: f64 = light + noise.sample(&mut self.random);
                (255.0 * noisy.clamp(0.0, 1.0)).round() as u8
            })
        });
        let bytes: Vec<u8> = levels.collect::<Vec<_>>().concat();
        let picture = RgbImage::from_raw(self.width as u32, self.height as u32, bytes).unwrap();
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("picture.png");
        picture.save(&path).unwrap();
        reason(&path, &[])
    }
}

/// Code and reason of a picture that is not identified.
fn reason(path: &Path, options: &[&str]) -> (String, String) {
    let mut command = starpipe();
    command.args(["process", "--format", "json"]).args(options);
    let ran = Ran::new(command.arg(path));
    let report = ran.reports().remove(0);
    assert_eq!(report["status"], "not_identified", "{}", ran.stderr);
    let word = |name: &str| report[name].as_str().unwrap().to_owned();
    let text = word("reason");
    assert!(
        !text.contains("log10") && !text.contains("probab"),
        "{text}"
    );
    (word("reason_code"), text)
}

const DARK: [f64; 3] = [0.05, 0.05, 0.06];
const WHITE: [f64; 3] = [1.0; 3];
const SIZES: [(usize, usize); 2] = [(640, 480), (1100, 900)];

/// The number before a word of a text.
fn number_before(text: &str, unit: &str) -> f64 {
    let before = text.split(unit).next().unwrap();
    let digits = before.rsplit([' ', '(']).next().unwrap();
    digits.parse().unwrap_or_else(|_| panic!("{unit}: {text}"))
}

#[test]
fn a_moon_a_crescent_and_a_lamp_are_bright_discs() {
    for (width, height) in SIZES {
        let (x, y) = (0.4 * width as f64, 0.6 * height as f64);
        let radius = 0.12 * width as f64;
        let is_in = |px: f64, py: f64, shift: f64| (px - x - shift).hypot(py - y) < radius;
        let mut full = Scene::new(width, height, DARK, 1);
        full.add(WHITE, |px, py| if is_in(px, py, 0.0) { 0.7 } else { 0.0 });
        let mut crescent = Scene::new(width, height, DARK, 2);
        let lit = |px: f64, py: f64| is_in(px, py, 0.0) && !is_in(px, py, 0.6 * radius);
        crescent.add(WHITE, |px, py| if lit(px, py) { 0.7 } else { 0.0 });
        for mut scene in [full, crescent] {
            let (code, text) = scene.reason();
            assert_eq!(code, "bright_disc", "{text}");
            let diameter = number_before(&text, " px wide");
            assert!((diameter / (2.0 * radius) - 1.0).abs() < 0.1, "{text}");
        }
        let mut lamp = Scene::new(width, height, DARK, 3);
        let size = 0.03 * width as f64;
        lamp.add([1.0, 0.8, 0.4], |px, py| {
            3.0 / (1.0 + ((px - x).hypot(py - y) / size).powi(2))
        });
        assert_eq!(lamp.reason().0, "bright_disc");
    }
}

/// Arcs of this angle about a point.
fn arcs(scene: &mut Scene, [x, y]: [f64; 2], turn_deg: f64) {
    let far = scene.width as f64;
    for _ in 0..70 {
        let radius = far * scene.random.random_range(0.003_f64..1.0).sqrt();
        let start = scene.random.random_range(0.0..TAU);
        let peak = scene.random.random_range(0.05..0.4);
        let steps = (radius * turn_deg.to_radians()) as usize + 2;
        for step in 0..steps {
            let angle = start + turn_deg.to_radians() * step as f64 / (steps - 1) as f64;
            let place = [x + radius * angle.cos(), y + radius * angle.sin()];
            if place[0] > 1.0 && place[1] > 1.0 {
                scene.spot(place, peak, 1.2);
            }
        }
    }
}

#[test]
fn star_trails_tell_by_how_much_the_sky_turned() {
    for (width, height) in SIZES {
        for turn_deg in [8.0, 25.0, 50.0] {
            let mut scene = Scene::new(width, height, DARK, turn_deg as u64);
            arcs(
                &mut scene,
                [0.6 * width as f64, 0.3 * height as f64],
                turn_deg,
            );
            let (code, text) = scene.reason();
            assert_eq!(code, "star_trails", "{text}");
            let found = number_before(&text, "°");
            assert!(
                (found - turn_deg).abs() < 1.0 + 0.05 * turn_deg,
                "{turn_deg}: {text}"
            );
        }
    }
}

#[test]
fn lines_in_random_directions_are_no_star_trails() {
    for seed in 0..2 {
        let mut scene = Scene::new(640, 480, DARK, seed);
        for _ in 0..40 {
            let ([x, y], angle) = (scene.place(), scene.random.random_range(0.0..TAU));
            for step in 0..40 {
                let along = f64::from(step) - 20.0;
                let place = [x + along * angle.cos(), y + along * angle.sin()];
                if place[0] > 1.0 && place[1] > 1.0 {
                    scene.spot(place, 0.3, 1.2);
                }
            }
        }
        let (code, text) = scene.reason();
        assert!(!["star_trails", "trails"].contains(&&*code), "{text}");
    }
}

#[test]
fn stars_out_of_focus_tell_the_size_of_their_discs() {
    for ((width, height), radius) in SIZES.into_iter().zip([9.0, 24.0]) {
        let mut scene = Scene::new(width, height, DARK, 4);
        for _ in 0..14 {
            let ([x, y], peak) = (scene.place(), scene.random.random_range(0.08..0.6));
            scene.add(WHITE, |px, py| {
                if (px - x).hypot(py - y) < radius {
                    peak
                } else {
                    0.0
                }
            });
        }
        let (code, text) = scene.reason();
        assert_eq!(code, "out_of_focus", "{text}");
        let size = number_before(&text, " px;");
        assert!((size / (2.0 * radius) - 1.0).abs() < 0.15, "{text}");
    }
}

#[test]
fn a_blue_sky_is_daylight_and_green_light_is_an_aurora() {
    for (width, height) in SIZES {
        let mut day = Scene::new(width, height, [0.25, 0.45, 0.85], 5);
        day.add(WHITE, |_, y| 0.1 * y / height as f64);
        assert_eq!(day.reason().0, "daylight");
        let mut aurora = Scene::new(width, height, DARK, 6);
        aurora.add([0.25, 1.0, 0.4], |x, y| {
            let base = height as f64 * (0.6 + 0.1 * (9.0 * x / width as f64).sin());
            if y > base {
                0.0
            } else {
                0.4 * (-(base - y) / (0.2 * height as f64)).exp()
            }
        });
        assert_eq!(aurora.reason().0, "aurora");
    }
}

#[test]
fn patches_are_clouds_and_a_gradient_is_none() {
    for (width, height) in SIZES {
        let wave = |at: f64, side: usize, waves: f64| (TAU * waves * at / side as f64).sin();
        let mut clouds = Scene::new(width, height, [0.0; 3], 7);
        clouds.add(WHITE, |x, y| {
            0.2 + 0.07 * (wave(x, width, 2.2) * wave(y, height, 1.7) + wave(x + y, width, 3.1))
        });
        let (code, text) = clouds.reason();
        assert_eq!(code, "clouds", "{text}");
        let mut twilight = Scene::new(width, height, [0.0; 3], 8);
        twilight.add(WHITE, |_, y| 0.1 + 0.3 * (y / height as f64).powi(3));
        assert_ne!(twilight.reason().0, "clouds");
    }
}

#[test]
fn pictures_put_together_have_seams_and_one_has_none() {
    for (width, height) in SIZES {
        let mut scene = Scene::new(width, height, DARK, 9);
        let (right, low) = (0.5 * width as f64, 0.4 * height as f64);
        scene.add(WHITE, |x, y| match (x > right, y > low) {
            (true, true) => 0.1,
            (true, false) => 0.05,
            (false, true) => 0.03,
            (false, false) => 0.0,
        });
        for _ in 0..60 {
            let (place, peak) = (scene.place(), scene.random.random_range(0.1..0.6));
            scene.spot(place, peak, 1.2);
        }
        let (code, text) = scene.reason();
        assert_eq!(code, "mosaic", "{text}");
        assert!(text.contains("2 × 2"), "{text}");
        let mut roof = Scene::new(width, height, DARK, 10);
        roof.add(WHITE, |_, y| if y > low { 0.1 } else { 0.0 });
        assert_ne!(roof.reason().0, "mosaic");
    }
}

#[test]
fn lines_on_paper_are_a_drawing() {
    for (width, height) in SIZES {
        let mut scene = Scene::new(width, height, [0.85, 0.84, 0.8], 11);
        for line in 1..8 {
            let middle = f64::from(line) * height as f64 / 8.0;
            scene.add(WHITE, |x, y| {
                let wave = middle + 20.0 * (x / (20.0 + 5.0 * f64::from(line))).sin();
                if (y - wave).abs() < 2.0 && x > 30.0 && x < width as f64 - 30.0 {
                    -0.7
                } else {
                    0.0
                }
            });
        }
        let (code, text) = scene.reason();
        assert_eq!(code, "drawing", "{text}");
    }
}

#[test]
fn a_covered_lens_is_black_and_few_stars_are_few() {
    for (width, height) in SIZES {
        let mut cap = Scene::new(width, height, [0.02; 3], 12);
        for _ in 0..30 {
            let [x, y] = cap.place().map(|at| at as usize);
            cap.light[y * width + x] = [0.8; 3];
        }
        let (code, text) = cap.reason();
        assert_eq!(code, "black", "{text}");
        assert!(text.contains("uncover the lens"), "{text}");
        let mut few = Scene::new(width, height, DARK, 13);
        for place in [
            [100.0, 90.0],
            [500.0, 200.0],
            [320.0, 400.0],
            [220.0, 310.0],
            [600.0, 60.0],
        ] {
            few.spot(place, 0.5, 1.4);
        }
        let (code, text) = few.reason();
        assert_eq!(code, "too_few_stars", "{text}");
        assert!(text.contains("only 5 stars"), "{text}");
    }
}

#[test]
fn random_stars_show_no_cause() {
    for seed in 20..22 {
        let mut scene = Scene::new(800, 600, DARK, seed);
        for _ in 0..60 {
            let (place, peak) = (scene.place(), scene.random.random_range(0.1..0.6));
            scene.spot(place, peak, 1.3);
        }
        let (code, text) = scene.reason();
        assert_eq!(code, "no_match", "{text}");
    }
}
