//! Limiting magnitudes on frames with known truth, of the detector and of the brightest-pixel rule,
//! compared with the sensitivity model.
//!
//! The whole table: `cargo test --release --test it completeness:: -- --ignored --nocapture`.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use starpipe::base::coords::PixelPoint;
use starpipe::camera::data_sheet::{DataSheet, Imperfections, Preset, Response};
use starpipe::detect::{DetectConfig, Detection, Workspace, detect};
use starpipe::frame::Frame;
use starpipe::lab::simulate::star_field;
use starpipe::predict::{Budget, Detector, Extinction, Rule, Scenario, SkyBrightness};

/// Side of the frames, in pixels.
const SIDE_PX: usize = 1024;
/// Distance between stars: they cover a small part of a background cell. At half this distance
/// their light counts as noise, and the detector loses 0.03 to 0.09 mag.
const SPACING_PX: f64 = 64.0;
/// Stars are drawn uniformly within this range of magnitudes about the limit.
const MAG_RANGE: std::ops::Range<f64> = -1.2..2.8;
/// Bright stars on each frame, from which the detector measures the spot, and how much brighter
/// than the limit they are.
const BRIGHT_STARS: usize = 30;
const BRIGHT_MAG: (f64, f64) = (2.0, 3.5);
/// A detection within this distance of a star is that star.
const MATCH_PX: f64 = 2.0;

/// A star of a frame, and which rules detect it.
struct Trial {
    v_mag: f64,
    /// Detected at its position, as something that may be a star.
    detected: bool,
    /// A pixel reaches the wanted signal-to-noise ratio.
    peak: bool,
}

impl Trial {
    fn is_found(&self, rule: Rule) -> bool {
        match rule {
            Rule::MatchedFilter => self.detected,
            Rule::PeakPixel => self.peak,
        }
    }
}

/// Frames of isolated stars, and which of them are detected.
fn trials(scenario: &Scenario, frames: u64) -> Vec<Trial> {
    let budget = Budget::new(scenario);
    let mut workspace = Workspace::new();
    let mut all = Vec::new();
    for seed in 0..frames {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let stars = isolated_stars(scenario, &budget, &mut random);
        let frame = star_field(scenario, &stars, random.random()).unwrap();
        let found = detect(&frame, &DetectConfig::default(), &mut workspace).unwrap();
        let faint = stars.iter().skip(BRIGHT_STARS);
        all.extend(faint.map(|(position, v_mag)| {
            let near = |source: &&Detection| source.position.distance_to(position) < MATCH_PX;
            let mut near = found.sources.iter().filter(near);
            Trial {
                v_mag: *v_mag,
                detected: near.any(|source| source.flags.is_star_like()),
                peak: peak_stands_out(scenario, &budget, &frame, position),
            }
        }));
    }
    all
}

/// Stars in the cells of a grid, the bright ones first.
fn isolated_stars(
    scenario: &Scenario,
    budget: &Budget,
    random: &mut ChaCha8Rng,
) -> Vec<(PixelPoint, f64)> {
    let spacing_px = SPACING_PX + scenario.conditions.motion_px;
    let cells = (SIDE_PX as f64 / spacing_px).floor() as usize;
    let mut places: Vec<PixelPoint> = (0..cells * cells)
        .map(|cell| {
            let mut middle =
                |index: usize| (index as f64 + 0.5) * spacing_px + random.random_range(-0.5..0.5);
            PixelPoint::new(middle(cell % cells), middle(cell / cells))
        })
        .collect();
    for bright in 0..BRIGHT_STARS {
        let other = random.random_range(bright..places.len());
        places.swap(bright, other);
    }
    let v_mag = |i: usize| {
        budget.limit_vmag
            + if i < BRIGHT_STARS {
                -random.random_range(BRIGHT_MAG.0..BRIGHT_MAG.1)
            } else {
                random.random_range(MAG_RANGE)
            }
    };
    let v_mags: Vec<f64> = (0..places.len()).map(v_mag).collect();
    places.into_iter().zip(v_mags).collect()
}

/// Whether a pixel within [`MATCH_PX`] of `position` has the wanted ratio of signal to noise,
/// signal and noise as in the model's equation (11).
fn peak_stands_out(
    scenario: &Scenario,
    budget: &Budget,
    frame: &Frame,
    position: &PixelPoint,
) -> bool {
    let sheet = &scenario.camera;
    let floor_e2 = budget.background_noise_e.powi(2);
    let level_e = budget.background_e + budget.dark_e;
    let around = |at: f64| {
        let first = (at - MATCH_PX).ceil().max(0.0) as usize;
        first..=(at + MATCH_PX).floor() as usize
    };
    around(position.y)
        .flat_map(|y| around(position.x).map(move |x| (x, y)))
        .filter(|&(x, y)| PixelPoint::new(x as f64, y as f64).distance_to(position) <= MATCH_PX)
        .any(|(x, y)| {
            let level_adu = f64::from(frame.pixels.value(y * frame.width + x)) - sheet.bias_adu;
            let signal_e = level_adu * sheet.gain_e_per_adu - level_e;
            signal_e / (signal_e.max(0.0) + floor_e2).sqrt() >= scenario.conditions.snr
        })
}

