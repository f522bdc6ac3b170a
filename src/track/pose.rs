//! The attitude that fits the centroids of known stars.

use super::outcome::Attitude;
use crate::base::coords::{Camera, Icrs, PixelPoint, Rotation, UnitVector};
use crate::base::statistics::median;
use crate::camera::CameraModel;
use crate::catalog::StarIndex;
use crate::identify::MIN_STARS;
use crate::identify::fit::{CameraFit, MeasuredStar, fit_camera};
use nalgebra::Vector4;

/// Largest residual of a star that belongs to the fit, in its errors, …
const CLIP_SIGMAS: f64 = 5.0;
/// … and at least in pixels.
const MIN_CLIP_PX: f64 = 0.25;
/// The first fit takes the stars within this many median distances from the median shift, …
const FIRST_CLIP: f64 = 3.0;
/// … and at least within this, in pixels.
const FIRST_CLIP_PX: f64 = 1.0;
/// Maximum rounds of fitting and choosing.
const MAX_ROUNDS: usize = 6;

/// A star as it was measured: in pixels of the frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct PoseStar {
    pub position: PixelPoint,
    pub direction: UnitVector<Icrs>,
    pub star: StarIndex,
    /// Standard error on each axis, in pixels.
    pub sigma_px: f64,
}

/// What is known beforehand.
#[derive(Debug, Clone, Copy)]
pub(super) struct PosePrior<'a> {
    pub camera: &'a CameraModel,
    /// Standard error of its focal length, in pixels.
    pub focal_sigma_px: f64,
    /// The predicted attitude.
    pub icrs_to_camera: &'a Rotation<Icrs, Camera>,
    /// Standard deviation on each axis, in pixels, that the errors of the stars lack.
    pub excess_px: f64,
}

/// Fits attitudes. Its buffers are reused.
#[derive(Debug, Default)]
pub(super) struct PoseFitter {
    /// The stars as a camera without distortion has them.
    ideal: Vec<MeasuredStar>,
    /// Which of them agree with the last fit.
    pub is_used: Vec<bool>,
    before: Vec<bool>,
    fitted: Vec<MeasuredStar>,
    residuals_px: Vec<[f64; 2]>,
    of_fit_px: Vec<[f64; 2]>,
    scratch: Vec<f64>,
}

impl PoseFitter {
    /// The attitude that fits most of the stars; `None` where fewer than [`MIN_STARS`] agree.
    pub fn fit(&mut self, stars: &[PoseStar], prior: &PosePrior) -> Option<Attitude> {
        let plain = self.straighten(stars, prior);
        if stars.len() < MIN_STARS {
            return None;
        }
        self.choose_first(&plain, prior.icrs_to_camera);
        let mut start = *prior.icrs_to_camera;
        let mut attitude = None;
        for _ in 0..MAX_ROUNDS {
            self.fitted.clear();
            let used = self.ideal.iter().zip(&self.is_used);
            self.fitted
                .extend(used.filter(|(_, used)| **used).map(|(star, _)| *star));
            if self.fitted.len() < MIN_STARS {
                return None;
            }
            let fit = fit_camera(&self.fitted, &plain, &start, None, &mut self.of_fit_px)?;
            let found = with_known_focal_length(&fit, prior);
            start = found.icrs_to_camera;
            attitude = Some(found);
            std::mem::swap(&mut self.is_used, &mut self.before);
            self.set_residuals(&plain, &start);
            self.choose(clip_px);
            if self.is_used == self.before {
                break;
            }
        }
        attitude
    }

    /// Number of stars of the last fit.
    pub fn used(&self) -> usize {
        self.is_used.iter().filter(|used| **used).count()
    }

    /// The largest residual within which a star of the last fit agreed with it, in pixels.
    pub fn agreeing_px(&self) -> f64 {
        self.ideal.iter().map(clip_px).fold(0.0, f64::max)
    }

