//! The linear solution of a frame.

use crate::base::coords::PixelPoint;
use crate::base::format::printable;
use crate::base::units::DEG_PER_RAD;
use crate::frame::RowOrder;
use crate::solve::Solution;

/// The linear solution of a frame: the plane that touches the sky at the frame's centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plate {
    /// Columns and rows.
    pub size_px: [usize; 2],
    /// The centre of the frame, the first pixel being (1, 1).
    pub crpix: [f64; 2],
    /// Right ascension and declination there, in degrees.
    pub crval_deg: [f64; 2],
    /// From offsets in pixels to degrees to the east (first row) and north, at the centre.
    pub cd_deg: [[f64; 2]; 2],
}

/// The order in which ASTAP has the rows of a file: those of FITS and of PNM as they are stored, those of other
/// pictures from the bottom. `head` are the file's first bytes, `stored` is the order of its rows.
pub fn row_order(head: &[u8], stored: RowOrder) -> RowOrder {
    /// FITS, and what may be FITS in gzip or bzip2.
    const AS_STORED: [&[u8]; 3] = [b"SIMPLE", b"\x1f\x8b", b"BZh"];
    let is_pnm = matches!(head, [b'P', b'1'..=b'7', ..]);
    if is_pnm || AS_STORED.iter().any(|start| head.starts_with(start)) {
        stored
    } else {
        RowOrder::BottomUp
    }
}

impl Plate {
    /// The solution of a frame with its rows in this order; `None` where it is not identified.
    pub fn new(solution: &Solution, rows: RowOrder) -> Option<Self> {
        let found = solution.outcome.identification()?;
        let size_px = [solution.width, solution.height];
        let centre = found.camera.centre();
        let middle = found.direction_of(&centre)?;
        let (east, north) = middle.east_north();
        let on_plane = |x: f64, y: f64| {
            let seen = found.direction_of(&PixelPoint::new(centre.x + x, centre.y + y))?;
            let seen = seen.as_vector();
            let depth = seen.dot(middle.as_vector());
            Some([&east, &north].map(|axis| seen.dot(axis) / depth * DEG_PER_RAD))
        };
        let change = |x: f64, y: f64| {
            let (before, behind) = (on_plane(-x, -y)?, on_plane(x, y)?);
            Some([0, 1].map(|axis| behind[axis] - before[axis]))
        };
        let upward = match rows {
            RowOrder::TopDown => 0.5,
            RowOrder::BottomUp => -0.5,
        };
        let (column, row) = (change(0.5, 0.0)?, change(0.0, upward)?);
        let (ra_rad, dec_rad) = middle.to_ra_dec();
        Some(Self {
            size_px,
            crpix: size_px.map(|side| 0.5 * (side as f64 + 1.0)),
            crval_deg: [ra_rad, dec_rad].map(|rad| rad * DEG_PER_RAD),
            cd_deg: [0, 1].map(|axis| [column[axis], row[axis]]),
        })
    }

    /// Sizes of a pixel along columns and rows, in degrees: the first is negative where the sky is seen as the eye
    /// sees it, the second is positive.
    pub fn cdelt_deg(&self) -> [f64; 2] {
        let [east, north] = self.cd_deg.map(|[x, y]| libm::hypot(x, y));
        [self.parity() * east, north]
    }

    /// Turns of the axes, in degrees.
    pub fn crota_deg(&self) -> [f64; 2] {
        let [[xx, xy], [yx, yy]] = self.cd_deg;
        let parity = self.parity();
        [libm::atan2(parity * yx, parity * xx), libm::atan2(-xy, yy)].map(|rad| rad * DEG_PER_RAD)
    }

    /// The sign of the determinant.
    fn parity(&self) -> f64 {
        let [[xx, xy], [yx, yy]] = self.cd_deg;
        if xx * yy < xy * yx { -1.0 } else { 1.0 }
    }

