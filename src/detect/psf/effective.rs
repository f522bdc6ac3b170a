//! The effective point spread function of a frame whose spots are not round Gaussians: a mixture of
//! round Gaussians on a grid, integrated over the pixels, stretched and turned over the field.
//!
//! # Reference
//! Anderson & King 2000, PASP 112, 1360, doi 10.1086/316632, for the effective PSF and its change
//! over the field.

use super::gaussian::{GaussianComponent, MAX_WINDOW_PX};
use super::table::{ComponentExtent, PsfTable};
use crate::base::size::Size;
use crate::detect::detection::MeasuredPsf;

/// Size and elongation of a spot: `[ln σ, e₁, e₂]`. Its covariance is `σ² exp(e₁ K + e₂ L)` with the
/// matrices K = diag(1, −1) and L = ((0, 1), (1, 0)): its axes are in a ratio of `exp |e|`.
pub(crate) type SpotMoments = [f64; 3];

/// Terms of the polynomials over the field: 1, x, y; x², xy, y²; the last three times r².
pub(crate) const FIELD_TERMS: usize = 9;

/// A part of the spots of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FieldComponent {
    /// Where its share is that of the centre of the frame.
    pub component: GaussianComponent,
    /// Its share in the corners, where the spots turn with the field.
    pub corner_share: f64,
}

/// The spot at one place: a mixture of Gaussians, or a single one.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct LocalPsf {
    /// Empty where it is tabulated, and for a single Gaussian of the size that is fitted.
    pub components: Vec<GaussianComponent>,
    /// The size, as [`SpotFit::spot_px`](crate::detect::fit::SpotFit::spot_px), of a spot that is not scaled, in
    /// pixels.
    pub spot_px: f64,
    /// The spot of that size, where it is tabulated.
    pub table: PsfTable,
}

impl LocalPsf {
    /// Becomes a copy of another spot, without a new allocation where it fits.
    pub fn copy_from(&mut self, other: &Self) {
        self.components.clone_from(&other.components);
        self.spot_px = other.spot_px;
        self.table.copy_from(&other.table);
    }

    /// Tabulates the components, unless they are too sharp.
    pub fn tabulate(&mut self) {
        let mut extent = ComponentExtent::default();
        extent.add(&self.components);
        match extent.layout() {
            Some(layout) => self.table.fill(&self.components, layout),
            None => self.table.clear(),
        }
    }

    /// Becomes a single Gaussian.
    pub fn clear(&mut self) {
        self.components.clear();
        self.table.clear();
    }

    /// Whether it is a single Gaussian.
    pub fn is_gaussian(&self) -> bool {
        self.components.is_empty() && self.table.is_empty()
    }
}

/// Where on the frame a star is: relative to the centre, in units of half of the diagonal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FieldFrame {
    centre_px: [f64; 2],
    radius_px: f64,
}

impl FieldFrame {
    /// Of a frame of this size.
    pub fn new(size: Size) -> Self {
        let [width, height] = size.sides().map(|side| side as f64);
        Self {
            centre_px: [0.5 * (width - 1.0), 0.5 * (height - 1.0)],
            radius_px: 0.5 * libm::hypot(width, height),
        }
    }

    /// Distance from the centre at a pixel, at most that of the corners: 1.
    pub fn distance(&self, x_px: f64, y_px: f64) -> f64 {
        let [_, x, y, ..] = self.terms(x_px, y_px);
        libm::hypot(x, y).min(1.0)
    }

    /// Values of the terms of the polynomials at a pixel.
    pub fn terms(&self, x_px: f64, y_px: f64) -> [f64; FIELD_TERMS] {
        let x = (x_px - self.centre_px[0]) / self.radius_px;
        let y = (y_px - self.centre_px[1]) / self.radius_px;
        let r2 = x * x + y * y;
        let [xx, xy, yy] = [x * x, x * y, y * y];
        [1.0, x, y, xx, xy, yy, xx * r2, xy * r2, yy * r2]
    }
}

/// Size and elongation over the field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FieldMoments {
    /// The frame that the terms refer to.
    pub frame: FieldFrame,
    /// Coefficients of each of the moments.
    pub coefficients: [[f64; FIELD_TERMS]; 3],
    /// Smallest and largest value of each: the polynomials do not hold beyond the stars.
    pub range: [[f64; 2]; 3],
}

impl FieldMoments {
    /// The same moments everywhere.
    pub fn constant(frame: FieldFrame, moments: SpotMoments) -> Self {
        Self {
            frame,
            coefficients: moments.map(|moment| {
                let mut coefficients = [0.0; FIELD_TERMS];
                coefficients[0] = moment;
                coefficients
            }),
            range: moments.map(|moment| [moment; 2]),
        }
    }

    /// The moments at a pixel.
    pub fn at(&self, x_px: f64, y_px: f64) -> SpotMoments {
        let moments = polynomials(&self.coefficients, &self.frame.terms(x_px, y_px));
        std::array::from_fn(|i| moments[i].clamp(self.range[i][0], self.range[i][1]))
    }
}

