//! Cells of HEALPix, a partition of the sky into cells of equal area.
//!
//! # Reference
//! Górski et al. 2005, ApJ 622, 759, sect. 5.

use crate::base::coords::{Icrs, UnitVector};
use crate::base::units::RAD_PER_DEG;
use nalgebra::Vector3;
#[cfg(feature = "archive")]
use std::f64::consts::FRAC_PI_4;
use std::f64::consts::{FRAC_PI_2, TAU};

/// A cell: one of the twelve faces, and its place there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct HealpixCell {
    face: u32,
    x: u32,
    y: u32,
}

impl HealpixCell {
    /// The cell that holds a direction, where each face is divided into `side` × `side`.
    pub fn of(direction: &UnitVector<Icrs>, side: u32) -> Self {
        let (ra_rad, _) = direction.to_ra_dec();
        let z = direction.as_vector().z;
        let quarters = (ra_rad / FRAC_PI_2).rem_euclid(4.0);
        let (face, u, v) = if z.abs() <= 2.0 / 3.0 {
            equatorial(z, quarters)
        } else {
            polar(direction.as_vector(), quarters)
        };
        let along = |share: f64| ((share * f64::from(side)).max(0.0) as u32).min(side - 1);
        Self {
            face,
            x: along(u),
            y: along(v),
        }
    }

    /// The cell of twice its width that holds it.
    pub const fn parent(self) -> Self {
        Self {
            face: self.face,
            x: self.x / 2,
            y: self.y / 2,
        }
    }

    /// Its number in the scheme of astrometry.net: face by face, x by x.
    pub const fn number_by_face(self, side: u32) -> u32 {
        (self.face * side + self.x) * side + self.y
    }
}

/// One of twelve equal parts of the sky: a face.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct SkyZone(u32);

impl SkyZone {
    /// Their number.
    pub const COUNT: u32 = 12;

    /// All of them.
    pub fn all() -> impl Iterator<Item = Self> {
        (0..Self::COUNT).map(Self)
    }

    /// Its number.
    pub const fn number(self) -> u32 {
        self.0
    }

    /// Its centre.
    pub fn centre(self) -> UnitVector<Icrs> {
        let (row, column) = (self.0 / 4, f64::from(self.0 % 4));
        let (z, offset): (f64, f64) = match row {
            0 => (2.0 / 3.0, 0.5),
            1 => (0.0, 0.0),
            _ => (-2.0 / 3.0, 0.5),
        };
        UnitVector::from_ra_dec((column + offset) * FRAC_PI_2, libm::asin(z))
    }

    /// A circle of this radius around its centre holds it: to a pole it is acos(2/3).
    pub const RADIUS_RAD: f64 = 48.2 * RAD_PER_DEG;

    /// Whether a direction lies in it, or not farther than this beside it.
    pub fn contains(self, direction: &UnitVector<Icrs>, margin_rad: f64) -> bool {
        let is_in = |direction: &UnitVector<Icrs>| HealpixCell::of(direction, 1).face == self.0;
        if is_in(direction) {
            return true;
        }
        let (east, north) = direction.east_north();
        [east, -east, north, -north].iter().any(|side| {
            is_in(&UnitVector::from_vector(
                direction.as_vector() + side * margin_rad,
            ))
        })
    }
}

/// Cells of 4 to the power of the order to a face, by their numbers in the nested scheme.
#[cfg(feature = "archive")]
impl HealpixCell {
    /// The cell with a number; `order` is at most 29, and the number below 12 times that.
    pub fn from_nested(number: u64, order: u32) -> Self {
        let within = number & ((1 << (2 * order)) - 1);
        Self {
            face: (number >> (2 * order)) as u32,
            x: even_bits(within),
            y: even_bits(within >> 1),
        }
    }

