//! Hot pixels, learned from the sky's motion: stars move on, hot pixels stay.
//!
//! frames spread over a night, in the rows of their files → [`NightHotPixel`] for each
//!
//! A pixel stands out in a frame if it is brighter than all but one of eight others around it by ten
//! standard deviations. These are two pixels away, so that filters of a mosaic are alike. The noise is that of
//! differences to their median. Hot is what
//! stands out in three quarters of the frames.
//!
//! Caveats: lamps and their reflections stand still, too. Where the sky moves by less than three pixels
//! between the first and the last frame, about the celestial pole, nothing counts as hot.

use crate::base::coords::{Horizon, PixelPoint, UnitVector};
use crate::base::format::to_decimals;
use crate::base::statistics::{SIGMA_PER_MAD, median, median_of};
use crate::base::units::RAD_PER_DEG;
use crate::ephemeris::observer::Site;
use crate::frame::{Frame, RowOrder};
use crate::solve::FixedCamera;
use nalgebra::{Rotation3, Unit, Vector3};
use serde::Serialize;
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// Standard deviations by which a pixel stands out.
const SIGMAS: f32 = 10.0;
/// Share of the frames in which a hot pixel stands out.
const FRACTION: f64 = 0.75;
/// Frames that are needed.
const MIN_FRAMES: usize = 6;
/// The least motion of the sky, in pixels.
const MIN_MOTION_PX: f64 = 3.0;
/// Turn of the sky in a day, in radians: a sidereal day is shorter.
const TURN_RAD_PER_DAY: f64 = TAU * 1.002_737_9;

/// A hot pixel, in the rows of the file.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[non_exhaustive]
pub struct NightHotPixel {
    /// Column.
    pub x: usize,
    /// Row.
    pub y: usize,
    /// Frames in which it stands out, of those that were looked at.
    pub share: f64,
    /// How much brighter it is than all but one of eight pixels around it, in ADU.
    pub excess_adu: f64,
}

/// Pixels that stand out in one frame.
#[derive(Debug, Clone)]
pub struct OutlierPixels {
    size: [usize; 2],
    row_order: RowOrder,
    mjd: Option<f64>,
    /// Index and excess in ADU.
    pixels: Vec<(usize, f32)>,
}

impl OutlierPixels {
    /// Those of a frame in the rows of its file, which was taken at `mjd`.
    pub fn of(frame: &Frame, mjd: Option<f64>) -> Self {
        /// One of so many pixels tells the noise.
        const SAMPLED: usize = 7;
        let (width, height) = (frame.width, frame.height);
        let mut all = Vec::new();
        let mut sample = Vec::new();
        for y in 2..height.saturating_sub(2) {
            for x in 2..width.saturating_sub(2) {
                let [above_median_adu, above_all_adu] = above_others_adu(frame, x, y);
                if (x + y) % SAMPLED == 0 && above_median_adu.is_finite() {
                    sample.push(f64::from(above_median_adu.abs()));
                }
                if above_all_adu > 0.0 {
                    all.push((y * width + x, above_all_adu));
                }
            }
        }
        let middle = median_of(sample.into_iter());
        let noise_adu = SIGMA_PER_MAD * middle.unwrap_or(f64::INFINITY);
        let limit_adu = SIGMAS * (noise_adu as f32).max(0.5);
        all.retain(|(_, excess_adu)| *excess_adu > limit_adu);
        Self {
            size: [width, height],
            row_order: frame.metadata.row_order,
            mjd,
            pixels: all,
        }
    }
}

/// How much brighter a pixel is than the median of eight around it, and than all but one of them.
fn above_others_adu(frame: &Frame, x: usize, y: usize) -> [f32; 2] {
    let rows = [y - 2, y - 2, y - 2, y, y, y + 2, y + 2, y + 2];
    let columns = [x - 2, x, x + 2, x - 2, x + 2, x - 2, x, x + 2];
    let mut around = [0.0_f32; 8];
    for ((value, y), x) in around.iter_mut().zip(rows).zip(columns) {
        *value = frame.at(x, y);
    }
    around.sort_unstable_by(f32::total_cmp);
    let own = frame.at(x, y);
    [own - 0.5 * (around[3] + around[4]), own - around[6]]
}

