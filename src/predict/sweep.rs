//! Sweeps: the limiting magnitude over one parameter, the others constant.

use super::budget::Budget;
use super::check::ScenarioError;
use super::parameters::{Parameter, UnknownParameter};
use super::scenario::Scenario;
use crate::camera::data_sheet::NumberRange;
use std::cmp::Ordering;

/// Spacing of values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Spacing {
    /// Constant difference.
    Linear,
    /// Constant ratio.
    Log,
}

impl Spacing {
    /// `count` values from `from` to `to`, both included; for logarithmic spacing both must be
    /// above 0. Values are rounded to 12 digits, so that decimal fractions print as such.
    pub fn values(self, from: f64, to: f64, count: usize) -> Vec<f64> {
        let last = count.max(2) - 1;
        let value = |i: usize| {
            let part = i as f64 / last as f64;
            match self {
                _ if i == 0 => from,
                _ if i == last => to,
                Self::Linear => rounded_as(from + part * (to - from), from.abs().max(to.abs())),
                Self::Log => {
                    let value = from * libm::pow(to / from, part);
                    rounded_as(value, value)
                }
            }
        };
        (0..count).map(value).collect()
    }
}

impl Spacing {
    /// [`Self::values`] from the first to the second of `ends`, with checked arguments.
    ///
    /// # Errors
    /// [`SweepError::Count`], [`SweepError::Backwards`], [`SweepError::LogOfNothing`].
    pub fn checked_values(self, ends: [f64; 2], count: usize) -> Result<Vec<f64>, SweepError> {
        let [from, to] = ends;
        if !(2..=Sweep::MAX_VALUES).contains(&count) {
            return Err(SweepError::Count { count });
        }
        // Also refuses NaN.
        if from.partial_cmp(&to) != Some(Ordering::Less) {
            return Err(SweepError::Backwards { from, to });
        }
        if self == Self::Log && from <= 0.0 {
            return Err(SweepError::LogOfNothing { from });
        }
        Ok(self.values(from, to, count))
    }
}

/// `value`, rounded to the twelfth digit of `size`.
fn rounded_as(value: f64, size: f64) -> f64 {
    let decimals = (11.0 - libm::log10(size).floor()).max(0.0) as usize;
    // Via decimal digits, as a product with a power of ten is not exact.
    format!("{value:.decimals$}").parse().unwrap_or(value)
}

/// Values of one parameter.
#[derive(Debug, Clone)]
pub struct Sweep {
    /// The parameter.
    pub parameter: Parameter,
    /// Its values, increasing.
    pub values: Vec<f64>,
    /// Their spacing.
    pub spacing: Spacing,
}

/// Why a sweep is invalid.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SweepError {
    /// There is no parameter of this name.
    #[error(transparent)]
    Unknown(#[from] UnknownParameter),
    /// Fewer than two values, or too many.
    #[error(
        "the number of sweep values is {count}, expected 2 to {}",
        Sweep::MAX_VALUES
    )]
    Count {
        /// Number of values.
        count: usize,
    },
    /// The values do not increase.
    #[error("the sweep runs from {from} to {to}, expected increasing values")]
    Backwards {
        /// The first value.
        from: f64,
        /// The last value.
        to: f64,
    },
    /// A value is outside the parameter's limits.
    #[error("{name} would be {found}, expected {expected}")]
    Value {
        /// The parameter.
        name: &'static str,
        /// The value.
        found: f64,
        /// Valid values.
        expected: NumberRange,
    },
    /// Logarithmic spacing needs values above 0.
    #[error("the logarithmic sweep starts at {from}, expected a start above 0")]
    LogOfNothing {
        /// The first value.
        from: f64,
    },
}

impl Sweep {
    /// Largest number of values.
    pub const MAX_VALUES: usize = 1000;

    /// `count` values of the parameter called `name`, from the first to the second of `ends`.
    ///
    /// # Errors
    /// [`SweepError`] for an unknown name, a value outside the limits, or an invalid range or
    /// count.
    pub fn new(
        name: &str,
        ends: [f64; 2],
        count: usize,
        spacing: Spacing,
    ) -> Result<Self, SweepError> {
        let parameter = Parameter::named(name)?;
        let values = spacing.checked_values(ends, count)?;
        let limits = parameter.limits();
        match values.iter().find(|value| !limits.accept(**value)) {
            Some(&found) => Err(SweepError::Value {
                name: parameter.name(),
                found,
                expected: limits,
            }),
            None => Ok(Self {
                parameter,
                values,
                spacing,
            }),
        }
    }

    /// `base` with each of the values, all checked.
    ///
    /// # Errors
    /// [`ScenarioError`] if a value contradicts another parameter.
    pub fn scenarios(&self, base: &Scenario) -> Result<Vec<Scenario>, ScenarioError> {
        let scenario = |value: &f64| {
            let mut scenario = base.clone();
            self.parameter.set(&mut scenario, *value);
            scenario.check()?;
            Ok(scenario)
        };
        self.values.iter().map(scenario).collect()
    }
}

/// The parameter that differs between the curves of a figure, and its values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurveValues {
    /// Name of the parameter.
    pub parameter: &'static str,
    /// Its value for each curve.
    pub values: [f64; 2],
}

impl CurveValues {
    /// The two exposures of the paper's figures.
    pub const PAPER_EXPOSURES: Self = Self {
        parameter: "exposure_s",
        values: [0.04, 0.5],
    };
    /// The two apertures of the paper's figure over the exposure.
    pub const PAPER_APERTURES: Self = Self {
        parameter: "aperture_mm",
        values: [100.0, 50.0],
    };

