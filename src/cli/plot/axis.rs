//! The axes of a panel.

use plotters::coord::combinators::{BindKeyPoints, LogCoord, WithKeyPoints};
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::IntoLogRange;
use std::ops::Range;

/// Room beyond the marks on either side, as a part of the axis.
const ROOM: f64 = 0.04;

/// An axis, from the first to the last mark unless it is bounded.
#[derive(Clone, Default)]
pub(crate) struct Axis {
    pub(crate) title: String,
    pub(crate) is_log: bool,
    pub(crate) from: Option<f64>,
    pub(crate) to: Option<f64>,
}

impl Axis {
    pub(crate) fn new(title: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            ..Self::default()
        }
    }

    /// An axis that is logarithmic if `is_log`.
    pub(crate) fn log(title: impl Into<String>, is_log: bool) -> Self {
        Self {
            is_log,
            ..Self::new(title)
        }
    }

    pub(crate) fn within(self, from: f64, to: f64) -> Self {
        Self {
            from: Some(from),
            to: Some(to),
            ..self
        }
    }

    /// The ends of the axis for marks at `values`.
    pub(super) fn range(&self, values: impl Iterator<Item = f64>) -> [f64; 2] {
        let fits = |value: &f64| value.is_finite() && (!self.is_log || *value > 0.0);
        let ends = values.filter(fits).fold(None, |ends, value| {
            let [low, high] = ends.unwrap_or([value; 2]);
            Some([f64::min(low, value), f64::max(high, value)])
        });
        let [low, high] = ends.unwrap_or([1.0, 2.0]);
        let [from, to] = if self.is_log {
            let room = (high / low).powf(ROOM).max(1.05);
            [low / room, high * room]
        } else {
            // An axis of constant values has a length as well.
            let room = ((high - low) * ROOM).max(1e-3 * high.abs()).max(1e-6);
            [low - room, high + room]
        };
        [self.from.unwrap_or(from), self.to.unwrap_or(to)]
    }

    /// The scale between the two ends.
    pub(super) fn scale(&self, [from, to]: [f64; 2]) -> Scale {
        if self.is_log {
            Scale::Log(logarithmic(from..to))
        } else {
            Scale::linear(from..to)
        }
    }
}

/// The scale of an axis. It is one type for all axes, so that charts are compiled once.
pub(crate) enum Scale {
    Linear(RangedCoordf64),
    Log(WithKeyPoints<LogCoord<f64>>),
}

impl Scale {
    pub(crate) fn linear(range: Range<f64>) -> Self {
        Self::Linear(range.into())
    }
}

impl Ranged for Scale {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        match self {
            Self::Linear(scale) => scale.map(value, limit),
            Self::Log(scale) => scale.map(value, limit),
        }
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        match self {
            Self::Linear(scale) => scale.key_points(hint),
            Self::Log(scale) => scale.key_points(hint),
        }
    }

    fn range(&self) -> Range<f64> {
        match self {
            Self::Linear(scale) => scale.range(),
            Self::Log(scale) => scale.range(),
        }
    }
}

impl ValueFormatter<f64> for Scale {
    fn format(value: &f64) -> String {
        RangedCoordf64::format(value)
    }
}

/// A logarithmic axis with round numbers at any range; plotters has only powers of ten.
fn logarithmic(range: Range<f64>) -> WithKeyPoints<LogCoord<f64>> {
    let numbers = round_numbers(range.start, range.end);
    let decades = decades(range.start, range.end);
    let lines = decades.flat_map(|decade| (2..10).map(move |i| decade * f64::from(i)));
    let lines: Vec<f64> = lines.filter(|value| range.contains(value)).collect();
    range
        .log_scale()
        .with_key_points(numbers)
        .with_light_points(lines)
}

/// Powers of ten, the first below `from`.
fn decades(from: f64, to: f64) -> impl Iterator<Item = f64> {
    let (first, last) = (from.log10().floor() as i32, to.log10().ceil() as i32);
    (first..=last).map(|power| 10f64.powi(power))
}

/// Numbers beside a logarithmic axis: the fewest of each decade that leave three on the axis.
fn round_numbers(from: f64, to: f64) -> Vec<f64> {
    const ENOUGH: usize = 3;
    let mantissas: [&[f64]; 4] = [
        &[1.0],
        &[1.0, 3.0],
        &[1.0, 2.0, 5.0],
        &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0],
    ];
    let of = |mantissas: &[f64]| -> Vec<f64> {
        let all = decades(from, to).flat_map(|decade| mantissas.iter().map(move |m| m * decade));
        all.filter(|value| (from..=to).contains(value)).collect()
    };
    let choices = mantissas.iter().map(|mantissas| of(mantissas));
    choices
        .reduce(|numbers, more| {
            if numbers.len() < ENOUGH {
                more
            } else {
                numbers
            }
        })
        .unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_logarithmic_axis_has_three_round_numbers() {
        assert_eq!(round_numbers(0.5, 2000.0), [1.0, 10.0, 100.0, 1000.0]);
        assert_eq!(round_numbers(0.9, 5.0), [1.0, 2.0, 5.0]);
        assert_eq!(round_numbers(2.5, 7.5), [3.0, 4.0, 5.0, 6.0, 7.0]);
    }
}
