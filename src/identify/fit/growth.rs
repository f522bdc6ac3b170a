//! A lens that is known in a part of the frame is followed outwards, over all of it.
//!
//! named stars of a window → fit of a lens → stars a step farther out → fit → … as far as there are
//! stars
//!
//! The parameters of the lens have errors, so the error of each predicted place is known. Only stars
//! that are predicted so well that chance seldom puts a detection there are paired, and only a step
//! beyond those that agree: a lens that is wrong out there finds chance pairs and follows them.

use super::adjustment::{
    Adjustment, MeasuredStar, POSE_PARAMETERS, PositionPredictor, PredictedPosition,
};
use super::lens_choice::with_projection;
use crate::base::coords::{Camera, Icrs, PixelPoint, Rotation, UnitVector};
use crate::base::least_squares::huber_sigma;
use crate::base::neighbors::PointGrid;
use crate::base::statistics::{log10_binomial_tail, median};
use crate::base::units::RAD_PER_DEG;
use crate::camera::{CameraModel, DistortionModel, Projection};
use crate::identify::field::{Photometry, StarField};
use crate::identify::hypothesis::{Hypothesis, Problem};
use crate::identify::identification::MIN_STARS;
use crate::identify::predict::{PredictedStar, PredictionDepth, Surroundings};
use nalgebra::{Matrix3, SMatrix, SVector};
use std::f64::consts::PI;

/// The lens that is followed: all terms that real lenses have.
const MODEL: DistortionModel = DistortionModel::BrownConrady;
const PARAMETERS: usize = POSE_PARAMETERS + MODEL.terms();
/// Angle from the axis up to which stars are looked for, in radians: somewhat more than a hemisphere.
const MAX_ANGLE_RAD: f64 = 100.0 * RAD_PER_DEG;
/// Catalogue stars that are looked for, the brightest.
const MAX_PREDICTED: usize = 2000;
/// Probability at which chance puts a detection where a star is looked for.
const MAX_CHANCE: f64 = 0.1;
/// Radius within which stars are looked for, in predicted errors, and at least in pixels.
const RADIUS_SIGMAS: f64 = 3.0;
const MIN_RADIUS_PX: f64 = 1.5;
/// Largest such radius, in diagonals of the frame.
const MAX_RADIUS_FRACTION: f64 = 0.005;
/// Smallest error of a star's place, in pixels, while the lens is not known well.
const MIN_SIGMA_PX: f64 = 0.3;
/// How far beyond the stars that agree others are looked for, in radians.
const STEP_RAD: f64 = 6.0 * RAD_PER_DEG;
/// Rounds without a step outwards after which there is none.
const MAX_STALLED: usize = 3;
/// Fits of the stars of the seed in which outliers lose weight.
const ROBUST_ROUNDS: usize = 3;
/// Maximum rounds of pairing and fitting.
const MAX_ROUNDS: usize = 40;
/// A fit ends where a step moves the predicted places by less than this, in standard errors.
const CONVERGED: f64 = 0.01;
/// Width of the rings around the axis in which the lens is tested, in radians.
const RING_RAD: f64 = 4.0 * RAD_PER_DEG;
/// Largest log10 of the probability that as many stars of a ring agree by chance.
const LOG10_CHANCE: f64 = -2.0;

/// What is known of a part of the frame.
pub struct Seed<'a> {
    /// Its stars, at their places in the whole frame.
    stars: &'a [MeasuredStar],
    /// The direction of its middle.
    centre: UnitVector<Icrs>,
    /// A lens of the angle that images it about so, of the whole frame, and its attitude.
    camera: CameraModel,
    icrs_to_camera: Rotation<Icrs, Camera>,
    zero_point_mag: f64,
}

impl<'a> Seed<'a> {
    /// A window around `centre` of a frame, with the window's camera and attitude.
    pub fn of_window(
        frame: &StarField,
        centre: PixelPoint,
        of_window: &Hypothesis,
        stars: &'a [MeasuredStar],
    ) -> Self {
        let (camera, icrs_to_camera) = start(frame, centre, of_window);
        Self {
            stars,
            centre: of_window.icrs_to_camera.boresight(),
            camera,
            icrs_to_camera,
            zero_point_mag: of_window.zero_point_mag,
        }
    }

