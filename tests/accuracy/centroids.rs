//! Centroids against the Cramer-Rao bound, and what is stated of their errors.

use crate::stars::{Field, Star, found_at, sensor};
use crate::tally::{Rms, Spread};
use rayon::prelude::*;
use starpipe::detect::{CentroidMethod, DetectConfig, Workspace, detect};
use starpipe::sensitivity::CramerRao;

/// Ratios of signal to noise of the stars, of the matched filter.
const CLASSES: [(f64, f64); 6] = [
    (5.0, 7.0),
    (10.0, 10.0),
    (20.0, 20.0),
    (50.0, 50.0),
    (100.0, 100.0),
    (300.0, 300.0),
];
const PHASES: usize = 10;

/// What was measured of the stars of one class.
#[derive(Debug, Clone, Default)]
struct Measured {
    stars: usize,
    /// Along x and y.
    errors: [Rms; 2],
    bounds: [Rms; 2],
    /// Error over stated error: of x, y and flux.
    pulls: [Spread; 3],
    /// The mean error by place in the pixel, along x and y.
    by_phase: [[Spread; PHASES]; 2],
}

impl Measured {
    fn add(&mut self, star: &Star, field: &Field, method_sources: &starpipe::detect::Detections) {
        self.stars += 1;
        let Some(found) = found_at(method_sources, &star.place) else {
            return;
        };
        let offset = [star.place.x, star.place.y].map(|at| at - at.round());
        let sensor = &field.scenario.sensor;
        let bound = CramerRao::of_spot(
            sensor.spot_sigma_px,
            offset,
            star.flux_e,
            field.noise_e().powi(2),
        );
        let errors = [
            found.position.x - star.place.x,
            found.position.y - star.place.y,
        ];
        let sigmas = [found.sigma_x_px, found.sigma_y_px];
        for (axis, bound_px) in [bound.sigma_x_px, bound.sigma_y_px].into_iter().enumerate() {
            self.errors[axis].add(errors[axis]);
            self.bounds[axis].add(bound_px);
            self.pulls[axis].add(errors[axis] / sigmas[axis]);
            let phase = ((offset[axis] + 0.5) * PHASES as f64) as usize;
            self.by_phase[axis][phase.min(PHASES - 1)].add(errors[axis]);
        }
        let flux_e = found.flux_adu * sensor.gain_e_per_adu;
        self.pulls[2].add((flux_e - star.flux_e) / (flux_e / found.snr));
    }

    fn merge(mut self, other: &Self) -> Self {
        self.stars += other.stars;
        for axis in 0..2 {
            self.errors[axis].merge(&other.errors[axis]);
            self.bounds[axis].merge(&other.bounds[axis]);
            for phase in 0..PHASES {
                self.by_phase[axis][phase].merge(&other.by_phase[axis][phase]);
            }
        }
        for (mine, others) in self.pulls.iter_mut().zip(&other.pulls) {
            mine.merge(others);
        }
        self
    }

    /// RMS error over bound.
    fn ratio(&self, axis: usize) -> f64 {
        self.errors[axis].value() / self.bounds[axis].value()
    }

    /// The largest mean error at a place in the pixel, and its standard error.
    fn bias_px(&self) -> (f64, f64) {
        let means = self.by_phase.iter().flatten();
        means
            .map(|s| (s.mean().abs(), s.mean_error()))
            .fold((0.0, 0.0), |a, b| if b.0 > a.0 { b } else { a })
    }

    /// Root mean square of the mean errors by place, their own noise taken away.
    fn bias_rms_px(&self) -> f64 {
        let squares = self
            .by_phase
            .iter()
            .flatten()
            .map(|s| s.mean().powi(2) - s.mean_error().powi(2));
        (squares.sum::<f64>() / (2 * PHASES) as f64).max(0.0).sqrt()
    }
}

/// What is measured on `frames` frames, class by class.
fn measured(
    field: &Field,
    config: &DetectConfig,
    ranges: &[(f64, f64)],
    frames: u64,
) -> Vec<Measured> {
    let one = |workspace: &mut Workspace, seed: u64| {
        let (stars, frame) = field.frame(ranges, seed);
        let found = detect(&frame, config, workspace).unwrap();
        let mut classes = vec![Measured::default(); ranges.len()];
        for star in &stars {
            classes[star.class].add(star, field, &found);
        }
        classes
    };
    let merge = |a: Vec<Measured>, b: Vec<Measured>| -> Vec<Measured> {
        a.into_iter().zip(&b).map(|(a, b)| a.merge(b)).collect()
    };
    (0..frames)
        .into_par_iter()
        .map_init(Workspace::new, one)
        .reduce(|| vec![Measured::default(); ranges.len()], merge)
}

#[test]
#[ignore = "a minute or two of frames; prints the tables"]
fn table_of_centroids() {
    let frames: u64 = std::env::var("FRAMES").map_or(36, |f| f.parse().unwrap());
    println!(
        "sigma  SNR      stars found  rms_x px  rms/bound x, y ± error     pulls x, y, flux (mean flux) ± error    bias max ± , rms px"
    );
    for method in [CentroidMethod::GaussianFit, CentroidMethod::GreyWeighted] {
        println!("{method:?}");
        for spot_px in if std::env::var("S5").is_ok() {
            vec![0.5, 0.7]
        } else {
            vec![]
        }
        .into_iter()
        .chain([0.5, 0.7, 1.0, 1.25, 1.5])
        {
            let field = Field::new(sensor(2048, spot_px), 100.0);
            let config = DetectConfig {
                centroid: method,
                spot_sigma_px: std::env::var("SPOT").ok().map(|_| spot_px),
                ..DetectConfig::default()
            };
            for (range, m) in CLASSES
                .iter()
                .zip(measured(&field, &config, &CLASSES, frames))
            {
                let [px, py, pf] = &m.pulls;
                let bias = m.bias_px();
                println!(
                    "{spot_px:5.2} {:3.0}-{:<4.0} {:6} {:5.3}  {:.5}  {:.3} {:.3} ± {:.3}   {:.3} {:.3} {:.3} ({:+.3}) ± {:.3}   {:.4} ± {:.4} {:.4}",
                    range.0,
                    range.1,
                    m.stars,
                    m.errors[0].count() / m.stars as f64,
                    m.errors[0].value(),
                    m.ratio(0),
                    m.ratio(1),
                    m.errors[0].relative_error(),
                    px.sigma(),
                    py.sigma(),
                    pf.sigma(),
                    pf.mean(),
                    px.sigma_error(),
                    bias.0,
                    bias.1,
                    m.bias_rms_px(),
                );
            }
        }
    }
}
