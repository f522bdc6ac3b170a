//! Lens distortion as SIP polynomials of pixel offsets.

use crate::base::coords::PixelPoint;
use crate::camera::{CameraModel, Distortion};
use nalgebra::{DMatrix, DVector, Matrix2, Vector2};

/// Highest order of the inverse; keywords have one digit per power.
const MAX_INVERSE_ORDER: usize = 9;
/// Largest accepted error of the inverse on the frame, in pixels.
const INVERSE_TOLERANCE_PX: f64 = 1e-3;
/// Points per side on which the inverse is fitted, denser towards the borders.
const FIT_POINTS: usize = 24;
/// How far the points reach, in units of the frame's half side.
const FIT_REACH: f64 = 1.02;

/// A polynomial of two offsets, in pixels.
#[derive(Debug, Clone)]
pub(super) struct Polynomial {
    pub(super) order: usize,
    /// In the order of [`powers`].
    coefficients: Vec<f64>,
}

/// The pairs of powers (p, q) of a polynomial of this order: p + q ≤ order.
fn powers(order: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..=order).flat_map(move |p| (0..=order - p).map(move |q| (p, q)))
}

impl Polynomial {
    /// Both powers and the coefficient of each term.
    pub(super) fn terms(&self) -> impl Iterator<Item = (usize, usize, f64)> {
        powers(self.order)
            .zip(&self.coefficients)
            .map(|((p, q), value)| (p, q, *value))
    }

    /// `sign` times the polynomial at (u, −v).
    fn with_rows_reversed(&self, sign: f64) -> Self {
        let term = |(_, q, value): (usize, usize, f64)| sign * (-1.0_f64).powi(q as i32) * value;
        Self {
            order: self.order,
            coefficients: self.terms().map(term).collect(),
        }
    }

    fn at(&self, [u, v]: [f64; 2]) -> f64 {
        self.terms()
            .map(|(p, q, value)| value * u.powi(p as i32) * v.powi(q as i32))
            .sum()
    }
}

/// A distortion in SIP form.
///
/// SIP polynomials have no terms of first order: with observed offsets U in the file's axes, ideal
/// offset = `linear` (U + `forward`(U)).
#[derive(Debug, Clone)]
pub(super) struct Sip {
    /// The linear part of the distortion, a factor of `CD`.
    pub(super) linear: Matrix2<f64>,
    /// `A` and `B`.
    pub(super) forward: [Polynomial; 2],
    /// `AP` and `BP`.
    pub(super) inverse: [Polynomial; 2],
}

impl Sip {
    /// The distortion of `camera`.
    pub(super) fn new(distortion: &Distortion, camera: &CameraModel) -> Self {
        let (linear, forward) = expand(distortion, camera.mirrored);
        let inverse = invert(&forward, camera);
        Self {
            linear,
            forward,
            inverse,
        }
    }

    /// The same for offsets whose second coordinate has the other sign.
    pub(super) fn with_rows_reversed(&self) -> Self {
        let reversal = Matrix2::new(1.0, 0.0, 0.0, -1.0);
        let reversed =
            |[x, y]: &[Polynomial; 2]| [x.with_rows_reversed(1.0), y.with_rows_reversed(-1.0)];
        Self {
            linear: reversal * self.linear * reversal,
            forward: reversed(&self.forward),
            inverse: reversed(&self.inverse),
        }
    }
}

/// Splits the distortion into its linear part and the polynomials of higher order.
fn expand(distortion: &Distortion, mirrored: bool) -> (Matrix2<f64>, [Polynomial; 2]) {
    let order = distortion.model().order();
    let sign: f64 = if mirrored { -1.0 } else { 1.0 };
    let count = powers(order).count();
    let mut linear = Matrix2::identity();
    let mut higher = vec![Vector2::zeros(); count];
    for (p, q, along) in distortion.monomials() {
        let scale = distortion.radius_px().powi((p + q) as i32);
        // With x reversed, u changes sign as a variable and as a result.
        let flip = sign * sign.powi(p as i32);
        let flipped = Vector2::new(along[0] * flip, along[1] * sign.powi(p as i32)) / scale;
        match (p, q) {
            (1, 0) => linear.set_column(0, &(linear.column(0) + flipped)),
            (0, 1) => linear.set_column(1, &(linear.column(1) + flipped)),
            _ => {
                if let Some(index) = powers(order).position(|powers| powers == (p, q)) {
                    higher[index] += flipped;
                }
            }
        }
    }
    // `linear` is close to the identity: lenses do not fold the image.
    let inverse = linear.try_inverse().unwrap_or_else(Matrix2::identity);
    let polynomial = |axis: usize| Polynomial {
        order,
        coefficients: higher.iter().map(|term| (inverse * term)[axis]).collect(),
    };
    (linear, [polynomial(0), polynomial(1)])
}

