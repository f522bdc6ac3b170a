//! From the pieces of trails to detections: one for each star.

use super::profile::{Strip, TrailProfile};
use super::shape::TrailShape;
use super::streak_profile::StreakProfile;
use super::trails::Trails;
use crate::base::coords::PixelPoint;
use crate::base::interrupt::Interrupted;
use crate::detect::candidates::Peak;
use crate::detect::detection::{Detection, DetectionFlags};
use crate::detect::fit::{FrameMaps, SpotEstimate};
use crate::detect::measure::clamp_to_frame;

/// A bar in the frame.
#[derive(Debug, Clone, Copy)]
struct StreakInFrame {
    /// Its middle.
    x: f64,
    y: f64,
    streak: StreakProfile,
    /// Whether other trails are next to it.
    is_blended: bool,
    /// Whether one of its pieces is saturated.
    is_saturated: bool,
}

/// Measures the stars of a frame of trails, whose pieces are the peaks, strongest first.
///
/// # Errors
/// [`Interrupted`].
pub(in crate::detect) fn measure_trailed(
    maps: &FrameMaps<'_>,
    trails: &Trails,
    peaks: &[Peak],
    detections: &mut Vec<Detection>,
) -> Result<(), Interrupted> {
    let shape = trails.shape;
    let mut bars: Vec<StreakInFrame> = Vec::new();
    let mut profile = TrailProfile::default();
    for peak in peaks {
        maps.view.check()?;
        if let Some(bar) = bars.iter_mut().find(|bar| bar.covers(&shape, peak)) {
            bar.is_saturated |= peak.saturated;
        } else if !peak.saturated && maps.contrast_at(peak).is_sharper_than_any_spot() {
            detections.push(hot_pixel(maps, peak));
        } else {
            let placed = StreakInFrame::at(maps, trails, peak, &bars, &mut profile);
            bars.extend(placed);
        }
    }
    detections.extend(bars.iter().map(|bar| bar.detection(maps, &shape)));
    Ok(())
}

impl StreakInFrame {
    /// The bar whose brightest piece is at a peak, beside those found before.
    fn at(
        maps: &FrameMaps<'_>,
        trails: &Trails,
        peak: &Peak,
        others: &[Self],
        profile: &mut TrailProfile,
    ) -> Option<Self> {
        /// The line goes through the peak, then through the light across it.
        const ROUNDS: usize = 2;
        let Trails { shape, template } = trails;
        let mut strip = Strip {
            x: peak.x as f64 + f64::from(peak.offset_px[0]),
            y: peak.y as f64 + f64::from(peak.offset_px[1]),
            shape: *shape,
            reach_px: 1.5 * shape.length_px,
        };
        let [cos, sin] = shape.direction;
        let mut found = None;
        for _ in 0..ROUNDS {
            profile.measure(maps, &strip);
            let mut is_blended = false;
            for other in others {
                let [along, across] = strip.place(other.x, other.y);
                let is_beside = across.abs() < 2.0 * shape.half_breadth_px;
                if is_beside && along.abs() < strip.reach_px + 0.5 * shape.length_px {
                    is_blended |= along.abs() < 1.5 * shape.length_px;
                    let half_px = 0.5 * shape.length_px + 1.0;
                    profile.forget(along - half_px, along + half_px);
                }
            }
            let bar = StreakProfile::fit(profile, shape, template.as_ref(), shape.half_breadth_px)?;
            strip.shift(0.0, bar.across_px);
            found = Some(Self {
                x: strip.x + bar.along_px * cos,
                y: strip.y + bar.along_px * sin,
                streak: bar,
                is_blended,
                is_saturated: peak.saturated,
            });
        }
        found
    }

    /// Whether a peak is a piece of this star.
    fn covers(&self, shape: &TrailShape, peak: &Peak) -> bool {
        let strip = Strip {
            x: self.x,
            y: self.y,
            shape: *shape,
            reach_px: 0.0,
        };
        let [along, across] = strip.place(peak.x as f64, peak.y as f64);
        across.abs() < shape.half_breadth_px + 1.0
            && along.abs()
                < 0.5 * shape.length_px + self.streak.sigma_along_px + shape.half_breadth_px
    }

    fn detection(&self, maps: &FrameMaps<'_>, shape: &TrailShape) -> Detection {
        let Self {
            x, y, streak: bar, ..
        } = *self;
        let [cos, sin] = shape.direction.map(f64::abs);
        let view = &maps.view;
        let half_px = 0.5 * shape.length_px;
        let is_outside =
            |at: f64, reach: f64, side: usize| at < reach || at > side as f64 - 1.0 - reach;
        let border =
            is_outside(x, half_px * cos, view.width) || is_outside(y, half_px * sin, view.height);
        let mut spot = SpotEstimate {
            x,
            y,
            sigma_x: libm::hypot(bar.sigma_along_px * cos, bar.sigma_across_px * sin),
            sigma_y: libm::hypot(bar.sigma_along_px * sin, bar.sigma_across_px * cos),
            ..SpotEstimate::default()
        };
        clamp_to_frame(&mut spot, view.width, view.height);
        Detection {
            position: PixelPoint::new(spot.x + view.x0 as f64, spot.y + view.y0 as f64),
            sigma_x_px: spot.sigma_x,
            sigma_y_px: spot.sigma_y,
            flux_adu: bar.flux_adu,
            peak_adu: bar.flux_adu / shape.length_px,
            snr: bar.flux_adu / bar.sigma_flux_adu,
            flags: DetectionFlags {
                saturated: self.is_saturated,
                blended: self.is_blended,
                border,
                ..DetectionFlags::default()
            },
        }
    }
}

/// A pixel that is no piece of a trail.
fn hot_pixel(maps: &FrameMaps<'_>, peak: &Peak) -> Detection {
    let spot = maps.initial_guess(peak);
    let view = &maps.view;
    let level = maps.background.at(peak.x as f32, peak.y as f32).0;
    Detection {
        position: PixelPoint::new(spot.x + view.x0 as f64, spot.y + view.y0 as f64),
        sigma_x_px: maps.width_px(),
        sigma_y_px: maps.width_px(),
        flux_adu: spot.flux,
        peak_adu: f64::from(view.at(peak.x, peak.y) - level),
        snr: f64::from(peak.snr),
        flags: DetectionFlags {
            hot_pixel: true,
            ..DetectionFlags::default()
        },
    }
}
