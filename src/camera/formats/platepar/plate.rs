//! RMS's plate: sky ↔ pixel by a distorted equidistant projection.
//!
//! With ρ = F θ the distance from the reference direction in pixels (θ in degrees), (x, y) = ρ (cos ψ,
//! sin ψ) and offsets (X, Y) of pixels from half the size of the image, h half of its width:
//!
//! - radial, from the sky (reverse): X = x (2 − s) + x₀, Y = y (2 − s)/(1 + a) + y₀ with s = 1 + k₁r² + …,
//!   r = ρ/h; `odd` kinds have the even powers of s, `all` kinds have r, r², …
//! - radial, to the sky (forward): x = (X − x₀) s, y = (1 + a)(Y − y₀) s, r that of (X − x₀, (1 + a)(Y −
//!   y₀))/h
//! - an asymmetry makes r longer by a₁(y cos a₂ − x sin a₂)/h
//! - polynomial, from the sky: X = x − dx, Y = y − dy; to the sky: x = X + dx, y = Y + dy; dx has all
//!   monomials up to the third order, then x r, y r and, in richer kinds, x r³ and x r⁵; dy has y r, x r, y r³
//!   and y r⁵; r is the distance from (x₀, y₀) in pixels
//!
//! # Reference
//! Croatian Meteor Network, RMS, `RMS/Astrometry/CyFunctions.pyx`; Vida et al. 2021, MNRAS 506, 5046.

use std::f64::consts::TAU;

/// A kind of distortion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum DistortionKind {
    /// A number of radial coefficients, of even powers or of all.
    Radial { terms: usize, all_powers: bool },
    /// Polynomials with this many coefficients.
    Polynomial { terms: usize },
}

impl DistortionKind {
    const ALL: [(&'static str, Self); 10] = [
        ("poly3+radial", Self::Polynomial { terms: 12 }),
        ("poly3+radial3", Self::Polynomial { terms: 13 }),
        ("poly3+radial5", Self::Polynomial { terms: 14 }),
        ("radial3-all", Self::radial(2, true)),
        ("radial4-all", Self::radial(3, true)),
        ("radial5-all", Self::radial(4, true)),
        ("radial3-odd", Self::radial(1, false)),
        ("radial5-odd", Self::radial(2, false)),
        ("radial7-odd", Self::radial(3, false)),
        ("radial9-odd", Self::radial(4, false)),
    ];

    const fn radial(terms: usize, all_powers: bool) -> Self {
        Self::Radial { terms, all_powers }
    }

    pub(super) fn named(name: &str) -> Option<Self> {
        let mut all = Self::ALL.into_iter();
        all.find(|(of, _)| *of == name).map(|(_, kind)| kind)
    }

    pub(super) fn name(self) -> &'static str {
        let mut all = Self::ALL.into_iter();
        all.find(|(_, kind)| *kind == self)
            .map_or("", |(name, _)| name)
    }
}

/// The distortion of a plate in one direction, in pixels.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Warp {
    Radial {
        /// x₀ and y₀.
        axis_px: [f64; 2],
        aspect: f64,
        /// a₁ and a₂ (in turns).
        asymmetry: [f64; 2],
        radial: Vec<f64>,
        all_powers: bool,
        half_px: f64,
    },
    Polynomial {
        along: [Vec<f64>; 2],
    },
}

/// What a radial plate leaves out of its list of coefficients.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct OmittedTerms {
    /// x₀ and y₀: the axis is half a pixel right of and below half the size.
    pub axis: bool,
    pub aspect: bool,
    pub asymmetry: bool,
}

