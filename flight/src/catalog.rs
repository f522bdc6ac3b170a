//! The stars and their triangles, read in place.
//!
//! Little-endian, without padding, at any address:
//!
//! | bytes | what |
//! | --- | --- |
//! | 0–8 | `SPFLIGHT` |
//! | 8–12 | version, 1 |
//! | 12–16 | length of the whole, in bytes |
//! | 16–24 | XXH3 (64 bits) of all that follows |
//! | 24–40 | narrowest and widest field of view in degrees, faintest V magnitude, epoch as a year: four `f32` |
//! | 40–52 | stars, triangles, stars in the fullest circle of the widest field: three `u32` |
//! | 52–56 | chord of the longest side, `f32` |
//! | then | number of the first star of each sky cell, and of stars: `u32` |
//! | then | the stars, brightest first in each cell: 22 bytes each |
//! | then | number of the first triangle of each class of longest sides, and of triangles: `u32` |
//! | then | the triangles, by their middle side in each class: 12 bytes each |
//!
//! A star: x, y, z of its direction (ICRS, at the epoch) over 2⁻³⁰, three `i32`; proper motion towards east and north in
//! mas a year, two `i16`; V magnitude over 0.001, `i16`; its number in the catalogue it is of, `u32`. A triangle: its
//! sides, longest first, over the longest chord of all and 2⁻¹⁶, three `u16`; its stars, opposite to these sides, three
//! `u16`.

use crate::Error;
use core::f64::consts::{FRAC_PI_2, PI, TAU};
use nalgebra::Vector3;
use xxhash_rust::xxh3::xxh3_64;

pub(crate) const MAGIC: &[u8; 8] = b"SPFLIGHT";
pub(crate) const VERSION: u32 = 1;
pub(crate) const HASHED_FROM: usize = 24;
pub(crate) const HEADER_BYTES: usize = 56;
pub(crate) const STAR_BYTES: usize = 22;
pub(crate) const TRIANGLE_BYTES: usize = 12;
/// Classes of longest sides.
pub(crate) const CLASSES: usize = 256;
/// A unit of a star's direction.
pub(crate) const DIRECTION_UNIT: f64 = 1.0 / (1_u32 << 30) as f64;
/// A unit of a side is this part of the longest.
pub(crate) const SIDE_UNITS: f64 = 65535.0;
const RAD_PER_MAS: f64 = PI / 180.0 / 3.6e6;
/// Bands of declination.
const BANDS: usize = 36;

/// A star of the catalogue.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Star {
    /// Its direction at the epoch, a unit vector.
    pub direction: Vector3<f64>,
    /// Proper motion towards east and north, in mas a year.
    pub motion_mas: [i16; 2],
    /// V magnitude.
    pub v_mag: f64,
    /// Its number in the catalogue it is of.
    pub id: u32,
}

impl Star {
    /// Its direction some years after the epoch.
    pub(crate) fn direction_after(&self, years: f64) -> Vector3<f64> {
        let [x, y] = [self.direction.x, self.direction.y];
        let across = libm::hypot(x, y);
        if across < 1e-9 {
            return self.direction;
        }
        let east = Vector3::new(-y / across, x / across, 0.0);
        let north = self.direction.cross(&east);
        let [to_east, to_north] = self
            .motion_mas
            .map(|mas| f64::from(mas) * RAD_PER_MAS * years);
        (self.direction + east * to_east + north * to_north).normalize()
    }
}

/// Three stars that are near to each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Triangle {
    /// Its sides, longest first.
    pub sides: [u16; 3],
    /// Its stars, each opposite to a side.
    pub stars: [u16; 3],
}

/// The stars and their triangles.
#[derive(Debug, Clone, Copy)]
pub struct Catalog<'a> {
    bytes: &'a [u8],
    stars: usize,
    triangles: usize,
    longest_chord: f64,
}

