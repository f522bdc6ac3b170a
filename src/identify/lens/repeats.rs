//! What frames of one direction repeat: the same stars on nearly the same pixels.
//!
//! The light of neighbours, the response of the pixels and the air above shift a star in all of these
//! frames alike, and however many they are, that error stays. Its size follows from the residuals: those
//! of one star in several frames have a product whose mean is the variance that they have in common
//! (Fisher 1925, Statistical Methods for Research Workers, § 38). Of n observations with a variance T, of
//! which C is in common, each counts with T + (n − 1) C (Kish 1965, Survey Sampling, § 5.4).

use super::frames::LensFrame;
use crate::base::least_squares::{huber_sigma, solve_pair};
use crate::base::statistics::median;
use crate::catalog::StarIndex;
use crate::identify::fit::{JointFit, JointFrame};
use std::collections::HashMap;

/// Where the stars of frames repeat: a place is a star in the frames of one direction.
pub(super) struct Repeats {
    /// The direction of each frame, from 0.
    pub directions: Vec<usize>,
    /// The place of each star of each frame, from 0.
    pub places: Vec<Vec<usize>>,
    /// Number of observations at each place.
    observations: Vec<usize>,
    /// The index that the star of each place has in the first frame with it.
    first_indices: Vec<usize>,
}

/// The error that stars repeat in frames of one direction.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct CommonError {
    /// The share of the noise of the centroids.
    noise_fraction: f64,
    /// Its variance on each axis beyond that, in pixels squared.
    variance_px2: f64,
}

impl Repeats {
    pub(super) fn new(frames: &[LensFrame]) -> Self {
        let mut repeats = Self {
            directions: Vec::with_capacity(frames.len()),
            places: Vec::with_capacity(frames.len()),
            observations: Vec::new(),
            first_indices: Vec::new(),
        };
        // The first frame of each direction.
        let mut firsts: Vec<&LensFrame> = Vec::new();
        let mut known: HashMap<(usize, StarIndex), usize> = HashMap::new();
        for frame in frames {
            let direction = firsts.iter().position(|first| is_near(first, frame));
            let direction = direction.unwrap_or_else(|| {
                firsts.push(frame);
                firsts.len() - 1
            });
            let names = frame.names().iter().enumerate();
            let places = names.map(|(index, name)| {
                let place = *known.entry((direction, *name)).or_insert_with(|| {
                    repeats.observations.push(0);
                    repeats.first_indices.push(index);
                    repeats.observations.len() - 1
                });
                repeats.observations[place] += 1;
                place
            });
            let places = places.collect();
            repeats.places.push(places);
            repeats.directions.push(direction);
        }
        repeats
    }

    /// Number of directions.
    pub(super) fn direction_count(&self) -> usize {
        self.directions.iter().max().map_or(0, |last| last + 1)
    }

    /// Number of places.
    pub(super) fn place_count(&self) -> usize {
        self.observations.len()
    }

    /// The part of each star of a frame where the stars are parted: all observations at a place are in one.
    pub(super) fn parts(&self, frame: usize, count: usize) -> Vec<usize> {
        let places = self.places[frame].iter();
        places
            .map(|place| self.first_indices[*place] % count)
            .collect()
    }

    /// The error that the residuals of `fit` have in common; `excess_px` is what the stated errors lack.
    pub(super) fn common_error(
        &self,
        stated: &[JointFrame],
        fit: &JointFit,
        excess_px: f64,
    ) -> CommonError {
        let mut places = vec![Products::default(); self.place_count()];
        let frames = stated.iter().zip(&fit.residuals_px).zip(&self.places);
        for ((frame, residuals), of_stars) in frames {
            for ((star, residual), place) in frame.stars.iter().zip(residuals).zip(of_stars) {
                places[*place].add(star.sigma_px, excess_px, *residual);
            }
        }
        let repeated = self.observations.iter().filter(|count| **count > 1).count();
        // The lens and the attitude of each direction follow a part of the error.
        let taken = fit.covariance.nrows() + 3 * self.direction_count();
        let left = 1.0 - taken as f64 / (2.0 * repeated as f64);
        CommonError::fit(&places, left.max(0.25))
    }

