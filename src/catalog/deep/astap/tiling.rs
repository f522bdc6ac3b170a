//! How the sky is divided into areas: rings of declination, each divided in right ascension.

use crate::base::coords::{Icrs, UnitVector};
use crate::base::units::{DEG_PER_RAD, RAD_PER_DEG};
use std::f64::consts::PI;

/// Areas of the rings from the south pole to the equator, of each division; the north is its mirror image.
const OF_290: [u32; 9] = [1, 4, 8, 12, 16, 20, 24, 28, 32];
const OF_1476: [u32; 18] = [
    1, 3, 9, 15, 21, 27, 33, 38, 43, 48, 52, 56, 60, 63, 65, 67, 68, 69,
];
/// Stars may lie this far beyond the edges of their area: positions are rounded.
const MARGIN_DEG: f64 = 0.001;

/// A division of the sky.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Tiling {
    /// Into 290 areas, all of one size but the caps at the poles.
    Areas290,
    /// Into 1476 areas.
    Areas1476,
}

/// An area: its ring from the south pole, and its place there, both from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Area {
    /// The ring.
    pub ring: u32,
    /// The place in the ring.
    pub place: u32,
}

impl Tiling {
    /// The division of files with this ending.
    pub fn of_extension(extension: &str) -> Option<Self> {
        match extension {
            "290" => Some(Self::Areas290),
            "1476" => Some(Self::Areas1476),
            _ => None,
        }
    }

    const fn southern(self) -> &'static [u32] {
        match self {
            Self::Areas290 => &OF_290,
            Self::Areas1476 => &OF_1476,
        }
    }

    /// Number of rings.
    pub const fn rings(self) -> u32 {
        2 * self.southern().len() as u32
    }

    /// Number of areas of a ring, counted from 1.
    pub const fn areas_of(self, ring: u32) -> u32 {
        let southern = self.southern();
        let from_south = ring as usize - 1;
        let from_north = self.rings() as usize - ring as usize;
        southern[if from_south < from_north {
            from_south
        } else {
            from_north
        }]
    }

    /// The declination of the southern edge of a ring, counted from 1; of one more than there are, the north
    /// pole.
    fn south_edge_deg(self, ring: u32) -> f64 {
        let half = self.rings() / 2;
        let below = ring - 1;
        if below > half {
            return -self.south_edge_deg(2 * half + 2 - ring);
        }
        match (self, below) {
            (_, 0) => -90.0,
            // Rings of equal area: there is as much of the sky below as areas, the caps half ones.
            (Self::Areas290, _) => {
                let odd = f64::from(2 * below - 1);
                libm::asin(odd * odd / 289.0 - 1.0) * DEG_PER_RAD
            }
            // Rings of equal height, the caps half as high.
            (Self::Areas1476, _) => 90.0 / 17.5 * (f64::from(below) - f64::from(half)),
        }
    }

    /// Area of an area of a ring.
    pub fn area_sq_deg(self, ring: u32) -> f64 {
        let [low, high] = [ring, ring + 1].map(|ring| {
            let edge_deg = self.south_edge_deg(ring);
            libm::sin(edge_deg * RAD_PER_DEG)
        });
        2.0 * PI * (high - low) * DEG_PER_RAD * DEG_PER_RAD / f64::from(self.areas_of(ring))
    }

    /// The areas that a circle on the sky reaches, from south to north.
    pub fn areas_near(self, centre: &UnitVector<Icrs>, radius_rad: f64) -> Vec<Area> {
        let (ra_rad, dec_rad) = centre.to_ra_dec();
        let (ra_deg, dec_deg) = (ra_rad * DEG_PER_RAD, dec_rad * DEG_PER_RAD);
        let radius_deg = radius_rad * DEG_PER_RAD + MARGIN_DEG;
        let reach_deg = reach_in_ra_deg(dec_deg, radius_deg);
        let mut areas = Vec::new();
        for ring in 1..=self.rings() {
            let (low, high) = (self.south_edge_deg(ring), self.south_edge_deg(ring + 1));
            if low > dec_deg + radius_deg || high < dec_deg - radius_deg {
                continue;
            }
            let width_deg = 360.0 / f64::from(self.areas_of(ring));
            areas.extend((1..=self.areas_of(ring)).filter_map(|place| {
                let middle_deg = (f64::from(place) - 0.5) * width_deg;
                let apart_deg = (middle_deg - ra_deg + 180.0).rem_euclid(360.0) - 180.0;
                let is_near = apart_deg.abs() <= reach_deg + width_deg / 2.0;
                is_near.then_some(Area { ring, place })
            }));
        }
        areas
    }
}

