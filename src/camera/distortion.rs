//! Distortion of the image by the lens and by differential refraction.
//!
//! observed offset (u, v) from the frame's centre → ideal offset (u, v) + Σ cₖ Bₖ(u/R, v/R), in
//! pixels.
//!
//! The direction is that of the SIP convention (Shupe et al. 2005, ASP Conf. 347, 491: pixel →
//! ideal), so that a FITS header needs no inversion. R is half the frame's diagonal, so a
//! coefficient is the displacement in pixels by its term at a corner. Rotation, shift and scale are
//! not part of the distortion: they belong to the attitude and the focal length.

use multiversion::multiversion;

/// Form of the distortion polynomial.
///
/// # Reference
/// Brown 1971, Photogrammetric Engineering 37, 855 (radial and decentring terms).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum DistortionModel {
    /// One radial term, r³.
    Radial,
    /// Two radial terms, r³ and r⁵.
    Radial5,
    /// Three radial terms, r³, r⁵ and r⁷.
    Radial7,
    /// [`DistortionModel::Radial7`], a decentred lens (2 terms) and a tilted detector (2).
    BrownConrady,
    /// Unequal scale along two axes (2 terms), second order (6) and third order (8): tilted
    /// detectors, decentred lenses, differential refraction.
    Cubic,
    /// [`DistortionModel::Cubic`], fourth order (10 terms) and fifth order (12).
    Quintic,
}

impl DistortionModel {
    /// Every model, simplest first.
    pub const ALL: [Self; 6] = [
        Self::Radial,
        Self::Radial5,
        Self::Radial7,
        Self::BrownConrady,
        Self::Cubic,
        Self::Quintic,
    ];

    /// The models of lenses, simplest first. Each has the terms of those before it.
    pub const LENSES: [Self; 4] = [
        Self::Radial,
        Self::Radial5,
        Self::Radial7,
        Self::BrownConrady,
    ];

    /// Number of coefficients.
    pub const fn terms(self) -> usize {
        match self {
            Self::Radial => 1,
            Self::Radial5 => 2,
            Self::Radial7 => 3,
            Self::BrownConrady => LENS_TERMS,
            Self::Cubic => 16,
            Self::Quintic => 38,
        }
    }

    /// Name, as in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Radial => "radial",
            Self::Radial5 => "radial5",
            Self::Radial7 => "radial7",
            Self::BrownConrady => "brown_conrady",
            Self::Cubic => "cubic",
            Self::Quintic => "quintic",
        }
    }

    /// Order of the polynomial.
    pub const fn order(self) -> usize {
        match self {
            Self::Radial | Self::Cubic => 3,
            Self::Radial5 | Self::Quintic => 5,
            Self::Radial7 | Self::BrownConrady => 7,
        }
    }

    /// Whether it is one of [`Self::LENSES`], and not a polynomial of all monomials.
    pub const fn is_lens(self) -> bool {
        match self {
            Self::Radial | Self::Radial5 | Self::Radial7 | Self::BrownConrady => true,
            Self::Cubic | Self::Quintic => false,
        }
    }
}

/// Number of terms of a lens.
pub const LENS_TERMS: usize = 7;

/// The terms of a lens along u and v at a normalized offset: r³, r⁵, r⁷; a lens decentred along u
/// and along v, in thirds, so that each is at most r²; a detector tilted along u and along v.
#[inline(always)]
pub(crate) fn lens_terms([u, v]: [f64; 2]) -> [[f64; LENS_TERMS]; 2] {
    const THIRD: f64 = 1.0 / 3.0;
    let [uu, uv, vv] = [u * u, u * v, v * v];
    let r2 = uu + vv;
    let (r4, r6) = (r2 * r2, r2 * r2 * r2);
    let (far, across, near) = (uu + THIRD * vv, 2.0 * THIRD * uv, THIRD * uu + vv);
    [
        [u * r2, u * r4, u * r6, far, across, uu, uv],
        [v * r2, v * r4, v * r6, across, near, uv, vv],
    ]
}

