//! The field of an identified frame, in the terms of astrometry.net.

use crate::base::coords::PixelPoint;
use crate::base::units::DEG_PER_RAD;
use crate::report::wcs;
use crate::solve::Solution;

/// The field of an identified frame, in the terms of astrometry.net. Orientation and parity are those of the
/// file's rows, the first of them at the bottom, as FITS has it.
///
/// # Reference
/// astrometry.net 0.93, `sip.c`: `tan_pixel_scale`, `tan_get_orientation`; `sip-utils.c`: `sip_get_field_size`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Field {
    /// Right ascension and declination of the frame's centre, in degrees.
    pub centre_deg: [f64; 2],
    /// Width and height, in degrees: the pixel scale times the frame's sides.
    pub size_deg: [f64; 2],
    /// Width and height, in degrees, as angles on the sky from border to border through the centre.
    pub extent_deg: [f64; 2],
    /// Pixel scale at the centre, in arcseconds.
    pub pixel_scale_arcsec: f64,
    /// Position angle of the direction to later rows, from north through east, in degrees.
    pub orientation_deg: f64,
    /// Whether east and north are seen as in a mirror: the determinant of `CD` is positive.
    pub is_mirrored: bool,
}

impl Field {
    /// The field of a frame; `None` where it is not identified.
    pub fn new(solution: &Solution) -> Option<Self> {
        let found = solution.outcome.identification()?;
        let linear = wcs::linear(solution)?;
        let [[xx, xy], [yx, yy]] = linear.cd_deg;
        let parity = if linear.is_mirrored() { 1.0 } else { -1.0 };
        let orientation_rad = -libm::atan2(parity * yx - xy, parity * xx + yy);
        let scale_deg = linear.scale_deg();
        let centre = found.camera.centre();
        let seen =
            |x: f64, y: f64| found.direction_of(&PixelPoint::new(centre.x + x, centre.y + y));
        let middle = seen(0.0, 0.0)?;
        let extent_rad = |x: f64, y: f64| {
            let borders = [seen(-x, -y)?, seen(x, y)?];
            let angles = borders.iter().map(|border| middle.angle_to(border));
            Some(angles.sum::<f64>())
        };
        let sides = [solution.width, solution.height].map(|side| side as f64);
        let size_deg = sides.map(|side| side * scale_deg);
        let extents_rad = [
            extent_rad(0.5 * sides[0], 0.0),
            extent_rad(0.0, 0.5 * sides[1]),
        ];
        // Some lenses do not reach the borders of their frames.
        let extent_deg = [0, 1].map(|axis| {
            let extent_deg = extents_rad[axis].map(|rad| rad * DEG_PER_RAD);
            extent_deg.unwrap_or(size_deg[axis])
        });
        let (ra_rad, dec_rad) = middle.to_ra_dec();
        Some(Self {
            centre_deg: [ra_rad * DEG_PER_RAD, dec_rad * DEG_PER_RAD],
            size_deg,
            extent_deg,
            pixel_scale_arcsec: scale_deg * 3600.0,
            orientation_deg: orientation_rad * DEG_PER_RAD,
            is_mirrored: linear.is_mirrored(),
        })
    }

    /// Half the field's diagonal, in degrees.
    pub fn radius_deg(&self) -> f64 {
        let [width, height] = self.size_deg;
        0.5 * libm::hypot(width, height)
    }
}