    /// The standard errors with which the stars of each frame are weighted in a fit, in pixels. `of_stars` are
    /// those of each star by itself; what `common` says is repeated by all frames is counted once.
    pub(super) fn sigmas_px(
        &self,
        common: &CommonError,
        of_stars: &[Vec<StarError>],
    ) -> Vec<Vec<f64>> {
        let mut sums = vec![ResidualSums::default(); self.place_count()];
        let stars = of_stars.iter().zip(&self.places);
        for (star, place) in stars
            .clone()
            .flat_map(|(stars, places)| stars.iter().zip(places))
        {
            sums[*place].add(star, star.in_common(common));
        }
        let sigma_px = |star: &StarError, place: usize| {
            let observations = self.observations[place] as f64;
            let others = observations - 1.0;
            let variance_px2 = star.sigma_px * star.sigma_px + others * star.in_common(common);
            (variance_px2 + observations * sums[place].excess_px2(observations)).sqrt()
        };
        let of_frame = |(stars, places): (&Vec<StarError>, &Vec<usize>)| {
            let stars = stars.iter().zip(places);
            stars.map(|(star, place)| sigma_px(star, *place)).collect()
        };
        stars.map(of_frame).collect()
    }
}

/// The error of a star in one frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct StarError {
    /// Standard error of its centroid on each axis.
    pub noise_px: f64,
    /// The same of all its errors.
    pub sigma_px: f64,
    pub residual_px: [f64; 2],
}

impl StarError {
    /// Its variance on each axis that other frames repeat.
    fn in_common(&self, common: &CommonError) -> f64 {
        common
            .sigma_px(self.noise_px)
            .powi(2)
            .min(self.sigma_px.powi(2))
    }
}

/// Sums over the observations at a place.
#[derive(Debug, Clone, Copy, Default)]
struct ResidualSums {
    residuals_px: [f64; 2],
    /// Of the variances of the observations, and of what is in common.
    variances_px2: f64,
    common_px2: f64,
}

impl ResidualSums {
    fn add(&mut self, star: &StarError, common_px2: f64) {
        self.variances_px2 += star.sigma_px * star.sigma_px;
        self.common_px2 += common_px2;
        for (sum, along) in self.residuals_px.iter_mut().zip(star.residual_px) {
            *sum += along;
        }
    }

    /// The variance that the mean of an outlier has beyond the usual one: all frames repeat it.
    fn excess_px2(&self, observations: f64) -> f64 {
        if observations < 2.0 {
            return 0.0;
        }
        let [common_px2, single_px2] =
            [self.common_px2, self.variances_px2 - self.common_px2].map(|sum| sum / observations);
        let variance_px2 = common_px2 + single_px2 / observations;
        let [x, y] = self.residuals_px.map(|sum| sum / observations);
        huber_sigma(variance_px2.sqrt(), libm::hypot(x, y)).powi(2) - variance_px2
    }
}

/// Whether a frame has the direction of `first`: most stars that it has are there, and near.
fn is_near(first: &LensFrame, frame: &LensFrame) -> bool {
    /// The median distance, over that of the corners from the centre.
    const NEAR: f64 = 0.05;
    let shared = first.shared_stars(frame);
    if 2 * shared.len() < first.stars().min(frame.stars()) {
        return false;
    }
    let distances = shared.iter().map(|[i, j]| {
        let (a, b) = (first.joint.stars[*i].pixel, frame.joint.stars[*j].pixel);
        libm::hypot(a.x - b.x, a.y - b.y)
    });
    let mut distances_px: Vec<f64> = distances.collect();
    median(&mut distances_px) < NEAR * frame.camera.radius_px()
}

/// Sums over the observations at a place, and sums of the squares: they give those of the products of two
/// different observations.
#[derive(Debug, Clone, Copy, Default)]
struct Products {
    sums: [f64; 7],
    squares: [f64; 7],
}

impl Products {
    fn add(&mut self, noise_px: f64, excess_px: f64, residual_px: [f64; 2]) {
        /// Standard errors beyond which a residual counts no more.
        const MAX_SIGMAS: f64 = 2.5;
        let variance = noise_px * noise_px + excess_px * excess_px;
        let most_px = MAX_SIGMAS * variance.sqrt();
        let [x, y] = residual_px.map(|along| along.clamp(-most_px, most_px) / variance);
        let terms = [
            noise_px * noise_px / variance,
            noise_px / variance,
            1.0 / variance,
            noise_px * x,
            noise_px * y,
            x,
            y,
        ];
        for (at, term) in terms.into_iter().enumerate() {
            self.sums[at] += term;
            self.squares[at] += term * term;
        }
    }

    fn products(&self) -> [f64; 7] {
        std::array::from_fn(|at| self.sums[at].powi(2) - self.squares[at])
    }
}

