//! Time of identification, over simulated fields of 2° to 40° and frames on the command line:
//! `cargo run --release --example identify_speed -- [FIELDS] [FRAME ...]`
//!
//! Each field is identified with nothing known, and with its scale known to a factor of two. The
//! shortest of several times counts, so that other load on the machine does not: of five, or of the
//! number in the variable REPEATS.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use starpipe::camera::CameraModel;
use starpipe::catalog::Catalog;
use starpipe::detect::{self, DetectConfig, detect};
use starpipe::ephemeris::places::StarPlaces;
use starpipe::identify::{
    Identification, IndexedCatalog, Priors, ScalePrior, StarField, Workspace,
};
use starpipe::lab::robustness::{Answer, SimulatedCentroids, TrialProtocol};
use starpipe::solve::star_field;
use std::error::Error;
use std::f64::consts::SQRT_2;
use std::time::Instant;

const FIELDS: u64 = 500;
const FOV_DEG: (f64, f64) = (2.0, 40.0);
/// Default number of repetitions.
const REPEATS: usize = 5;

/// Milliseconds of each field, and the outcomes.
struct Times {
    workspace: Workspace,
    repeats: usize,
    least_ms: Vec<f64>,
    right: usize,
    wrong: usize,
}

impl Times {
    fn new() -> Self {
        let asked = std::env::var("REPEATS").ok();
        Self {
            workspace: Workspace::new(),
            repeats: asked.and_then(|text| text.parse().ok()).unwrap_or(REPEATS),
            least_ms: Vec::new(),
            right: 0,
            wrong: 0,
        }
    }

    fn add(
        &mut self,
        field: &StarField,
        priors: &Priors,
        indexed: &IndexedCatalog,
    ) -> Option<Identification> {
        let mut least_ms = f64::MAX;
        let mut found = None;
        for _ in 0..self.repeats.max(1) {
            let start = Instant::now();
            let answer = self.workspace.identify(field, priors, indexed);
            least_ms = least_ms.min(start.elapsed().as_secs_f64() * 1e3);
            found = answer.ok().cloned();
        }
        self.least_ms.push(least_ms);
        found
    }

    fn judge(&mut self, answer: Answer) {
        self.right += usize::from(answer == Answer::Right);
        self.wrong += usize::from(answer == Answer::Wrong);
    }

    fn print(mut self, name: &str) {
        self.least_ms.sort_by(f64::total_cmp);
        let count = self.least_ms.len();
        let at = |share: f64| self.least_ms[(share * (count - 1) as f64).round() as usize];
        println!(
            "{name:16} {count:4} fields: {:4} right, {} wrong; median {:7.3} ms, 90 % {:7.3}, 99 % {:7.3}, worst {:7.3}",
            self.right,
            self.wrong,
            at(0.5),
            at(0.9),
            at(0.99),
            at(1.0)
        );
    }
}

/// A prior of the scale of `camera` with a total range of a factor of two.
fn factor_of_two(camera: &CameraModel) -> Priors {
    let scale_rad = 1.0 / camera.focal_length_px();
    Priors {
        scale: Some(ScalePrior::between(scale_rad / SQRT_2, scale_rad * SQRT_2)),
        ..Priors::default()
    }
}

/// Fields of view, uniform in the logarithm.
fn simulated(fields: u64, indexed: &IndexedCatalog) {
    if fields == 0 {
        return;
    }
    let (mut nothing, mut factor) = (Times::new(), Times::new());
    for number in 0..fields {
        let place = (number as f64 + 0.5) / fields as f64;
        let fov_deg = FOV_DEG.0 * (FOV_DEG.1 / FOV_DEG.0).powf(place);
        let protocol = TrialProtocol {
            fov_deg,
            ..TrialProtocol::default()
        };
        let mut random = ChaCha8Rng::seed_from_u64(number);
        let drawn = SimulatedCentroids::draw(&protocol, indexed, &mut random);
        let field = drawn.list.star_field(StarPlaces::default());
        for (times, priors) in [
            (&mut nothing, Priors::default()),
            (&mut factor, factor_of_two(&drawn.camera)),
        ] {
            if let Some(found) = times.add(&field, &priors, indexed) {
                times.judge(Answer::of(&found, &drawn.camera, &drawn.icrs_to_camera));
            }
        }
    }
    nothing.print("nothing known");
    factor.print("factor of two");
}

/// An identification with nothing known must be repeatable; it also gives the scale.
fn real(frames: &[String], indexed: &IndexedCatalog) -> Result<(), Box<dyn Error>> {
    for path in frames {
        let frame = starpipe::frame::read(path)?;
        let detections = detect(
            &frame,
            &DetectConfig::default(),
            &mut detect::Workspace::new(),
        )?;
        let field = star_field(&frame, &detections, StarPlaces::default());
        let mut nothing = Times::new();
        let found = nothing.add(&field, &Priors::default(), indexed);
        println!("{path}: {} stars", field.stars.len());
        if let Some(found) = found {
            let truth = (&found.camera, &found.icrs_to_camera);
            nothing.judge(Answer::of(&found, truth.0, truth.1));
            let mut factor = Times::new();
            let priors = factor_of_two(&found.camera);
            if let Some(again) = factor.add(&field, &priors, indexed) {
                factor.judge(Answer::of(&again, truth.0, truth.1));
            }
            nothing.print("nothing known");
            factor.print("factor of two");
        } else {
            nothing.print("nothing known");
        }
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments: Vec<String> = std::env::args().skip(1).collect();
    let fields = match arguments.first().map(|first| first.parse()) {
        Some(Ok(fields)) => {
            arguments.remove(0);
            fields
        }
        _ => FIELDS,
    };
    let indexed = IndexedCatalog::build(Catalog::built_in(), &|_| {});
    simulated(fields, &indexed);
    real(&arguments, &indexed)
}