/// Number of monomials of second and third order.
pub(crate) const CUBIC_MONOMIALS: usize = 7;
/// Number of monomials of second to fifth order.
pub(crate) const QUINTIC_MONOMIALS: usize = 18;

/// The first `K` monomials of second and higher order: by order, then by falling power of u.
#[inline]
pub(crate) fn monomials<const K: usize>([u, v]: [f64; 2]) -> [f64; K] {
    let (mut u_powers, mut v_powers) = ([1.0; MAX_ORDER + 1], [1.0; MAX_ORDER + 1]);
    for power in 1..=MAX_ORDER {
        u_powers[power] = u_powers[power - 1] * u;
        v_powers[power] = v_powers[power - 1] * v;
    }
    let powers = const { powers::<K>() };
    powers.map(|[of_u, of_v]| u_powers[of_u] * v_powers[of_v])
}

/// [`monomials`] for several offsets at once.
#[inline(always)]
pub(crate) fn monomials_in_lanes<const K: usize>([u, v]: [&[f64; LANES]; 2]) -> [[f64; LANES]; K] {
    let (u_powers, v_powers) = (powers_of(u), powers_of(v));
    let mut monomials = [[0.0; LANES]; K];
    for (monomial, [of_u, of_v]) in monomials.iter_mut().zip(const { powers::<K>() }) {
        for lane in 0..LANES {
            monomial[lane] = u_powers[of_u][lane] * v_powers[of_v][lane];
        }
    }
    monomials
}

#[inline(always)]
fn powers_of(offsets: &[f64; LANES]) -> [[f64; LANES]; MAX_ORDER + 1] {
    let mut powers = [[1.0; LANES]; MAX_ORDER + 1];
    for power in 1..=MAX_ORDER {
        for lane in 0..LANES {
            powers[power][lane] = powers[power - 1][lane] * offsets[lane];
        }
    }
    powers
}

/// The powers of u and v in the first `K` monomials.
const fn powers<const K: usize>() -> [[usize; 2]; K] {
    let mut powers = [[0; 2]; K];
    let (mut order, mut of_v, mut next) = (2, 0, 0);
    while next < K {
        powers[next] = [order - of_v, of_v];
        next += 1;
        of_v += 1;
        if of_v > order {
            (order, of_v) = (order + 1, 0);
        }
    }
    powers
}

/// Number of offsets that are computed together.
pub(crate) const LANES: usize = 8;

/// Inverts the polynomial for [`LANES`] offsets: the observed offsets, and whether each converged.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn apply_to_lanes(
    distortion: &Distortion,
    ideal: &[[f64; LANES]; 2],
) -> ([[f64; LANES]; 2], [bool; LANES]) {
    let mut observed = *ideal;
    let (mut found, mut diverged) = ([false; LANES], [false; LANES]);
    for _ in 0..INVERSION_STEPS {
        let removed = distortion.remove_from_lanes(&observed);
        let mut is_open = false;
        for lane in 0..LANES {
            let error = [0, 1].map(|axis| ideal[axis][lane] - removed[axis][lane]);
            let is_done = found[lane] | diverged[lane];
            for axis in 0..2 {
                let next = observed[axis][lane] + error[axis];
                observed[axis][lane] = if is_done { observed[axis][lane] } else { next };
            }
            let is_exact = error[0].abs() + error[1].abs() < INVERSION_TOLERANCE_PX;
            let reach_px = observed[0][lane].abs() + observed[1][lane].abs();
            let is_near = reach_px <= 10.0 * distortion.radius_px;
            found[lane] |= !is_done & is_exact;
            diverged[lane] |= !is_done & !is_exact & !is_near;
            is_open |= !(found[lane] | diverged[lane]);
        }
        if !is_open {
            break;
        }
    }
    (observed, found)
}

