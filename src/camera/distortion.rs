//! Distortion of the image by the lens, in the camera's direction: ideal → observed.
//!
//! ideal offset from the axis → radial and decentring terms → stretch and skew → where the axis
//! meets the frame → observed offset from the frame's centre, in pixels
//!
//! This is the direction of OpenCV and of the text books. Offsets are divided by R, half the
//! frame's diagonal, so a coefficient is a displacement in pixels at the distance of the corners.
//!
//! # Reference
//! Brown 1971, Photogrammetric Engineering 37, 855.

use crate::base::least_squares::solve_pair;

/// The terms of a lens that are not zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum DistortionModel {
    /// One radial term, r³.
    Radial,
    /// Two radial terms, r³ and r⁵.
    Radial5,
    /// Three radial terms, r³, r⁵ and r⁷.
    Radial7,
    /// [`DistortionModel::Radial7`], an axis off the frame's centre (2 terms), and a decentred lens
    /// (2).
    BrownConrady,
    /// [`DistortionModel::BrownConrady`], unequal scales along two axes (2).
    Stretched,
    /// [`DistortionModel::Stretched`], and what no lens does: all monomials of second and third order
    /// along each axis (14). Pictures that software has straightened, refraction.
    Irregular3,
    /// The same with all monomials of second to fifth order (36).
    Irregular5,
}

impl DistortionModel {
    /// Every model, simplest first. Each has the terms of those before it.
    pub const ALL: [Self; 7] = [
        Self::Radial,
        Self::Radial5,
        Self::Radial7,
        Self::BrownConrady,
        Self::Stretched,
        Self::Irregular3,
        Self::Irregular5,
    ];

    /// The models of lenses, simplest first.
    pub(crate) const LENSES: [Self; 5] = [
        Self::Radial,
        Self::Radial5,
        Self::Radial7,
        Self::BrownConrady,
        Self::Stretched,
    ];

    /// Number of coefficients.
    pub const fn terms(self) -> usize {
        match self {
            Self::Radial => 1,
            Self::Radial5 => 2,
            Self::Radial7 => 3,
            Self::BrownConrady => 7,
            Self::Stretched => LENS_TERMS,
            Self::Irregular3 => LENS_TERMS + 14,
            Self::Irregular5 => MAX_TERMS,
        }
    }

    /// The simplest model with this many coefficients or more.
    pub fn with_terms(count: usize) -> Option<Self> {
        let mut all = Self::ALL.into_iter();
        all.find(|model| count > 0 && model.terms() >= count)
    }

    /// Name, as in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Radial => "radial",
            Self::Radial5 => "radial5",
            Self::Radial7 => "radial7",
            Self::BrownConrady => "brown_conrady",
            Self::Stretched => "stretched",
            Self::Irregular3 => "irregular3",
            Self::Irregular5 => "irregular5",
        }
    }
}

/// Number of terms of a lens.
pub const LENS_TERMS: usize = 9;
/// Number of monomials of second to fifth order.
pub(crate) const MONOMIALS: usize = 18;
/// Largest number of terms of any model.
pub(crate) const MAX_TERMS: usize = LENS_TERMS + 2 * MONOMIALS;
/// Number of radial terms: r³, r⁵ and r⁷.
const RADIAL_TERMS: usize = 3;
/// The term that shifts the axis along u; the next one does along v.
const AXIS: usize = 3;
/// The term of a lens that is decentred along u; the next one, along v.
const DECENTRING: usize = 5;
/// Unequal scales along u and v; the next one, along the diagonals.
const STRETCH: usize = 7;

/// A distortion: a model and its coefficients.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distortion {
    model: DistortionModel,
    radius_px: f64,
    /// One per term of the model, then zeros.
    coefficients_px: [f64; MAX_TERMS],
    /// Ideal distance from the axis, squared and in units of R, at which the image folds, or beyond which
    /// monomials tell nothing.
    fold_sq: f64,
}

/// An ideal offset as it is observed, and the derivatives.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Observed {
    /// Offset from the frame's centre, in pixels.
    pub at: [f64; 2],
    /// Derivatives of the two coordinates by those of the ideal offset.
    pub by_ideal: [[f64; 2]; 2],
    /// Derivatives of the two coordinates by each coefficient of a lens.
    pub by_term: [[f64; LENS_TERMS]; 2],
}