impl CommonError {
    /// The least squares of s nᵢ nⱼ + v to the products of residuals, with n the noise, in the variances of
    /// these products. A fit took all but a part `left` of the error.
    fn fit(places: &[Products], left: f64) -> Self {
        let mut total = [0.0; 7];
        for place in places {
            for (sum, product) in total.iter_mut().zip(place.products()) {
                *sum += product;
            }
        }
        let [nn, n, one, nx, ny, x, y] = total;
        let [aa, ab, bb] = [nn, n, one].map(|sum| 2.0 * sum);
        let vector = [nx + ny, x + y];
        let share = |[share, variance_px2]: [f64; 2]| Self {
            noise_fraction: (share / left).clamp(0.0, 1.0),
            variance_px2: (variance_px2 / left).max(0.0),
        };
        let (both, determinant) = solve_pair([[aa, ab], [ab, bb]], vector);
        // Neither is below 0, and errors that are all equal do not tell them apart.
        match both {
            [a, b] if a >= 0.0 && b >= 0.0 && determinant > 1e-9 * aa * bb => share(both),
            [a, _] if a < 0.0 && bb > 0.0 => share([0.0, vector[1] / bb]),
            _ if aa > 0.0 => share([vector[0] / aa, 0.0]),
            _ => Self::default(),
        }
    }

    /// Standard error on each axis of stars whose centroids have an error of `noise_px`, in pixels.
    pub(super) fn sigma_px(&self, noise_px: f64) -> f64 {
        (self.noise_fraction * noise_px * noise_px + self.variance_px2).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    /// What is found of errors of `noise_px` to its double, of which a share is in common, and of `common_px`, in
    /// common, of as many observations at each of 300 places.
    fn found(observations: usize, noise_px: f64, [share, common_px]: [f64; 2]) -> CommonError {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut normal = || rng.sample::<f64, _>(StandardNormal);
        let place = |number: usize| {
            let mut products = Products::default();
            let noise_px = noise_px * (1.0 + number as f64 / 300.0);
            let repeated =
                [0, 1].map(|_| share.sqrt() * noise_px * normal() + common_px * normal());
            for _ in 0..observations {
                let residual = repeated.map(|px| px + (1.0 - share).sqrt() * noise_px * normal());
                products.add(noise_px, common_px, residual);
            }
            products
        };
        let places: Vec<Products> = (0..300).map(place).collect();
        CommonError::fit(&places, 1.0)
    }

    #[test]
    fn what_observations_have_in_common_is_measured() {
        for observations in [2, 8] {
            let none = found(observations, 0.1, [0.0, 0.0]);
            assert!(none.sigma_px(0.15) < 0.05, "{none:?}");
            let half = found(observations, 0.1, [0.0, 0.15]);
            let common_px = half.sigma_px(0.15);
            assert!((common_px - 0.15).abs() < 0.025, "{half:?}");
            let noise = found(observations, 0.1, [0.6, 0.0]);
            let common_px = noise.sigma_px(0.15);
            assert!(
                (common_px - 0.6_f64.sqrt() * 0.15).abs() < 0.025,
                "{noise:?}"
            );
        }
        let single = CommonError::fit(&[Products::default()], 1.0);
        assert_eq!(single, CommonError::default());
    }

    #[test]
    fn what_all_frames_repeat_counts_once() {
        const FRAMES: usize = 8;
        let repeats = Repeats {
            directions: vec![0; FRAMES],
            places: vec![vec![0, 1, 2]; FRAMES],
            observations: vec![FRAMES; 3],
            first_indices: vec![0, 1, 2],
        };
        let common = CommonError {
            noise_fraction: 0.0,
            variance_px2: 0.06 * 0.06,
        };
        let star = |residual_px| StarError {
            noise_px: 0.08,
            sigma_px: huber_sigma(0.1, residual_px),
            residual_px: [residual_px, 0.0],
        };
        // The second has a neighbour; the third was hit by a cosmic ray in one frame.
        let mut of_stars = vec![vec![star(0.05), star(1.0), star(0.0)]; FRAMES];
        of_stars[0][2] = star(1.0);
        let of_star = |index: usize| {
            let sigmas_px = repeats.sigmas_px(&common, &of_stars);
            let weights = sigmas_px.iter().map(|frame| frame[index].powi(-2));
            weights.sum::<f64>().sqrt().recip()
        };
        let usual_px = (0.06_f64.powi(2) + 0.08_f64.powi(2) / FRAMES as f64).sqrt();
        assert!((of_star(0) - usual_px).abs() < 1e-12);
        // It pulls no harder than a residual of 2.5 standard errors.
        let outlier_px = of_star(1);
        assert!(1.0 / outlier_px.powi(2) < 2.6 / usual_px, "{outlier_px}");
        let hit_px = of_star(2);
        assert!(hit_px < 1.6 * usual_px, "{hit_px}");
    }
}