impl Warp {
    /// From the lists of a file; `None` if they are too short.
    pub(super) fn from_lists(
        kind: DistortionKind,
        left: OmittedTerms,
        size_px: [f64; 2],
        [x, y]: [&[f64]; 2],
    ) -> Option<Self> {
        match kind {
            DistortionKind::Polynomial { terms } => Some(Self::Polynomial {
                along: [x.get(..terms)?.to_vec(), y.get(..terms)?.to_vec()],
            }),
            DistortionKind::Radial { terms, all_powers } => {
                let mut rest = x.iter().copied();
                let axis_px = if left.axis {
                    [0.5; 2]
                } else {
                    let [x0, y0] = [rest.next()?, rest.next()?];
                    [x0 * size_px[0] / 2.0, y0 * size_px[1] / 2.0]
                };
                let aspect = if left.aspect { 0.0 } else { rest.next()? };
                let asymmetry = if left.asymmetry {
                    [0.0; 2]
                } else {
                    [rest.next()?, rest.next()?]
                };
                let radial: Vec<f64> = rest.take(terms).collect();
                // The centre is somewhere on the image.
                let wrapped = |axis: usize| {
                    let half_px = size_px[axis] / 2.0;
                    (axis_px[axis] + half_px).rem_euclid(size_px[axis]) - half_px
                };
                (radial.len() == terms).then(|| Self::Radial {
                    axis_px: [wrapped(0), wrapped(1)],
                    aspect,
                    asymmetry,
                    radial,
                    all_powers,
                    half_px: size_px[0] / 2.0,
                })
            }
        }
    }

    /// The lists of a file, without an asymmetry and, with `equal_aspect`, without the aspect.
    pub(super) fn to_lists(&self, equal_aspect: bool, size_px: [f64; 2]) -> [Vec<f64>; 2] {
        match self {
            Self::Polynomial { along } => along.clone(),
            Self::Radial {
                axis_px,
                aspect,
                radial,
                ..
            } => {
                let mut list = vec![2.0 * axis_px[0] / size_px[0], 2.0 * axis_px[1] / size_px[1]];
                list.extend((!equal_aspect).then_some(*aspect));
                list.extend(radial);
                let empty = vec![0.0; list.len()];
                [list, empty]
            }
        }
    }

    /// From the sky to the image: offset from half its size.
    pub(super) fn reverse(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        match self {
            Self::Radial {
                axis_px, aspect, ..
            } => {
                let shrink = 2.0 - self.stretch([x, y]);
                [
                    x * shrink + axis_px[0],
                    y * shrink / (1.0 + aspect) + axis_px[1],
                ]
            }
            Self::Polynomial { along } => {
                let [dx, dy] = polynomial(along, [x, y]);
                [x - dx, y - dy]
            }
        }
    }

    /// From the image to the sky.
    pub(super) fn forward(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        match self {
            Self::Radial {
                axis_px, aspect, ..
            } => {
                let at = [x - axis_px[0], (1.0 + aspect) * (y - axis_px[1])];
                at.map(|along| along * self.stretch(at))
            }
            Self::Polynomial { along } => {
                let [dx, dy] = polynomial(along, [x, y]);
                [x + dx, y + dy]
            }
        }
    }

    /// s, of radial plates.
    fn stretch(&self, [x, y]: [f64; 2]) -> f64 {
        let Self::Radial {
            asymmetry: [amount, turns],
            radial,
            all_powers,
            half_px,
            ..
        } = self
        else {
            return 1.0;
        };
        let (sin, cos) = libm::sincos(turns * TAU);
        let r = (libm::hypot(x, y) + amount * (y * cos - x * sin)) / half_px;
        let base = if *all_powers { r } else { r * r };
        1.0 + radial.iter().rev().fold(0.0, |sum, k| base * (sum + k))
    }
}

/// The displacement by polynomials.
fn polynomial(along: &[Vec<f64>; 2], [x, y]: [f64; 2]) -> [f64; 2] {
    let r = libm::hypot(x - along[0][0], y - along[1][0]);
    let r3 = r * r * r;
    let [by_x, by_y] =
        [[x, y], [y, x]].map(|[near, far]| [near * r, far * r, near * r3, near * r3 * r * r]);
    let common = [
        1.0,
        x,
        y,
        x * x,
        x * y,
        y * y,
        x * x * x,
        x * x * y,
        x * y * y,
        y * y * y,
    ];
    [(0, by_x), (1, by_y)].map(|(axis, own): (usize, [f64; 4])| {
        let values = common.iter().chain(&own);
        along[axis]
            .iter()
            .zip(values)
            .map(|(c, value)| c * value)
            .sum()
    })
}

/// The powers of lengths in the terms of [`polynomial`].
pub(super) const DEGREES: [i32; 14] = [0, 1, 1, 2, 2, 2, 3, 3, 3, 3, 2, 2, 4, 6];