/// Largest number of steps of Newton's method that inverts the distortion.
const MAX_INVERSION_STEPS: usize = 25;
/// Step at which the inversion ends, in units of R: its square is below any rounding.
const INVERTED: f64 = 1e-9;
/// Squared distance from the axis, in units of R, up to which folds are looked for. All of a frame is
/// nearer than this.
const FAR_SQ: f64 = 16.0;
/// Monomials are those of the frame: this far from the axis, over the farthest place that the frame can
/// have, they would image what is outside of it inside.
const BEYOND_FRAME: f64 = 1.5;

impl Distortion {
    /// Makes a distortion with one coefficient in pixels per term of `model`. Offsets are divided
    /// by `radius_px` in the terms.
    ///
    /// # Panics
    /// If the number of coefficients is not the number of terms.
    pub fn new(model: DistortionModel, radius_px: f64, coefficients_px: &[f64]) -> Self {
        assert_eq!(coefficients_px.len(), model.terms(), "one per term");
        let mut padded = [0.0; MAX_TERMS];
        padded[..model.terms()].copy_from_slice(coefficients_px);
        let radial = [0, 1, 2].map(|term: usize| padded[term] / radius_px);
        let fold_sq = fold_sq(radial);
        let fold_sq = if model >= DistortionModel::Irregular3 {
            let axis = [padded[AXIS], padded[AXIS + 1]].map(|along| along / radius_px);
            fold_sq.min((BEYOND_FRAME * (1.0 + libm::hypot(axis[0], axis[1]))).powi(2))
        } else {
            fold_sq
        };
        Self {
            model,
            radius_px,
            coefficients_px: padded,
            fold_sq,
        }
    }

    /// No displacement by any of the terms of `model`.
    pub(crate) fn zero(model: DistortionModel, radius_px: f64) -> Self {
        Self::new(model, radius_px, &[0.0; MAX_TERMS][..model.terms()])
    }

    /// The terms of `model` alone; those that this distortion lacks are 0.
    pub(crate) fn of_model(&self, model: DistortionModel) -> Self {
        Self::new(
            model,
            self.radius_px,
            &self.coefficients_px[..model.terms()],
        )
    }

    /// The radial terms alone.
    pub(crate) fn radial(&self) -> Self {
        self.of_model(DistortionModel::Radial7)
    }

    /// The same with changes added to the first coefficients, in pixels.
    pub(crate) fn changed(&self, changes_px: impl IntoIterator<Item = f64>) -> Self {
        let mut changed = *self;
        let coefficients = changed.coefficients_px[..self.model.terms()].iter_mut();
        for (coefficient, change) in coefficients.zip(changes_px) {
            *coefficient += change;
        }
        changed.of_model(self.model)
    }

    /// The distortion model.
    pub fn model(&self) -> DistortionModel {
        self.model
    }

    /// The radius R by which offsets are divided, in pixels.
    pub fn radius_px(&self) -> f64 {
        self.radius_px
    }

    /// The coefficients in pixels, as many as the model has, with (u, v) the ideal offset in units of
    /// R and r its length: r² (u, v); r⁴ (u, v); r⁶ (u, v); the axis, (1, 0) and (0, 1); decentring,
    /// (u² + v²/3, 2uv/3) and (2uv/3, u²/3 + v²); and of the result, without the axis, the stretch
    /// (u, −v) and the skew (v, u). Then two for each monomial, along u and along v; monomials are
    /// sorted by order, then by falling power of u.
    pub fn coefficients_px(&self) -> &[f64] {
        &self.coefficients_px[..self.model.terms()]
    }

    /// Where the axis meets the frame, as an offset from its centre along the camera's x and y axes,
    /// in pixels.
    pub fn axis_offset_px(&self) -> [f64; 2] {
        [self.coefficients_px[AXIS], self.coefficients_px[AXIS + 1]]
    }

    /// Stretch and skew, in units of R.
    pub(crate) fn stretch(&self) -> [f64; 2] {
        let c = self.normalized();
        [c[STRETCH], c[STRETCH + 1]]
    }

    /// The coefficients of the lens in units of R.
    #[inline(always)]
    fn normalized(&self) -> [f64; LENS_TERMS] {
        std::array::from_fn(|term| self.coefficients_px[term] / self.radius_px)
    }

