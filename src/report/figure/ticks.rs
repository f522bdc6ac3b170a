//! Numbers beside an axis: round ones, and what they are called.

use super::typeset::{power_of_ten, typeset};
use crate::base::epoch::ObservationDate;

/// The marks of an axis.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Ticks {
    /// Values with their names.
    pub(super) named: Vec<(f64, String)>,
    /// Values between them.
    pub(super) minor: Vec<f64>,
}

/// About `most` round numbers between two, with as many decimals as their distance needs.
pub(super) fn linear([low, high]: [f64; 2], most: usize) -> Ticks {
    let least = (high - low) / most as f64;
    let power = libm::pow(10.0, libm::floor(libm::log10(least)));
    let parts = [1.0, 2.0, 5.0, 10.0].into_iter();
    let step = parts
        .map(|part| part * power)
        .find(|step| *step >= 0.999 * least);
    let step = step.unwrap_or(10.0 * power);
    // Numbers of many digits are written with powers of ten.
    let is_plain = step >= 1e-5 && low.abs().max(high.abs()) < 1e6;
    let name = if is_plain { number } else { scientific };
    let values = multiples([low, high], step).map(|value| (value, name(value, step)));
    Ticks {
        named: values.collect(),
        minor: Vec::new(),
    }
}

/// The multiples of `step` between two numbers, of which there are a few.
fn multiples([low, high]: [f64; 2], step: f64) -> impl Iterator<Item = f64> {
    /// What rounding may hide of a step.
    const ROUNDING: f64 = 1e-6;
    /// More are no few.
    const MAX: f64 = 100.0;
    let first = (low / step - ROUNDING).ceil();
    let count = ((high / step + ROUNDING).floor() - first + 1.0).clamp(0.0, MAX) as u32;
    (0..count).map(move |i| (first + f64::from(i)) * step)
}

/// A multiple of `step` as text.
fn number(value: f64, step: f64) -> String {
    let exponent = |value: f64| libm::floor(libm::log10(value.abs()) + 1e-9) as i32;
    let last = exponent(step);
    if value.abs() < 1e-6 * step {
        return format!("{:.*}", (-last).max(0) as usize, 0.0);
    }
    typeset(&format!("{value:.*}", (-last).max(0) as usize))
}

/// A multiple of `step` as text with a power of ten.
fn scientific(value: f64, step: f64) -> String {
    if value.abs() < 1e-6 * step {
        return "0".to_owned();
    }
    let exponent = |value: f64| libm::floor(libm::log10(value.abs()) + 1e-9) as i32;
    let decimals = (exponent(value) - exponent(step)).max(0) as usize;
    typeset(&format!("{value:.decimals$e}"))
}

/// Numbers beside a logarithmic axis: the fewest of each decade that leave three on the axis, and powers of ten
/// where there would be more than `most`.
pub(super) fn logarithmic([low, high]: [f64; 2], most: usize) -> Ticks {
    const ENOUGH: usize = 3;
    let mantissas: [&[i32]; 4] = [&[1], &[1, 3], &[1, 2, 5], &[1, 2, 3, 4, 5, 6, 7, 8, 9]];
    let [first, last] = [low, high].map(|end| libm::floor(libm::log10(end)) as i32);
    let stride = ((last - first) as usize / most.max(1) + 1) as i32;
    let of = |mantissas: &'static [i32], stride: i32| {
        let decades = (first..=last).filter(move |decade| decade % stride == 0);
        let all = decades.flat_map(move |decade| mantissas.iter().map(move |m| (*m, decade)));
        all.map(|(m, decade)| (f64::from(m) * libm::pow(10.0, f64::from(decade)), decade))
            .filter(|(value, _)| (low * (1.0 - 1e-9)..=high * (1.0 + 1e-9)).contains(value))
    };
    let fits = |mantissas: &&'static [i32]| {
        stride > 1 || (ENOUGH..=most.max(ENOUGH)).contains(&of(mantissas, 1).count())
    };
    let Some(mantissas) = mantissas.into_iter().find(fits) else {
        // A small part of a decade.
        return linear([low, high], most);
    };
    let is_plain = -3 <= first && last <= 4;
    let name = |(value, decade): (f64, i32)| {
        let step = libm::pow(10.0, f64::from(decade));
        let text = match mantissas.len() {
            1 if !is_plain => power_of_ten(decade),
            _ if (-5..6).contains(&decade) => number(value, step),
            _ => scientific(value, step),
        };
        (value, text)
    };
    let minor = of(&[1, 2, 3, 4, 5, 6, 7, 8, 9], 1).map(|(value, _)| value);
    /// Of more decades the marks between powers of ten run together.
    const MAX_DECADES: i32 = 10;
    Ticks {
        named: of(mantissas, stride).map(name).collect(),
        minor: minor.filter(|_| last - first <= MAX_DECADES).collect(),
    }
}