/// The magnitude at which half of the stars are detected.
#[derive(Debug, Clone, Copy)]
struct Curve {
    v_mag_50: f64,
    sigma_v_mag_50: f64,
    /// Standard deviation of the flux noise, in magnitudes at the limit.
    width_mag: f64,
}

/// Fits the probability of detection Φ(a + b · flux) (a threshold on flux with Gaussian noise) by
/// maximum likelihood, with Fisher scoring.
fn fit(trials: &[Trial], limit_v_mag: f64, rule: Rule) -> Option<Curve> {
    const ROUNDS: usize = 100;
    let [mut a, mut b] = [-4.0, 4.0];
    let mut information = [[0.0; 2]; 2];
    for _ in 0..ROUNDS {
        information = [[0.0; 2]; 2];
        let mut score = [0.0; 2];
        for trial in trials {
            let flux = 10f64.powf(-0.4 * (trial.v_mag - limit_v_mag));
            let z = (a + b * flux).clamp(-7.0, 7.0);
            let (above, below) = (cumulative(z), cumulative(-z));
            let density = (-0.5 * z * z).exp() / std::f64::consts::TAU.sqrt();
            let gain = if trial.is_found(rule) {
                density / above
            } else {
                -density / below
            };
            let weight = density * density / (above * below);
            let x = [1.0, flux];
            for i in 0..2 {
                score[i] += gain * x[i];
                for j in 0..2 {
                    information[i][j] += weight * x[i] * x[j];
                }
            }
        }
        let [[aa, ab], [_, bb]] = information;
        let determinant = aa * bb - ab * ab;
        let step = [
            (bb * score[0] - ab * score[1]) / determinant,
            (aa * score[1] - ab * score[0]) / determinant,
        ];
        // Damped step, where a full one would overshoot.
        let damping = (1.0 / (step[0].abs().max(step[1].abs()))).min(1.0);
        a += damping * step[0];
        b += damping * step[1];
        if step[0].abs().max(step[1].abs()) < 1e-9 {
            break;
        }
    }
    let flux_50 = -a / b;
    if !(flux_50 > 0.0 && b > 0.0) {
        return None;
    }
    let [[aa, ab], [_, bb]] = information;
    let determinant = aa * bb - ab * ab;
    let [va, vb, vab] = [bb / determinant, aa / determinant, -ab / determinant];
    // ln(flux_50) = ln(−a) − ln(b).
    let variance = va / (a * a) + vb / (b * b) - 2.0 * vab / (a * b);
    let mag_of_relative = 2.5 / std::f64::consts::LN_10;
    Some(Curve {
        v_mag_50: limit_v_mag - 2.5 * flux_50.log10(),
        sigma_v_mag_50: mag_of_relative * variance.sqrt(),
        width_mag: mag_of_relative / (b * flux_50),
    })
}

/// Φ(z).
fn cumulative(z: f64) -> f64 {
    0.5 * libm::erfc(-z * std::f64::consts::FRAC_1_SQRT_2)
}

/// A camera with these pixels, lens and noise, under a night sky.
fn camera(
    name: &str,
    [pitch_um, focal_length_mm, f_number, spot_sigma_px]: [f64; 4],
    [read_noise_e, gain_e_per_adu, full_well_e]: [f64; 3],
) -> DataSheet {
    DataSheet {
        name: name.to_owned(),
        width_px: SIDE_PX,
        height_px: SIDE_PX,
        pitch_x_um: pitch_um,
        pitch_y_um: pitch_um,
        focal_length_mm,
        aperture_mm: focal_length_mm / f_number,
        lens_transmission: Response::Constant(0.9),
        quantum_efficiency: Response::Constant(0.7),
        band_from_nm: 400.0,
        band_to_nm: 700.0,
        read_noise_e,
        dark_current_e_s: 1.0,
        full_well_e,
        gain_e_per_adu,
        bits: 12,
        bias_adu: 100.0,
        spot_sigma_px,
        peak_share: None,
        spot_image: None,
        imperfections: Imperfections::default(),
    }
}

fn scenario(sheet: DataSheet, exposure_s: f64, sky_mag_arcsec2: f64) -> Scenario {
    let mut scenario = Scenario::new(sheet);
    scenario.conditions.exposure_s = exposure_s;
    scenario.conditions.sky = SkyBrightness::MagArcsec2(sky_mag_arcsec2);
    scenario
}

/// One of the paper's experiments, with frames of the common size.
fn experiment(preset: Preset) -> Scenario {
    let mut scenario = Scenario::of(preset);
    (scenario.camera.width_px, scenario.camera.height_px) = (SIDE_PX, SIDE_PX);
    scenario
}

