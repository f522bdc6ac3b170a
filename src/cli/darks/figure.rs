//! The figures of dark frames: how many pixels have which level, and which noise.

use starpipe::base::format::{counted, five_digits};
use starpipe::calibration::darks::Darks;
use starpipe::report::figure::{Axis, Marks, Panel, PlotLayer, Rgb, Sheet};

/// Bars, at most.
const BARS: usize = 60;
/// Share of the pixels, at either end, that decides how far a figure reaches.
const END_FRACTION: f64 = 1e-3;
/// A figure reaches farther than this by half.
const ROOM: f64 = 0.5;

/// The figures of what was measured on every pixel.
pub(super) fn sheet(darks: &Darks) -> Sheet {
    let mut panels = Vec::new();
    if let Some(group) = darks.groups.last() {
        let exposure = group
            .exposure_s
            .map_or(String::new(), |s| format!(" at {} s", five_digits(s)));
        panels.extend(histogram(
            &format!("Levels{exposure}"),
            "mean level of a pixel (ADU)",
            &group.means,
            // Grey levels are whole: their means lie this far apart.
            1.0 / group.frames as f64,
        ));
    }
    if let Some(noise) = &darks.noise_adu {
        panels.extend(histogram("Noise", "noise of a pixel (ADU)", noise, 0.0));
    }
    let abreast = panels.len().max(1);
    Sheet::new(panels, abreast)
}

/// Bars of the numbers of pixels, as wide as a multiple of `step`; none without values. The title has how many
/// are beyond.
fn histogram(title: &str, axis: &str, values: &[f32], step: f64) -> Option<Panel> {
    let finite = || values.iter().filter(|value| value.is_finite());
    let mut sorted: Vec<f32> = finite().copied().collect();
    let last = sorted.len().checked_sub(1)?;
    let end = (END_FRACTION * last as f64) as usize;
    sorted.sort_unstable_by(f32::total_cmp);
    let [low, high] = [end, last - end].map(|place| f64::from(sorted[place]));
    let room = (ROOM * (high - low)).max(f64::from(f32::EPSILON) * high.abs().max(1.0));
    let least = if sorted[0] < 0.0 { f64::MIN } else { 0.0 };
    let (low, high) = ((low - room).max(least), high + room);
    let width = (high - low) / BARS as f64;
    let (low, width) = match step {
        0.0 => (low, width),
        // Edges lie between the values.
        _ => (
            (low / step).floor() * step - 0.5 * step,
            (width / step).ceil() * step,
        ),
    };
    let bars = (((high - low) / width).ceil() as usize).clamp(1, BARS);
    let high = low + width * bars as f64;
    let mut counts = vec![0usize; bars];
    let mut beyond = 0;
    for value in finite() {
        let bar = (f64::from(*value) - low) / width;
        match counts.get_mut(bar as usize).filter(|_| bar >= 0.0) {
            Some(count) => *count += 1,
            None => beyond += 1,
        }
    }
    let bar = |(number, count): (usize, &usize)| {
        let from = low + width * number as f64;
        ([from, from + width], *count as f64)
    };
    Some(Panel {
        title: format!("{title}; {} beyond", counted(beyond, "pixel")),
        x: Axis::new(axis).within(low, high),
        y: Axis::new("pixels").beginning_at(0.0),
        layers: vec![PlotLayer::unnamed(
            Rgb::BLUE,
            Marks::Bars(counts.iter().enumerate().map(bar).collect()),
        )],
        ..Panel::default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pixel_is_in_a_bar_or_beyond() {
        let mut values: Vec<f32> = (0..10_000).map(|i| (i % 100) as f32).collect();
        values[7] = 1e6;
        values[8] = f32::NAN;
        let panel = histogram("Levels", "ADU", &values, 1.0).unwrap();
        let Marks::Bars(bars) = &panel.layers[0].marks else {
            panic!("bars");
        };
        assert_eq!(bars.iter().map(|bar| bar.1).sum::<f64>(), 9998.0);
        assert_eq!(panel.title, "Levels; 1 pixel beyond");
        assert!(histogram("Levels", "ADU", &[f32::NAN], 0.0).is_none());
        assert!(histogram("Levels", "ADU", &[3.0; 9], 0.5).is_some());
    }
}