/// Full hours, or parts of them, between two Modified Julian Dates; days where there are many.
pub(super) fn times([low, high]: [f64; 2], most: usize) -> Ticks {
    const MINUTES: [f64; 13] = [
        1.0, 2.0, 5.0, 10.0, 30.0, 60.0, 120.0, 180.0, 360.0, 720.0, 1440.0, 10_080.0, 43_200.0,
    ];
    const PER_DAY: f64 = 1440.0;
    let [first, last] = [low, high].map(|mjd| mjd * PER_DAY);
    let step = MINUTES
        .into_iter()
        .find(|step| (last - first) / step <= most as f64);
    let step = step.unwrap_or((last - first) / most.max(1) as f64);
    let name = |minutes: f64| {
        let mjd = minutes / PER_DAY;
        if step >= PER_DAY {
            let date = ObservationDate::from_modified_julian_date(mjd);
            return date.map_or_else(String::new, |date| date.to_iso().chars().take(10).collect());
        }
        let of_day = (minutes.round() as i64).rem_euclid(PER_DAY as i64);
        format!("{:02}:{:02}", of_day / 60, of_day % 60)
    };
    let values = multiples([first, last], step).map(|minutes| (minutes / PER_DAY, name(minutes)));
    Ticks {
        named: values.collect(),
        minor: Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(ticks: &Ticks) -> Vec<&str> {
        ticks.named.iter().map(|(_, name)| name.as_str()).collect()
    }

    #[test]
    fn linear_axes_have_round_numbers_and_true_minus_signs() {
        for (range, most, expected) in [
            ([0.0, 100.0], 5, &["0", "20", "40", "60", "80", "100"][..]),
            ([20.49, 21.08], 4, &["20.6", "20.8", "21.0"]),
            ([-0.05, 0.05], 3, &["−0.05", "0.00", "0.05"]),
            ([-3e-7, 3e-7], 3, &["−2×10⁻⁷", "0", "2×10⁻⁷"]),
            ([0.0, 100_000.0], 2, &["0", "50000", "100000"]),
            ([0.0, 2.5e6], 3, &["0", "1×10⁶", "2×10⁶"]),
        ] {
            assert_eq!(names(&linear(range, most)), expected, "{range:?}");
        }
    }

    #[test]
    fn logarithmic_axes_have_decades_or_at_least_three_round_numbers() {
        for (range, expected) in [
            ([0.5, 2000.0], &["1", "10", "100", "1000"][..]),
            ([0.9, 5.0], &["1", "2", "5"]),
            ([2.5, 7.5], &["3", "4", "5", "6", "7"]),
            ([1e-6, 2e-4], &["10⁻⁶", "10⁻⁵", "10⁻⁴"]),
            ([4.2, 4.6], &["4.2", "4.3", "4.4", "4.5", "4.6"]),
        ] {
            assert_eq!(names(&logarithmic(range, 5)), expected, "{range:?}");
        }
        assert!(names(&logarithmic([1e-12, 1e12], 5)).len() <= 6);
    }

    #[test]
    fn times_are_full_hours_or_dates() {
        let night = times([61_000.76, 61_001.1], 10);
        let hours = [
            "19:00", "20:00", "21:00", "22:00", "23:00", "00:00", "01:00", "02:00",
        ];
        assert_eq!(names(&night), hours);
        assert_eq!(
            names(&times([61_000.5, 61_000.51], 3)),
            ["12:00", "12:05", "12:10"]
        );
        let days = times([61_000.5, 61_003.5], 5);
        assert_eq!(names(&days), ["2025-11-22", "2025-11-23", "2025-11-24"]);
    }
}
