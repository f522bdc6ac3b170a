//! Converts magnitudes of Gaia to Johnson's.

use super::star::rounded_mag;

/// The epoch of the positions of its third release, as a Julian year.
pub(super) const EPOCH_YEAR: f64 = 2016.0;

/// V and B−V, rounded to 0.001 mag, of a star with a G magnitude and, where it is known, a color BP−RP: V within
/// 0.03 mag for colors from −0.5 to 5, B−V within 0.07 mag for colors from −0.5 to 1.75. Redder and bluer stars get
/// the values of the ends.
///
/// A star without a color gets the one of the median of bright stars: then V is within about 0.3 mag.
///
/// # Reference
/// Riello et al. 2021, A&A 649, A3, table C.2, and for B the documentation of Gaia DR3, sect. 5.5.1, table 5.9.
pub(super) fn johnson(g_mag: f64, bp_rp_mag: Option<f64>) -> (f32, Option<f32>) {
    /// G − V and G − B as polynomials in BP − RP.
    const G_MINUS_V: [f64; 4] = [-0.02704, 0.01424, -0.2156, 0.01426];
    const G_MINUS_B: [f64; 5] = [0.01448, -0.6874, -0.3604, 0.06718, -0.006061];
    const V_RANGE: [f64; 2] = [-0.5, 5.0];
    const B_RANGE: [f64; 2] = [-0.5, 1.75];
    const MEDIAN_COLOR_MAG: f64 = 0.9;
    let known = bp_rp_mag.filter(|color| color.is_finite());
    let value = |coefficients: &[f64], [low, high]: [f64; 2]| {
        let color = known.unwrap_or(MEDIAN_COLOR_MAG).clamp(low, high);
        let terms = coefficients.iter().rev();
        terms.fold(0.0, |sum, coefficient| sum * color + coefficient)
    };
    let bv_mag = value(&G_MINUS_V, B_RANGE) - value(&G_MINUS_B, B_RANGE);
    let v_mag = g_mag - value(&G_MINUS_V, V_RANGE);
    (rounded_mag(v_mag), known.map(|_| rounded_mag(bv_mag)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn v_is_that_of_the_published_relation() {
        let v_mag = |color| johnson(10.0, color).0;
        // At the ends of the range, and for a star like the Sun.
        assert_eq!(v_mag(Some(0.0)), 10.027);
        assert_eq!(v_mag(Some(0.82)), 10.152);
        assert_eq!(v_mag(Some(9.0)), v_mag(Some(5.0)));
        assert_eq!(v_mag(Some(-3.0)), v_mag(Some(-0.5)));
        assert!((v_mag(None) - 10.18).abs() < 0.01);
    }

    #[test]
    fn colors_are_those_of_the_published_relations() {
        let bv_mag = |color: f64| johnson(10.0, Some(color)).1.unwrap();
        assert!((bv_mag(0.82) - 0.605).abs() < 0.002);
        assert!((bv_mag(1.5) - 1.189).abs() < 0.002);
        assert_eq!(bv_mag(3.0), bv_mag(1.75));
        assert_eq!(johnson(10.0, None).1, None);
    }
}
