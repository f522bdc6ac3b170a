//! Least squares: the lens of one kind that is most like one of another kind.

use crate::CameraModel;
use crate::base::coords::{Camera, PixelPoint, UnitVector};
use crate::camera::{Distortion, DistortionModel, Projection};
use nalgebra::Vector3;

/// Points along each side of the frame at which lenses are fitted.
pub(super) const FIT_POINTS: usize = 25;
/// Points along each side at which the largest error is looked for.
pub(super) const CHECK_POINTS: usize = 49;

/// A direction and the pixel on which it is imaged.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    /// In the axes of the lens: z along its axis.
    pub direction: Vector3<f64>,
    pub pixel: [f64; 2],
}

/// What the camera sees at `points` × `points` places of the frame, its borders among them.
pub(super) fn samples(camera: &CameraModel, points: usize) -> Vec<Sample> {
    let to_lens = camera.lens_axes();
    grid(camera.width_px, camera.height_px, points)
        .filter_map(|pixel| {
            let direction = camera.direction_of(&PixelPoint::new(pixel[0], pixel[1]))?;
            Some(Sample {
                direction: to_lens * direction.as_vector(),
                pixel,
            })
        })
        .collect()
}

/// `points` × `points` pixels from border to border, closer together at the borders, where errors of
/// polynomials are largest.
pub(super) fn grid(width_px: f64, height_px: f64, points: usize) -> impl Iterator<Item = [f64; 2]> {
    let node = move |i: usize| {
        let turn = std::f64::consts::PI * i as f64 / (points - 1) as f64;
        0.5 - 0.5 * libm::cos(turn)
    };
    (0..points * points).map(move |i| {
        [
            node(i % points) * width_px - 0.5,
            node(i / points) * height_px - 0.5,
        ]
    })
}

/// The parameters near `start` for which the squares of `residuals` have the least sum.
///
/// `residuals` adds its numbers to an empty list, and says whether the parameters are possible. The
/// derivatives are taken over `steps`. `None` if there are fewer residuals than parameters. Method of Levenberg and Marquardt, without any function whose bits
/// differ between machines.
pub(super) fn least_squares(
    start: &[f64],
    steps: &[f64],
    residuals: impl Fn(&[f64], &mut Vec<f64>) -> bool,
) -> Option<Vec<f64>> {
    const MAX_STEPS: usize = 60;
    const CONVERGED: f64 = 1e-10;
    let cost_of = |parameters: &[f64]| {
        let mut found = Vec::new();
        let possible = residuals(parameters, &mut found);
        let cost: f64 = found.iter().map(|r| r * r).sum();
        (possible && cost.is_finite()).then_some((cost, found))
    };
    let mut parameters = start.to_vec();
    let (mut cost, mut found) = cost_of(&parameters)?;
    if found.len() < parameters.len() {
        return None;
    }
    let mut damping = 1e-9;
    for _ in 0..MAX_STEPS {
        let (matrix, slope) = normal_equations(&parameters, steps, &found, &residuals)?;
        let mut better = None;
        while better.is_none() && damping < 1e6 {
            if let Some(step) = solve(&matrix, &slope, damping) {
                let next: Vec<f64> = parameters.iter().zip(&step).map(|(p, s)| p - s).collect();
                better = cost_of(&next)
                    .filter(|(next_cost, _)| *next_cost < cost)
                    .map(|(next_cost, found)| (next, next_cost, found));
            }
            damping *= if better.is_some() { 0.1 } else { 10.0 };
        }
        damping = damping.max(1e-15);
        let Some((next, next_cost, next_found)) = better else {
            break;
        };
        let gained = cost - next_cost;
        (parameters, cost, found) = (next, next_cost, next_found);
        if gained <= CONVERGED * cost {
            break;
        }
    }
    Some(parameters)
}