/// Values of the polynomials with these coefficients.
pub(crate) fn polynomials(
    coefficients: &[[f64; FIELD_TERMS]; 3],
    terms: &[f64; FIELD_TERMS],
) -> SpotMoments {
    let value = |row: &[f64; FIELD_TERMS]| row.iter().zip(terms).map(|(c, t)| c * t).sum();
    coefficients.each_ref().map(value)
}

/// How the spots change over the field, apart from their moments.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum FieldForm {
    /// Not at all, and they are the same turned by 180 degrees: motion, defocus.
    Symmetric,
    /// Not at all.
    Fixed,
    /// They point outward, and their components' shares change linearly from the centre to the corners:
    /// coma.
    Radial,
}

/// The effective PSF of a frame.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct EffectivePsf {
    /// Of a spot of the typical moments; for [`FieldForm::Radial`], of a star to the right of the
    /// centre.
    pub components: Vec<FieldComponent>,
    /// How they change over the field.
    pub form: FieldForm,
    /// Moments that the components have as they are.
    pub typical: SpotMoments,
    /// Moments over the field.
    pub moments: FieldMoments,
    /// Size of the frame's spot where it is taken for a round Gaussian, in pixels.
    pub spot_px: f64,
    /// Half of the side of a window that holds the spot, in pixels.
    pub radius_px: usize,
}

impl EffectivePsf {
    /// Round Gaussians of these sizes; elongations are left out.
    pub fn gaussian(moments: FieldMoments, spot_px: f64, radius_px: usize) -> Self {
        let component = GaussianComponent {
            offset_px: [0.0; 2],
            sigma_px: spot_px,
            share: 1.0,
        };
        let component = FieldComponent {
            component,
            corner_share: 1.0,
        };
        Self {
            components: vec![component],
            form: FieldForm::Symmetric,
            typical: [libm::log(spot_px), 0.0, 0.0],
            moments,
            spot_px,
            radius_px,
        }
    }

    /// Whether it is the same everywhere.
    pub fn is_uniform(&self) -> bool {
        let is_one = |[least, most]: &[f64; 2]| least == most;
        self.form != FieldForm::Radial && self.moments.range.iter().all(is_one)
    }

    /// What the spots of a frame of this size are like.
    pub fn summary(&self, size: Size) -> MeasuredPsf {
        /// Places along each side at which the spot is computed.
        const PLACES: usize = 9;
        let at = |side: usize, place: usize| (side - 1) as f64 * place as f64 / (PLACES - 1) as f64;
        let rows = (0..PLACES).flat_map(|y| (0..PLACES).map(move |x| (x, y)));
        let everywhere = rows.map(|(x, y)| self.moments.at(at(size.width, x), at(size.height, y)));
        let start = MeasuredPsf {
            axis_ratio: 1.0,
            sigma_range_px: [f64::INFINITY, 0.0],
            is_comatic: self.form == FieldForm::Radial,
        };
        everywhere.fold(start, |psf, [ln_sigma, e1, e2]| {
            let ([least, largest], sigma_px) = (psf.sigma_range_px, libm::exp(ln_sigma));
            MeasuredPsf {
                axis_ratio: psf.axis_ratio.max(libm::exp(libm::hypot(e1, e2))),
                sigma_range_px: [least.min(sigma_px), largest.max(sigma_px)],
                ..psf
            }
        })
    }

    /// The spot at a pixel, its centre of light at its place.
    pub fn at(&self, x_px: f64, y_px: f64, local: &mut LocalPsf) {
        self.place_components(x_px, y_px, local);
        let components = &mut local.components;
        let sum: f64 = components.iter().map(|component| component.share).sum();
        for axis in 0..2 {
            let moments = components
                .iter()
                .map(|component| component.share * component.offset_px[axis]);
            let centre = moments.sum::<f64>() / sum;
            for component in components.iter_mut() {
                component.offset_px[axis] -= centre;
            }
        }
        for component in components {
            component.share /= sum;
        }
    }

    /// The components at a pixel, about the point that their offsets refer to.
    pub fn place_components(&self, x_px: f64, y_px: f64, local: &mut LocalPsf) {
        let here = self.moments.at(x_px, y_px);
        let mut stretch = product(root(here), inverse_root(self.typical));
        let mut outward = 0.0;
        if self.form == FieldForm::Radial {
            let [_, x, y, ..] = self.moments.frame.terms(x_px, y_px);
            outward = libm::hypot(x, y).min(1.0);
            let [cos, sin] = if outward > 0.0 {
                [x / outward, y / outward]
            } else {
                [1.0, 0.0]
            };
            stretch = product(stretch, [[cos, -sin], [sin, cos]]);
        }
        let scale = libm::exp(here[0] - self.typical[0]);
        local.components.clear();
        local
            .components
            .extend(self.components.iter().map(|of_field| {
                let GaussianComponent {
                    offset_px: [x, y],
                    sigma_px,
                    share,
                } = of_field.component;
                GaussianComponent {
                    offset_px: stretch.map(|[a, b]| a * x + b * y),
                    sigma_px: scale * sigma_px,
                    share: share + outward * (of_field.corner_share - share),
                }
            }));
        local.spot_px = self.spot_px;
    }

