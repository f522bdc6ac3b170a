//! A partition of the sky into cells of about equal size, and the cones around their centres.
//!
//! The sky is cut into zones of declination, and each zone in right ascension.

use crate::base::coords::{Icrs, UnitVector};
use libm::{acos, asin, cos, sincos};
use nalgebra::Vector3;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::ops::Range;

/// Cones are searched wider by this factor: directions may be rounded to single precision.
const ROUNDING_FACTOR: f64 = 1.0 + 1e-4;

/// The partition: zones of equal height, and a cone around the centre of each cell.
#[derive(Debug)]
pub struct SkyCells {
    /// Number of zones.
    pub zones: usize,
    zone_height_rad: f64,
    /// Radius of the cones, a little widened, and its cosine.
    radius_rad: f64,
    cos_radius: f64,
}

/// The cells between two declinations.
#[derive(Debug)]
pub struct Zone<'a> {
    /// Number of cells in the zone.
    pub cells: usize,
    partition: &'a SkyCells,
    number: usize,
    /// Of the declination of the cells' centres.
    sin_dec: f64,
    cos_dec: f64,
    /// Sines of the lowest and the highest declination, a little widened.
    heights: Range<f64>,
}

impl SkyCells {
    /// Cells about `height_rad` high and wide; the cones have the radius `radius_rad`.
    pub fn new(height_rad: f64, radius_rad: f64) -> Self {
        let zones = (PI / height_rad).ceil() as usize;
        let radius_rad = radius_rad * ROUNDING_FACTOR;
        Self {
            zones,
            zone_height_rad: PI / zones as f64,
            radius_rad,
            cos_radius: cos(radius_rad),
        }
    }

    /// The zone with this number, counted from the south pole.
    pub fn zone(&self, number: usize) -> Zone<'_> {
        let height_rad = self.zone_height_rad;
        let (sin_dec, cos_dec) = sincos((number as f64 + 0.5) * height_rad - FRAC_PI_2);
        let low_rad = number as f64 * height_rad - FRAC_PI_2;
        // Beyond the pole the sine would fall again.
        let high_rad = (low_rad + height_rad).min(FRAC_PI_2);
        Zone {
            cells: (TAU * cos_dec / height_rad).round().max(1.0) as usize,
            partition: self,
            number,
            sin_dec,
            cos_dec,
            heights: sincos(low_rad).0 - 1e-9..sincos(high_rad).0 + 1e-9,
        }
    }

    /// The numbers of the zone and of the cell in it that hold a direction.
    pub fn cell_of(&self, direction: &UnitVector<Icrs>) -> (usize, usize) {
        let (ra_rad, dec_rad) = direction.to_ra_dec();
        let zone = ((dec_rad + FRAC_PI_2) / self.zone_height_rad) as usize;
        let zone = zone.min(self.zones - 1);
        let cells = self.zone(zone).cells;
        let cell = (ra_rad / TAU * cells as f64) as usize;
        (zone, cell.min(cells - 1))
    }

    /// The zones that may have cells whose cones hold `direction`, a unit vector.
    pub fn zones_near(&self, direction: &[f64; 3]) -> Range<usize> {
        let from_south_rad = asin(direction[2].clamp(-1.0, 1.0)) + FRAC_PI_2;
        // The middle of zone n lies n + 1/2 heights from the south pole.
        let place = |angle_rad: f64| (angle_rad / self.zone_height_rad - 0.5).max(-1.0);
        let first = place(from_south_rad - self.radius_rad).ceil().max(0.0);
        let end = place(from_south_rad + self.radius_rad).floor() + 1.0;
        first as usize..(end as usize).min(self.zones)
    }
}

impl Zone<'_> {
    /// Unit vector to the centre of a cell; cells are numbered by ascending right ascension.
    pub fn centre(&self, cell: usize) -> [f64; 3] {
        let (sin_ra, cos_ra) = sincos((cell as f64 + 0.5) / self.cells as f64 * TAU);
        [self.cos_dec * cos_ra, self.cos_dec * sin_ra, self.sin_dec]
    }

    /// The cells whose cones may hold `direction`, a unit vector with the right ascension `ra_rad`.
    /// The numbers count on beyond 360°: they are to be taken modulo [`cells`](Self::cells).
    pub fn cells_near(&self, direction: &[f64; 3], ra_rad: f64) -> Range<usize> {
        let [x, y, sin_dec] = *direction;
        let cos_dec = (x * x + y * y).sqrt();
        // The spherical law of cosines.
        let cos_reach =
            (self.partition.cos_radius - self.sin_dec * sin_dec) / (self.cos_dec * cos_dec);
        if cos_reach > 1.0 {
            return 0..0;
        }
        let reach_rad = if cos_reach > -1.0 {
            acos(cos_reach)
        } else {
            PI
        };
        let place = |ra_rad: f64| (ra_rad / TAU + 1.0) * self.cells as f64 - 0.5;
        let first = place(ra_rad - reach_rad).ceil() as usize;
        let end = place(ra_rad + reach_rad).floor() as usize + 1;
        first..end.min(first + self.cells)
    }

    /// Whether the direction of `vector`, of any length, may lie in this zone. Needs no
    /// trigonometry.
    pub fn may_hold(&self, vector: &[f64; 3]) -> bool {
        let [x, y, z] = *vector;
        let sin_dec = z / (x * x + y * y + z * z).sqrt();
        sin_dec >= self.heights.start && sin_dec < self.heights.end
    }

    /// The cell that holds the direction of `vector`, of any length, if it lies in this zone.
    pub fn cell_of(&self, vector: &[f64; 3]) -> Option<usize> {
        let [x, y, z] = *vector;
        let norm = (x * x + y * y + z * z).sqrt();
        let direction = UnitVector::<Icrs>::from_unit(Vector3::new(x / norm, y / norm, z / norm));
        let (ra_rad, dec_rad) = direction.to_ra_dec();
        let SkyCells {
            zones,
            zone_height_rad,
            ..
        } = *self.partition;
        let zone = ((dec_rad + FRAC_PI_2) / zone_height_rad) as usize;
        let cell = (ra_rad / TAU * self.cells as f64) as usize;
        (zone.min(zones - 1) == self.number).then(|| cell.min(self.cells - 1))
    }
}