    /// The displacement by the monomials at an ideal offset in units of R, and its derivatives by the
    /// offset, in the same units.
    #[inline(always)]
    fn irregular(&self, offset: [f64; 2]) -> ([f64; 2], [[f64; 2]; 2]) {
        if self.model < DistortionModel::Irregular3 {
            ([0.0; 2], [[0.0; 2]; 2])
        } else {
            self.sum_of_monomials(offset)
        }
    }

    /// Out of line: hardly any camera has them.
    #[inline(never)]
    fn sum_of_monomials(&self, offset: [f64; 2]) -> ([f64; 2], [[f64; 2]; 2]) {
        let (mut moved, mut by_ideal) = ([0.0; 2], [[0.0; 2]; 2]);
        let coefficients = self.coefficients_px[LENS_TERMS..].as_chunks::<2>().0;
        let values = monomials(offset).into_iter().zip(monomial_slopes(offset));
        for (coefficients, (value, slopes)) in coefficients.iter().zip(values) {
            for axis in 0..2 {
                let coefficient = coefficients[axis] / self.radius_px;
                moved[axis] += coefficient * value;
                by_ideal[axis][0] += coefficient * slopes[0];
                by_ideal[axis][1] += coefficient * slopes[1];
            }
        }
        (moved, by_ideal)
    }

    /// Converts the ideal offset from the axis to the observed one from the frame's centre, in
    /// pixels. `None` where the image would fold.
    #[inline]
    pub fn apply(&self, ideal: [f64; 2]) -> Option<[f64; 2]> {
        let c = self.normalized();
        let offset = self.before_fold(ideal)?;
        let (moved, _) = self.irregular(offset);
        Some(self.placed(&c, distorted(&c, offset), moved))
    }

    /// An ideal offset in units of R; `None` where the image would fold.
    #[inline(always)]
    fn before_fold(&self, ideal: [f64; 2]) -> Option<[f64; 2]> {
        let [u, v] = ideal.map(|along| along / self.radius_px);
        (u * u + v * v < self.fold_sq).then_some([u, v])
    }

    /// The place in pixels of what is distorted to (du, dv) and moved by the monomials.
    #[inline(always)]
    fn placed(&self, c: &[f64; LENS_TERMS], [du, dv]: [f64; 2], [mu, mv]: [f64; 2]) -> [f64; 2] {
        let [stretch, skew] = [c[STRETCH], c[STRETCH + 1]];
        let along_u = du + stretch * du + skew * dv + c[AXIS] + mu;
        let along_v = dv - stretch * dv + skew * du + c[AXIS + 1] + mv;
        [along_u * self.radius_px, along_v * self.radius_px]
    }

    /// [`Self::apply`], with the derivatives.
    #[inline(always)]
    pub(crate) fn observe(&self, ideal: [f64; 2]) -> Option<Observed> {
        let c = self.normalized();
        let offset = self.before_fold(ideal)?;
        let [du, dv] = distorted(&c, offset);
        let [[uu, uv], [vu, vv]] = slope(&c, offset);
        let [stretch, skew] = [c[STRETCH], c[STRETCH + 1]];
        let stretched = |[u, v]: [f64; 2]| [u + stretch * u + skew * v, v - stretch * v + skew * u];
        let ([by_u_u, by_u_v], [by_v_u, by_v_v]) = (stretched([uu, vu]), stretched([uv, vv]));
        let mut by_term = [[0.0; LENS_TERMS]; 2];
        let before = terms_before_stretch(offset);
        for term in 0..STRETCH {
            let moved = match term {
                AXIS => [1.0, 0.0],
                of_axis if of_axis == AXIS + 1 => [0.0, 1.0],
                _ => stretched([before[0][term], before[1][term]]),
            };
            (by_term[0][term], by_term[1][term]) = (moved[0], moved[1]);
        }
        (by_term[0][STRETCH], by_term[1][STRETCH]) = (du, -dv);
        (by_term[0][STRETCH + 1], by_term[1][STRETCH + 1]) = (dv, du);
        let (moved, [of_u, of_v]) = self.irregular(offset);
        Some(Observed {
            at: self.placed(&c, [du, dv], moved),
            by_ideal: [
                [by_u_u + of_u[0], by_v_u + of_u[1]],
                [by_u_v + of_v[0], by_v_v + of_v[1]],
            ],
            by_term,
        })
    }