impl<'a> Catalog<'a> {
    /// The catalogue in these bytes.
    ///
    /// # Errors
    /// [`Error::Catalog`] where they are none, and [`Error::CatalogHash`] where they are damaged.
    pub fn new(bytes: &'a [u8]) -> Result<Self, Error> {
        if bytes.len() < HEADER_BYTES || &bytes[..8] != MAGIC {
            return Err(Error::Catalog);
        }
        let number = |at: usize| u32_at(bytes, at) as usize;
        let (length, stars, triangles) = (number(12), number(40), number(44));
        if u32_at(bytes, 8) != VERSION || length > bytes.len() || stars > usize::from(u16::MAX) {
            return Err(Error::Catalog);
        }
        if stars.checked_mul(STAR_BYTES).is_none() || triangles > length / TRIANGLE_BYTES {
            return Err(Error::Catalog);
        }
        let bytes = &bytes[..length];
        let catalog = Self {
            bytes,
            stars,
            triangles,
            longest_chord: f64::from(f32_at(bytes, 52)),
        };
        if catalog.triangles_at() + triangles * TRIANGLE_BYTES != length {
            return Err(Error::Catalog);
        }
        if xxh3_64(&bytes[HASHED_FROM..]).to_le_bytes() != bytes[16..24] {
            return Err(Error::CatalogHash);
        }
        if catalog.is_sound() {
            Ok(catalog)
        } else {
            Err(Error::Catalog)
        }
    }

    /// Whether numbers that point into the catalogue do: the hash tells of damage, and not of who made it.
    fn is_sound(&self) -> bool {
        let ascends = |at: usize, count: usize, total: usize| {
            let number = |index: usize| u32_at(self.bytes, at + 4 * index) as usize;
            number(0) == 0
                && number(count) == total
                && (0..count).all(|index| number(index) <= number(index + 1))
        };
        let [narrowest, widest] = self.fov_deg();
        let floats = [
            narrowest,
            widest,
            self.v_limit(),
            self.epoch_year(),
            self.longest_chord,
        ];
        floats.iter().all(|value| value.is_finite())
            && narrowest > 0.0
            && self.longest_chord > 0.0
            && ascends(HEADER_BYTES, cell_count(), self.stars)
            && ascends(self.classes_at(), CLASSES, self.triangles)
            && (0..self.triangles).all(|index| {
                let stars = self.triangle(index).stars;
                stars.iter().all(|star| usize::from(*star) < self.stars)
            })
            && (0..self.stars).all(|index| (self.star(index).direction.norm() - 1.0).abs() < 1e-6)
    }

    /// Number of stars.
    pub fn len(&self) -> usize {
        self.stars
    }

    /// Whether it has no star.
    pub fn is_empty(&self) -> bool {
        self.stars == 0
    }

    /// Number of triangles.
    pub fn triangles(&self) -> usize {
        self.triangles
    }

    /// Narrowest and widest field of view, in degrees.
    pub fn fov_deg(&self) -> [f64; 2] {
        [24, 28].map(|at| f64::from(f32_at(self.bytes, at)))
    }

    /// V magnitude of the faintest star.
    pub fn v_limit(&self) -> f64 {
        f64::from(f32_at(self.bytes, 32))
    }

    /// Year of the directions.
    pub fn epoch_year(&self) -> f64 {
        f64::from(f32_at(self.bytes, 36))
    }

    /// The hash of its content.
    pub fn hash(&self) -> u64 {
        u64::from(u32_at(self.bytes, 16)) | u64::from(u32_at(self.bytes, 20)) << 32
    }

    /// Most stars in a circle around a frame of the widest field of view.
    pub(crate) fn most_in_view(&self) -> usize {
        (u32_at(self.bytes, 48) as usize).min(self.stars)
    }

    /// The chord of a unit of a side.
    pub(crate) fn chord_unit(&self) -> f64 {
        self.longest_chord / SIDE_UNITS
    }

    fn classes_at(&self) -> usize {
        HEADER_BYTES + 4 * (cell_count() + 1) + self.stars * STAR_BYTES
    }

    fn triangles_at(&self) -> usize {
        self.classes_at() + 4 * (CLASSES + 1)
    }

