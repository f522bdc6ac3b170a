//! Frames without an image: one value everywhere, mostly full scale, or with a sky close to it.

use super::cause::Diagnosis;
use crate::base::statistics::median;
use crate::frame::Frame;

/// Fraction of pixels at the highest level from which a frame is overexposed.
const SATURATED_FRACTION: f64 = 0.2;
/// Median over the highest level from which a frame is overexposed where it reaches full scale.
const FULL_SKY: f64 = 0.9;
/// Fewest steps between the lowest and the highest level for the latter to be a full scale.
const FULL_SCALE_STEPS: f32 = 32.0;
/// The median is that of at most so many pixels.
const MEDIAN_PX: usize = 1 << 20;

/// Whether the frame is empty or overexposed.
pub(super) fn diagnose(frame: &Frame) -> Option<Diagnosis> {
    let pixels = &frame.pixels;
    let [lowest, highest] = frame.range_adu();
    let saturation_adu = frame.saturation_level_adu();
    let is_full = saturation_adu.is_some_and(|full| highest >= full);
    if lowest == highest && !is_full {
        return Some(Diagnosis::NoVariation {
            level_adu: f64::from(lowest),
        });
    }
    let steps = (highest - lowest) / frame.step_adu;
    // A detector with fewer bits than its file saturates below the format's full scale.
    if !is_full && (steps.is_nan() || steps < FULL_SCALE_STEPS) {
        return None;
    }
    let full = match saturation_adu {
        Some(full) if is_full => full,
        _ => highest,
    };
    let at_full = pixels.count(|p| p >= full);
    let share = at_full as f64 / pixels.count(|p| !p.is_nan()) as f64;
    // Of frames with negative levels the lowest is dark.
    let dark = f64::from(lowest.min(0.0));
    let step = pixels.len().div_ceil(MEDIAN_PX);
    let sample = (0..pixels.len())
        .step_by(step)
        .map(|index| f64::from(pixels.value(index)));
    let sample = sample.filter(|p| !p.is_nan());
    let sky = median(&mut sample.collect::<Vec<_>>());
    let sky = (sky - dark) / (f64::from(full) - dark);
    let is_sky_full = is_full && sky > FULL_SKY;
    (share > SATURATED_FRACTION || is_sky_full).then_some(Diagnosis::Saturated {
        share,
        sky,
        level_adu: f64::from(full),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(pixels: impl Fn(usize) -> f32) -> Frame<'static> {
        Frame::new(40, 30, (0..1200).map(pixels).collect())
            .unwrap()
            .with_levels(1.0, Some(255.0))
    }

    #[test]
    fn one_value_is_no_picture_and_full_scale_is_too_much_light() {
        assert_eq!(
            diagnose(&frame(|_| 7.0)),
            Some(Diagnosis::NoVariation { level_adu: 7.0 })
        );
        let white = diagnose(&frame(|_| 255.0));
        assert!(
            matches!(white, Some(Diagnosis::Saturated { share: 1.0, .. })),
            "{white:?}"
        );
        let half = diagnose(&frame(|i| if i % 2 == 0 { 255.0 } else { 90.0 }));
        assert!(
            matches!(half, Some(Diagnosis::Saturated { share: 0.5, .. })),
            "{half:?}"
        );
    }

    #[test]
    fn a_detector_may_be_full_below_the_scale_of_its_file() {
        let full = diagnose(&frame(|i| if i % 3 == 0 { 200.0 } else { 90.0 }));
        assert!(
            matches!(
                full,
                Some(Diagnosis::Saturated {
                    level_adu: 200.0,
                    ..
                })
            ),
            "{full:?}"
        );
    }

    #[test]
    fn a_sky_close_to_full_scale_is_too_much_light() {
        // Noise of 60 levels of which the highest are rare, cut off at 12 bits.
        let noise = |i: usize| ((i * 37) % 61 + (i * 29) % 59) as f32 - 59.0;
        let sky = |level: f32| {
            let pixels = (0..1200).map(|i| (level + noise(i)).min(4095.0));
            Frame::new(40, 30, pixels.collect())
                .unwrap()
                .with_levels(1.0, Some(65_535.0))
        };
        let over = diagnose(&sky(4066.0));
        assert!(
            matches!(over, Some(Diagnosis::Saturated { share, sky, .. }) if share < 0.2 && sky > 0.9),
            "{over:?}"
        );
        assert_eq!(diagnose(&sky(3000.0)), None);
    }

    #[test]
    fn the_sky_is_a_part_of_full_scale_where_that_is_zero_too() {
        let full = diagnose(&frame(|i| if i % 3 == 0 { 0.0 } else { -300.0 }));
        assert!(
            matches!(full, Some(Diagnosis::Saturated { sky: 0.0, .. })),
            "{full:?}"
        );
    }

    #[test]
    fn dark_frames_of_few_levels_and_frames_with_bright_stars_are_neither() {
        assert_eq!(diagnose(&frame(|i| (i % 3) as f32)), None);
        assert_eq!(
            diagnose(&frame(|i| if i % 50 == 0 { 255.0 } else { 10.0 })),
            None
        );
    }
}
