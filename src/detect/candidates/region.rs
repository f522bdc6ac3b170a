//! Area, centre and principal axes of a connected region.

use crate::detect::psf::PIXEL_VARIANCE_PX2;

/// A connected region above the threshold.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Region {
    /// Number of pixels.
    pub area_px: usize,
    /// Number of peaks kept.
    pub peaks: usize,
    /// Centre, weighted with the filtered values.
    pub x: f64,
    /// Centre, weighted with the filtered values.
    pub y: f64,
    /// Variances along x and y, and covariance, in px².
    pub covariance: [f64; 3],
    /// Standard deviation along the longer principal axis, in pixels.
    pub major_px: f64,
    /// Standard deviation along the shorter principal axis, in pixels.
    pub minor_px: f64,
}

impl Region {
    /// Number, centre and principal axes of points (x, y, weight).
    pub fn of_points(points: impl Iterator<Item = (f64, f64, f64)>) -> Self {
        let mut sums = [0.0f64; 6];
        let mut origin = None;
        let mut count = 0;
        for (x, y, w) in points {
            let (x0, y0) = *origin.get_or_insert((x, y));
            let (x, y) = (x - x0, y - y0);
            count += 1;
            for (sum, term) in sums.iter_mut().zip([1.0, x, y, x * x, y * y, x * y]) {
                *sum += w * term;
            }
        }
        let [w, x, y, xx, yy, xy] = sums;
        let (x0, y0) = origin.unwrap_or_default();
        let (x, y) = (x / w, y / w);
        let (xx, yy, xy) = (xx / w - x * x, yy / w - y * y, xy / w - x * y);
        let mean = 0.5 * (xx + yy);
        let half_range = libm::hypot(0.5 * (xx - yy), xy);
        let minor_px2 = mean - half_range + PIXEL_VARIANCE_PX2;
        Self {
            area_px: count,
            peaks: 0,
            x: x + x0,
            y: y + y0,
            covariance: [xx + PIXEL_VARIANCE_PX2, yy + PIXEL_VARIANCE_PX2, xy],
            major_px: (mean + half_range + PIXEL_VARIANCE_PX2).sqrt(),
            minor_px: minor_px2.max(PIXEL_VARIANCE_PX2).sqrt(),
        }
    }
}
