//! The zero point of a frame's fluxes, and whether they are proportional to light.
//!
//! V and instrumental magnitudes m = −2.5 log10(flux) of single stars → [`ZeroPoint`]
//!
//! ```text
//! V = ZP + m + k (B−V − 0.6) − a ρ² − b ρ⁴ + s (V − V̄)
//! ```
//!
//! 1. The variance of a star is that of its flux, plus a scatter (catalogue, color, pixels) that
//!    is estimated from the residuals.
//! 2. Outliers, mostly unresolved companions and variables on one side, are down-weighted with
//!    Tukey's biweight, to zero from 4.7 standard deviations on.
//! 3. The terms k (color), a and b (vignetting; ρ is the distance from the frame's centre, 1 in
//!    the corner) and s (grey levels not proportional to light) are used only where they are
//!    significant.
//!
//! With the color term, the zero point is that of a star of B−V = 0.6; without it, that of the
//! mean star, whose B−V is given. With vignetting, it is that of the frame's centre. With s, it
//! holds only for stars of the mean magnitude V̄; one magnitude in V is then 1 − s instrumental ones.
//!
//! The stars must be chosen by V and not by flux, which would prefer stars that noise or color
//! makes brighter.

mod color_index;
mod relation;
mod standard;
mod weights;

pub(crate) use color_index::ColorIndex;
pub use standard::{MIN_STARS, REFERENCE_BV_MAG, StandardStar, WeightedColor};
pub use standard::{NoZeroPoint, ZeroPoint};

use relation::{Relation, Term};

/// A color term is tried where at least this share of the stars has a color.
const MIN_COLORED_FRACTION: f64 = 0.5;

/// Measures the zero point of `stars`; `None` if they are too few.
pub(crate) fn measure(stars: &[StandardStar]) -> Option<ZeroPoint> {
    if stars.len() < MIN_STARS {
        return None;
    }
    let with_color = |star: &&StandardStar| star.bv_mag.is_some();
    let colored: Vec<StandardStar> = stars.iter().filter(with_color).copied().collect();
    let has_colors = colored.len() as f64 >= MIN_COLORED_FRACTION * stars.len() as f64;
    let with_term = has_colors
        .then(|| Relation::fit_significant(&colored, &[Term::Color]))
        .flatten();
    let (stars, mut relation) = match with_term {
        Some(relation) => (&colored[..], relation),
        None => (stars, Relation::fit(stars, &[])?),
    };
    for term in [Term::Vignetting, Term::VignettingOfFourthOrder] {
        let terms = relation.terms_and(&[term]);
        let further = Relation::fit_significant(stars, &terms);
        // No lens transmits more in the corners.
        match further.filter(Relation::loses_light_in_the_corners) {
            Some(further) => relation = further,
            None => break,
        }
    }
    let sloping = slope(stars, &relation);
    let linearity = sloping.as_ref().map(Relation::linearity);
    match sloping {
        Some(fit) if fit.needs_last_term() => Some(fit.zero_point(stars, linearity, true)),
        _ => Some(relation.zero_point(stars, linearity, false)),
    }
}

/// `relation` with a slope. Faint stars have other colors than bright ones, so that a color term
/// that is bent would look like a slope.
fn slope(stars: &[StandardStar], relation: &Relation) -> Option<Relation> {
    let further: &[Term] = match relation.has(Term::Color) {
        true => &[Term::ColorOfSecondOrder, Term::Slope],
        false => &[Term::Slope],
    };
    Relation::fit(stars, &relation.terms_and(further))
        .or_else(|| Relation::fit(stars, &relation.terms_and(&[Term::Slope])))
}

#[cfg(test)]
mod tests;