    /// The squared error on each axis that the stated ones (with the excess of the prior) lack to
    /// explain the residuals of the last fit, in px²; it scatters about 0 where they lack nothing.
    ///
    /// # Reference
    /// DerSimonian & Laird 1986, Control. Clin. Trials 7, 177, doi 10.1016/0197-2456(86)90046-2.
    pub fn excess_variance_px2(&self) -> f64 {
        /// Parameters of the attitude.
        const PARAMETERS: f64 = 3.0;
        let equations = 2.0 * self.used() as f64;
        let free = (equations - PARAMETERS) / equations;
        let stars = self.ideal.iter().zip(&self.residuals_px).zip(&self.is_used);
        let [excess, weights] = stars.filter(|(_, used)| **used).fold(
            [0.0; 2],
            |[excess, weights], ((star, [x, y]), _)| {
                let variance = star.sigma_px.powi(2);
                let weight = 1.0 / variance;
                let over = (x * x + y * y) - 2.0 * free * variance;
                [
                    excess + weight * weight * over,
                    weights + 2.0 * weight * weight,
                ]
            },
        );
        if weights > 0.0 { excess / weights } else { 0.0 }
    }

    /// The stars of the last fit, in pixels of the frame.
    pub fn used_stars<'a>(&'a self, stars: &'a [PoseStar]) -> impl Iterator<Item = MeasuredStar> {
        let used = stars.iter().zip(&self.ideal).zip(&self.is_used);
        used.filter(|(_, used)| **used)
            .map(|((star, ideal), _)| MeasuredStar {
                pixel: star.position,
                ..*ideal
            })
    }

    /// Removes the distortion from the stars; returns the camera without it.
    fn straighten(&mut self, stars: &[PoseStar], prior: &PosePrior) -> CameraModel {
        let plain = prior.camera.with_distortion(None);
        // A star that the lens does not image was not predicted.
        let straight = |star: &PoseStar| {
            let direction = prior.camera.direction_of(&star.position);
            let pixel = direction.and_then(|direction| plain.pixel_of(&direction));
            MeasuredStar {
                pixel: pixel.unwrap_or(star.position),
                icrs: star.direction,
                sigma_px: libm::hypot(star.sigma_px, prior.excess_px),
            }
        };
        self.ideal.clear();
        self.ideal.extend(stars.iter().map(straight));
        plain
    }

    /// Chooses the stars that are shifted from their predicted places as most are.
    fn choose_first(&mut self, plain: &CameraModel, icrs_to_camera: &Rotation<Icrs, Camera>) {
        self.set_residuals(plain, icrs_to_camera);
        let shift = [0, 1].map(|axis: usize| {
            self.scratch.clear();
            let along = self.residuals_px.iter().map(|residual| residual[axis]);
            self.scratch.extend(along);
            median(&mut self.scratch)
        });
        for [x, y] in &mut self.residuals_px {
            *x -= shift[0];
            *y -= shift[1];
        }
        self.scratch.clear();
        let lengths = self
            .residuals_px
            .iter()
            .map(|[x, y]| (x * x + y * y).sqrt());
        self.scratch.extend(lengths);
        let within_px = (FIRST_CLIP * median(&mut self.scratch)).max(FIRST_CLIP_PX);
        self.choose(|_| within_px);
    }

    /// Sets the residuals of all stars.
    fn set_residuals(&mut self, plain: &CameraModel, icrs_to_camera: &Rotation<Icrs, Camera>) {
        let residual = |star: &MeasuredStar| {
            let direction = icrs_to_camera.apply(&star.icrs);
            let [u, v] = plain.offset_of(&star.pixel);
            let predicted = plain.pixel_of(&direction);
            predicted.map_or([f64::INFINITY; 2], |predicted| {
                let [along_u, along_v] = plain.offset_of(&predicted);
                [u - along_u, v - along_v]
            })
        };
        self.residuals_px.clear();
        self.residuals_px.extend(self.ideal.iter().map(residual));
    }

    fn choose(&mut self, within_px: impl Fn(&MeasuredStar) -> f64) {
        self.is_used.clear();
        let stars = self.ideal.iter().zip(&self.residuals_px);
        self.is_used
            .extend(stars.map(|(star, [x, y])| x * x + y * y <= within_px(star).powi(2)));
    }
}

/// Largest residual of a star that belongs to the fit, in pixels.
fn clip_px(star: &MeasuredStar) -> f64 {
    (CLIP_SIGMAS * star.sigma_px).max(MIN_CLIP_PX)
}