    /// Its centre.
    ///
    /// # Reference
    /// Calabretta & Roukema 2007, MNRAS 381, 865, sect. 4, in the form of `xyf2loc` of HEALPix.
    pub fn centre(self, order: u32) -> UnitVector<Icrs> {
        let side = libm::exp2(f64::from(order));
        let along = |place: u32| (f64::from(place) + 0.5) / side;
        let (u, v) = (along(self.x), along(self.y));
        let (row, column) = (self.face / 4, self.face % 4);
        // Sides of faces from the north pole to the south corner of the face, and eighths of a turn to it.
        let corner = f64::from(row + 2);
        let eighths = f64::from(2 * column + u32::from(row != 1));
        let down = corner - u - v;
        let (z, width) = if down < 1.0 {
            (1.0 - down * down / 3.0, down)
        } else if down > 3.0 {
            let up = 4.0 - down;
            (up * up / 3.0 - 1.0, up)
        } else {
            ((2.0 - down) * 2.0 / 3.0, 1.0)
        };
        let ra_rad = FRAC_PI_4 * (eighths + (u - v) / width);
        UnitVector::from_ra_dec(ra_rad, libm::asin(z))
    }
}

/// No place in a cell of this order is further from its centre.
///
/// # Reference
/// `max_pixrad` of HEALPix.
#[cfg(feature = "archive")]
pub fn radius_of_cells_rad(order: u32) -> f64 {
    let share = libm::exp2(-f64::from(order));
    let centre = UnitVector::<Icrs>::from_ra_dec(FRAC_PI_4 * share, libm::asin(2.0 / 3.0));
    let from_pole = 1.0 - share;
    let corner = UnitVector::from_ra_dec(0.0, libm::asin(1.0 - from_pole * from_pole / 3.0));
    centre.angle_to(&corner)
}

/// The number of every other bit, from the lowest on.
#[cfg(feature = "archive")]
fn even_bits(bits: u64) -> u32 {
    let bit = |place: u32| ((bits >> (2 * place)) & 1) << place;
    (0..32).map(bit).sum::<u64>() as u32
}

/// The face, and the place there from 0 to 1, near the equator.
fn equatorial(z: f64, quarters: f64) -> (u32, f64, f64) {
    // Lines of constant x and y are straight in z and right ascension.
    let rising = 0.5 + quarters - 0.75 * z;
    let falling = 0.5 + quarters + 0.75 * z;
    let (row, column) = (rising.floor(), falling.floor());
    let of_four = |number: f64| number.rem_euclid(4.0) as u32;
    let face = if row == column {
        of_four(row) + 4
    } else if row < column {
        of_four(row)
    } else {
        of_four(column) + 8
    };
    (face, falling - column, 1.0 - (rising - row))
}

/// The same, near a pole.
fn polar(direction: &Vector3<f64>, quarters: f64) -> (u32, f64, f64) {
    let quarter = quarters.floor().min(3.0);
    let within = quarters - quarter;
    let z = direction.z.abs();
    // 1 − |z|, without loss at the pole.
    let from_pole = (direction.x.powi(2) + direction.y.powi(2)) / (1.0 + z);
    let height = (3.0 * from_pole).sqrt();
    let (east, west) = (within * height, (1.0 - within) * height);
    if direction.z > 0.0 {
        (quarter as u32, 1.0 - west, 1.0 - east)
    } else {
        (quarter as u32 + 8, east, west)
    }
}