    /// The part of a frame around its middle in which `stars` are.
    pub fn of_middle(of_frame: &Hypothesis, stars: &'a [MeasuredStar]) -> Self {
        let (camera, icrs_to_camera) = with_projection(of_frame, Projection::Equidistant);
        Self {
            stars,
            centre: of_frame.icrs_to_camera.boresight(),
            camera: camera.limited_to(MAX_ANGLE_RAD),
            icrs_to_camera,
            zero_point_mag: of_frame.zero_point_mag,
        }
    }
}

/// Follows lenses outwards. Its buffers are reused.
#[derive(Debug, Default)]
pub struct Growth {
    around: Surroundings,
    predicted: Vec<PredictedStar>,
    detections: PointGrid,
    stars: Vec<MeasuredStar>,
    expected: Vec<WellPredictedStar>,
    differences_mag: Vec<f64>,
}

/// A star that is predicted well.
#[derive(Debug, Clone, Copy)]
struct WellPredictedStar {
    /// Its angle from the axis, in radians.
    from_axis_rad: f64,
    /// Its angle from the middle of the seed, in radians.
    from_seed_rad: f64,
    /// Probability that a detection is there by chance.
    chance: f64,
    is_found: bool,
}

/// The part of the sky in which stars are paired.
#[derive(Debug, Clone, Copy)]
struct PairedRegion {
    centre: UnitVector<Icrs>,
    radius_rad: f64,
}

/// A lens, its attitude, and the covariance of all parameters.
struct FittedCamera {
    camera: CameraModel,
    icrs_to_camera: Rotation<Icrs, Camera>,
    covariance: SMatrix<f64, PARAMETERS, PARAMETERS>,
}

impl Growth {
    /// The lens of the whole frame, as far as the stars show it. `None` where the stars of the seed do
    /// not determine one.
    pub fn grow(&mut self, problem: Problem, seed: &Seed) -> Option<Hypothesis> {
        let field = problem.field;
        self.around.forget();
        let positions = field.stars.iter().map(|star| star.position);
        self.detections.fill(field.stars.len(), positions);
        self.stars.clear();
        self.stars.extend_from_slice(seed.stars);
        let mut fitted = fit(&self.stars, &seed.camera, &seed.icrs_to_camera)?;
        for _ in 0..ROBUST_ROUNDS {
            for (star, of_seed) in self.stars.iter_mut().zip(seed.stars) {
                let seen = fitted.icrs_to_camera.apply(&star.icrs);
                let residual_px = fitted.camera.pixel_of(&seen)?.distance_to(&star.pixel);
                star.sigma_px = huber_sigma(of_seed.sigma_px, residual_px);
            }
            fitted = fit(&self.stars, &fitted.camera, &fitted.icrs_to_camera)?;
        }
        let mut zero_point_mag = seed.zero_point_mag;
        let mut reach = reach_of(seed);
        let mut stalled = 0;
        for _ in 0..MAX_ROUNDS {
            zero_point_mag = self.pair(problem, &fitted, &reach, zero_point_mag);
            let Some(next) = fit(&self.stars, &fitted.camera, &fitted.icrs_to_camera) else {
                break;
            };
            fitted = next;
            let known_rad = self.known_to_rad(|star| star.from_seed_rad)?;
            if known_rad + STEP_RAD > reach.radius_rad {
                reach.radius_rad = known_rad + STEP_RAD;
                stalled = 0;
            } else {
                stalled += 1;
                if stalled == MAX_STALLED {
                    break;
                }
            }
        }
        let to_rad = self.known_to_rad(|star| star.from_axis_rad)?;
        Some(Hypothesis {
            camera: fitted.camera.limited_to(to_rad),
            icrs_to_camera: fitted.icrs_to_camera,
            parameters: PARAMETERS,
            fitted_stars: self.stars.len(),
            zero_point_mag,
        })
    }