/// The inverse of `forward` over the frame, of the lowest order that is accurate enough.
fn invert(forward: &[Polynomial; 2], camera: &CameraModel) -> [Polynomial; 2] {
    let half = [camera.width_px / 2.0, camera.height_px / 2.0];
    let points = points(half);
    let ideal = points.iter().map(|&at| {
        let shift = [forward[0].at(at), forward[1].at(at)];
        [at[0] + shift[0], at[1] + shift[1]]
    });
    let ideal: Vec<[f64; 2]> = ideal.collect();
    let mut best: Option<(f64, [Polynomial; 2])> = None;
    for order in forward[0].order..=MAX_INVERSE_ORDER {
        let Some(fitted) = fit(order, &points, &ideal, camera.radius_px()) else {
            break;
        };
        let error_px = points.iter().zip(&ideal).map(|(at, there)| {
            let back = [
                there[0] + fitted[0].at(*there),
                there[1] + fitted[1].at(*there),
            ];
            PixelPoint::new(back[0], back[1]).distance_to(&PixelPoint::new(at[0], at[1]))
        });
        let error_px = error_px.fold(0.0, f64::max);
        if best.as_ref().is_none_or(|(least, _)| error_px < *least) {
            best = Some((error_px, fitted));
        }
        if error_px < INVERSE_TOLERANCE_PX {
            break;
        }
    }
    best.map_or_else(|| forward.clone(), |(_, inverse)| inverse)
}

/// Offsets on the frame, denser towards its borders, where polynomials are worst.
fn points(half: [f64; 2]) -> Vec<[f64; 2]> {
    let node = |i: usize| {
        let angle = (i as f64 + 0.5) / FIT_POINTS as f64 * std::f64::consts::PI;
        let outermost = (0.5 / FIT_POINTS as f64 * std::f64::consts::PI).cos();
        FIT_REACH * angle.cos() / outermost
    };
    (0..FIT_POINTS)
        .flat_map(|i| (0..FIT_POINTS).map(move |j| [half[0] * node(i), half[1] * node(j)]))
        .collect()
}

/// Fits by least squares the polynomials of ideal offsets that give the shift to observed ones.
fn fit(
    order: usize,
    observed: &[[f64; 2]],
    ideal: &[[f64; 2]],
    radius_px: f64,
) -> Option<[Polynomial; 2]> {
    let terms: Vec<(usize, usize)> = powers(order).collect();
    // In units of the radius, so that high powers stay of order one.
    let design = DMatrix::from_fn(ideal.len(), terms.len(), |row, column| {
        let ([u, v], (p, q)) = (ideal[row], terms[column]);
        (u / radius_px).powi(p as i32) * (v / radius_px).powi(q as i32)
    });
    let decomposed = design.svd(true, true);
    let solve = |axis: usize| {
        let shift = |(o, i): (&[f64; 2], &[f64; 2])| o[axis] - i[axis];
        let shifts = DVector::from_iterator(observed.len(), observed.iter().zip(ideal).map(shift));
        let solved = decomposed.solve(&shifts, 1e-12).ok()?;
        let coefficient =
            |(value, (p, q)): (&f64, &(usize, usize))| value / radius_px.powi((p + q) as i32);
        Some(Polynomial {
            order,
            coefficients: solved.iter().zip(&terms).map(coefficient).collect(),
        })
    };
    Some([solve(0)?, solve(1)?])
}