    /// A star by its number; the numbers are those below [`Catalog::len`].
    pub fn star(&self, number: usize) -> Star {
        let at = HEADER_BYTES + 4 * (cell_count() + 1) + number * STAR_BYTES;
        let part = |axis: usize| {
            f64::from(u32_at(self.bytes, at + 4 * axis).cast_signed()) * DIRECTION_UNIT
        };
        let small = |offset: usize| u16_at(self.bytes, at + offset).cast_signed();
        Star {
            direction: Vector3::new(part(0), part(1), part(2)),
            motion_mas: [small(12), small(14)],
            v_mag: f64::from(small(16)) * 1e-3,
            id: u32_at(self.bytes, at + 18),
        }
    }

    pub(crate) fn triangle(&self, number: usize) -> Triangle {
        let at = self.triangles_at() + number * TRIANGLE_BYTES;
        let part = |offset: usize| u16_at(self.bytes, at + offset);
        Triangle {
            sides: [part(0), part(2), part(4)],
            stars: [part(6), part(8), part(10)],
        }
    }

    /// Calls `visit` with the number of each star within an angle of a direction at the epoch.
    pub(crate) fn visit_stars(
        &self,
        middle: &Vector3<f64>,
        radius_rad: f64,
        mut visit: impl FnMut(usize),
    ) {
        let nearest = libm::cos(radius_rad.min(PI));
        visit_cells(middle, radius_rad, |cell| {
            let number = |index: usize| u32_at(self.bytes, HEADER_BYTES + 4 * index) as usize;
            for star in number(cell)..number(cell + 1) {
                if self.star(star).direction.dot(middle) >= nearest {
                    visit(star);
                }
            }
        });
    }

    /// The numbers of the triangles of a class whose middle side lies between two values.
    pub(crate) fn triangles_of(&self, class: usize, middle: [u16; 2]) -> core::ops::Range<usize> {
        let start = |class: usize| u32_at(self.bytes, self.classes_at() + 4 * class) as usize;
        let [from, end] = [start(class), start(class + 1)];
        let first = |side: u32| {
            partition(from, end, |index| {
                u32::from(self.triangle(index).sides[1]) < side
            })
        };
        first(u32::from(middle[0]))..first(u32::from(middle[1]) + 1)
    }
}

/// The class of a longest side.
pub(crate) fn class_of(longest: u16) -> usize {
    (usize::from(longest) * CLASSES) >> 16
}

/// The first number in `from..end` for which `is_before` does not hold.
fn partition(mut from: usize, mut end: usize, is_before: impl Fn(usize) -> bool) -> usize {
    while from < end {
        let middle = from + (end - from) / 2;
        if is_before(middle) {
            from = middle + 1;
        } else {
            end = middle;
        }
    }
    from
}

/// Cells in a band of declination: about as wide as high.
fn cells_in(band: usize) -> usize {
    let middle = (band as f64 + 0.5) / BANDS as f64 * PI - FRAC_PI_2;
    let around = libm::ceil(libm::cos(middle) * 2.0 * BANDS as f64) as usize;
    around.max(1)
}

/// Number of cells of the sky.
pub(crate) fn cell_count() -> usize {
    (0..BANDS).map(cells_in).sum()
}

#[cfg(any(test, feature = "build"))]
/// The cell of a direction.
pub(crate) fn cell_of(direction: &Vector3<f64>) -> usize {
    let (ra, dec) = angles(direction);
    let band = band_of(dec);
    let before: usize = (0..band).map(cells_in).sum();
    before + column_of(ra, cells_in(band))
}

fn band_of(dec: f64) -> usize {
    let band = (dec + FRAC_PI_2) / PI * BANDS as f64;
    (band.max(0.0) as usize).min(BANDS - 1)
}

#[cfg(any(test, feature = "build"))]
fn column_of(ra: f64, count: usize) -> usize {
    ((ra / TAU * count as f64).max(0.0) as usize).min(count - 1)
}

