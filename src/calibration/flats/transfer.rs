//! Photon transfer: the gain from the shot noise of light.

use crate::base::least_squares::LinearFit;
use crate::calibration::robust::RobustMoments;
use nalgebra::Vector2;

/// Signal and variance of two frames of the same light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairPoint {
    /// Mean level above the dark, in ADU.
    pub signal_adu: f64,
    /// Variance of a pixel of one frame, without rounding, in ADU².
    pub variance_adu2: f64,
    /// Its standard error.
    pub sigma_adu2: f64,
}

impl PairPoint {
    /// Compares two frames, given by level and pixels; `step_adu` is the step between grey levels.
    pub(super) fn measure(pair: [(f64, &[f32]); 2], step_adu: f64) -> Option<Self> {
        /// Variance of rounding to whole steps, in steps².
        const ROUNDING_VARIANCE: f64 = 1.0 / 12.0;
        let [(one_level, one), (other_level, other)] = pair;
        let signal_adu = (one_level + other_level) / 2.0;
        // Both are scaled to their mean level, so that the fixed pattern cancels in the difference.
        let (a, b) = (
            (signal_adu / one_level) as f32,
            (signal_adu / other_level) as f32,
        );
        let differences: Vec<f32> = one.iter().zip(other).map(|(p, q)| p * a - q * b).collect();
        let count = differences.iter().filter(|d| !d.is_nan()).count();
        let sigma = RobustMoments::clipped(&differences, step_adu / 2.0)?.sigma;
        let variance = sigma * sigma / 2.0;
        Some(Self {
            signal_adu,
            variance_adu2: variance - ROUNDING_VARIANCE * step_adu * step_adu,
            sigma_adu2: variance * (2.0 / count as f64).sqrt(),
        })
    }
}

/// How a gain was measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GainMethod {
    /// From the slope of variance over signal.
    Line,
    /// From pairs of one light, with the read noise of the data sheet.
    KnownReadNoise,
    /// From pairs of one light, neglecting read noise.
    ShotNoiseAlone,
}

impl GainMethod {
    /// Description, as in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Line => "slope of variance against signal",
            Self::KnownReadNoise => "one level, read noise of the camera",
            Self::ShotNoiseAlone => "one level, read noise neglected",
        }
    }
}

/// The gain, and the read noise if it was measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gain {
    /// Gain, in electrons per grey level.
    pub e_per_adu: f64,
    /// Its standard error.
    pub sigma: f64,
    /// Read noise, in ADU, if the line has an intercept above 0.
    pub read_noise_adu: Option<f64>,
    /// How it was measured.
    pub method: GainMethod,
}

impl Gain {
    /// Measures the gain from `pairs`. `None` if there is no pair, or variance does not grow with
    /// signal.
    pub(super) fn measure(pairs: &[PairPoint], read_noise_e: Option<f64>) -> Option<Self> {
        /// Minimum ratio of the largest to the smallest signal for a line.
        const LINE_RANGE: f64 = 1.5;
        let signals = pairs.iter().map(|pair| pair.signal_adu);
        let lowest = signals.clone().reduce(f64::min)?;
        let highest = signals.reduce(f64::max)?;
        if highest >= LINE_RANGE * lowest {
            return Self::from_line(pairs);
        }
        Self::from_one_light(pairs, read_noise_e)
    }

    /// Solves V g² − S g − R² = 0 for g, with the weighted means of S and V, and R in electrons.
    fn from_one_light(pairs: &[PairPoint], read_noise_e: Option<f64>) -> Option<Self> {
        let weight = |pair: &PairPoint| pair.sigma_adu2.powi(-2);
        let total: f64 = pairs.iter().map(weight).sum();
        let mean = |of: fn(&PairPoint) -> f64| {
            pairs.iter().map(|p| weight(p) * of(p)).sum::<f64>() / total
        };
        let (signal, variance) = (mean(|p| p.signal_adu), mean(|p| p.variance_adu2));
        let read_noise = read_noise_e.unwrap_or(0.0);
        let e_per_adu = (signal
            + (signal * signal + 4.0 * variance * read_noise * read_noise).sqrt())
            / (2.0 * variance);
        let sigma = e_per_adu * total.sqrt().recip() / variance;
        (variance > 0.0).then_some(Self {
            e_per_adu,
            sigma,
            read_noise_adu: None,
            method: match read_noise_e {
                Some(_) => GainMethod::KnownReadNoise,
                None => GainMethod::ShotNoiseAlone,
            },
        })
    }

    /// Fits the weighted line V = R² + S / g.
    fn from_line(pairs: &[PairPoint]) -> Option<Self> {
        let mut fit = LinearFit::new();
        for pair in pairs {
            let row = Vector2::new(1.0, pair.signal_adu) / pair.sigma_adu2;
            fit.add(&row, 1.0, pair.variance_adu2 / pair.sigma_adu2);
        }
        let covariance = fit.matrix.try_inverse()?;
        let line = covariance * fit.vector;
        let (intercept, slope) = (line[0], line[1]);
        let chi_sq = |p: &PairPoint| {
            ((p.variance_adu2 - intercept - slope * p.signal_adu) / p.sigma_adu2).powi(2)
        };
        let reduced_chi_sq = match pairs.len() {
            0..=2 => 1.0,
            n => (pairs.iter().map(chi_sq).sum::<f64>() / (n - 2) as f64).max(1.0),
        };
        let e_per_adu = 1.0 / slope;
        (slope > 0.0).then(|| Self {
            e_per_adu,
            sigma: e_per_adu * e_per_adu * (covariance[(1, 1)] * reduced_chi_sq).sqrt(),
            read_noise_adu: (intercept > 0.0).then(|| intercept.sqrt()),
            method: GainMethod::Line,
        })
    }
}