    /// The choice of the paper, applied to another camera: the scenario's exposure and one 12.5
    /// times as long; over the exposure, the scenario's aperture and half of it.
    pub fn around(base: &Scenario, swept: Parameter) -> Self {
        if swept.name() == "exposure_s" {
            let aperture_mm = base.camera.aperture_mm;
            return Self {
                parameter: "aperture_mm",
                values: [aperture_mm, aperture_mm / 2.0],
            };
        }
        let exposure_s = base.conditions.exposure_s;
        Self {
            parameter: "exposure_s",
            values: [exposure_s, exposure_s * 12.5],
        }
    }
}

/// A curve of a figure.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepCurve {
    /// Label: `exposure 0.04 s`.
    pub label: String,
    /// Values of the parameter and limiting magnitudes.
    pub points: Vec<(f64, f64)>,
}

/// The limiting magnitude over `sweep`, once for each value of `series`.
///
/// # Errors
/// [`ScenarioError`] if a value contradicts another parameter or has no limit.
pub fn curves(
    base: &Scenario,
    sweep: &Sweep,
    series: &CurveValues,
) -> Result<Vec<SweepCurve>, ScenarioError> {
    let Ok(apart) = Parameter::named(series.parameter) else {
        return Ok(Vec::new());
    };
    let curve = |value: &f64| {
        let mut base = base.clone();
        apart.set(&mut base, *value);
        let limit = |scenario: &Scenario| Ok(Budget::checked(scenario)?.limit_vmag);
        let scenarios = sweep.scenarios(&base)?;
        let limits: Result<Vec<f64>, ScenarioError> = scenarios.iter().map(limit).collect();
        Ok(SweepCurve {
            label: format!("{} {value} {}", apart.quantity(), apart.unit()),
            points: sweep.values.iter().copied().zip(limits?).collect(),
        })
    };
    series.values.iter().map(curve).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::data_sheet::Preset;
    use proptest::prelude::*;

    fn sweep(name: &str, from: f64, to: f64, count: usize) -> Result<Sweep, SweepError> {
        Sweep::new(name, [from, to], count, Spacing::Linear)
    }

    #[test]
    fn values_look_like_themselves() {
        let values = Spacing::Linear.values(0.0, 1.0, 11);
        assert_eq!(values[3].to_string(), "0.3");
        assert_eq!(Spacing::Linear.values(-0.3, 0.3, 3), [-0.3, 0.0, 0.3]);
        assert_eq!(Spacing::Log.values(1e-4, 0.1, 4), [1e-4, 1e-3, 1e-2, 0.1]);
        assert_eq!(Spacing::Linear.values(5.0, 9.0, 1), [5.0]);
        assert_eq!(Spacing::Linear.values(3e20, 4e20, 3), [3e20, 3.5e20, 4e20]);
    }

    #[test]
    fn what_is_no_sweep_is_refused() {
        for (found, expected) in [
            (
                sweep("apertur", 5.0, 200.0, 40),
                "unknown parameter 'apertur'; did you mean 'aperture_mm'?",
            ),
            (
                sweep("aperture_mm", 200.0, 5.0, 40),
                "from 200 to 5, expected increasing values",
            ),
            (
                sweep("aperture_mm", 5.0, f64::NAN, 40),
                "to NaN, expected increasing values",
            ),
            (
                sweep("aperture_mm", 5.0, 200.0, 1),
                "the number of sweep values is 1, expected 2 to 1000",
            ),
            (
                sweep("aperture_mm", 5.0, 200.0, 1001),
                "the number of sweep values is 1001",
            ),
            (
                sweep("aperture_mm", -5.0, 200.0, 3),
                "aperture_mm would be -5, expected a number above 0",
            ),
            (
                sweep("zenith_distance_deg", 0.0, 90.0, 10),
                "would be 90, expected a number from 0 to below 90",
            ),
            (sweep("bits", 8.0, 9.0, 3), "bits would be 8.5"),
            (
                Sweep::new("dark_current_e_s", [0.0, 9.0], 3, Spacing::Log),
                "the logarithmic sweep starts at 0",
            ),
        ] {
            let error = found.unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        }
    }

    #[test]
    fn a_contradiction_on_the_way_is_found() {
        let base = Scenario::of(Preset::Experiment1);
        let found = sweep("band_to_nm", 700.0, 900.0, 3).unwrap();
        let error = found.scenarios(&base).unwrap_err().to_string();
        assert!(
            error.contains("360 to 780 nm, which does not cover"),
            "{error}"
        );
    }

    #[test]
    fn a_curve_is_the_limit_at_each_value() {
        let base = Scenario::of(Preset::Experiment1);
        let swept = sweep("focal_length_mm", 80.0, 160.0, 3).unwrap();
        let found = curves(&base, &swept, &CurveValues::around(&base, swept.parameter)).unwrap();
        assert_eq!(found[0].label, "exposure 0.04 s");
        assert_eq!(found[1].label, "exposure 0.5 s");
        assert_eq!(found[0].points[2], (160.0, Budget::new(&base).limit_vmag));
        assert!(found[1].points[2].1 > 10.7);
        let exposure = Parameter::named("exposure_s").unwrap();
        let series = CurveValues::around(&base, exposure);
        assert_eq!(
            (series.parameter, series.values),
            ("aperture_mm", [100.0, 50.0])
        );
    }

    proptest! {
        #[test]
        fn values_rise_from_end_to_end(from in 1e-6..1e6f64, ratio in 1.01..1e6f64, count in 2..50usize) {
            for spacing in [Spacing::Linear, Spacing::Log] {
                let values = spacing.values(from, from * ratio, count);
                prop_assert_eq!(values.len(), count);
                prop_assert_eq!((values[0], values[count - 1]), (from, from * ratio));
                prop_assert!(values.is_sorted());
            }
        }
    }
}
