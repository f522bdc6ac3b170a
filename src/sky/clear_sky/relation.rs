//! The relation between a star's magnitude and what the frame shows of it, and what is known of it beforehand.

use crate::base::statistics::Estimate;
use crate::photometry::zero_point::REFERENCE_BV_MAG;
use nalgebra::SVector;

/// Unknowns: Z, c, k, a, b, s, q.
pub(super) const UNKNOWNS: usize = 7;
pub(super) const COLOR: usize = 1;
pub(super) const EXTINCTION: usize = 2;
pub(super) const VIGNETTING: [usize; 2] = [3, 4];
pub(super) const SLOPE: usize = 5;
pub(super) const COLOR_CURVE: usize = 6;
/// Extinction in V, in magnitudes per airmass, and how it differs from place to place and night to night
/// (Patat et al. 2011, A&A 527, A91, for Paranal: 0.12; 0.2 to 0.3 near sea level).
pub(super) const USUAL_EXTINCTION: Estimate = Estimate {
    value: 0.2,
    sigma: 0.1,
};
/// Color terms of cameras.
pub(super) const USUAL_COLOR_SIGMA: f64 = 0.3;
/// Their change with color: 0 in a band as V, 0.12 without a filter (black bodies from 400 to 800 nm).
pub(super) const USUAL_COLOR_CURVE: Estimate = Estimate {
    value: 0.06,
    sigma: 0.06,
};
/// Loss of light at the edge where no flat removed it, in magnitudes: of the terms with ρ² and ρ⁴.
const USUAL_LOSS: [Estimate; 2] = [
    Estimate {
        value: 0.3,
        sigma: 0.7,
    },
    Estimate {
        value: 0.0,
        sigma: 0.3,
    },
];
/// The same where a flat did, or the loss is stated.
const FLAT_SIGMA_MAG: f64 = 0.01;
/// Slopes of gray levels with a tone curve.
const USUAL_SLOPE_SIGMA: f64 = 0.3;
/// Values of the unknowns.
pub(super) type Unknowns = SVector<f64, UNKNOWNS>;

/// The derivatives of the relation by the unknowns.
pub(super) fn row_of(
    airmass: Option<f64>,
    off_axis_sq: f64,
    bv_mag: Option<f64>,
    above_mean_mag: f64,
) -> [f64; UNKNOWNS] {
    let off_mag = bv_mag.map_or(0.0, |bv_mag| bv_mag - REFERENCE_BV_MAG);
    [
        1.0,
        off_mag,
        // Without a horizon the zero point is that of the ground.
        -airmass.unwrap_or(0.0),
        -off_axis_sq,
        -off_axis_sq * off_axis_sq,
        above_mean_mag,
        off_mag * off_mag,
    ]
}

/// Expected values of the unknowns and their standard deviations; nothing is known of Z.
pub(super) fn experience(is_flat: bool) -> [Estimate; UNKNOWNS] {
    let flat = Estimate {
        value: 0.0,
        sigma: FLAT_SIGMA_MAG,
    };
    let [first, second] = if is_flat { [flat; 2] } else { USUAL_LOSS };
    let of = |value: f64, sigma: f64| Estimate { value, sigma };
    [
        of(0.0, f64::INFINITY),
        of(0.0, USUAL_COLOR_SIGMA),
        USUAL_EXTINCTION,
        first,
        second,
        of(0.0, USUAL_SLOPE_SIGMA),
        USUAL_COLOR_CURVE,
    ]
}
