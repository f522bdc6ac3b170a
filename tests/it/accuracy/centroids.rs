//! Centroids compared with the Cramér-Rao bound, and their stated errors.

use super::stars::{Field, Star, data_sheet, found_at};
use super::tally::{Rms, Spread};
use rayon::prelude::*;
use starpipe::detect::{CentroidMethod, DetectConfig, Detections, Workspace, detect};
use starpipe::predict::CramerRao;

/// Matched-filter signal-to-noise ratios of the stars.
pub const CLASSES: [(f64, f64); 6] = [
    (5.0, 7.0),
    (10.0, 10.0),
    (20.0, 20.0),
    (50.0, 50.0),
    (100.0, 100.0),
    (300.0, 300.0),
];
const PHASES: usize = 10;

/// Distance of a star from the centre of its pixel.
fn offset_px(star: &Star) -> [f64; 2] {
    [star.place.x, star.place.y].map(|at| at - at.round())
}

pub fn bound(field: &Field, star: &Star) -> CramerRao {
    let spot_sigma_px = field.scenario.camera.spot_sigma_px;
    CramerRao::of_spot(
        spot_sigma_px,
        offset_px(star),
        star.flux_e,
        field.pixel_noise_e().powi(2),
    )
}

/// Measurements of the stars of one class.
#[derive(Debug, Clone, Default)]
struct Measured {
    stars: usize,
    /// Along x and y.
    errors: [Rms; 2],
    bounds: [Rms; 2],
    /// Error over stated error: of x, y and flux.
    pulls: [Spread; 3],
    /// Mean error by position in the pixel, along x and y.
    by_phase: [[Spread; PHASES]; 2],
}

impl Measured {
    fn add(&mut self, star: &Star, field: &Field, detections: &Detections) {
        self.stars += 1;
        let Some(found) = found_at(detections, &star.place) else {
            return;
        };
        let offset = [star.place.x, star.place.y].map(|at| at - at.round());
        let sheet = &field.scenario.camera;
        let bound = CramerRao::of_spot(
            sheet.spot_sigma_px,
            offset,
            star.flux_e,
            field.pixel_noise_e().powi(2),
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
        let flux_e = found.flux_adu * field.scenario.camera.gain_e_per_adu;
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

    /// Root mean square of the mean errors by position, corrected for their noise.
    fn bias_rms_px(&self) -> f64 {
        let squares = self
            .by_phase
            .iter()
            .flatten()
            .map(|s| s.mean().powi(2) - s.mean_error().powi(2));
        (squares.sum::<f64>() / (2 * PHASES) as f64).max(0.0).sqrt()
    }
}

/// Measurements on `frames` frames, class by class.
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

/// Frames of the table, for a relative error of a hundredth in each class.
const FRAMES: u64 = 36;

#[test]
#[ignore = "minutes of frames; prints the tables"]
fn table_of_centroids() {
    println!(
        "sigma  SNR        stars  found  rms x px  rms/bound x, y ±      pulls x, y, flux (mean flux) ±     bias by place, rms px"
    );
    for method in [CentroidMethod::GaussianFit, CentroidMethod::GreyWeighted] {
        println!("{method:?}");
        for spot_px in [0.5, 0.7, 1.0, 1.25, 1.5] {
            let field = Field::new(data_sheet(2048, spot_px), 100.0);
            let mut config = DetectConfig::default();
            config.centroid = method;
            for ((from, to), m) in CLASSES
                .iter()
                .zip(measured(&field, &config, &CLASSES, FRAMES))
            {
                let [x, y, flux] = &m.pulls;
                let found = m.errors[0].count() / m.stars as f64;
                println!(
                    "{spot_px:5.2}  {from:3.0}-{to:<4.0} {:7}  {found:.3}  {:.5}   {:.3} {:.3} ± {:.3}   {:.3} {:.3} {:.3} ({:+.3}) ± {:.3}   {:.4}",
                    m.stars,
                    m.errors[0].value(),
                    m.ratio(0),
                    m.ratio(1),
                    m.errors[0].relative_error(),
                    x.sigma(),
                    y.sigma(),
                    flux.sigma(),
                    flux.mean(),
                    x.sigma_error(),
                    m.bias_rms_px(),
                );
            }
        }
    }
}

#[test]
fn centroids_reach_the_bound_and_state_their_errors() {
    const CLASSES: [(f64, f64); 4] = [(5.0, 7.0), (10.0, 10.0), (30.0, 30.0), (200.0, 200.0)];
    /// Tolerances: RMS over bound of faint stars and of others; the pulls' departure from 1; the
    /// bias.
    const MAX: [f64; 2] = [1.20, 1.05];
    const PULL_TOLERANCE: f64 = 0.05;
    const MAX_BIAS_PX: f64 = 0.002;
    /// For about thirty comparisons with 2 x 450 errors each: one exceeds it in 1 of 300 runs.
    const SIGMAS: f64 = 3.5;
    for spot_px in [0.5, 0.8, 1.5] {
        let field = Field::new(data_sheet(1024, spot_px), 100.0);
        let all = measured(&field, &DetectConfig::default(), &CLASSES, 8);
        for (class, m) in all.iter().enumerate() {
            let chance = SIGMAS * m.errors[0].relative_error();
            let most = MAX[usize::from(class > 0)] + chance;
            let name = format!("{spot_px} px, SNR {:?}", CLASSES[class]);
            assert!(m.ratio(0) < most && m.ratio(1) < most, "{name}: {m:?}");
            // Faint stars are detected where noise made them brighter, and their errors are stated
            // for that flux.
            for pull in m.pulls.iter().filter(|_| class > 0) {
                let off = (pull.sigma() - 1.0).abs();
                assert!(off < PULL_TOLERANCE + chance, "{name}: {pull:?}");
            }
        }
        let brightest = &all[CLASSES.len() - 1];
        assert!(
            brightest.bias_rms_px() < MAX_BIAS_PX,
            "{spot_px}: {brightest:?}"
        );
    }
}