    /// Pairs the stars that are predicted well with detections; returns the zero point of the
    /// magnitudes.
    fn pair(
        &mut self,
        problem: Problem,
        fitted: &FittedCamera,
        reach: &PairedRegion,
        zero_point_mag: f64,
    ) -> f64 {
        let field = problem.field;
        let hypothesis = Hypothesis {
            camera: fitted.camera,
            icrs_to_camera: fitted.icrs_to_camera,
            parameters: PARAMETERS,
            fitted_stars: self.stars.len(),
            zero_point_mag,
        };
        let depth = PredictionDepth {
            count: field.stars.len().min(MAX_PREDICTED),
            v_mag: f64::NEG_INFINITY,
        };
        hypothesis.predict_at_least(problem, depth, &mut self.around, &mut self.predicted);
        let predictor = PositionPredictor::new(&fitted.camera, &fitted.icrs_to_camera, Some(MODEL));
        let diagonal_px = libm::hypot(field.width_px, field.height_px);
        let density_px2 = field.stars.len() as f64 / (field.width_px * field.height_px);
        self.stars.clear();
        self.expected.clear();
        self.differences_mag.clear();
        for star in self.predicted.iter().take(MAX_PREDICTED) {
            let from_seed_rad = star.direction.angle_to(&reach.centre);
            if from_seed_rad > reach.radius_rad {
                continue;
            }
            let direction = fitted.icrs_to_camera.apply(&star.direction);
            let Some(sigma_px) = predictor
                .predict(&star.direction)
                .map(|prediction| fitted.sigma_px(&prediction))
            else {
                continue;
            };
            let radius_px = RADIUS_SIGMAS * sigma_px + MIN_RADIUS_PX;
            let chance = PI * radius_px * radius_px * density_px2;
            if chance > MAX_CHANCE || radius_px > MAX_RADIUS_FRACTION * diagonal_px {
                continue;
            }
            let found = self.nearest(problem, &hypothesis, star, radius_px);
            self.expected.push(WellPredictedStar {
                from_axis_rad: direction.angle_to(&UnitVector::BORESIGHT),
                from_seed_rad,
                chance,
                is_found: found.is_some(),
            });
            if let Some((index, distance_px)) = found {
                let observed = &field.stars[index];
                let sigma_px = libm::hypot(observed.sigma_px, MIN_SIGMA_PX);
                self.stars.push(MeasuredStar {
                    pixel: observed.position,
                    icrs: star.direction,
                    sigma_px: huber_sigma(sigma_px, distance_px),
                });
                self.differences_mag
                    .push(f64::from(star.v_mag) - observed.mag);
            }
        }
        match field.photometry {
            Photometry::Instrumental if !self.differences_mag.is_empty() => {
                median(&mut self.differences_mag)
            }
            _ => zero_point_mag,
        }
    }

    /// The detection nearest to a predicted star that is about as bright, and its distance in pixels.
    fn nearest(
        &self,
        problem: Problem,
        hypothesis: &Hypothesis,
        star: &PredictedStar,
        radius_px: f64,
    ) -> Option<(usize, f64)> {
        let field = problem.field;
        let mut best: Option<(usize, f64)> = None;
        self.detections
            .for_each_within(&star.pixel, radius_px, |near| {
                let observed = &field.stars[near.index];
                let is_nearer = best.is_none_or(|(index, distance_px)| {
                    (near.distance_px, near.index) < (distance_px, index)
                });
                let difference = hypothesis.mag_difference(observed, star, field.photometry);
                if is_nearer && difference.is_some() {
                    best = Some((near.index, near.distance_px));
                }
            });
        best
    }