/// Distortion relative to a pinhole camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distortion {
    model: DistortionModel,
    radius_px: f64,
    /// One per term of the model, then zeros.
    coefficients_px: [f64; MAX_TERMS],
}

/// Highest order of any model.
const MAX_ORDER: usize = 5;
/// Largest number of terms of any model.
const MAX_TERMS: usize = DistortionModel::Quintic.terms();

/// Maximum number of steps of the fixed-point iteration that inverts the polynomial.
const INVERSION_STEPS: usize = 50;
/// Residual at which the iteration stops.
const INVERSION_TOLERANCE_PX: f64 = 1e-5;

impl Distortion {
    /// Makes a distortion with one coefficient in pixels per term of `model`. Offsets are divided
    /// by `radius_px` in the polynomial.
    ///
    /// # Panics
    /// If the number of coefficients is not the number of terms.
    pub fn new(model: DistortionModel, radius_px: f64, coefficients_px: &[f64]) -> Self {
        assert_eq!(coefficients_px.len(), model.terms(), "one per term");
        let mut padded = [0.0; MAX_TERMS];
        padded[..model.terms()].copy_from_slice(coefficients_px);
        Self {
            model,
            radius_px,
            coefficients_px: padded,
        }
    }

    /// The distortion model.
    pub fn model(&self) -> DistortionModel {
        self.model
    }

    /// The radius R by which offsets are divided, in pixels.
    pub fn radius_px(&self) -> f64 {
        self.radius_px
    }

    /// The coefficients in pixels, one per term, with (u, v) the normalized offset and r its length.
    ///
    /// - Lenses, as many as the model has: r² (u, v); r⁴ (u, v); r⁶ (u, v); (u² + v²/3, 2uv/3) and
    ///   (2uv/3, u²/3 + v²), decentring; u (u, v) and v (u, v), tilt.
    /// - Other models: (u, −v) and (v, u), then two for each monomial of second and higher order,
    ///   along u and along v; monomials are sorted by order, then by falling power of u.
    pub fn coefficients_px(&self) -> &[f64] {
        &self.coefficients_px[..self.model.terms()]
    }

    /// The terms of the polynomial: powers of u/R and v/R, and the coefficients along u and v in
    /// pixels. The same powers may occur more than once.
    pub fn monomials(&self) -> Vec<(usize, usize, [f64; 2])> {
        if self.model.is_lens() {
            return self.lens_monomials();
        }
        let c = self.coefficients_px();
        let mut monomials = vec![(1, 0, [c[0], c[1]]), (0, 1, [c[1], -c[0]])];
        let powers = const { powers::<QUINTIC_MONOMIALS>() };
        let pairs = c[2..].as_chunks().0;
        monomials.extend(
            powers
                .iter()
                .zip(pairs)
                .map(|([p, q], pair)| (*p, *q, *pair)),
        );
        monomials
    }

    /// The terms of a lens, expanded.
    fn lens_monomials(&self) -> Vec<(usize, usize, [f64; 2])> {
        let [third, fifth, seventh, along_u, along_v, tilt_u, tilt_v] = self.lens_coefficients();
        let across = [2.0 / 3.0 * along_u, 2.0 / 3.0 * along_v];
        let mut monomials = vec![
            (2, 0, [along_u + tilt_u, along_v / 3.0]),
            (1, 1, [across[1] + tilt_v, across[0] + tilt_u]),
            (0, 2, [along_u / 3.0, along_v + tilt_v]),
        ];
        // r² = u² + v², and its powers.
        let expanded: [(f64, &[f64]); 3] = [
            (third, &[1.0, 1.0]),
            (fifth, &[1.0, 2.0, 1.0]),
            (seventh, &[1.0, 3.0, 3.0, 1.0]),
        ];
        for (coefficient, binomials) in expanded {
            let most = 2 * (binomials.len() - 1);
            for (of_v, binomial) in binomials.iter().enumerate() {
                let (p, q, value) = (most - 2 * of_v, 2 * of_v, coefficient * binomial);
                monomials.push((p + 1, q, [value, 0.0]));
                monomials.push((p, q + 1, [0.0, value]));
            }
        }
        let order = self.model.order();
        monomials.retain(|(p, q, _)| p + q <= order);
        monomials
    }