/// Directions that lie in every cell that a cone reaches, if cells are not much smaller than a third of it: its
/// centre, and points on circles around it.
pub fn samples(centre: &UnitVector<Icrs>, radius_rad: f64) -> Vec<UnitVector<Icrs>> {
    const CIRCLES: u32 = 4;
    const ON_CIRCLE: u32 = 24;
    /// Cones are taken this much larger.
    const MARGIN_RAD: f64 = 0.1 * RAD_PER_DEG;
    let (east, north) = centre.east_north();
    let mut samples = vec![*centre];
    for circle in 1..=CIRCLES {
        let apart_rad = (radius_rad + MARGIN_RAD) * f64::from(circle) / f64::from(CIRCLES);
        let (sin, cos) = libm::sincos(apart_rad);
        samples.extend((0..ON_CIRCLE).map(|number| {
            let angle_rad = TAU * f64::from(number) / f64::from(ON_CIRCLE);
            let (to_east, to_north) = libm::sincos(angle_rad);
            let across = east * to_east + north * to_north;
            UnitVector::from_vector(centre.as_vector() * cos + across * sin)
        }));
    }
    samples
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;

    #[test]
    fn cells_have_equal_areas() {
        let side = 4;
        let mut counts: HashMap<u32, u32> = HashMap::new();
        let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
        let points = 192 * 400;
        for number in 0..points {
            let z = 1.0 - (2.0 * f64::from(number) + 1.0) / f64::from(points);
            let direction = UnitVector::from_ra_dec(f64::from(number) * golden, libm::asin(z));
            let cell = HealpixCell::of(&direction, side);
            *counts.entry(cell.number_by_face(side)).or_default() += 1;
        }
        assert_eq!(counts.len(), 192);
        assert!(counts.keys().all(|number| *number < 192));
        let range = counts.values().min().unwrap()..=counts.values().max().unwrap();
        assert!(**range.start() > 380 && **range.end() < 420, "{range:?}");
    }

    #[test]
    fn zones_are_in_their_circles_and_each_direction_is_in_one() {
        for number in 0..20_000 {
            let share = |factor: f64| (factor * f64::from(number)).fract();
            let dec_rad = libm::asin(2.0 * share(0.754_877_666_2) - 1.0);
            let direction = UnitVector::from_ra_dec(TAU * share(0.618_033_988_7), dec_rad);
            let zones: Vec<SkyZone> = SkyZone::all()
                .filter(|zone| zone.contains(&direction, 0.0))
                .collect();
            assert_eq!(zones.len(), 1);
            assert!(zones[0].centre().angle_to(&direction) < SkyZone::RADIUS_RAD);
        }
        let across = UnitVector::from_ra_dec(FRAC_PI_2 + 0.001, 0.9);
        let zones = SkyZone::all().filter(|zone| zone.contains(&across, 0.01));
        assert_eq!(zones.count(), 2);
    }

    /// The inverse of finding the cell of a direction; some numbers as healpy gives them.
    #[cfg(feature = "archive")]
    #[test]
    fn nested_cells_hold_their_centres_and_no_place_beyond_their_radius() {
        for order in [0, 1, 3, 8] {
            let radius_rad = radius_of_cells_rad(order);
            let mut widest_rad: f64 = 0.0;
            for number in 0..20_000u32 {
                let z = 1.0 - (2.0 * f64::from(number) + 1.0) / 20_000.0;
                let direction = UnitVector::from_ra_dec(f64::from(number) * 2.4, libm::asin(z));
                let cell = HealpixCell::of(&direction, 1 << order);
                let centre = cell.centre(order);
                assert_eq!(HealpixCell::of(&centre, 1 << order), cell);
                widest_rad = widest_rad.max(centre.angle_to(&direction));
            }
            assert!(widest_rad <= radius_rad, "{widest_rad} {radius_rad}");
            assert!(widest_rad > 0.8 * radius_rad, "{widest_rad} {radius_rad}");
            for number in 0..(12u64 << (2 * order)).min(3000) {
                let cell = HealpixCell::from_nested(number, order);
                let centre = cell.centre(order);
                assert_eq!(HealpixCell::of(&centre, 1 << order), cell);
                let parent = HealpixCell::from_nested(number / 4, order.saturating_sub(1));
                if order > 0 {
                    let side = 1 << (order - 1);
                    assert_eq!(HealpixCell::of(&centre, side), parent);
                }
            }
        }
        let cell = HealpixCell::from_nested(0b1011, 1);
        assert_eq!((cell.face, cell.x, cell.y), (2, 1, 1));
        let cell = HealpixCell::from_nested(0b1001, 2);
        assert_eq!((cell.face, cell.x, cell.y), (0, 1, 2));
    }

    /// Centres of faces, from the paper's figure 4.
    #[test]
    fn faces_are_numbered_from_the_north() {
        let face = |ra_deg: f64, dec_deg: f64| {
            let direction = UnitVector::from_ra_dec(ra_deg * RAD_PER_DEG, dec_deg * RAD_PER_DEG);
            HealpixCell::of(&direction, 1).number_by_face(1)
        };
        for quarter in 0..4 {
            let ra_deg = 90.0 * f64::from(quarter);
            assert_eq!(face(ra_deg + 45.0, 41.8), quarter);
            assert_eq!(face(ra_deg, 0.0), quarter + 4);
            assert_eq!(face(ra_deg + 45.0, -41.8), quarter + 8);
            assert_eq!(face(ra_deg + 45.0, 89.9), quarter);
            assert_eq!(face(ra_deg + 1.0, -80.0), quarter + 8);
        }
    }
}
