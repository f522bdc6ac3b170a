//! Frames without an image: one value everywhere, or mostly full scale.

use super::cause::Diagnosis;
use crate::frame::Frame;

/// Fraction of pixels at the highest level from which a frame is overexposed.
const SATURATED_SHARE: f64 = 0.2;
/// Fewest steps between the lowest and the highest level for the latter to be a full scale.
const FULL_SCALE_STEPS: f32 = 32.0;

/// Whether the frame is empty or overexposed.
pub(super) fn diagnose(frame: &Frame) -> Option<Diagnosis> {
    let pixels = frame.values();
    let values = || pixels.iter().copied().filter(|p| !p.is_nan());
    let lowest = values().fold(f32::INFINITY, f32::min);
    let highest = values().fold(f32::NEG_INFINITY, f32::max);
    let is_full = frame.saturation_adu.is_some_and(|full| highest >= full);
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
    let full = match frame.saturation_adu {
        Some(full) if is_full => full,
        _ => highest,
    };
    let at_full = values().filter(|&p| p >= full).count();
    let share = at_full as f64 / values().count() as f64;
    (share > SATURATED_SHARE).then_some(Diagnosis::Saturated {
        share,
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
    fn dark_frames_of_few_levels_and_frames_with_bright_stars_are_neither() {
        assert_eq!(diagnose(&frame(|i| (i % 3) as f32)), None);
        assert_eq!(
            diagnose(&frame(|i| if i % 50 == 0 { 255.0 } else { 10.0 })),
            None
        );
    }
}
