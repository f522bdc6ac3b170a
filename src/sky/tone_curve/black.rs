//! The light at the level of a pixel without light, by a tone curve.

use super::curve::ToneCurve;
use crate::base::statistics::{Estimate, median, normal_quantile};
use crate::detect::Detections;
use crate::frame::Frame;
use crate::sky::dark_level::{DarkLevel, DarkSource, STRAY_LIGHT, unlit_adu};

/// Error of a level that was rounded to a step, over that: compression makes even pixels equal.
const ROUNDING: f64 = 0.29;

/// What a frame tells of the level of a pixel without light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Black {
    /// It is stated.
    Known(DarkLevel),
    /// Pixels outside the circle of an all-sky lens have this level, with light that the lens scatters there.
    Unlit(Estimate),
    /// It lies between 0 and that of the darkest part of the frame.
    Below {
        /// The level of that part, in ADU.
        darkest_adu: f64,
        /// Noise of the sky in ADU, where the dark end of the picture may have been cut off, so that it is below 0.
        cut_by_adu: Option<f64>,
    },
}

impl Black {
    /// By `stated`, else by the frame itself.
    pub fn find(
        frame: &Frame,
        detections: &Detections,
        stated: Option<DarkLevel>,
        is_flat: bool,
    ) -> Option<Self> {
        let circle = detections.sky_area.as_ref().and_then(|area| area.circle());
        // A flat divides unlit pixels by what is no light.
        let unlit = || {
            let level = unlit_adu(frame, &circle.filter(|_| !is_flat)?)?;
            Some(Self::Unlit(Estimate {
                sigma: libm::hypot(level.sigma, ROUNDING * f64::from(frame.step_adu)),
                ..level
            }))
        };
        let darkest = || {
            Some(Self::Below {
                darkest_adu: darkest_adu(frame)?,
                cut_by_adu: (frame.range_adu()[0] <= 0.0).then_some(detections.noise_adu),
            })
        };
        let known = stated.map(Self::Known).or_else(unlit);
        known.or_else(darkest)
    }

    /// The level, where it is known and above 0, in ADU.
    pub fn level_adu(&self) -> Option<f64> {
        let level_adu = match self {
            Self::Known(level) => level.adu.value,
            Self::Unlit(level) => level.value,
            Self::Below { .. } => return None,
        };
        (level_adu > 0.0).then_some(level_adu)
    }

    /// The light by a curve below which it is with `probability`, over that of white, for a sky of this level.
    pub fn light(&self, curve: &ToneCurve, probability: f64, sky_adu: f64) -> f64 {
        let normal =
            |estimate: &Estimate| estimate.value + normal_quantile(probability) * estimate.sigma;
        match self {
            Self::Known(level) => curve.light(normal(&level.adu)),
            Self::Unlit(level) => {
                let unlit = curve.light(level.value);
                let over = (curve.light(sky_adu) - unlit).max(0.0);
                let by_level = curve.light_per_adu(level.value) * level.sigma;
                normal(&Estimate {
                    value: unlit - STRAY_LIGHT.value * over,
                    sigma: libm::hypot(by_level, STRAY_LIGHT.sigma * over),
                })
            }
            Self::Below {
                darkest_adu,
                cut_by_adu,
            } => {
                let cut = cut_by_adu
                    .map(|noise_adu| Cut::choose(curve, sky_adu, *darkest_adu, noise_adu));
                let share = cut.as_ref().map_or(0.0, |cut| cut.probability);
                let above = (probability - share) / (1.0 - share);
                match cut.filter(|_| above < 0.0) {
                    None => above * curve.light(*darkest_adu),
                    Some(cut) => (probability / share - 1.0) * cut.most * curve.light(sky_adu),
                }
            }
        }
    }

    /// What reports say of it.
    pub fn dark_level(&self) -> DarkLevel {
        match *self {
            Self::Known(level) => level,
            Self::Unlit(adu) => DarkLevel {
                adu,
                source: DarkSource::Unlit,
            },
            Self::Below { darkest_adu, .. } => DarkLevel {
                // Any level between is as probable.
                adu: Estimate {
                    value: 0.5 * darkest_adu,
                    sigma: darkest_adu / 12.0_f64.sqrt(),
                },
                source: DarkSource::Darkest,
            },
        }
    }
}