/// The matrix and the right side of the equations of a step.
fn normal_equations(
    parameters: &[f64],
    steps: &[f64],
    found: &[f64],
    residuals: &impl Fn(&[f64], &mut Vec<f64>) -> bool,
) -> Option<(Vec<Vec<f64>>, Vec<f64>)> {
    let there = |index: usize, by: f64| {
        let mut moved = parameters.to_vec();
        moved[index] += by;
        let mut residual = Vec::with_capacity(found.len());
        residuals(&moved, &mut residual).then_some(residual)
    };
    let mut columns = Vec::with_capacity(steps.len());
    for (index, step) in steps.iter().enumerate() {
        let (low, high) = (there(index, -step)?, there(index, *step)?);
        let column = low.iter().zip(&high).map(|(l, h)| (h - l) / (2.0 * step));
        columns.push(column.collect::<Vec<f64>>());
    }
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let row = |a: &Vec<f64>| columns.iter().map(|b| product(a, b)).collect();
    let matrix = columns.iter().map(row).collect();
    let slope = columns.iter().map(|a| product(a, found)).collect();
    Some((matrix, slope))
}

/// Solves `matrix` · x = `right` by Cholesky's method, with `damping` added to the diagonal after all
/// columns have been given the length 1.
fn solve(matrix: &[Vec<f64>], right: &[f64], damping: f64) -> Option<Vec<f64>> {
    let size = right.len();
    let length = |i: usize| matrix[i][i].sqrt().max(f64::MIN_POSITIVE);
    let lengths: Vec<f64> = (0..size).map(length).collect();
    let mut factor = vec![vec![0.0; size]; size];
    let mut solved = vec![0.0; size];
    for i in 0..size {
        for j in 0..=i {
            let known: f64 = (0..j).map(|k| factor[i][k] * factor[j][k]).sum();
            let scaled = matrix[i][j] / (lengths[i] * lengths[j]);
            if i == j {
                let left = scaled + damping - known;
                if left.is_nan() || left <= 0.0 {
                    return None;
                }
                factor[i][i] = left.sqrt();
            } else {
                factor[i][j] = (scaled - known) / factor[j][j];
            }
        }
        let known: f64 = (0..i).map(|k| factor[i][k] * solved[k]).sum();
        solved[i] = (right[i] / lengths[i] - known) / factor[i][i];
    }
    for i in (0..size).rev() {
        let known: f64 = (i + 1..size).map(|k| factor[k][i] * solved[k]).sum();
        solved[i] = (solved[i] - known) / factor[i][i];
    }
    Some(solved.iter().zip(&lengths).map(|(s, l)| s / l).collect())
}

/// The largest distance in pixels between `samples` and what `image` makes of their directions;
/// infinite where it makes nothing.
pub(super) fn largest_error_px(
    samples: &[Sample],
    image: impl Fn(&Vector3<f64>) -> Option<[f64; 2]>,
) -> f64 {
    let error = |sample: &Sample| {
        image(&sample.direction).map_or(f64::INFINITY, |[x, y]| {
            libm::hypot(x - sample.pixel[0], y - sample.pixel[1])
        })
    };
    samples.iter().map(error).fold(0.0, f64::max)
}

/// A lens to be fitted: its kind, and its first guess.
#[derive(Debug, Clone, Copy)]
pub(super) struct Guess {
    /// Width, height, whether it is mirrored, focal length, and the angle to which it is valid.
    pub camera: CameraModel,
    /// The axis, as an offset from the frame's centre along the camera's axes.
    pub axis_px: [f64; 2],
    /// The stretch.
    pub stretch_px: f64,
}

