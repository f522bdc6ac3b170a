//! The level of a pixel without light.

use crate::base::coords::PixelPoint;
use crate::base::statistics::{Estimate, mean_and_squares, median, median_of_rounded};
use crate::detect::{Circle, Detections};
use crate::frame::Frame;

/// The level of a pixel without light, and what tells it.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct DarkLevel {
    /// In ADU.
    pub adu: Estimate,
    /// What tells it.
    pub source: DarkSource,
}

/// What tells the level of a pixel without light.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum DarkSource {
    /// A dark frame.
    Dark,
    /// The camera's description.
    Camera,
    /// Pixels of the detector that light does not reach.
    OpticalBlack,
    /// The pixels outside the circle of an all-sky lens.
    Unlit,
    /// Frames of different exposure.
    Exposures,
    /// The darkest part of the frame: it is no higher.
    Darkest,
}

impl DarkSource {
    /// Its code in reports.
    pub const fn code(self) -> &'static str {
        match self {
            Self::Dark => "dark",
            Self::Camera => "camera",
            Self::OpticalBlack => "optical_black",
            Self::Unlit => "unlit",
            Self::Exposures => "exposures",
            Self::Darkest => "darkest",
        }
    }
}

impl DarkLevel {
    /// A level that is stated.
    pub(crate) fn stated(adu: f64, source: DarkSource) -> Self {
        let adu = Estimate {
            value: adu,
            sigma: 0.0,
        };
        Self { adu, source }
    }

    /// That of the pixels outside the circle of an all-sky lens.
    pub(super) fn of_unlit_pixels(frame: &Frame, detections: &Detections) -> Option<Self> {
        let circle = detections.sky_area.as_ref()?.circle()?;
        of_unlit(frame, &circle, detections.background_adu)
    }
}

/// Light that an all-sky lens scatters outside its circle, over that of the sky, and its error.
pub(super) const STRAY_LIGHT: Estimate = Estimate {
    value: 0.02,
    sigma: 0.02,
};

/// That of the pixels outside the circle of an all-sky lens, where they are those of the detector.
fn of_unlit(frame: &Frame, circle: &Circle, sky_adu: f64) -> Option<DarkLevel> {
    let unlit_adu = unlit_adu(frame, circle)?;
    let over_adu = (sky_adu - unlit_adu.value).max(0.0);
    Some(DarkLevel {
        adu: Estimate {
            value: unlit_adu.value - STRAY_LIGHT.value * over_adu,
            sigma: libm::hypot(unlit_adu.sigma, STRAY_LIGHT.sigma * over_adu),
        },
        source: DarkSource::Unlit,
    })
}

/// The level of the pixels outside the circle, with the light that the lens scatters there.
pub(super) fn unlit_adu(frame: &Frame, circle: &Circle) -> Option<Estimate> {
    /// Corners at least, of four.
    const MIN_CORNERS: usize = 3;
    let level = |pixels| level_of(pixels, frame.step_adu.into());
    let corners = corners(frame, circle).into_iter();
    let mut levels: Vec<f64> = corners.filter_map(level).collect();
    if levels.len() < MIN_CORNERS {
        return None;
    }
    let count = levels.len() as f64;
    let (_, squares) = mean_and_squares(&levels);
    // A corner in which something shines does not count.
    Some(Estimate {
        value: median(&mut levels),
        sigma: (squares / (count - 1.0) / count).sqrt(),
    })
}

/// Pixels outside the circle, by corner.
fn corners(frame: &Frame, circle: &Circle) -> [Vec<f64>; 4] {
    /// Distance from the centre from which on no light is expected, over the circle's radius.
    const OUTSIDE: f64 = 1.08;
    /// Pixels that are looked at, about.
    const SAMPLES: f64 = 200_000.0;
    let pixels = (frame.width * frame.height) as f64;
    // An odd step meets all filters of a mosaic and both of a pair of amplifiers.
    let step = (pixels / SAMPLES).sqrt() as usize | 1;
    let mut corners: [Vec<f64>; 4] = Default::default();
    for y in (0..frame.height).step_by(step) {
        for x in (0..frame.width).step_by(step) {
            let place = PixelPoint::new(x as f64, y as f64);
            let pixel = frame.at(x, y);
            if pixel.is_nan() || place.distance_to(&circle.centre) < OUTSIDE * circle.radius_px {
                continue;
            }
            let is_right = usize::from(place.x > circle.centre.x);
            let is_below = usize::from(place.y > circle.centre.y);
            corners[2 * is_below + is_right].push(f64::from(pixel));
        }
    }
    corners
}

