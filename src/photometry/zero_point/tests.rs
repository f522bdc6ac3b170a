//! Tests of the zero point.

use super::*;
use crate::base::statistics::{Estimate, mean_and_squares};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

/// The parameters of simulated stars.
#[derive(Clone, Copy)]
struct Stars {
    count: usize,
    zero_point: f64,
    color_term: f64,
    linearity: f64,
    scatter: f64,
    outliers: f64,
    /// Magnitudes lost in the corner.
    corner_loss: f64,
}

const TYPICAL: Stars = Stars {
    count: 40,
    zero_point: 16.5,
    color_term: 0.0,
    linearity: 1.0,
    scatter: 0.08,
    outliers: 0.0,
    corner_loss: 0.0,
};

impl Stars {
    fn draw(&self, seed: u64) -> Vec<StandardStar> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut places = ChaCha8Rng::seed_from_u64(!seed);
        let normal = Normal::new(0.0, 1.0).unwrap();
        let mut star = || {
            let v_mag = random.random_range(4.0..8.0);
            let bv_mag = random.random_range(-0.1..1.7);
            let sigma_mag = 0.12 * 10_f64.powf(0.2 * (v_mag - 8.0));
            let off = if random.random_bool(self.outliers) {
                random.random_range(0.3..1.5)
            } else {
                sigma_mag.hypot(self.scatter) * normal.sample(&mut random)
            };
            let off_centre_sq: f64 = places.random_range(0.0..1.0);
            let loss = self.corner_loss * off_centre_sq;
            let color = self.color_term * (bv_mag - REFERENCE_BV_MAG);
            StandardStar {
                v_mag,
                bv_mag: Some(bv_mag),
                instrumental_mag: 6.0 + self.linearity * (v_mag - 6.0) - self.zero_point - color
                    + loss
                    + off,
                sigma_mag,
                off_centre_sq,
            }
        };
        (0..self.count).map(|_| star()).collect()
    }

    fn zero_points(&self, frames: u64) -> Vec<ZeroPoint> {
        let zero_point = |seed| measure(&self.draw(seed)).unwrap();
        (0..frames).map(zero_point).collect()
    }
}

/// Mean and standard deviation.
fn mean_and_spread(values: &[f64]) -> (f64, f64) {
    let (mean, squares) = mean_and_squares(values);
    (mean, (squares / values.len() as f64).sqrt())
}

#[test]
fn the_zero_point_is_found_within_its_standard_error() {
    for count in [8, 12, 40, 200] {
        let found = Stars { count, ..TYPICAL }.zero_points(600);
        let pulls: Vec<f64> = found
            .iter()
            .map(|zero| (zero.v_mag - TYPICAL.zero_point) / zero.sigma_mag)
            .collect();
        let (mean, spread) = mean_and_spread(&pulls);
        println!("{count} stars: pulls {mean:+.3} ± {spread:.3}");
        assert!(
            mean.abs() < 0.12 && (spread - 1.0).abs() < 0.12,
            "{mean} {spread}"
        );
    }
}

#[test]
fn outliers_on_one_side_hardly_move_the_zero_point() {
    let stars = Stars {
        outliers: 0.15,
        ..TYPICAL
    };
    let found = stars.zero_points(200);
    let off: Vec<f64> = found
        .iter()
        .map(|zero| zero.v_mag - stars.zero_point)
        .collect();
    let (mean, spread) = mean_and_spread(&off);
    println!("zero point off by {mean:+.4} ± {spread:.4}");
    // Their mean alone is off by 0.15 × 0.9 = 0.135.
    assert!(mean.abs() < 0.04 && spread < 0.04, "{mean} {spread}");
}