    /// The coefficients of all terms of a lens; those that the model lacks are 0.
    #[inline(always)]
    fn lens_coefficients(&self) -> [f64; LENS_TERMS] {
        std::array::from_fn(|term| self.coefficients_px[term])
    }

    /// Converts the observed offset to the ideal one, in pixels.
    #[inline]
    pub fn remove(&self, observed: [f64; 2]) -> [f64; 2] {
        let [u, v] = [observed[0] / self.radius_px, observed[1] / self.radius_px];
        match self.model {
            DistortionModel::Radial
            | DistortionModel::Radial5
            | DistortionModel::Radial7
            | DistortionModel::BrownConrady => self.lens([u, v], observed),
            DistortionModel::Cubic => self.polynomial::<CUBIC_MONOMIALS>([u, v], observed),
            DistortionModel::Quintic => self.polynomial::<QUINTIC_MONOMIALS>([u, v], observed),
        }
    }

    /// Adds the displacement by a lens at the normalized offset to `observed`.
    #[inline(always)]
    fn lens(&self, offset: [f64; 2], observed: [f64; 2]) -> [f64; 2] {
        let (terms, c) = (lens_terms(offset), self.lens_coefficients());
        let shift = |axis: usize| -> f64 { terms[axis].iter().zip(&c).map(|(t, c)| t * c).sum() };
        [observed[0] + shift(0), observed[1] + shift(1)]
    }

    /// Adds the displacement by a model with `K` monomials at the normalized offset to `observed`.
    #[inline]
    fn polynomial<const K: usize>(&self, [u, v]: [f64; 2], observed: [f64; 2]) -> [f64; 2] {
        let c = &self.coefficients_px;
        let mut along_u = observed[0] + c[0] * u + c[1] * v;
        let mut along_v = observed[1] - c[0] * v + c[1] * u;
        for (monomial, [of_u, of_v]) in monomials::<K>([u, v]).iter().zip(c[2..].as_chunks().0) {
            along_u += of_u * monomial;
            along_v += of_v * monomial;
        }
        [along_u, along_v]
    }

    /// Converts the ideal offset to the observed one, in pixels. `None` if the inversion does not
    /// converge, which may happen far outside the frame.
    pub fn apply(&self, ideal: [f64; 2]) -> Option<[f64; 2]> {
        let mut observed = ideal;
        for _ in 0..INVERSION_STEPS {
            let removed = self.remove(observed);
            let error = [ideal[0] - removed[0], ideal[1] - removed[1]];
            observed = [observed[0] + error[0], observed[1] + error[1]];
            if error[0].abs() + error[1].abs() < INVERSION_TOLERANCE_PX {
                return Some(observed);
            }
            let reach_px = observed[0].abs() + observed[1].abs();
            if reach_px.is_nan() || reach_px > 10.0 * self.radius_px {
                return None;
            }
        }
        None
    }

    /// [`Self::apply`] for several offsets in vector registers, with identical results; `None`
    /// becomes false.
    pub(super) fn apply_to_lanes(
        &self,
        ideal: &[[f64; LANES]; 2],
    ) -> ([[f64; LANES]; 2], [bool; LANES]) {
        apply_to_lanes(self, ideal)
    }

    /// [`Self::remove`] for several offsets.
    #[inline(always)]
    pub(super) fn remove_from_lanes(&self, observed: &[[f64; LANES]; 2]) -> [[f64; LANES]; 2] {
        match self.model {
            DistortionModel::Radial
            | DistortionModel::Radial5
            | DistortionModel::Radial7
            | DistortionModel::BrownConrady => self.lens_lanes(observed),
            DistortionModel::Cubic => self.polynomial_lanes::<CUBIC_MONOMIALS>(observed),
            DistortionModel::Quintic => self.polynomial_lanes::<QUINTIC_MONOMIALS>(observed),
        }
    }