/// The camera of one of `kinds` that images `fitted` best, and its largest error at `checked`. The first
/// kind with an error far below `tolerance_px` is taken, or that with the least error.
pub(super) fn camera_like(
    guess: &Guess,
    [fitted, checked]: [&[Sample]; 2],
    kinds: &[(Projection, DistortionModel)],
    tolerance_px: f64,
) -> Option<(CameraModel, f64)> {
    let mut best: Option<(CameraModel, f64)> = None;
    for (projection, model) in kinds {
        let Some(camera) = fit_camera(guess, fitted, *projection, *model) else {
            continue;
        };
        let error_px = largest_error_px(checked, |direction| image_in_lens(&camera, direction));
        if best
            .as_ref()
            .is_none_or(|(_, least_px)| error_px < *least_px)
        {
            best = Some((camera, error_px));
        }
        if error_px < 0.1 * tolerance_px {
            break;
        }
    }
    best
}

fn fit_camera(
    guess: &Guess,
    fitted: &[Sample],
    projection: Projection,
    model: DistortionModel,
) -> Option<CameraModel> {
    let max_angle_rad = guess.camera.max_angle_rad();
    let empty = guess.camera.with_projection(projection);
    let (focal_px, radius_px) = (empty.focal_length_px(), empty.radius_px());
    let camera_of = |parameters: &[f64]| {
        let distortion = Distortion::new(model, radius_px, &parameters[1..]);
        let camera = empty.with_focal_length(focal_px * parameters[0]);
        camera.with_distortion(Some(distortion))
    };
    let mut start = vec![0.0; 1 + model.terms()];
    start[0] = 1.0;
    if model >= DistortionModel::Stretched {
        (start[4], start[5], start[8]) = (guess.axis_px[0], guess.axis_px[1], guess.stretch_px);
    }
    let mut steps = vec![1e-2; start.len()];
    steps[0] = 1e-6;
    let fitted = least_squares(&start, &steps, |parameters, residuals| {
        let camera = camera_of(parameters);
        fitted.iter().all(|sample| {
            let image = image_in_lens(&camera, &sample.direction);
            image.is_some_and(|[x, y]| {
                residuals.extend([x - sample.pixel[0], y - sample.pixel[1]]);
                true
            })
        })
    })?;
    Some(camera_of(&fitted).limited_to(max_angle_rad))
}

/// The pixel of a direction in the axes of the lens.
pub(super) fn image_in_lens(camera: &CameraModel, direction: &Vector3<f64>) -> Option<[f64; 2]> {
    let direction = UnitVector::<Camera>::from_unit(*direction);
    let at = camera.projection().image_of(&direction)?;
    let ideal = at.map(|along| along * camera.focal_length_px());
    let offset = match camera.distortion() {
        Some(distortion) => distortion.apply(ideal)?,
        None => ideal,
    };
    let pixel = camera.pixel_at(offset);
    Some([pixel.x, pixel.y])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_nearly_singular_problem_is_solved() {
        // The coefficients of a polynomial of the fifth order, from 30 of its values.
        let wanted = [1.0, -2.0, 0.5, 0.25, -0.125, 3.0];
        let value = |c: &[f64], x: f64| c.iter().rev().fold(0.0, |sum, c| sum * x + c);
        let found = least_squares(&[0.0; 6], &[1e-3; 6], |parameters, residuals| {
            residuals.extend((0..30).map(|i| {
                let x = f64::from(i) / 30.0;
                value(parameters, x) - value(&wanted, x)
            }));
            true
        });
        for (found, wanted) in found.unwrap().iter().zip(wanted) {
            assert!((found - wanted).abs() < 1e-6, "{found} {wanted}");
        }
    }

    #[test]
    fn a_camera_is_fitted_with_another_projection() {
        let camera = CameraModel::pinhole(640.0, 480.0, 900.0, false);
        let seen = samples(&camera, FIT_POINTS);
        let guess = Guess {
            camera,
            axis_px: [0.0; 2],
            stretch_px: 0.0,
        };
        let kinds = [(Projection::Stereographic, DistortionModel::Radial7)];
        let (_, error_px) = camera_like(&guess, [&seen, &seen], &kinds, 0.0).unwrap();
        assert!(error_px < 1e-4, "{error_px}");
    }
}