/// What a program may have cut off at the dark end of a picture.
struct Cut {
    /// How probable it is.
    probability: f64,
    /// The light at most, over that of the sky above level 0.
    most: f64,
}

impl Cut {
    /// Programs that stretch pictures cut them off some deviations of the noise below the sky. Then the ground is
    /// black.
    fn choose(curve: &ToneCurve, sky_adu: f64, darkest_adu: f64, noise_adu: f64) -> Self {
        const SIGMAS: f64 = 5.0;
        /// Light of the ground over that of the sky at most.
        const GROUND: f64 = 0.3;
        let sky = curve.light(sky_adu);
        let has_ground = curve.light(darkest_adu) < GROUND * sky;
        let is_near_black = sky < SIGMAS * noise_adu * curve.light_per_adu(sky_adu);
        match is_near_black && !has_ground {
            true => Self {
                probability: 0.75,
                most: 20.0,
            },
            false => Self {
                probability: 0.25,
                most: 0.5,
            },
        }
    }
}

/// The level of the darkest part of a frame; parts that a program drew black do not count.
fn darkest_adu(frame: &Frame) -> Option<f64> {
    /// Side of the parts, in pixels.
    const SIDE: usize = 16;
    /// Parts that may be dark by chance.
    const FRACTION: f64 = 0.002;
    /// Share of black pixels from which on a program may have drawn them.
    const DRAWN: f64 = 0.1;
    let part = |x: usize, y: usize| {
        let pixels = (y..y + SIDE).flat_map(|y| (x..x + SIDE).map(move |x| (x, y)));
        let levels = pixels.map(|(x, y)| f64::from(frame.at(x, y)));
        let mut levels: Vec<f64> = levels.filter(|level| !level.is_nan()).collect();
        let black = levels.iter().filter(|level| **level == 0.0).count() as f64;
        let is_drawn = black >= DRAWN * levels.len() as f64;
        (!is_drawn).then(|| median(&mut levels))
    };
    let starts = |side: usize| (0..(side + 1).saturating_sub(SIDE)).step_by(2 * SIDE);
    let mut levels: Vec<f64> = starts(frame.height)
        .flat_map(|y| starts(frame.width).map(move |x| (x, y)))
        .filter_map(|(x, y)| part(x, y))
        .collect();
    levels.sort_unstable_by(f64::total_cmp);
    let darkest = *levels.get((FRACTION * levels.len() as f64) as usize)?;
    (darkest >= 0.0).then_some(darkest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_darkest_part_is_the_ground_and_not_what_a_program_drew() {
        let side = 320;
        let level = |i: usize| match (i % side, i / side) {
            (x, _) if x < 64 => 0.0,
            (_, y) if y > 256 => 7.0 + (i * 7919 % 3) as f32,
            _ => 60.0 + (i * 7919 % 11) as f32,
        };
        let frame = Frame::new(side, side, (0..side * side).map(level).collect()).unwrap();
        assert_eq!(darkest_adu(&frame), Some(8.0));
    }

    #[test]
    fn a_level_that_is_not_known_lies_below_the_darkest_part() {
        let below = |noise_adu| Black::Below {
            darkest_adu: 30.0,
            cut_by_adu: noise_adu,
        };
        let curve = ToneCurve::LINEAR;
        let light = |black: &Black, probability| black.light(&curve, probability, 60.0);
        let whole = below(None);
        assert_eq!(
            [0.0, 0.5, 1.0].map(|at| light(&whole, at)),
            [0.0, 15.0, 30.0]
        );
        // The dark end may be cut off, and of a sky that is hardly above black nearly all of it.
        let cut = below(Some(2.0));
        assert!((light(&cut, 0.0) + 30.0).abs() < 1e-9 && light(&cut, 1.0) == 30.0);
        assert!(light(&below(Some(20.0)), 0.0) < -1000.0);
    }
}