    #[inline(always)]
    fn lens_lanes(&self, observed: &[[f64; LANES]; 2]) -> [[f64; LANES]; 2] {
        let mut ideal = *observed;
        for lane in 0..LANES {
            let observed = [observed[0][lane], observed[1][lane]];
            let offset = observed.map(|along| along / self.radius_px);
            [ideal[0][lane], ideal[1][lane]] = self.lens(offset, observed);
        }
        ideal
    }

    #[inline(always)]
    fn polynomial_lanes<const K: usize>(&self, observed: &[[f64; LANES]; 2]) -> [[f64; LANES]; 2] {
        let c = &self.coefficients_px;
        let [u, v] = observed.map(|offsets| offsets.map(|offset| offset / self.radius_px));
        let mut ideal = *observed;
        for lane in 0..LANES {
            ideal[0][lane] = observed[0][lane] + c[0] * u[lane] + c[1] * v[lane];
            ideal[1][lane] = observed[1][lane] - c[0] * v[lane] + c[1] * u[lane];
        }
        let monomials = monomials_in_lanes::<K>([&u, &v]);
        for (monomial, pair) in monomials.iter().zip(c[2..].as_chunks::<2>().0) {
            for lane in 0..LANES {
                ideal[0][lane] += pair[0] * monomial[lane];
                ideal[1][lane] += pair[1] * monomial[lane];
            }
        }
        ideal
    }

    /// The largest displacement on a circle of radius R, in pixels.
    pub fn largest_px(&self) -> f64 {
        (0..64)
            .map(|step| {
                let (sin, cos) = (f64::from(step) / 64.0 * std::f64::consts::TAU).sin_cos();
                let edge = [self.radius_px * cos, self.radius_px * sin];
                let ideal = self.remove(edge);
                (ideal[0] - edge[0]).hypot(ideal[1] - edge[1])
            })
            .fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_expanded_polynomial_is_the_displacement() {
        for model in DistortionModel::ALL {
            let coefficient = |term: usize| 3.0 - 1.7 * (term % 5) as f64;
            let coefficients: Vec<f64> = (0..model.terms()).map(coefficient).collect();
            let distortion = Distortion::new(model, 500.0, &coefficients);
            for [u, v] in [[0.3_f64, -0.8], [-0.6, 0.1], [0.7, 0.7]] {
                let [mut along_u, mut along_v] = [500.0 * u, 500.0 * v];
                for (p, q, [of_u, of_v]) in distortion.monomials() {
                    assert!(p + q <= model.order(), "{model:?}");
                    let monomial = u.powi(p as i32) * v.powi(q as i32);
                    along_u += of_u * monomial;
                    along_v += of_v * monomial;
                }
                let found = distortion.remove([500.0 * u, 500.0 * v]);
                let off_px = (found[0] - along_u).hypot(found[1] - along_v);
                assert!(off_px < 1e-10, "{model:?} {off_px}");
            }
        }
    }

    #[test]
    fn each_term_of_a_lens_moves_a_point_on_its_axis_at_the_radius_by_its_coefficient() {
        for term in 0..LENS_TERMS {
            let mut coefficients = [0.0; LENS_TERMS];
            coefficients[term] = 1.0;
            let model = DistortionModel::BrownConrady;
            let distortion = Distortion::new(model, 100.0, &coefficients);
            let at = if matches!(term, 4 | 6) {
                [0.0, 100.0]
            } else {
                [100.0, 0.0]
            };
            let found = distortion.remove(at);
            assert!(
                (found[0] + found[1] - 101.0).abs() < 1e-12,
                "{term} {found:?}"
            );
        }
    }
}