fn moving(mut scenario: Scenario, motion_px: f64) -> Scenario {
    scenario.conditions.motion_px = motion_px;
    scenario
}

/// Cameras of many kinds.
fn cases() -> Vec<(&'static str, Scenario)> {
    let imx174 = || camera("35 mm f/1.4", [5.86, 35.0, 1.4, 0.7], [6.83, 8.0, 32_000.0]);
    let asi183 = camera("135 mm f/2", [2.4, 135.0, 2.0, 1.2], [2.2, 1.0, 15_000.0]);
    let nanosat = camera("16 mm f/1.2", [2.2, 16.0, 1.2, 1.5], [2.0, 1.0, 5000.0]);
    let small = camera("8 mm f/1.6", [2.2, 8.0, 1.6, 0.8], [3.0, 1.5, 5000.0]);
    let experiment_1 = || experiment(Preset::Experiment1);
    let mut space = scenario(nanosat, 0.1, 22.5);
    space.conditions.extinction = Extinction::MagPerAirmass(0.0);
    vec![
        ("experiment 1", experiment_1()),
        ("experiment 2", experiment(Preset::Experiment2)),
        ("35 mm f/1.4, 0.2 s", scenario(imx174(), 0.2, 21.0)),
        ("135 mm f/2, 0.2 s", scenario(asi183, 0.2, 21.0)),
        ("16 mm f/1.2 in space, 0.1 s", space),
        ("8 mm f/1.6, 0.1 s", scenario(small, 0.1, 21.0)),
        ("35 mm f/1.4, sky 17", scenario(imx174(), 0.2, 17.0)),
        (
            "35 mm f/1.4, 2 px",
            moving(scenario(imx174(), 0.2, 21.0), 2.0),
        ),
        ("experiment 1, 2 px", moving(experiment_1(), 2.0)),
        ("experiment 1, 5 px", moving(experiment_1(), 5.0)),
    ]
}

/// Prediction and measurement of one rule.
fn described(predicted: &Detector, measured: Option<Curve>) -> String {
    let model = predicted.vmag_at(0.5);
    let model_width =
        (predicted.vmag_at(ONE_SIGMA_BELOW) - predicted.vmag_at(1.0 - ONE_SIGMA_BELOW)) / 2.0;
    let Some(curve) = measured else {
        return format!("{model:6.3} {model_width:5.3}  not measured");
    };
    format!(
        "{model:6.3} {:6.3} ± {:.3} {:+6.3}  {model_width:5.3} {:5.3}",
        curve.v_mag_50,
        curve.sigma_v_mag_50,
        model - curve.v_mag_50,
        curve.width_mag
    )
}

/// Φ(−1).
const ONE_SIGMA_BELOW: f64 = 0.158_655;

/// Tolerance of the model, which ignores touching stars and the skewness of few photons.
const MODEL_TOLERANCE_MAG: f64 = 0.05;

#[test]
fn as_many_stars_are_found_as_the_model_says() {
    const FRAMES: u64 = 12;
    for (name, scenario) in cases()
        .into_iter()
        .filter(|(name, _)| TESTED.contains(name))
    {
        let budget = Budget::new(&scenario);
        let trials = trials(&scenario, FRAMES);
        for rule in [Rule::MatchedFilter, Rule::PeakPixel] {
            let model = Detector::new(rule, &scenario, &budget);
            let measured = fit(&trials, budget.limit_vmag, rule).unwrap();
            let difference = model.vmag_at(0.5) - measured.v_mag_50;
            let tolerance = MODEL_TOLERANCE_MAG + 3.0 * measured.sigma_v_mag_50;
            assert!(
                difference.abs() < tolerance,
                "{name}: {rule:?} {difference}"
            );
        }
    }
}

const TESTED: [&str; 3] = [
    "experiment 1",
    "16 mm f/1.2 in space, 0.1 s",
    "experiment 1, 5 px",
];

#[test]
#[ignore = "a minute of frames; prints the table"]
fn table_of_completeness() {
    const FRAMES: u64 = 100;
    println!(
        "{:<28} {:>6} {:>6}  {:<45}  {:<45}",
        "camera",
        "limit",
        "stars",
        "detector: model 50 %, measured, width",
        "brightest pixel: the same"
    );
    for (name, scenario) in cases() {
        let budget = Budget::new(&scenario);
        let limit_v_mag = budget.limit_vmag;
        let trials = trials(&scenario, FRAMES);
        let [detector, peak] = [Rule::MatchedFilter, Rule::PeakPixel].map(|rule| {
            let model = Detector::new(rule, &scenario, &budget);
            described(&model, fit(&trials, limit_v_mag, rule))
        });
        let count = trials.len();
        println!("{name:<28} {limit_v_mag:6.3} {count:6}  {detector}  {peak}");
    }
}