/// Right ascension in [0, 2π), and declination.
fn angles(direction: &Vector3<f64>) -> (f64, f64) {
    let ra = libm::atan2(direction.y, direction.x);
    let ra = if ra < 0.0 { ra + TAU } else { ra };
    (ra, libm::asin(direction.z.clamp(-1.0, 1.0)))
}

/// Calls `visit` with each cell that may have a part within an angle of a direction, each once.
fn visit_cells(middle: &Vector3<f64>, radius_rad: f64, mut visit: impl FnMut(usize)) {
    /// More than the rounding of angles.
    const SLACK: f64 = 1e-6;
    let (ra, dec) = angles(middle);
    let radius = radius_rad + SLACK;
    let bands = [band_of(dec - radius), band_of(dec + radius)];
    let mut before: usize = (0..bands[0]).map(cells_in).sum();
    for band in bands[0]..=bands[1] {
        let count = cells_in(band);
        let reach = reach_in_ra(dec, radius);
        if reach >= PI {
            (before..before + count).for_each(&mut visit);
        } else {
            let width = TAU / count as f64;
            let first = libm::floor((ra - reach) / width) as i64;
            let last = libm::floor((ra + reach) / width) as i64;
            for column in first..=last.min(first + count as i64 - 1) {
                visit(before + column.rem_euclid(count as i64) as usize);
            }
        }
        before += count;
    }
}

/// How far a circle reaches in right ascension; π or more where it holds a pole.
fn reach_in_ra(dec: f64, radius: f64) -> f64 {
    if dec.abs() + radius >= FRAC_PI_2 {
        return TAU;
    }
    libm::asin((libm::sin(radius) / libm::cos(dec)).min(1.0))
}

fn u16_at(bytes: &[u8], at: usize) -> u16 {
    bytes
        .get(at..at + 2)
        .map_or(0, |part| u16::from_le_bytes([part[0], part[1]]))
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    bytes.get(at..at + 4).map_or(0, |part| {
        u32::from_le_bytes([part[0], part[1], part[2], part[3]])
    })
}

fn f32_at(bytes: &[u8], at: usize) -> f32 {
    f32::from_bits(u32_at(bytes, at))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    fn direction(ra: f64, dec: f64) -> Vector3<f64> {
        Vector3::new(dec.cos() * ra.cos(), dec.cos() * ra.sin(), dec.sin())
    }

    proptest! {
        #[test]
        fn each_cell_near_a_direction_is_visited_once(
            ra in 0.0..TAU, dec in -FRAC_PI_2..FRAC_PI_2, radius in 0.0..1.0_f64, along in 0.0..TAU, share in 0.0..1.0_f64,
        ) {
            let middle = direction(ra, dec);
            let mut cells = Vec::new();
            visit_cells(&middle, radius, |cell| cells.push(cell));
            let east = Vector3::new(-ra.sin(), ra.cos(), 0.0);
            let north = middle.cross(&east);
            let turn = radius * share;
            let across = east * along.cos() + north * along.sin();
            let near = middle * turn.cos() + across * turn.sin();
            prop_assert!(cells.contains(&cell_of(&near)));
            let count = cells.len();
            cells.sort_unstable();
            cells.dedup();
            prop_assert_eq!(cells.len(), count);
            prop_assert!(cells.iter().all(|cell| *cell < cell_count()));
        }

        #[test]
        fn what_is_no_catalog_is_refused(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
            let mut named = MAGIC.to_vec();
            named.extend(VERSION.to_le_bytes());
            named.extend(&bytes);
            prop_assert!(Catalog::new(&named).is_err());
            prop_assert!(Catalog::new(&bytes).is_err());
        }
    }

    #[test]
    fn proper_motion_is_towards_east_and_north() {
        let star = Star {
            direction: direction(1.0, 0.5),
            motion_mas: [3000, -2000],
            v_mag: 5.0,
            id: 1,
        };
        let (ra, dec) = angles(&star.direction_after(100.0));
        assert!(((ra - 1.0) * 0.5_f64.cos() / RAD_PER_MAS - 3e5).abs() < 1e3);
        assert!(((dec - 0.5) / RAD_PER_MAS + 2e5).abs() < 1e3);
    }
}
