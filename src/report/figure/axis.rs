//! The axes of a panel.

use super::ticks::{self, Ticks};

/// Room beyond the marks on either side, and beyond a bound at which there is a point, as a part of the axis.
const ROOM: f64 = 0.04;
/// A point so near to a bound would touch the border.
const NEAR: f64 = 0.015;

/// An axis, from the first to the last mark unless it is bounded.
#[derive(Debug, Clone, Default)]
pub struct Axis {
    /// The quantity and its unit.
    pub title: String,
    /// How values are spaced.
    pub spacing: Spacing,
    /// Where it begins.
    pub from: Option<f64>,
    /// Where it ends; before its beginning if it runs the other way.
    pub to: Option<f64>,
}

/// How the values of an axis are spaced.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Spacing {
    /// Equal differences have equal distances.
    #[default]
    Linear,
    /// Equal ratios have equal distances.
    Log,
    /// Modified Julian Dates.
    Time,
    /// As linear ones, with the names of some values instead of numbers.
    Named(Vec<(f64, String)>),
}

impl Axis {
    /// A linear axis.
    pub fn new(title: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            ..Self::default()
        }
    }

    /// An axis that is logarithmic if `is_log`.
    pub fn log(title: impl Into<String>, is_log: bool) -> Self {
        let spacing = if is_log {
            Spacing::Log
        } else {
            Spacing::Linear
        };
        Self {
            spacing,
            ..Self::new(title)
        }
    }

    /// The axis from one value to another.
    pub fn within(self, from: f64, to: f64) -> Self {
        Self {
            to: Some(to),
            ..self.beginning_at(from)
        }
    }

    /// The axis from a value on.
    pub fn beginning_at(self, from: f64) -> Self {
        Self {
            from: Some(from),
            ..self
        }
    }

    /// The ends of the axis for marks at `values`, of which the `points` must not lie on the border.
    pub(super) fn ends(
        &self,
        values: impl Iterator<Item = f64>,
        points: impl Iterator<Item = f64>,
    ) -> [f64; 2] {
        let known = values.map(|value| self.forward(value));
        let ends = known
            .filter(|value| value.is_finite())
            .fold(None, |ends, value| {
                let [low, high] = ends.unwrap_or([value; 2]);
                Some([f64::min(low, value), f64::max(high, value)])
            });
        let [low, high] = ends.unwrap_or([0.0, 1.0]);
        // An axis of constant values has a length as well.
        let least = if self.spacing == Spacing::Log {
            0.02
        } else {
            (1e-3 * high.abs()).max(1e-6)
        };
        let room = (ROOM * (high - low)).max(least);
        let [from, to] = [(self.from, low - room), (self.to, high + room)]
            .map(|(bound, end)| bound.map_or(end, |bound| self.forward(bound)));
        self.padded([from, to], points)
            .map(|end| self.backward(end))
    }

    /// The ends with room for points that lie near or on them.
    fn padded(&self, [from, to]: [f64; 2], points: impl Iterator<Item = f64>) -> [f64; 2] {
        let room = ROOM * (to - from);
        let part = |value: f64| (self.forward(value) - from) / (to - from);
        let [mut first, mut last] = [false; 2];
        for part in points.map(part) {
            first |= (-1e-9..NEAR).contains(&part);
            last |= (1.0 - NEAR..1.0 + 1e-9).contains(&part);
        }
        let room_at = |is_near: bool| if is_near { room } else { 0.0 };
        [from - room_at(first), to + room_at(last)]
    }

    /// The place of a value where equal distances are equal.
    fn forward(&self, value: f64) -> f64 {
        match self.spacing {
            Spacing::Log => libm::log10(value),
            _ => value,
        }
    }

    fn backward(&self, place: f64) -> f64 {
        match self.spacing {
            Spacing::Log => libm::pow(10.0, place),
            _ => place,
        }
    }

    /// The axis from `ends[0]` at the first pixel to `ends[1]` at the last.
    pub(super) fn scale(&self, ends: [f64; 2], [first_px, last_px]: [f32; 2]) -> Scale {
        let [from, to] = ends.map(|end| self.forward(end));
        Scale {
            is_log: self.spacing == Spacing::Log,
            from,
            to,
            first_px,
            last_px,
        }
    }

    /// The most marks whose names fit beside each other; `length_px` of a name along the axis.
    pub(super) fn ticks(
        &self,
        ends: [f64; 2],
        axis_px: f32,
        length_px: impl Fn(&str) -> f32,
    ) -> Ticks {
        /// Least distance of two names.
        const GAP_PX: f32 = 14.0;
        /// Least distance of two marks.
        const STEP_PX: f32 = 26.0;
        let range = [ends[0].min(ends[1]), ends[0].max(ends[1])];
        let of = |most: usize| match &self.spacing {
            Spacing::Linear => ticks::linear(range, most),
            Spacing::Log => ticks::logarithmic(range, most),
            Spacing::Time => ticks::times(range, most),
            Spacing::Named(names) => Ticks {
                named: names.clone(),
                minor: Vec::new(),
            },
        };
        let fits = |ticks: &Ticks| {
            let mut lengths = ticks.named.iter().map(|(_, name)| length_px(name) + GAP_PX);
            lengths.by_ref().sum::<f32>() <= axis_px + GAP_PX
        };
        let most = ((axis_px / STEP_PX) as usize).clamp(2, 9);
        let mut choices = (2..=most).rev().map(of);
        choices.find(fits).unwrap_or_else(|| of(2))
    }
}

/// An axis on a drawing.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scale {
    is_log: bool,
    from: f64,
    to: f64,
    first_px: f32,
    last_px: f32,
}

impl Scale {
    /// Where a value is.
    pub(super) fn px(&self, value: f64) -> f32 {
        let place = if self.is_log {
            libm::log10(value)
        } else {
            value
        };
        let part = (place - self.from) / (self.to - self.from);
        self.first_px + part as f32 * (self.last_px - self.first_px)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ends(axis: &Axis, values: &[f64]) -> [f64; 2] {
        axis.ends(values.iter().copied(), values.iter().copied())
    }

    #[test]
    fn no_point_is_on_the_border() {
        for (axis, values) in [
            (Axis::new(""), &[1.0, 2.0, f64::NAN][..]),
            (Axis::new("").within(0.0, 100.0), &[0.0, 50.0, 100.0]),
            (Axis::new("").within(100.0, 0.0), &[0.0, 50.0, 100.0]),
            (Axis::log("", true).within(1.0, 100.0), &[1.0, 100.0]),
            (Axis::new(""), &[7.0]),
            (Axis::log("", true), &[7.0]),
        ] {
            let ends = ends(&axis, values);
            let scale = axis.scale(ends, [0.0, 100.0]);
            for value in values.iter().filter(|value| value.is_finite()) {
                assert!(
                    (2.5..=97.5).contains(&scale.px(*value)),
                    "{axis:?} {ends:?}"
                );
            }
        }
        let far = [-50.0, 50.0];
        assert_eq!(ends(&Axis::new("").within(0.0, 100.0), &far), [0.0, 100.0]);
    }
}