    /// Height of the field, in degrees: of a pinhole with this scale.
    pub fn height_deg(&self) -> f64 {
        let half = 0.5 * self.size_px[1] as f64 * self.cdelt_deg()[1] / DEG_PER_RAD;
        2.0 * libm::atan(half) * DEG_PER_RAD
    }

    /// The line that ASTAP prints of a solution.
    pub fn line(&self) -> String {
        const TENTHS_PER_TURN: u64 = 24 * 36_000;
        let [ra_deg, dec_deg] = self.crval_deg;
        let tenths = (ra_deg * 2400.0).round() as u64 % TENTHS_PER_TURN;
        let (hours, minutes, tenths) = (tenths / 36_000, tenths / 600 % 60, tenths % 600);
        let seconds = (dec_deg.abs() * 3600.0).round() as u64;
        let sign = if dec_deg < 0.0 { '-' } else { '+' };
        printable(&format!(
            "Solution found: {hours:02}: {minutes:02}  {:02}.{} {sign}{:02}d {:02}  {:02}",
            tenths / 10,
            tenths % 10,
            seconds / 3600,
            seconds / 60 % 60,
            seconds % 60
        ))
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A frame with pixels of 36″ whose upper side is 30° from north towards east, or its picture in a mirror.
    pub(crate) fn turned(is_mirrored: bool) -> Plate {
        let (sin, cos) = (0.5, 0.75_f64.sqrt());
        let east = if is_mirrored { 1.0 } else { -1.0 };
        Plate {
            size_px: [640, 480],
            crpix: [320.5, 240.5],
            crval_deg: [83.7, -0.4],
            cd_deg: [
                [0.01 * east * cos, 0.01 * sin],
                [-0.01 * east * sin, 0.01 * cos],
            ],
        }
    }

    #[test]
    fn angles_and_signs_are_those_of_astap() {
        for (is_mirrored, sign) in [(false, -1.0), (true, 1.0)] {
            let plate = turned(is_mirrored);
            let ([x, y], [turn_x, turn_y]) = (plate.cdelt_deg(), plate.crota_deg());
            assert!((x - 0.01 * sign).abs() < 1e-15 && (y - 0.01).abs() < 1e-15);
            // The way from the angles to the matrix, as ASTAP goes it.
            assert!((turn_x + 30.0).abs() < 1e-12 && (turn_y + 30.0).abs() < 1e-12);
            let cd = [
                [
                    x * turn_x.to_radians().cos(),
                    -x * sign * turn_x.to_radians().sin(),
                ],
                [
                    y * sign * turn_y.to_radians().sin(),
                    y * turn_y.to_radians().cos(),
                ],
            ];
            for (found, expected) in plate.cd_deg.iter().flatten().zip(cd.iter().flatten()) {
                assert!((found - expected).abs() < 1e-15, "{is_mirrored} {cd:?}");
            }
        }
        assert!((turned(false).height_deg() - 4.7972).abs() < 1e-4);
    }

    #[test]
    fn the_line_rounds_to_whole_units() {
        let line = |ra_deg, dec_deg| {
            let crval_deg = [ra_deg, dec_deg];
            let plate = Plate {
                crval_deg,
                ..turned(false)
            };
            plate.line()
        };
        assert_eq!(line(83.7, -0.4), "Solution found: 05: 34  48.0 -00d 24  00");
        assert_eq!(
            line(359.999_99, 59.999_9),
            "Solution found: 00: 00  00.0 +60d 00  00"
        );
    }

    #[test]
    fn pictures_begin_at_the_bottom() {
        for head in [&b"\x89PNG"[..], b"II*\0", b"\xff\xd8\xff", b""] {
            assert_eq!(row_order(head, RowOrder::TopDown), RowOrder::BottomUp);
        }
        for head in [&b"SIMPLE  ="[..], b"P5\n", b"\x1f\x8b"] {
            for stored in [RowOrder::TopDown, RowOrder::BottomUp] {
                assert_eq!(row_order(head, stored), stored);
            }
        }
    }
}