    /// Converts the observed offset from the frame's centre to the ideal one from the axis, in
    /// pixels. `None` where nothing is imaged.
    #[inline]
    pub fn remove(&self, observed: [f64; 2]) -> Option<[f64; 2]> {
        let c = self.normalized();
        let [along_u, along_v] =
            [0, 1].map(|axis| observed[axis] / self.radius_px - c[AXIS + axis]);
        let [stretch, skew] = [c[STRETCH], c[STRETCH + 1]];
        let determinant = 1.0 - stretch * stretch - skew * skew;
        let unstretched = |[u, v]: [f64; 2]| {
            [
                ((1.0 - stretch) * u - skew * v) / determinant,
                ((1.0 + stretch) * v - skew * u) / determinant,
            ]
        };
        let wanted = unstretched([along_u, along_v]);
        let mut offset = wanted;
        for _ in 0..MAX_INVERSION_STEPS {
            let [du, dv] = distorted(&c, offset);
            let [[uu, uv], [vu, vv]] = slope(&c, offset);
            let (moved, [of_u, of_v]) = self.irregular(offset);
            let [mu, mv] = unstretched(moved);
            let [left_u, left_v] = [wanted[0] - du - mu, wanted[1] - dv - mv];
            let ([uu, vu], [uv, vv]) = {
                let ([a, b], [c, d]) = (
                    unstretched([of_u[0], of_v[0]]),
                    unstretched([of_u[1], of_v[1]]),
                );
                ([uu + a, vu + b], [uv + c, vv + d])
            };
            let (step, _) = solve_pair([[uu, uv], [vu, vv]], [left_u, left_v]);
            let length = step[0].abs() + step[1].abs();
            if !length.is_finite() {
                return None;
            }
            // A step beyond the fold would end on its far side.
            let shrink = (0.5 / length).min(1.0);
            offset = [offset[0] + shrink * step[0], offset[1] + shrink * step[1]];
            if length < INVERTED {
                let [u, v] = offset;
                let is_before_fold = u * u + v * v < self.fold_sq;
                return is_before_fold.then(|| offset.map(|along| along * self.radius_px));
            }
        }
        None
    }

    /// The largest displacement on a circle of radius R, without that of the axis, in pixels.
    pub fn largest_px(&self) -> f64 {
        self.largest_at_px(self.radius_px)
    }

    /// The same on a circle of this radius.
    pub(crate) fn largest_at_px(&self, radius_px: f64) -> f64 {
        let [axis_u, axis_v] = self.axis_offset_px();
        (0..64)
            .map(|step| {
                let (sin, cos) = libm::sincos(f64::from(step) / 64.0 * std::f64::consts::TAU);
                let edge = [radius_px * cos, radius_px * sin];
                let moved = self
                    .apply(edge)
                    .map(|[u, v]| libm::hypot(u - axis_u - edge[0], v - axis_v - edge[1]));
                // Where the image folds nothing is seen.
                moved.unwrap_or(radius_px)
            })
            .fold(0.0, f64::max)
    }
}

/// Radial and decentring terms at an ideal offset in units of R, with coefficients in the same.
#[inline(always)]
fn distorted(c: &[f64; LENS_TERMS], [u, v]: [f64; 2]) -> [f64; 2] {
    const THIRD: f64 = 1.0 / 3.0;
    let [uu, uv, vv] = [u * u, u * v, v * v];
    let r2 = uu + vv;
    let radial = 1.0 + r2 * (c[0] + r2 * (c[1] + r2 * c[2]));
    let [p, q] = [c[DECENTRING], c[DECENTRING + 1]];
    [
        u * radial + p * (uu + THIRD * vv) + q * (2.0 * THIRD * uv),
        v * radial + p * (2.0 * THIRD * uv) + q * (THIRD * uu + vv),
    ]
}

