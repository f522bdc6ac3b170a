//! The mapping from a camera's pixels to a plane, as SIP polynomials of pixel offsets.

use crate::base::coords::{PixelPoint, UnitVector};
use crate::camera::CameraModel;
use nalgebra::{DMatrix, Matrix2};

/// Highest order; keywords have one digit per power.
pub(super) const MAX_ORDER: usize = 9;
/// Lowest order, to tell the linear part from the rest.
const MIN_ORDER: usize = 3;
/// Error at which no higher order is tried, in pixels.
const TOLERANCE_PX: f64 = 1e-5;
/// Points per side on which the polynomials are fitted, denser towards the borders.
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

/// The pairs of powers (p, q) of a polynomial of this order without a constant: 1 ≤ p + q ≤ order.
fn powers(order: usize) -> impl Iterator<Item = (usize, usize)> {
    let all = (0..=order).flat_map(move |p| (0..=order - p).map(move |q| (p, q)));
    all.skip(1)
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

/// The mapping from pixels to a plane, in SIP form.
///
/// SIP polynomials have no terms of first order: with offsets U from the pixel in the boresight, along
/// the file's axes, a place in the plane is `linear` (U + `forward`(U)), in pixels.
#[derive(Debug, Clone)]
pub(super) struct Sip {
    /// A factor of `CD`.
    pub(super) linear: Matrix2<f64>,
    /// `A` and `B`.
    pub(super) forward: [Polynomial; 2],
    /// `AP` and `BP`.
    pub(super) inverse: [Polynomial; 2],
}

impl Sip {
    /// The mapping of `camera`, whose boresight is at `reference`; `plane` is where a direction is on
    /// the plane, in units of the focal length. Orders are `max_order` at most; of order 1 the linear part is that
    /// which fits best. `None` where its pixels do not determine it.
    pub(super) fn new(
        camera: &CameraModel,
        reference: &PixelPoint,
        max_order: usize,
        plane: impl Fn(&UnitVector<crate::base::coords::Camera>) -> [f64; 2],
    ) -> Option<Self> {
        let focal_px = camera.focal_length_px();
        let mirror = if camera.mirrored { -1.0 } else { 1.0 };
        let seen = pixels(camera).into_iter().filter_map(|pixel| {
            let [x, y] = plane(&camera.direction_of(&pixel)?);
            let offset = [pixel.x - reference.x, pixel.y - reference.y];
            Some((offset, [mirror * focal_px * x, focal_px * y]))
        });
        let (offsets, places): (Vec<[f64; 2]>, Vec<[f64; 2]>) = seen.unzip();
        let scale_px = camera.radius_px();
        let whole = fit_best(&offsets, &places, scale_px, max_order)?;
        let linear_of = |axis: usize| {
            let of = |powers: (usize, usize)| {
                let mut terms = whole[axis].terms();
                terms
                    .find(|(p, q, _)| (*p, *q) == powers)
                    .map_or(0.0, |(_, _, value)| value)
            };
            [of((1, 0)), of((0, 1))]
        };
        let ([xx, xy], [yx, yy]) = (linear_of(0), linear_of(1));
        let linear = Matrix2::new(xx, xy, yx, yy);
        let back = linear.try_inverse()?;
        let forward = |axis: usize| {
            let terms = whole[0].terms().zip(whole[1].terms());
            let higher = |((p, q, x), (_, _, y)): ((usize, usize, f64), (usize, usize, f64))| {
                let value = back[(axis, 0)] * x + back[(axis, 1)] * y;
                if p + q == 1 { 0.0 } else { value }
            };
            Polynomial {
                order: whole[axis].order,
                coefficients: terms.map(higher).collect(),
            }
        };
        let straight: Vec<[f64; 2]> = places
            .iter()
            .map(|[x, y]| [0, 1].map(|axis| back[(axis, 0)] * x + back[(axis, 1)] * y))
            .collect();
        let shift = |(offset, straight): (&[f64; 2], &[f64; 2])| {
            [offset[0] - straight[0], offset[1] - straight[1]]
        };
        let shifts: Vec<[f64; 2]> = offsets.iter().zip(&straight).map(shift).collect();
        Some(Self {
            linear,
            forward: [forward(0), forward(1)],
            inverse: fit_best(&straight, &shifts, scale_px, max_order)?,
        })
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

/// Pixels all over the frame, denser towards its borders, where polynomials are worst.
fn pixels(camera: &CameraModel) -> Vec<PixelPoint> {
    let node = |i: usize| {
        let angle = (i as f64 + 0.5) / FIT_POINTS as f64 * std::f64::consts::PI;
        let outermost = libm::cos(0.5 / FIT_POINTS as f64 * std::f64::consts::PI);
        0.5 * FIT_REACH * libm::cos(angle) / outermost
    };
    let centre = camera.centre();
    let at = |i: usize, j: usize| {
        PixelPoint::new(
            centre.x + camera.width_px * node(i),
            centre.y + camera.height_px * node(j),
        )
    };
    let rows = |i: usize| (0..FIT_POINTS).map(move |j| at(i, j));
    (0..FIT_POINTS).flat_map(rows).collect()
}

/// The polynomials of the lowest order that map `from` to `to` well enough, or of the order that does
/// it best; none is higher than `max_order`.
fn fit_best(
    from: &[[f64; 2]],
    to: &[[f64; 2]],
    scale_px: f64,
    max_order: usize,
) -> Option<[Polynomial; 2]> {
    let max_order = max_order.clamp(1, MAX_ORDER);
    let determined = |order: &usize| powers(*order).count() <= from.len();
    let max_order = (1..=max_order).rev().find(determined)?;
    let fits = Fits::new(from, to, scale_px, max_order);
    let mut best: Option<(f64, [Polynomial; 2])> = None;
    for order in MIN_ORDER.min(max_order)..=max_order {
        let Some(fitted) = fits.of_order(order) else {
            break;
        };
        let errors_px = from.iter().zip(to).map(|(from, to)| {
            let [x, y] = [0, 1].map(|axis: usize| fitted[axis].at(*from) - to[axis]);
            libm::hypot(x, y)
        });
        let error_px = errors_px.fold(0.0, f64::max);
        if best.as_ref().is_none_or(|(least, _)| error_px < *least) {
            best = Some((error_px, fitted));
        }
        if error_px < TOLERANCE_PX {
            break;
        }
    }
    best.map(|(_, fitted)| fitted)
}

/// Least-squares fits of the polynomials of all orders to a highest one: columns are sorted by degree, so that a part
/// of one QR decomposition is the decomposition for each lower order.
struct Fits {
    scale_px: f64,
    triangle: DMatrix<f64>,
    /// Both axes, turned by the orthogonal factor.
    wanted: DMatrix<f64>,
}

impl Fits {
    fn new(from: &[[f64; 2]], to: &[[f64; 2]], scale_px: f64, max_order: usize) -> Self {
        let mut terms: Vec<(usize, usize)> = powers(max_order).collect();
        terms.sort_by_key(|term| column(*term));
        // In units of the scale, so that high powers stay of order one.
        let design = DMatrix::from_fn(from.len(), terms.len(), |row, column| {
            let ([u, v], (p, q)) = (from[row], terms[column]);
            (u / scale_px).powi(p as i32) * (v / scale_px).powi(q as i32)
        });
        let mut wanted = DMatrix::from_fn(to.len(), 2, |row, axis| to[row][axis]);
        let decomposed = design.qr();
        decomposed.q_tr_mul(&mut wanted);
        Self {
            scale_px,
            triangle: decomposed.unpack_r(),
            wanted,
        }
    }

    /// The fit of this order; `None` where the points do not determine it.
    fn of_order(&self, order: usize) -> Option<[Polynomial; 2]> {
        let count = powers(order).count();
        let triangle = self.triangle.view((0, 0), (count, count));
        let solved = triangle.solve_upper_triangular(&self.wanted.rows(0, count))?;
        let coefficient = |(p, q): (usize, usize), axis: usize| {
            solved[(column((p, q)), axis)] / self.scale_px.powi((p + q) as i32)
        };
        Some([0, 1].map(|axis| Polynomial {
            order,
            coefficients: powers(order).map(|term| coefficient(term, axis)).collect(),
        }))
    }
}

/// Where a term is among all, sorted by their degrees.
fn column((p, q): (usize, usize)) -> usize {
    let degree = p + q;
    degree * (degree + 1) / 2 - 1 + p
}
