//! What a lens, and the air before it, do beyond the pinhole.
//!
//! observed offset (u, v) from the frame's centre → ideal offset (u, v) + Σ cₖ Bₖ(u/R, v/R), in pixels.
//!
//! The sense is that of the SIP convention (Shupe et al. 2005, ASP Conf. 347, 491: pixel → ideal), so that a
//! FITS header can be written from it without inversion. R is half the frame's diagonal: a coefficient is
//! the displacement in pixels that its term makes at a corner. A turn, a shift and a change of scale are
//! no part of it: they belong to the attitude and the focal length.

/// How much freedom a distortion has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum DistortionModel {
    /// One radial term, r³.
    Radial,
    /// Unequal scale along two axes (2 terms), and all of second (6) and third order (8): tilted
    /// sensors, decentred lenses, differential refraction.
    Cubic,
    /// [`DistortionModel::Cubic`] and all of fourth (10) and fifth order (12).
    Quintic,
}

impl DistortionModel {
    /// Every model, simplest first.
    pub const ALL: [Self; 3] = [Self::Radial, Self::Cubic, Self::Quintic];

    /// Number of coefficients.
    pub const fn terms(self) -> usize {
        match self {
            Self::Radial => 1,
            Self::Cubic => 16,
            Self::Quintic => 38,
        }
    }

    /// Name, as reports print it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Radial => "radial",
            Self::Cubic => "cubic",
            Self::Quintic => "quintic",
        }
    }

    /// Order of the polynomial.
    pub const fn order(self) -> usize {
        match self {
            Self::Radial | Self::Cubic => 3,
            Self::Quintic => 5,
        }
    }

    /// Calls `term` with each basis function's displacement (along u, along v) at the normalised offset.
    pub fn for_each_term(self, [u, v]: [f64; 2], mut term: impl FnMut([f64; 2])) {
        if self == Self::Radial {
            let r_sq = u * u + v * v;
            return term([u * r_sq, v * r_sq]);
        }
        term([u, -v]);
        term([v, u]);
        let (mut u_powers, mut v_powers) = ([1.0; MAX_ORDER + 1], [1.0; MAX_ORDER + 1]);
        for power in 1..=self.order() {
            u_powers[power] = u_powers[power - 1] * u;
            v_powers[power] = v_powers[power - 1] * v;
        }
        for order in 2..=self.order() {
            for power in 0..=order {
                let monomial = u_powers[order - power] * v_powers[power];
                term([monomial, 0.0]);
                term([0.0, monomial]);
            }
        }
    }
}

/// The departure of a lens from the pinhole camera.
#[derive(Debug, Clone, PartialEq)]
pub struct Distortion {
    model: DistortionModel,
    radius_px: f64,
    coefficients_px: Vec<f64>,
}

/// The highest order of any model.
const MAX_ORDER: usize = 5;

/// Steps of the fixed-point iteration that inverts the polynomial, and where it may stop.
const INVERSION_STEPS: usize = 50;
const INVERSION_TOLERANCE_PX: f64 = 1e-5;

impl Distortion {
    /// A distortion with one coefficient in pixels for each term of `model`; `radius_px` is the
    /// offset at which a normalised offset is 1.
    ///
    /// # Panics
    /// If there are not as many coefficients as the model has terms.
    pub fn new(model: DistortionModel, radius_px: f64, coefficients_px: Vec<f64>) -> Self {
        assert_eq!(coefficients_px.len(), model.terms(), "one per term");
        Self {
            model,
            radius_px,
            coefficients_px,
        }
    }

    /// Its model.
    pub fn model(&self) -> DistortionModel {
        self.model
    }

    /// The offset in pixels at which a normalised offset is 1.
    pub fn radius_px(&self) -> f64 {
        self.radius_px
    }

    /// The coefficients in pixels, in the order of [`DistortionModel::for_each_term`].
    pub fn coefficients_px(&self) -> &[f64] {
        &self.coefficients_px
    }

    /// Its polynomial term by term: the powers of u/R and of v/R, and the displacement along u and v in pixels.
    /// Terms of the same powers may occur more than once.
    pub fn monomials(&self) -> Vec<(usize, usize, [f64; 2])> {
        let c = &self.coefficients_px;
        if self.model == DistortionModel::Radial {
            // r² u and r² v, written out.
            return vec![
                (3, 0, [c[0], 0.0]),
                (1, 2, [c[0], 0.0]),
                (2, 1, [0.0, c[0]]),
                (0, 3, [0.0, c[0]]),
            ];
        }
        let mut monomials = vec![(1, 0, [c[0], c[1]]), (0, 1, [c[1], -c[0]])];
        let powers = (2..=self.model.order()).flat_map(|n| (0..=n).map(move |q| (n - q, q)));
        let pairs = c[2..].chunks_exact(2);
        monomials.extend(
            powers
                .zip(pairs)
                .map(|((p, q), pair)| (p, q, [pair[0], pair[1]])),
        );
        monomials
    }

    /// From the observed offset to the ideal one, in pixels.
    pub fn remove(&self, observed: [f64; 2]) -> [f64; 2] {
        let normalised = [observed[0] / self.radius_px, observed[1] / self.radius_px];
        let mut ideal = observed;
        let mut coefficients = self.coefficients_px.iter();
        self.model.for_each_term(normalised, |[du, dv]| {
            let c = coefficients.next().expect("one coefficient per term");
            ideal[0] += c * du;
            ideal[1] += c * dv;
        });
        ideal
    }

    /// From the ideal offset to the observed one, in pixels; `None` where the polynomial cannot be
    /// inverted, as may be far outside the frame.
    pub fn apply(&self, ideal: [f64; 2]) -> Option<[f64; 2]> {
        let mut observed = ideal;
        for _ in 0..INVERSION_STEPS {
            let there = self.remove(observed);
            let error = [ideal[0] - there[0], ideal[1] - there[1]];
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

    /// The largest displacement within the normalising radius, on a ring at it, in pixels.
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