    /// Half of the side of the window of a spot of this size, in pixels.
    pub fn window_radius(&self, spot_px: f64) -> usize {
        let scaled = (self.radius_px as f64 * spot_px / self.spot_px).ceil() as usize;
        scaled.clamp(self.radius_px, (MAX_WINDOW_PX - 1) / 2)
    }
}

/// Rows of a matrix.
pub(crate) type Matrix = [[f64; 2]; 2];

/// Covariance of a spot, in px².
pub(crate) fn covariance([ln_sigma, e1, e2]: SpotMoments) -> Matrix {
    scaled_exponential(libm::exp(2.0 * ln_sigma), [e1, e2])
}

/// Derivatives of the covariance with respect to the moments: of xx, yy and xy.
pub(crate) fn covariance_by(moments: SpotMoments) -> [[f64; 3]; 3] {
    derivatives(moments, covariance).map(|[[xx, xy], [_, yy]]| [xx, yy, xy])
}

/// For each of the moments, the matrix by which a larger one moves the parts of a spot.
pub(crate) fn stretch_by(moments: SpotMoments) -> [Matrix; 3] {
    let inverse = inverse_root(moments);
    derivatives(moments, root).map(|change| product(change, inverse))
}

/// Derivatives of a matrix with respect to the moments.
fn derivatives(moments: SpotMoments, matrix: impl Fn(SpotMoments) -> Matrix) -> [Matrix; 3] {
    /// Half of the difference that is taken.
    const STEP: f64 = 1e-4;
    std::array::from_fn(|i| {
        let at = |step: f64| {
            let mut near = moments;
            near[i] += step;
            matrix(near)
        };
        let (above, below) = (at(STEP), at(-STEP));
        let slope = |r: usize, c: usize| (above[r][c] - below[r][c]) / (2.0 * STEP);
        [[slope(0, 0), slope(0, 1)], [slope(1, 0), slope(1, 1)]]
    })
}

/// The inverse of a symmetric matrix.
pub(crate) fn inverse([[xx, xy], [_, yy]]: Matrix) -> Matrix {
    let determinant = xx * yy - xy * xy;
    [
        [yy / determinant, -xy / determinant],
        [-xy / determinant, xx / determinant],
    ]
}

/// The symmetric square root of the covariance.
fn root([ln_sigma, e1, e2]: SpotMoments) -> Matrix {
    scaled_exponential(libm::exp(ln_sigma), [0.5 * e1, 0.5 * e2])
}

/// Its inverse.
fn inverse_root([ln_sigma, e1, e2]: SpotMoments) -> Matrix {
    scaled_exponential(libm::exp(-ln_sigma), [-0.5 * e1, -0.5 * e2])
}

/// `scale · exp(e₁ K + e₂ L)`.
fn scaled_exponential(scale: f64, [e1, e2]: [f64; 2]) -> Matrix {
    let e = libm::hypot(e1, e2);
    let sinh_per_e = if e > 0.0 { libm::sinh(e) / e } else { 1.0 };
    let [cosh, plus, cross] =
        [libm::cosh(e), sinh_per_e * e1, sinh_per_e * e2].map(|part| scale * part);
    [[cosh + plus, cross], [cross, cosh - plus]]
}

fn product(a: Matrix, b: Matrix) -> Matrix {
    a.map(|[p, q]| [0, 1].map(|column| p * b[0][column] + q * b[1][column]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lobes_are_stretched_to_the_moments_of_the_place() {
        let frame = FieldFrame::new(Size::new(101, 101));
        let mut moments = FieldMoments::constant(frame, [0.0; 3]);
        moments.range = [[-1.0, 1.0]; 3];
        // Wider and elongated along x to the right.
        moments.coefficients[0][1] = 0.3;
        moments.coefficients[1][1] = 0.8;
        let offsets = [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]];
        let component = |offset_px: [f64; 2]| FieldComponent {
            component: GaussianComponent {
                offset_px,
                sigma_px: 0.5,
                share: 0.25,
            },
            corner_share: 0.25,
        };
        let psf = EffectivePsf {
            components: offsets.map(component).to_vec(),
            form: FieldForm::Fixed,
            typical: [0.0; 3],
            moments,
            spot_px: 1.0,
            radius_px: 4,
        };
        let mut local = LocalPsf::default();
        psf.at(50.0, 50.0, &mut local);
        assert_eq!(
            local.components,
            psf.components
                .iter()
                .map(|l| l.component)
                .collect::<Vec<_>>()
        );
        psf.at(100.0, 50.0, &mut local);
        let moment = |i: usize| {
            local
                .components
                .iter()
                .map(|l| l.share * l.offset_px[i].powi(2))
                .sum::<f64>()
        };
        // Half of the unit circle's moment, times σ² and the ratio of the axes.
        let x = moments.frame.terms(100.0, 50.0)[1];
        assert!((moment(0) * moment(1) - 0.25 * (4.0 * 0.3 * x).exp()).abs() < 1e-12);
        assert!((moment(0) / moment(1) - (2.0 * 0.8 * x).exp()).abs() < 1e-9);
    }
}