/// How far a circle on the sky reaches in right ascension.
fn reach_in_ra_deg(dec_deg: f64, radius_deg: f64) -> f64 {
    if dec_deg.abs() + radius_deg >= 89.9 {
        return 180.0;
    }
    let [radius, dec] = [radius_deg, dec_deg].map(|deg| deg * RAD_PER_DEG);
    libm::asin((libm::sin(radius) / libm::cos(dec)).min(1.0)) * DEG_PER_RAD + MARGIN_DEG
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(ra_deg: f64, dec_deg: f64) -> UnitVector<Icrs> {
        UnitVector::from_ra_dec(ra_deg * RAD_PER_DEG, dec_deg * RAD_PER_DEG)
    }

    #[test]
    fn both_divisions_have_their_number_of_areas_and_cover_the_sky() {
        for (tiling, number) in [(Tiling::Areas290, 290), (Tiling::Areas1476, 1476)] {
            let rings = 1..=tiling.rings();
            assert_eq!(
                rings.clone().map(|ring| tiling.areas_of(ring)).sum::<u32>(),
                number
            );
            let area =
                rings.map(|ring| f64::from(tiling.areas_of(ring)) * tiling.area_sq_deg(ring));
            assert!((area.sum::<f64>() - 41_252.96).abs() < 0.01);
            assert_eq!(tiling.south_edge_deg(tiling.rings() + 1), 90.0);
        }
        // The edges as they are published.
        assert!((Tiling::Areas290.south_edge_deg(2) + 85.232_244_04).abs() < 1e-8);
        assert!((Tiling::Areas290.south_edge_deg(9) + 12.794_405_89).abs() < 1e-8);
        assert!((Tiling::Areas290.south_edge_deg(11) - 12.794_405_89).abs() < 1e-8);
        assert_eq!(Tiling::Areas290.south_edge_deg(10), 0.0);
        assert!((Tiling::Areas1476.south_edge_deg(2) + 87.428_571_43).abs() < 1e-8);
        assert_eq!(Tiling::Areas1476.south_edge_deg(19), 0.0);
    }

    #[test]
    fn known_places_lie_in_their_areas() {
        for (ra_deg, dec_deg, of_290, of_1476) in [
            (101.287_155, -16.716_116, (8, 8), (15, 19)),
            (37.954_56, 89.264_109, (18, 1), (36, 1)),
            (279.234_735, 38.783_689, (13, 16), (26, 41)),
            (83.822, -5.391, (9, 8), (17, 16)),
            (359.99, 45.0, (13, 20), (27, 48)),
            (10.0, -89.9, (1, 1), (1, 1)),
        ] {
            for (tiling, (ring, place)) in
                [(Tiling::Areas290, of_290), (Tiling::Areas1476, of_1476)]
            {
                let near = tiling.areas_near(&at(ra_deg, dec_deg), 1e-7);
                assert!(near.contains(&Area { ring, place }), "{near:?}");
                assert!(near.len() <= 2);
            }
        }
    }

    #[test]
    fn every_place_in_a_circle_lies_in_an_area_near_it() {
        for (ra_deg, dec_deg, radius_deg) in
            [(0.3, 4.0, 3.0), (200.0, -71.0, 6.0), (90.0, 84.0, 7.0)]
        {
            let centre = at(ra_deg, dec_deg);
            let (east, north) = centre.east_north();
            let near = Tiling::Areas1476.areas_near(&centre, radius_deg * RAD_PER_DEG);
            for step in 0..360 {
                let (sin, cos) = libm::sincos(f64::from(step) * RAD_PER_DEG);
                let (across, along) = libm::sincos(radius_deg * RAD_PER_DEG);
                let vector = centre.as_vector() * along + (east * sin + north * cos) * across;
                let edge = UnitVector::from_vector(vector);
                let holds = Tiling::Areas1476.areas_near(&edge, 0.0);
                assert!(holds.iter().any(|area| near.contains(area)));
            }
        }
        assert_eq!(Tiling::Areas290.areas_near(&at(0.0, 0.0), PI).len(), 290);
    }
}