/// Derivatives of [`distorted`].
#[inline(always)]
fn slope(c: &[f64; LENS_TERMS], [u, v]: [f64; 2]) -> [[f64; 2]; 2] {
    const THIRD: f64 = 1.0 / 3.0;
    let r2 = u * u + v * v;
    let radial = 1.0 + r2 * (c[0] + r2 * (c[1] + r2 * c[2]));
    let twice = 2.0 * (c[0] + r2 * (2.0 * c[1] + r2 * 3.0 * c[2]));
    let [p, q] = [c[DECENTRING], c[DECENTRING + 1]];
    let across = twice * u * v + 2.0 * THIRD * (p * v + q * u);
    [
        [
            radial + twice * u * u + 2.0 * p * u + 2.0 * THIRD * q * v,
            across,
        ],
        [
            across,
            radial + twice * v * v + 2.0 * THIRD * p * u + 2.0 * q * v,
        ],
    ]
}

/// The radial and decentring terms along u and v, without the stretch.
#[inline(always)]
fn terms_before_stretch([u, v]: [f64; 2]) -> [[f64; STRETCH]; 2] {
    const THIRD: f64 = 1.0 / 3.0;
    let [uu, uv, vv] = [u * u, u * v, v * v];
    let r2 = uu + vv;
    let (r4, r6) = (r2 * r2, r2 * r2 * r2);
    let (far, across, near) = (uu + THIRD * vv, 2.0 * THIRD * uv, THIRD * uu + vv);
    [
        [u * r2, u * r4, u * r6, 0.0, 0.0, far, across],
        [v * r2, v * r4, v * r6, 0.0, 0.0, across, near],
    ]
}

/// The powers of u and v in the monomials.
const POWERS: [[usize; 2]; MONOMIALS] = {
    let mut powers = [[0; 2]; MONOMIALS];
    let (mut order, mut of_v, mut next) = (2, 0, 0);
    while next < MONOMIALS {
        powers[next] = [order - of_v, of_v];
        next += 1;
        of_v += 1;
        if of_v > order {
            (order, of_v) = (order + 1, 0);
        }
    }
    powers
};

/// The powers of a number from 0 to 5.
#[inline(always)]
fn powers_of(base: f64) -> [f64; 6] {
    let squared = base * base;
    let cubed = squared * base;
    [
        1.0,
        base,
        squared,
        cubed,
        squared * squared,
        squared * cubed,
    ]
}

/// The monomials at an offset in units of R.
#[inline]
pub(crate) fn monomials([u, v]: [f64; 2]) -> [f64; MONOMIALS] {
    let (of_u, of_v) = (powers_of(u), powers_of(v));
    POWERS.map(|[p, q]| of_u[p] * of_v[q])
}

/// Their derivatives by u and v.
#[inline]
fn monomial_slopes([u, v]: [f64; 2]) -> [[f64; 2]; MONOMIALS] {
    let (of_u, of_v) = (powers_of(u), powers_of(v));
    POWERS.map(|[p, q]| {
        let by_u = p as f64 * of_u[p.saturating_sub(1)] * of_v[q];
        let by_v = q as f64 * of_u[p] * of_v[q.saturating_sub(1)];
        [by_u, by_v]
    })
}