/// The hot pixels of frames of one size; `None` where they are too few.
pub fn hot_pixels(
    frames: &[OutlierPixels],
    held: Option<&FixedCamera>,
    site: Option<Site>,
) -> Option<Vec<NightHotPixel>> {
    let first = frames.first()?;
    let frames: Vec<&OutlierPixels> = frames
        .iter()
        .filter(|frame| frame.size == first.size)
        .collect();
    if frames.len() < MIN_FRAMES {
        return None;
    }
    let mut counted: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
    for (index, excess_adu) in frames.iter().flat_map(|frame| &frame.pixels) {
        counted
            .entry(*index)
            .or_default()
            .push(f64::from(*excess_adu));
    }
    let motion = SkyMotion::of(&frames, held, site);
    let [width, height] = first.size;
    let hot = |(index, mut excess_adu): (usize, Vec<f64>)| {
        let share = excess_adu.len() as f64 / frames.len() as f64;
        let (x, y) = (index % width, index / width);
        let drawn_y = match first.row_order {
            RowOrder::TopDown => y,
            RowOrder::BottomUp => height - 1 - y,
        };
        let place = PixelPoint::new(x as f64, drawn_y as f64);
        let moves = motion.as_ref().is_none_or(|motion| motion.moves(&place));
        (share >= FRACTION && moves).then(|| NightHotPixel {
            x,
            y,
            share: to_decimals(share, 3),
            excess_adu: to_decimals(median(&mut excess_adu), 1),
        })
    };
    Some(counted.into_iter().filter_map(hot).collect())
}

/// How the sky moves from the first frame to the last.
struct SkyMotion<'a> {
    held: &'a FixedCamera,
    turn: Rotation3<f64>,
}

impl<'a> SkyMotion<'a> {
    fn of(
        frames: &[&OutlierPixels],
        held: Option<&'a FixedCamera>,
        site: Option<Site>,
    ) -> Option<Self> {
        let dates = || frames.iter().filter_map(|frame| frame.mjd);
        let days =
            dates().fold(f64::NEG_INFINITY, f64::max) - dates().fold(f64::INFINITY, f64::min);
        let (sin, cos) = libm::sincos(site?.lat_deg() * RAD_PER_DEG);
        let pole = Unit::new_normalize(Vector3::new(0.0, cos, sin));
        // The sky turns to the west.
        let turn_rad = -TURN_RAD_PER_DAY * days;
        turn_rad.is_finite().then_some(())?;
        Some(Self {
            held: held?,
            turn: Rotation3::from_axis_angle(&pole, turn_rad),
        })
    }

    /// Whether the sky at a place moves enough; what is not sky does not.
    fn moves(&self, place: &PixelPoint) -> bool {
        let camera = &self.held.camera;
        let Some(direction) = camera.direction_of(place) else {
            return true;
        };
        let seen: UnitVector<Horizon> = self.held.pointing.inverse().apply(&direction);
        let later = UnitVector::from_vector(self.turn * seen.as_vector());
        let later = camera.pixel_of(&self.held.pointing.apply(&later));
        later.is_none_or(|later| later.distance_to(place) >= MIN_MOTION_PX)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A frame with a hot pixel at (20, 12) and a star that moves.
    fn frame(number: usize) -> Frame<'static> {
        const SIDE: usize = 40;
        let value = |index: usize| {
            let (x, y) = (index % SIDE, index / SIDE);
            let noise = ((index * 7919 + number * 104_729) % 11) as f32;
            let is_star = (x, y) == (5 + 3 * number, 30);
            let is_hot = (x, y) == (20, 12);
            100.0 + noise + if is_star || is_hot { 200.0 } else { 0.0 }
        };
        Frame::new(SIDE, SIDE, (0..SIDE * SIDE).map(value).collect()).unwrap()
    }

    #[test]
    fn what_stays_is_hot_and_what_moves_is_a_star() {
        let frames: Vec<OutlierPixels> =
            (0..8).map(|n| OutlierPixels::of(&frame(n), None)).collect();
        assert!(frames.iter().all(|frame| frame.pixels.len() == 2));
        let found = hot_pixels(&frames, None, None).unwrap();
        let [pixel] = found[..] else {
            panic!("{found:?}");
        };
        assert_eq!([pixel.x, pixel.y], [20, 12]);
        assert!((pixel.excess_adu - 200.0).abs() < 10.0);
        assert!(hot_pixels(&frames[..5], None, None).is_none());
    }
}
