//! A lens distortion as SIP polynomials in pixel offsets.

use crate::base::coords::PixelPoint;
use crate::camera::{CameraModel, Distortion};
use nalgebra::{DMatrix, DVector, Matrix2, Vector2};

/// The highest order of the inverse: keywords have one digit for each power.
const MAX_INVERSE_ORDER: usize = 9;
/// The inverse is good enough where it is off by less than this many pixels everywhere on the frame.
const INVERSE_TOLERANCE_PX: f64 = 1e-3;
/// The inverse is fitted on so many points a side, which lie closer towards the borders, ...
const FIT_POINTS: usize = 24;
/// ... as far as this beyond the frame's border, in units of its half side.
const FIT_REACH: f64 = 1.02;

/// A polynomial in two offsets, in pixels.
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
    /// The powers of the first and the second offset, and the coefficient of each term.
    pub(super) fn terms(&self) -> impl Iterator<Item = (usize, usize, f64)> {
        powers(self.order)
            .zip(&self.coefficients)
            .map(|((p, q), value)| (p, q, *value))
    }

    fn at(&self, [u, v]: [f64; 2]) -> f64 {
        self.terms()
            .map(|(p, q, value)| value * u.powi(p as i32) * v.powi(q as i32))
            .sum()
    }
}

/// A distortion as FITS writes it.
///
/// SIP keeps terms of first order out of its polynomials: with observed offsets U in the file's own
/// directions, ideal offset = `linear` (U + `forward`(U)).
#[derive(Debug, Clone)]
pub(super) struct Sip {
    /// What the linear part of the distortion does, to be multiplied into `CD`.
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
}

/// The terms of the distortion by their powers, the linear ones apart.
fn expand(distortion: &Distortion, mirrored: bool) -> (Matrix2<f64>, [Polynomial; 2]) {
    let order = distortion.model().order();
    let sign: f64 = if mirrored { -1.0 } else { 1.0 };
    let count = powers(order).count();
    let mut linear = Matrix2::identity();
    let mut higher = vec![Vector2::zeros(); count];
    for (p, q, along) in distortion.monomials() {
        let scale = distortion.radius_px().powi((p + q) as i32);
        // Reversed x: u changes its sign as a variable, and as a result.
        let flip = sign * sign.powi(p as i32);
        let turned = Vector2::new(along[0] * flip, along[1] * sign.powi(p as i32)) / scale;
        match (p, q) {
            (1, 0) => linear.set_column(0, &(linear.column(0) + turned)),
            (0, 1) => linear.set_column(1, &(linear.column(1) + turned)),
            _ => {
                if let Some(place) = powers(order).position(|powers| powers == (p, q)) {
                    higher[place] += turned;
                }
            }
        }
    }
    // Close to one: lenses do not fold the image.
    let inverse = linear.try_inverse().unwrap_or_else(Matrix2::identity);
    let polynomial = |axis: usize| Polynomial {
        order,
        coefficients: higher.iter().map(|term| (inverse * term)[axis]).collect(),
    };
    (linear, [polynomial(0), polynomial(1)])
}

/// The polynomials that undo `forward` over the frame, of the lowest order that is good enough.
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

/// Offsets on the frame, closer towards its borders, where polynomials are worst.
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

/// Least squares: polynomials of the ideal offsets that give the shift back to the observed ones.
fn fit(
    order: usize,
    observed: &[[f64; 2]],
    ideal: &[[f64; 2]],
    radius_px: f64,
) -> Option<[Polynomial; 2]> {
    let terms: Vec<(usize, usize)> = powers(order).collect();
    // In units of the radius, so that high powers stay near one.
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
