//! Errors of positions and flux, compared with the Cramér-Rao bound.

use crate::base::format::{to_decimals, to_significant};
use crate::lab::validation::StarRecord;
use serde::Serialize;

/// Lower end of the first bin.
const FIRST_SNR: f64 = 4.0;
/// Bins per factor of two.
const BINS_PER_OCTAVE: f64 = 2.0;
/// Number of bins: up to an SNR of 2900.
const BINS: usize = 19;

/// Errors of positions and flux of isolated, unsaturated stars, by the SNR of the matched filter.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CentroidSummary {
    /// RMS error on either axis in units of its Cramér-Rao bound, for stars with a detection
    /// probability of 99 % or more.
    pub ratio: Option<f64>,
    /// Standard error of that ratio for Gaussian errors.
    pub ratio_sigma: Option<f64>,
    /// Bins without empty ones.
    pub bins: Vec<CentroidBin>,
}

/// A bin of SNR. Position errors are on one axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[expect(missing_docs, reason = "docs/json.md describes the fields")]
pub struct CentroidBin {
    pub from_snr: f64,
    pub to_snr: f64,
    pub snr: f64,
    pub stars: usize,
    pub rms_px: f64,
    pub bound_px: Option<f64>,
    pub ratio: Option<f64>,
    pub ratio_sigma: Option<f64>,
    pub stated_px: f64,
    pub flux_part: f64,
    pub flux_ratio: Option<f64>,
}

/// Sums of one bin.
#[derive(Clone, Copy, Default)]
struct CentroidSums {
    stars: usize,
    snr: f64,
    errors_px2: f64,
    bounds_px2: f64,
    stated_px2: f64,
    flux_part: f64,
    flux_errors_e2: f64,
    flux_bounds_e2: f64,
}

#[derive(Default)]
pub(super) struct Centroids {
    bins: [CentroidSums; BINS],
    sure: usize,
    /// Sum of squared errors in units of their bounds.
    in_bounds: f64,
}

impl Centroids {
    /// Adds a star with its errors in x, y and flux.
    pub(super) fn add(&mut self, row: &StarRecord, errors: [Option<f64>; 3], is_sure: bool) {
        let ([Some(dx), Some(dy), Some(flux_error_e)], Some(snr)) = (errors, row.predicted_snr)
        else {
            return;
        };
        let bin = (libm::log2(snr / FIRST_SNR) * BINS_PER_OCTAVE).floor();
        if !(0.0..BINS as f64).contains(&bin) {
            return;
        }
        let squared = |value: Option<f64>| value.map_or(f64::NAN, |value| value * value);
        if is_sure && let (Some(bound_x), Some(bound_y)) = (row.bound_x_px, row.bound_y_px) {
            self.sure += 1;
            self.in_bounds += (dx / bound_x).powi(2) + (dy / bound_y).powi(2);
        }
        let sums = &mut self.bins[bin as usize];
        sums.stars += 1;
        sums.snr += snr;
        sums.errors_px2 += dx * dx + dy * dy;
        sums.bounds_px2 += squared(row.bound_x_px) + squared(row.bound_y_px);
        sums.stated_px2 += squared(row.sigma_x) + squared(row.sigma_y);
        sums.flux_part += 1.0 + flux_error_e / row.true_flux_e.unwrap_or(f64::NAN);
        sums.flux_errors_e2 += flux_error_e * flux_error_e;
        sums.flux_bounds_e2 += squared(row.bound_flux_e);
    }

    pub(super) fn finish(self) -> CentroidSummary {
        let bins = self
            .bins
            .iter()
            .enumerate()
            .filter(|(_, sums)| sums.stars > 0);
        let stars = self.sure as f64;
        let ratio = (self.sure > 0).then(|| (self.in_bounds / (2.0 * stars)).sqrt());
        CentroidSummary {
            ratio: ratio.map(|ratio| to_significant(ratio, 5)),
            ratio_sigma: ratio.map(|ratio| to_significant(ratio / (4.0 * stars).sqrt(), 3)),
            bins: bins.map(|(bin, sums)| sums.bin(bin)).collect(),
        }
    }
}

impl CentroidSums {
    fn bin(&self, bin: usize) -> CentroidBin {
        let stars = self.stars as f64;
        let edge = |bin: usize| {
            let snr = FIRST_SNR * libm::exp2(bin as f64 / BINS_PER_OCTAVE);
            to_significant(snr, 4)
        };
        let on_axis = |sum: f64| (sum / (2.0 * stars)).sqrt();
        let finite = |value: f64, digits| value.is_finite().then(|| to_significant(value, digits));
        let ratio = (self.errors_px2 / self.bounds_px2).sqrt();
        CentroidBin {
            from_snr: edge(bin),
            to_snr: edge(bin + 1),
            snr: to_significant(self.snr / stars, 5),
            stars: self.stars,
            rms_px: to_significant(on_axis(self.errors_px2), 5),
            bound_px: finite(on_axis(self.bounds_px2), 5),
            ratio: finite(ratio, 5),
            ratio_sigma: finite(ratio / (4.0 * stars).sqrt(), 3),
            stated_px: to_significant(on_axis(self.stated_px2), 5),
            flux_part: to_decimals(self.flux_part / stars, 5),
            flux_ratio: finite((self.flux_errors_e2 / self.flux_bounds_e2).sqrt(), 5),
        }
    }
}
