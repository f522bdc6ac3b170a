//! Photon transfer: the gain from the noise of light.

use crate::calibration::darks::robust::Typical;
use nalgebra::{Matrix2, Vector2};

/// Pairs whose signals differ by this factor or more are of different light, and give a line.
const RANGE_OF_LINE: f64 = 1.5;
const ROUNDING_VARIANCE: f64 = 1.0 / 12.0;

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
    /// From two frames with their levels, and the step between grey levels.
    pub(super) fn of(pair: [(f64, &[f32]); 2], step_adu: f64) -> Option<Self> {
        let [(one_level, one), (other_level, other)] = pair;
        let signal_adu = (one_level + other_level) / 2.0;
        // Both made as bright as their mean: what is left of the pattern in the difference is nothing.
        let (a, b) = (
            (signal_adu / one_level) as f32,
            (signal_adu / other_level) as f32,
        );
        let differences: Vec<f32> = one.iter().zip(other).map(|(p, q)| p * a - q * b).collect();
        let count = differences.iter().filter(|d| !d.is_nan()).count();
        let spread = Typical::of(&differences, step_adu / 2.0)?.spread;
        let variance = spread * spread / 2.0;
        Some(Self {
            signal_adu,
            variance_adu2: variance - ROUNDING_VARIANCE * step_adu * step_adu,
            sigma_adu2: variance * (2.0 / count as f64).sqrt(),
        })
    }
}

/// How a gain was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GainMethod {
    /// From the slope of variance against signal.
    Line,
    /// From pairs of one light, with the read noise of the camera's description.
    KnownReadNoise,
    /// From pairs of one light, as if there were no read noise.
    ShotNoiseAlone,
}

impl GainMethod {
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Line => "slope of variance against signal",
            Self::KnownReadNoise => "one level, read noise of the camera",
            Self::ShotNoiseAlone => "one level, read noise neglected",
        }
    }
}

/// The gain, and the read noise where it follows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gain {
    /// Electrons for a step of the grey level.
    pub e_per_adu: f64,
    /// Its standard error.
    pub sigma: f64,
    /// Read noise, in ADU, where the line's beginning is above 0.
    pub read_noise_adu: Option<f64>,
    /// How it was found.
    pub method: GainMethod,
}

impl Gain {
    /// From `pairs`; nothing where there is none, or variance does not grow with signal.
    pub(super) fn of(pairs: &[PairPoint], read_noise_e: Option<f64>) -> Option<Self> {
        let signals = pairs.iter().map(|pair| pair.signal_adu);
        let lowest = signals.clone().reduce(f64::min)?;
        let highest = signals.reduce(f64::max)?;
        if highest >= RANGE_OF_LINE * lowest {
            return Self::of_line(pairs);
        }
        let weight = |pair: &PairPoint| pair.sigma_adu2.powi(-2);
        let all: f64 = pairs.iter().map(weight).sum();
        let mean =
            |of: fn(&PairPoint) -> f64| pairs.iter().map(|p| weight(p) * of(p)).sum::<f64>() / all;
        let (signal, variance) = (mean(|p| p.signal_adu), mean(|p| p.variance_adu2));
        let read_noise = read_noise_e.unwrap_or(0.0);
        // V g² − S g − R² = 0 with R in electrons.
        let e_per_adu = (signal
            + (signal * signal + 4.0 * variance * read_noise * read_noise).sqrt())
            / (2.0 * variance);
        let sigma = e_per_adu * all.sqrt().recip() / variance;
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

    /// The weighted line V = R² + S / g.
    fn of_line(pairs: &[PairPoint]) -> Option<Self> {
        let (mut matrix, mut vector) = (Matrix2::zeros(), Vector2::zeros());
        for pair in pairs {
            let row = Vector2::new(1.0, pair.signal_adu) / pair.sigma_adu2;
            matrix += row * row.transpose();
            vector += row * (pair.variance_adu2 / pair.sigma_adu2);
        }
        let covariance = matrix.try_inverse()?;
        let line = covariance * vector;
        let (at_zero, slope) = (line[0], line[1]);
        let off = |p: &PairPoint| {
            ((p.variance_adu2 - at_zero - slope * p.signal_adu) / p.sigma_adu2).powi(2)
        };
        let excess = match pairs.len() {
            0..=2 => 1.0,
            n => (pairs.iter().map(off).sum::<f64>() / (n - 2) as f64).max(1.0),
        };
        let e_per_adu = 1.0 / slope;
        (slope > 0.0).then(|| Self {
            e_per_adu,
            sigma: e_per_adu * e_per_adu * (covariance[(1, 1)] * excess).sqrt(),
            read_noise_adu: (at_zero > 0.0).then(|| at_zero.sqrt()),
            method: GainMethod::Line,
        })
    }
}
