//! Converts Tycho magnitudes to Johnson magnitudes.

use crate::catalog::star::rounded_mag;

/// V and B−V in Johnson's system, rounded to 0.001 mag; `None` without any magnitude.
///
/// V = VT − 0.090 (BT − VT) and B−V = 0.850 (BT − VT). VT alone is used as V; BT alone is converted
/// with the median color.
///
/// # Reference
/// Høg et al. 2000, A&A 355, L27 (CDS I/259).
pub(in crate::catalog) fn johnson(
    bt_mag: Option<f64>,
    vt_mag: Option<f64>,
) -> Option<(f32, Option<f32>)> {
    /// V − VT in units of BT − VT.
    const V_PER_COLOR: f64 = -0.090;
    /// B − V in units of BT − VT.
    const BV_PER_COLOR: f64 = 0.850;
    /// Median of BT − VT over the 2,539,802 stars of the main catalogue that have both.
    const MEDIAN_COLOR_MAG: f64 = 0.721;
    let (v_mag, bv_mag) = match (bt_mag, vt_mag) {
        (Some(bt), Some(vt)) => {
            let color = bt - vt;
            (vt + V_PER_COLOR * color, Some(BV_PER_COLOR * color))
        }
        (None, Some(vt)) => (vt, None),
        (Some(bt), None) => (bt - (1.0 - V_PER_COLOR) * MEDIAN_COLOR_MAG, None),
        (None, None) => return None,
    };
    Some((rounded_mag(v_mag), bv_mag.map(rounded_mag)))
}
