//! Least squares: the lens of one kind that is most like one of another kind.

use crate::CameraModel;
use crate::base::coords::{Camera, PixelPoint, UnitVector};
use crate::base::least_squares::levenberg_marquardt;
use crate::camera::{Distortion, DistortionModel, Projection};
use nalgebra::Vector3;

/// Points along each side of the frame at which lenses are fitted.
pub(super) const FIT_POINTS: usize = 25;
/// Points along each side at which the largest error is looked for.
pub(super) const CHECK_POINTS: usize = 49;

/// A direction and the pixel on which it is imaged.
#[derive(Debug, Clone, Copy)]
pub(super) struct LensSample {
    /// In the axes of the lens: z along its axis.
    pub direction: Vector3<f64>,
    pub pixel: [f64; 2],
}

/// What the camera sees at `points` × `points` places of the frame, its borders among them.
pub(super) fn samples(camera: &CameraModel, points: usize) -> Vec<LensSample> {
    let to_lens = camera.lens_axes();
    grid(camera.width_px, camera.height_px, points)
        .filter_map(|pixel| {
            let direction = camera.direction_of(&PixelPoint::new(pixel[0], pixel[1]))?;
            Some(LensSample {
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

/// The largest distance in pixels between `samples` and what `image` makes of their directions;
/// infinite where it makes nothing.
pub(super) fn largest_error_px(
    samples: &[LensSample],
    image: impl Fn(&Vector3<f64>) -> Option<[f64; 2]>,
) -> f64 {
    let error = |sample: &LensSample| {
        image(&sample.direction).map_or(f64::INFINITY, |[x, y]| {
            libm::hypot(x - sample.pixel[0], y - sample.pixel[1])
        })
    };
    samples.iter().map(error).fold(0.0, f64::max)
}

/// A lens to be fitted: its kind, and its first guess.
#[derive(Debug, Clone, Copy)]
pub(super) struct LensGuess {
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
    guess: &LensGuess,
    [fitted, checked]: [&[LensSample]; 2],
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
    guess: &LensGuess,
    fitted: &[LensSample],
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
    let fitted = levenberg_marquardt(&start, &steps, |parameters, residuals| {
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
    fn a_camera_is_fitted_with_another_projection() {
        let camera = CameraModel::pinhole(640.0, 480.0, 900.0, false);
        let seen = samples(&camera, FIT_POINTS);
        let guess = LensGuess {
            camera,
            axis_px: [0.0; 2],
            stretch_px: 0.0,
        };
        let kinds = [(Projection::Stereographic, DistortionModel::Radial7)];
        let (_, error_px) = camera_like(&guess, [&seen, &seen], &kinds, 0.0).unwrap();
        assert!(error_px < 1e-4, "{error_px}");
    }
}
