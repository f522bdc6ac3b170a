//! Converts magnitudes of Gaia to Johnson's V.

use super::star::rounded_mag;

/// V, rounded to 0.001 mag, of a star with a G magnitude and, where it is known, a color BP−RP; within 0.03 mag
/// in the range of the relation, from −0.5 to 5. Redder and bluer stars get the value of its ends.
///
/// A star without a color gets the one of the median of bright stars: then V is within about 0.3 mag.
///
/// # Reference
/// Riello et al. 2021, A&A 649, A3, table C.2.
pub(super) fn johnson_v(g_mag: f64, bp_rp_mag: Option<f64>) -> f32 {
    /// G − V as a polynomial in BP − RP.
    const COEFFICIENTS: [f64; 4] = [-0.02704, 0.01424, -0.2156, 0.01426];
    const RANGE: [f64; 2] = [-0.5, 5.0];
    const MEDIAN_COLOR_MAG: f64 = 0.9;
    let color = bp_rp_mag.filter(|color| color.is_finite());
    let color = color.unwrap_or(MEDIAN_COLOR_MAG).clamp(RANGE[0], RANGE[1]);
    let terms = COEFFICIENTS.iter().rev();
    let g_minus_v = terms.fold(0.0, |sum, coefficient| sum * color + coefficient);
    rounded_mag(g_mag - g_minus_v)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn v_is_that_of_the_published_relation() {
        // At the ends of the range, and for a star like the Sun.
        assert_eq!(johnson_v(10.0, Some(0.0)), 10.027);
        assert_eq!(johnson_v(10.0, Some(0.82)), 10.152);
        assert_eq!(johnson_v(10.0, Some(9.0)), johnson_v(10.0, Some(5.0)));
        assert_eq!(johnson_v(10.0, Some(-3.0)), johnson_v(10.0, Some(-0.5)));
        assert!((johnson_v(10.0, None) - 10.18).abs() < 0.01);
    }
}