/// The attitude of a fit with a free focal length, which is known better: both are combined.
fn with_known_focal_length(fit: &CameraFit, prior: &PosePrior) -> Attitude {
    let known_px = prior.camera.focal_length_px();
    let variance = (prior.focal_sigma_px / known_px).powi(2);
    let with_focal: Vector4<f64> = fit.covariance.column(3).into_owned();
    let gain = with_focal / (variance + with_focal[3]);
    let off = libm::log(known_px / fit.camera.focal_length_px());
    let turn = gain.fixed_rows::<3>(0) * off;
    let covariance = fit.covariance - gain * with_focal.transpose();
    Attitude {
        icrs_to_camera: fit.icrs_to_camera.then_turn(turn),
        covariance_rad2: covariance.fixed_view::<3, 3>(0, 0).into_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Distortion, DistortionModel};
    use crate::track::motion::turn_between;
    use nalgebra::Vector3;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    const SIGMA_PX: f64 = 0.05;

    fn camera() -> CameraModel {
        let camera = CameraModel::pinhole(640.0, 480.0, 1800.0, true);
        let radial = Distortion::new(DistortionModel::Radial, camera.radius_px(), &[3.0]);
        camera.with_distortion(Some(radial))
    }

    fn stars(truth: &Rotation<Icrs, Camera>, rng: &mut ChaCha8Rng) -> Vec<PoseStar> {
        let camera = camera();
        let star = |_| {
            let place = PixelPoint::new(rng.random_range(9.0..630.0), rng.random_range(9.0..470.0));
            let direction = truth.inverse().apply(&camera.direction_of(&place).unwrap());
            let mut error = || SIGMA_PX * rng.sample::<f64, _>(StandardNormal);
            PoseStar {
                position: PixelPoint::new(place.x + error(), place.y + error()),
                direction,
                star: StarIndex::new(0),
                sigma_px: SIGMA_PX,
            }
        };
        (0..30).map(star).collect()
    }

    #[test]
    fn the_error_of_the_attitude_is_as_stated_and_strays_do_not_matter() {
        const TRIALS: u32 = 300;
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let truth = Rotation::looking_at(&UnitVector::from_ra_dec(2.0, 0.4), 0.3);
        let predicted = truth.then_turn(Vector3::new(1e-3, -5e-4, 2e-3));
        let camera = camera();
        let prior = PosePrior {
            camera: &camera,
            focal_sigma_px: 0.01,
            icrs_to_camera: &predicted,
            excess_px: 0.0,
        };
        let mut fitter = PoseFitter::default();
        let (mut nees, mut lacking) = (0.0, 0.0);
        for _ in 0..TRIALS {
            let mut stars = stars(&truth, &mut rng);
            stars[3].position.x += 4.0;
            stars[17].position.y -= 1.5;
            let found = fitter.fit(&stars, &prior).unwrap();
            assert!(!fitter.is_used[3] && !fitter.is_used[17]);
            assert!(fitter.used() >= 27);
            let error = turn_between(&found.icrs_to_camera, &truth);
            let inverse = found.covariance_rad2.try_inverse().unwrap();
            nees += (error.transpose() * inverse * error)[0] / 3.0 / f64::from(TRIALS);
            lacking += fitter.excess_variance_px2() / f64::from(TRIALS);
        }
        // The standard error of the mean is 5 %.
        assert!((nees - 1.0).abs() < 0.2, "{nees}");
        assert!(lacking.abs() < 0.05 * SIGMA_PX.powi(2), "{lacking}");
    }

    #[test]
    fn three_stars_are_too_few() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let truth = Rotation::looking_at(&UnitVector::from_ra_dec(2.0, 0.4), 0.3);
        let camera = camera();
        let prior = PosePrior {
            camera: &camera,
            focal_sigma_px: 0.01,
            icrs_to_camera: &truth,
            excess_px: 0.0,
        };
        let stars = stars(&truth, &mut rng);
        assert!(PoseFitter::default().fit(&stars[..3], &prior).is_none());
        assert!(PoseFitter::default().fit(&stars[..4], &prior).is_some());
    }
}