    /// The angle, of these of the stars, up to which more of them agree than by chance.
    fn known_to_rad(&self, angle_rad: impl Fn(&WellPredictedStar) -> f64) -> Option<f64> {
        let rings = (PI / RING_RAD).ceil() as usize;
        let is_known = |ring: usize| {
            let within = |star: &&WellPredictedStar| (angle_rad(star) / RING_RAD) as usize == ring;
            let of_ring = self.expected.iter().filter(within);
            let (mut stars, mut found, mut chance) = (0, 0, 0.0);
            for star in of_ring {
                stars += 1;
                found += usize::from(star.is_found);
                chance += star.chance;
            }
            stars > 0 && log10_binomial_tail(stars, found, chance / stars as f64) < LOG10_CHANCE
        };
        let outermost = (0..rings).rev().find(|ring| is_known(*ring))?;
        let edge_rad = (outermost + 1) as f64 * RING_RAD;
        let inside = self.expected.iter().filter(|star| star.is_found);
        let inside = inside.map(&angle_rad).filter(|angle| *angle < edge_rad);
        Some(inside.fold(0.0, f64::max) + 0.1 * RING_RAD)
    }
}

impl FittedCamera {
    /// Largest standard error of a predicted place along an axis, in pixels.
    fn sigma_px(&self, prediction: &PredictedPosition) -> f64 {
        let PredictedPosition {
            by_pose, observed, ..
        } = prediction;
        let variance = |axis: usize| {
            let by_parameters = by_pose[axis].iter().chain(&observed.by_term[axis]).copied();
            let by = SVector::<f64, PARAMETERS>::from_iterator(by_parameters.take(PARAMETERS));
            by.dot(&(self.covariance * by))
        };
        variance(0).max(variance(1)).max(0.0).sqrt()
    }
}

/// The seed, and a step around it.
fn reach_of(seed: &Seed) -> PairedRegion {
    let centre = seed.centre;
    let angles = seed.stars.iter().map(|star| star.icrs.angle_to(&centre));
    PairedRegion {
        centre,
        radius_rad: angles.fold(0.0, f64::max) + STEP_RAD,
    }
}

/// Where to start from: a lens of the angle with the scale of the window, on whose axis the frame's
/// centre is.
fn start(
    field: &StarField,
    centre: PixelPoint,
    of_window: &Hypothesis,
) -> (CameraModel, Rotation<Icrs, Camera>) {
    let window = &of_window.camera;
    let scale_px = window.central_focal_length_px();
    let camera = |focal_px: f64| {
        CameraModel::pinhole(field.width_px, field.height_px, focal_px, window.mirrored)
            .with_projection(Projection::Equidistant)
            .limited_to(MAX_ANGLE_RAD)
    };
    let [u, v] = camera(scale_px).offset_of(&centre);
    let radius_px = libm::hypot(u, v);
    // Along the circle around the axis the scale is larger by θ / sin θ.
    let angle_rad = radius_px / scale_px;
    let stretch = if angle_rad > 1e-3 && angle_rad < PI {
        angle_rad / libm::sin(angle_rad)
    } else {
        1.0
    };
    let camera = camera(scale_px / stretch.sqrt());
    let looks = |x: f64, y: f64| {
        let pixel = camera.pixel_at([u + x, v + y]);
        let direction = camera.direction_of(&pixel);
        *direction.unwrap_or(UnitVector::BORESIGHT).as_vector()
    };
    let out = looks(0.0, 0.0);
    let right = looks(0.5, 0.0) - looks(-0.5, 0.0);
    let right = (right - out * out.dot(&right)).normalize();
    let window_to_camera = Matrix3::from_columns(&[right, out.cross(&right), out]);
    let icrs_to_window = of_window.icrs_to_camera.matrix();
    (
        camera,
        Rotation::from_matrix(window_to_camera * icrs_to_window),
    )
}

/// Fits all parameters to the stars.
fn fit(
    stars: &[MeasuredStar],
    camera: &CameraModel,
    icrs_to_camera: &Rotation<Icrs, Camera>,
) -> Option<FittedCamera> {
    if stars.len() < MIN_STARS {
        return None;
    }
    let adjustment = Adjustment::<PARAMETERS>::new(stars, camera, icrs_to_camera, Some(MODEL));
    let mut adjustment = adjustment.followed();
    let normal = adjustment.converge(CONVERGED)?;
    Some(FittedCamera {
        camera: *adjustment.camera(),
        icrs_to_camera: adjustment.icrs_to_camera(),
        covariance: normal.root.inverse(),
    })
}
