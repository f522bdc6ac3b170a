//! The core of a source: its pixels above half of its height, saturated ones included.

use super::estimate::brightest_within;
use super::saturated_area::for_each_from;
use crate::detect::candidates::Peak;
use crate::detect::fit::FrameMaps;
use crate::detect::psf::PIXEL_VARIANCE_PX2;

/// The part of the height above the background from which on pixels are of the core.
const CORE_LEVEL: f64 = 0.5;

/// The 8-connected pixels about a peak that are above half of its height.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Core {
    /// Centre, weighted with the light above half of the height, in pixels.
    pub x: f64,
    /// Centre, weighted with the light above half of the height, in pixels.
    pub y: f64,
    /// Standard error of either, in pixels.
    pub sigma_px: f64,
    /// Number of pixels.
    pub area_px: f64,
    /// Variances along x and y, and covariance, of the area, in px².
    pub covariance: [f64; 3],
}

impl Core {
    /// Standard deviation of a Gaussian of which as much is above half of its height, in pixels.
    pub fn spot_px(&self) -> f64 {
        (self.area_px / (2.0 * std::f64::consts::PI * std::f64::consts::LN_2)).sqrt()
    }

    /// The core at a peak; `None` where there is no light.
    pub fn at(maps: &FrameMaps<'_>, peak: &Peak) -> Option<Self> {
        let background = f64::from(maps.background.at(peak.x as f32, peak.y as f32).0);
        let height = brightest_within(1, peak, &maps.view) - background;
        let level = background + CORE_LEVEL * height;
        if height <= 0.0 || !height.is_finite() {
            return None;
        }
        let mut sums = [0.0; 9];
        for_each_from(maps, peak, level as f32, |column, row| {
            let light = f64::from(maps.view.at(column, row)) - level;
            let (x, y) = (column as f64 - peak.x as f64, row as f64 - peak.y as f64);
            let terms = [1.0, x, y, x * x, y * y, x * y, light, light * x, light * y];
            for (sum, term) in sums.iter_mut().zip(terms) {
                *sum += term;
            }
        });
        let [area_px, x, y, xx, yy, xy, light, light_x, light_y] = sums;
        if area_px == 0.0 || light <= 0.0 {
            return None;
        }
        let (x, y) = (x / area_px, y / area_px);
        let covariance = [
            xx / area_px - x * x + PIXEL_VARIANCE_PX2,
            yy / area_px - y * y + PIXEL_VARIANCE_PX2,
            xy / area_px - x * y,
        ];
        // Each pixel is one sample of where the light ends; noise moves the centre by a part of the
        // width.
        let of_pixels = (PIXEL_VARIANCE_PX2 / area_px).sqrt();
        let of_noise = (covariance[0] + covariance[1]).sqrt() / f64::from(peak.snr);
        Some(Self {
            x: peak.x as f64 + light_x / light,
            y: peak.y as f64 + light_y / light,
            sigma_px: libm::hypot(of_pixels, of_noise),
            area_px,
            covariance,
        })
    }
}