#[test]
fn terms_are_not_kept_where_chance_alone_makes_them() {
    const FRAMES: u64 = 3000;
    for count in [15, 20, 60] {
        let found = Stars { count, ..TYPICAL }.zero_points(FRAMES);
        let colored = found
            .iter()
            .filter(|zero| zero.color_term.is_some())
            .count();
        let sloping = found.iter().filter(|zero| zero.is_nonlinear).count();
        let vignetted = found.iter().filter(|zero| zero.corner_loss_mag.is_some());
        let vignetted = vignetted.count();
        println!("{count} stars: {colored} color terms, {sloping} slopes in {FRAMES} frames");
        // The median absolute deviation of few stars is uncertain, which raises the rates.
        assert!(colored as f64 <= 0.025 * FRAMES as f64, "{colored}");
        assert!(vignetted as f64 <= 0.045 * FRAMES as f64, "{vignetted}");
        assert!(sloping as f64 <= 0.006 * FRAMES as f64, "{sloping}");
    }
}

#[test]
fn a_color_term_that_is_real_is_kept_and_makes_zero_points_comparable() {
    let stars = Stars {
        count: 60,
        color_term: 0.25,
        ..TYPICAL
    };
    let found = stars.zero_points(200);
    let kept: Vec<_> = found
        .iter()
        .filter_map(|zero| Some((zero, zero.color_term?)))
        .collect();
    assert!(kept.len() >= 198, "{}", kept.len());
    let pulls = |value: &dyn Fn(&(&ZeroPoint, Estimate)) -> f64| {
        mean_and_spread(&kept.iter().map(value).collect::<Vec<f64>>())
    };
    let color = pulls(&|(_, term)| (term.value - stars.color_term) / term.sigma);
    let zero = pulls(&|(zero, _)| (zero.v_mag - stars.zero_point) / zero.sigma_mag);
    for (mean, spread) in [color, zero] {
        assert!(
            mean.abs() < 0.3 && (spread - 1.0).abs() < 0.2,
            "{mean} {spread}"
        );
    }
    assert!(
        kept.iter()
            .all(|(zero, _)| zero.bv_mag == Some(REFERENCE_BV_MAG))
    );
}

#[test]
fn a_tone_curve_is_detected() {
    let stars = Stars {
        linearity: 0.45,
        ..TYPICAL
    };
    let found = measure(&stars.draw(1)).unwrap();
    let linearity = found.linearity.unwrap();
    assert!(found.is_nonlinear);
    assert!(
        (linearity.value - 0.45).abs() < 4.0 * linearity.sigma,
        "{found:?}"
    );
    // The tone curve does not count as scatter.
    assert!(found.scatter_mag < 2.0 * TYPICAL.scatter, "{found:?}");
}

#[test]
fn stars_of_unknown_color_still_make_a_zero_point_and_few_stars_none() {
    let mut stars = TYPICAL.draw(5);
    stars.iter_mut().for_each(|star| star.bv_mag = None);
    let found = measure(&stars).unwrap();
    assert_eq!(
        (found.bv_mag, found.color_term, found.stars),
        (None, None, 40)
    );
    assert_eq!(measure(&stars[..MIN_STARS - 1]), None);
    let same = vec![stars[0]; MIN_STARS];
    assert!(measure(&same).is_some_and(|zero| zero.sigma_mag.is_finite()));
}

#[test]
fn vignetting_is_measured_and_the_zero_point_is_that_of_the_centre() {
    let stars = Stars {
        count: 80,
        corner_loss: 0.6,
        ..TYPICAL
    };
    let found = stars.zero_points(200);
    let pulls = |value: &dyn Fn(&ZeroPoint) -> f64| {
        mean_and_spread(&found.iter().map(value).collect::<Vec<f64>>())
    };
    let loss = pulls(&|zero| {
        let loss = zero.corner_loss_mag.unwrap();
        (loss.value - stars.corner_loss) / loss.sigma
    });
    let zero = pulls(&|zero| (zero.v_mag - stars.zero_point) / zero.sigma_mag);
    println!("pulls of the loss {loss:?}, of the zero point {zero:?}");
    for (mean, spread) in [loss, zero] {
        assert!(mean.abs() < 0.3 && (spread - 1.0).abs() < 0.2);
    }
}