/// The level of a corner. `None` for few pixels, and where nearly all are black, as where a program drew a mask.
fn level_of(mut pixels: Vec<f64>, step_adu: f64) -> Option<f64> {
    const MIN_PIXELS: usize = 100;
    const MAX_SAME: f64 = 0.95;
    /// Steps up to which a level may be that of a drawn mask, which compression changes.
    const DRAWN_STEPS: f64 = 2.0;
    if pixels.len() < MIN_PIXELS {
        return None;
    }
    let middle = median(&mut pixels);
    let same = pixels.iter().filter(|pixel| **pixel == middle).count();
    let is_even = same as f64 > MAX_SAME * pixels.len() as f64;
    if is_even && middle <= DRAWN_STEPS * step_adu {
        return None;
    }
    Some(median_of_rounded(&mut pixels, step_adu))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sky of level 300 in a circle, and `unlit` levels around it with noise.
    fn frame(unlit: impl Fn(usize, usize) -> f64, noise: f64) -> (Frame<'static>, Circle) {
        let side = 400;
        let circle = Circle {
            centre: PixelPoint::new(199.5, 199.5),
            radius_px: 190.0,
        };
        let pixel = |i: usize| {
            let (x, y) = (i % side, i / side);
            let spread =
                (0..4).map(|k| ((i * 7919 + k * 104_729 + i * i % 9973) % 1009) as f64 / 1009.0);
            let deviate = (spread.sum::<f64>() - 2.0) * 3.0_f64.sqrt();
            let place = PixelPoint::new(x as f64, y as f64);
            let is_sky = place.distance_to(&circle.centre) < circle.radius_px;
            let level = if is_sky { 300.0 } else { unlit(x, y) };
            (level + noise * deviate).round() as f32
        };
        let pixels = (0..side * side).map(pixel).collect();
        let frame = Frame::new(side, side, pixels).unwrap();
        (frame.with_levels(1.0, None), circle)
    }

    #[test]
    fn pixels_outside_the_circle_tell_the_level_but_for_stray_light() {
        for noise in [0.4, 5.0] {
            let (frame, circle) = frame(|_, _| 104.3, noise);
            let found = of_unlit(&frame, &circle, 300.0).unwrap().adu;
            let expected = 104.3 - 0.02 * (300.0 - 104.3);
            assert!((found.value - expected).abs() < 0.2, "{found:?}");
            assert!((3.9..4.5).contains(&found.sigma), "{found:?}");
        }
    }

    #[test]
    fn noise_that_is_cut_off_at_zero_does_not_matter() {
        let (frame, circle) = frame(|_, _| 4.3, 6.0);
        let cut = frame.values().iter().map(|pixel| pixel.max(0.0)).collect();
        let cut = Frame::new(frame.width, frame.height, cut).unwrap();
        let found = of_unlit(&cut.with_levels(1.0, None), &circle, 4.3)
            .unwrap()
            .adu;
        assert!((found.value - 4.3).abs() < 0.3, "{found:?}");
    }

    #[test]
    fn a_lamp_in_a_corner_does_not_count_and_a_drawn_mask_is_no_level() {
        let lamp = |x: usize, y: usize| if x < 200 && y < 200 { 160.0 } else { 104.0 };
        let (lit, circle) = frame(lamp, 3.0);
        let found = of_unlit(&lit, &circle, 300.0).unwrap().adu;
        assert!(
            (found.value - 100.0).abs() < 2.0 && found.sigma > 5.0,
            "{found:?}"
        );
        let (masked, circle) = frame(|_, _| 0.0, 0.0);
        assert_eq!(of_unlit(&masked, &circle, 300.0), None);
        let all = Circle {
            radius_px: 300.0,
            ..circle
        };
        assert_eq!(of_unlit(&lit, &all, 300.0), None);
    }
}
