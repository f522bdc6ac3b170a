//! How much better the stars are where the air of a place bends their light to.
//!
//! Refraction about the stated zenith is compared with none. What a lens may do is taken out of both: a
//! polynomial over the frame, and what is the same all around the axis. So only the form that no lens has
//! counts: the steep rise on the one side of the frame where the horizon is.

use super::sky::{NamedStar, ObservedSky};
use crate::base::statistics::median;
use crate::ephemeris::places::StarPlaces;
use crate::identify::Identification;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// The comparison of refraction about different zeniths in one frame.
pub(super) struct Bending<'a> {
    found: &'a Identification,
    stars: Vec<NamedStar>,
    /// Weighted terms of the lens: one row a star.
    terms: DMatrix<f64>,
    normal: Cholesky<f64, Dyn>,
    weights: Vec<f64>,
    /// Weighted misfit without air.
    airless: f64,
    /// Residuals without air, in pixels.
    residuals: [Vec<f64>; 2],
    /// How many standard errors squared an error of the lens, which stars nearby share, makes of one.
    shared: f64,
}

/// Fewer stars tell no refraction from a lens.
const MIN_STARS: usize = 60;
/// With so many a polynomial of fifth order is taken out, else one of third.
const STARS_FOR_FIFTH: usize = 150;
/// Squared residuals count up to this, in standard errors.
const MAX_SQUARE: f64 = 9.0;

impl<'a> Bending<'a> {
    pub fn new(sky: &ObservedSky<'a>) -> Option<Self> {
        let found = sky.found;
        let (stars, residuals) = airless_residuals(sky);
        if stars.len() < MIN_STARS {
            return None;
        }
        let excess_px = found.excess_sigma_px;
        let sigmas = stars
            .iter()
            .map(|star| libm::hypot(star.sigma_px, excess_px));
        let sigmas: Vec<f64> = sigmas.collect();
        let weights = |scale: f64| sigmas.iter().map(|sigma| 1.0 / (sigma * scale)).collect();
        let mut bending = Self {
            found,
            terms: DMatrix::zeros(0, 0),
            normal: Cholesky::new(DMatrix::identity(1, 1))?,
            weights: Vec::new(),
            airless: 0.0,
            residuals,
            shared: 1.0,
            stars,
        };
        bending.set_weights(weights(1.0))?;
        let scale = bending.scale();
        if scale > 1.0 {
            bending.set_weights(weights(scale))?;
        }
        bending.shared = shared(&bending.stars, &bending.weights);
        bending.airless = bending.misfit(&bending.residuals);
        Some(bending)
    }

    fn set_weights(&mut self, weights: Vec<f64>) -> Option<()> {
        self.terms = lens_terms(self.found, &self.stars, &weights);
        self.normal = Cholesky::new(self.terms.tr_mul(&self.terms))?;
        self.weights = weights;
        Some(())
    }

    /// By how much the squared misfit, in standard errors, is larger with the air of `places` than without.
    /// Errors that neighbours share are taken for as many as they are.
    pub fn excess(&self, places: &StarPlaces) -> f64 {
        /// Cosine of the zenith distance beyond which a star is hidden, and refraction means nothing.
        const HIDDEN: f64 = -0.01;
        let Some(zenith) = places.zenith() else {
            return 0.0;
        };
        let mut bent = self.residuals.clone();
        for (at, star) in self.stars.iter().enumerate() {
            if zenith.dot(&star.airless) < HIDDEN {
                continue;
            }
            let lifted = self.found.pixel_of(&places.refracted(&star.airless));
            let airless = self.found.pixel_of(&star.airless);
            if let Some((lifted, airless)) = lifted.zip(airless) {
                bent[0][at] -= lifted.x - airless.x;
                bent[1][at] -= lifted.y - airless.y;
            }
        }
        (self.misfit(&bent) - self.airless) / self.shared
    }