/// The squared distance from the axis at which the observed distance no longer grows with the ideal
/// one: the smallest positive root of 1 + 3 k₁ x + 5 k₂ x² + 7 k₃ x³.
fn fold_sq([k1, k2, k3]: [f64; RADIAL_TERMS]) -> f64 {
    const STEPS: u32 = 64;
    const BISECTIONS: usize = 40;
    let growth = |x: f64| 1.0 + x * (3.0 * k1 + x * (5.0 * k2 + x * 7.0 * k3));
    if k1 >= 0.0 && k2 >= 0.0 && k3 >= 0.0 {
        return FAR_SQ;
    }
    let step = FAR_SQ / f64::from(STEPS);
    let folded = (1..=STEPS).map(|i| f64::from(i) * step);
    let Some(mut high) = { folded }.find(|x| growth(*x) <= 0.0) else {
        return FAR_SQ;
    };
    let mut low = high - step;
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        if growth(middle) > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

#[cfg(test)]
mod tests {
    use super::*;

    const RADIUS_PX: f64 = 500.0;

    fn distortions() -> impl Iterator<Item = Distortion> {
        let lens = [-40.0, 12.0, -3.0, 15.0, -9.0, 2.0, -3.0, 11.0, 4.0];
        let others = (0..2 * MONOMIALS).map(|i| 0.7 - 0.3 * (i % 6) as f64);
        let all: Vec<f64> = lens.into_iter().chain(others).collect();
        DistortionModel::ALL
            .into_iter()
            .map(move |model| Distortion::new(model, RADIUS_PX, &all[..model.terms()]))
    }

    #[test]
    fn offsets_are_found_again() {
        for distortion in distortions() {
            for step in 0..40 {
                let (sin, cos) = f64::from(step).sin_cos();
                let radius_px = f64::from(step) * 14.0;
                let ideal = [radius_px * cos, radius_px * sin];
                let observed = distortion.apply(ideal).unwrap();
                let back = distortion.remove(observed).unwrap();
                let off_px = (back[0] - ideal[0]).hypot(back[1] - ideal[1]);
                assert!(off_px < 1e-9, "{:?} {off_px}", distortion.model());
            }
        }
    }

    #[test]
    fn the_derivatives_are_those_of_small_steps() {
        const STEP_PX: f64 = 1e-3;
        let ideal = [230.0, -170.0];
        for distortion in distortions() {
            let observed = distortion.observe(ideal).unwrap();
            assert_eq!(Some(observed.at), distortion.apply(ideal));
            for along in 0..2 {
                let there = |by: f64| {
                    let mut ideal = ideal;
                    ideal[along] += by;
                    distortion.apply(ideal).unwrap()
                };
                let (low, high) = (there(-STEP_PX), there(STEP_PX));
                for axis in 0..2 {
                    let slope = (high[axis] - low[axis]) / (2.0 * STEP_PX);
                    assert!((observed.by_ideal[axis][along] - slope).abs() < 1e-7);
                }
            }
            for term in 0..distortion.model().terms().min(LENS_TERMS) {
                let there = |by: f64| {
                    let mut coefficients_px = distortion.coefficients_px().to_vec();
                    coefficients_px[term] += by;
                    let moved = Distortion::new(distortion.model(), RADIUS_PX, &coefficients_px);
                    moved.apply(ideal).unwrap()
                };
                let (low, high) = (there(-STEP_PX), there(STEP_PX));
                for axis in 0..2 {
                    let slope = (high[axis] - low[axis]) / (2.0 * STEP_PX);
                    assert!(
                        (observed.by_term[axis][term] - slope).abs() < 1e-7,
                        "{term}"
                    );
                }
            }
        }
    }

    #[test]
    fn nothing_is_imaged_beyond_the_fold() {
        // r − 0.1 r³ is largest, 1.217, at r = 1.826.
        let distortion = Distortion::new(DistortionModel::Radial, 100.0, &[-10.0]);
        assert!(distortion.apply([182.0, 0.0]).is_some());
        assert_eq!(distortion.apply([183.0, 0.0]), None);
        assert!(distortion.remove([0.0, 121.0]).is_some());
        assert_eq!(distortion.remove([0.0, 122.0]), None);
    }

    #[test]
    fn monomials_image_nothing_from_far_outside_the_frame() {
        let mut coefficients_px = [0.0; DistortionModel::Irregular5.terms()];
        coefficients_px[LENS_TERMS + 28] = -12.0;
        let distortion = Distortion::new(DistortionModel::Irregular5, RADIUS_PX, &coefficients_px);
        for step in 0..80 {
            let radius_px = RADIUS_PX * (1.0 + 0.05 * f64::from(step));
            for direction in 0..60 {
                let (sin, cos) = (0.105 * f64::from(direction)).sin_cos();
                if let Some([x, y]) = distortion.apply([radius_px * cos, radius_px * sin]) {
                    assert!(x.hypot(y) > 0.95 * RADIUS_PX, "{radius_px}");
                }
            }
        }
    }

    #[test]
    fn a_radial_coefficient_is_the_displacement_at_the_radius() {
        for term in [0, 1, 2, 5, 7] {
            let mut coefficients_px = [0.0; LENS_TERMS];
            coefficients_px[term] = 1.0;
            let distortion = Distortion::new(DistortionModel::Stretched, 100.0, &coefficients_px);
            let observed = distortion.apply([100.0, 0.0]).unwrap();
            assert!((observed[0] - 101.0).abs() < 1e-12 && observed[1] == 0.0);
            assert!((distortion.largest_px() - 1.0).abs() < 1e-9);
        }
    }
}