    /// What is left of residuals along an axis, in standard errors, when the lens takes what it can.
    fn left(&self, residuals: &[f64]) -> DVector<f64> {
        let weighted = residuals.iter().zip(&self.weights).map(|(r, w)| r * w);
        let weighted = DVector::from_iterator(residuals.len(), weighted);
        let lens = self.normal.solve(&self.terms.tr_mul(&weighted));
        weighted - &self.terms * lens
    }

    fn misfit(&self, residuals: &[Vec<f64>; 2]) -> f64 {
        let squares = residuals.iter().map(|along| {
            let left = self.left(along);
            left.iter().map(|r| (r * r).min(MAX_SQUARE)).sum::<f64>()
        });
        squares.sum()
    }

    /// How much larger residuals are than their standard errors, by the middle one.
    fn scale(&self) -> f64 {
        /// Median of the absolute value of a normal deviate.
        const NORMAL_MEDIAN: f64 = 0.674_49;
        let left = self.residuals.iter().map(|along| self.left(along));
        let mut sizes: Vec<f64> = left.flat_map(|left| left.data.as_vec().clone()).collect();
        sizes.iter_mut().for_each(|size| *size = size.abs());
        median(&mut sizes) / NORMAL_MEDIAN
    }
}

/// The mean number of stars that share an error: of what centroids lack to explain, four.
fn shared(stars: &[NamedStar], weights: &[f64]) -> f64 {
    const NEIGHBOURS: f64 = 4.0;
    let own = stars.iter().zip(weights).map(|(star, weight)| {
        let share = star.sigma_px * weight;
        (share * share).min(1.0)
    });
    let own = own.sum::<f64>() / stars.len() as f64;
    1.0 + NEIGHBOURS * (1.0 - own)
}

/// The stars that the lens would show without air, and how far they are from there, in pixels.
fn airless_residuals(sky: &ObservedSky) -> (Vec<NamedStar>, [Vec<f64>; 2]) {
    let mut stars = Vec::with_capacity(sky.stars.len());
    let mut residuals = [Vec::new(), Vec::new()];
    for star in &sky.stars {
        if let Some(expected) = sky.found.pixel_of(&star.airless) {
            residuals[0].push(star.pixel.x - expected.x);
            residuals[1].push(star.pixel.y - expected.y);
            stars.push(*star);
        }
    }
    (stars, residuals)
}

/// What a lens may do to a coordinate: polynomials over the frame, and higher powers of the distance from
/// the axis. One row a star, in units of its standard error.
fn lens_terms(found: &Identification, stars: &[NamedStar], weights: &[f64]) -> DMatrix<f64> {
    let order = if stars.len() < STARS_FOR_FIFTH { 3 } else { 5 };
    let axis = found.camera.axis();
    let distances = stars.iter().map(|star| star.pixel.distance_to(&axis));
    let radius_px = distances.fold(1.0, f64::max);
    let powers = (0..=order).flat_map(|i| (0..=order - i).map(move |j| (i, j)));
    let powers: Vec<(i32, i32)> = powers.collect();
    let power = |base: f64, exponent: i32| (0..exponent).fold(1.0, |product, _| product * base);
    let rows = stars.iter().zip(weights).map(|(star, weight)| {
        let u = (star.pixel.x - axis.x) / radius_px;
        let v = (star.pixel.y - axis.y) / radius_px;
        let square = u * u + v * v;
        let mut row: Vec<f64> = Vec::with_capacity(powers.len() + 4);
        row.extend(
            powers
                .iter()
                .map(|(i, j)| power(u, *i) * power(v, *j) * weight),
        );
        for n in [order / 2 + 1, order / 2 + 2] {
            row.extend([u, v].map(|along| along * power(square, n) * weight));
        }
        row
    });
    let rows: Vec<Vec<f64>> = rows.collect();
    let columns = rows.first().map_or(0, Vec::len);
    DMatrix::from_fn(rows.len(), columns, |row, column| rows[row][column])
}
