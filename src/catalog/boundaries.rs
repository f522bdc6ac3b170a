//! Which constellation is a direction in?
//!
//! # Reference
//! Roman 1987, PASP 99, 695, doi 10.1086/132034: the boundaries that the International Astronomical Union
//! adopted in 1928 (Delporte 1930), as zones of right ascension and declination for the equinox B1875.0.

use crate::base::coords::{Icrs, UnitVector};
use crate::base::units::DEG_PER_RAD;
use nalgebra::{Matrix3, Vector3};
use sofars::consts::DJ00;
use sofars::pnp;
use std::sync::OnceLock;

const ZONES: &str = include_str!("../../assets/constellation-boundaries.csv");
/// Days from J2000.0 to B1875.0.
const B1875_DAYS: f64 = 2_405_889.258_55 - DJ00;
const DEG_PER_HOUR: f64 = 15.0;

/// What lies north of a declination and between two right ascensions, and in no zone before it.
struct Zone {
    ra_deg: [f64; 2],
    dec_deg: f64,
    abbreviation: &'static str,
}

struct Boundaries {
    /// From ICRS axes to those of the equinox B1875.0.
    precession: Matrix3<f64>,
    /// In the order in which they count.
    zones: Vec<Zone>,
}

/// The IAU's abbreviation of the constellation that `direction` lies in, as in `Ori`.
pub(crate) fn constellation_at(direction: &UnitVector<Icrs>) -> &'static str {
    static ALL: OnceLock<Boundaries> = OnceLock::new();
    ALL.get_or_init(Boundaries::read).at(direction)
}

impl Boundaries {
    fn read() -> Self {
        let matrix = pnp::pmat76(DJ00, B1875_DAYS);
        Self {
            precession: Matrix3::from_fn(|row, column| matrix[row][column]),
            zones: ZONES.lines().skip(1).filter_map(zone).collect(),
        }
    }

    fn at(&self, direction: &UnitVector<Icrs>) -> &'static str {
        let of_date: Vector3<f64> = self.precession * direction.as_vector();
        let ra_deg = (libm::atan2(of_date.y, of_date.x) * DEG_PER_RAD).rem_euclid(360.0);
        let dec_deg = libm::asin(of_date.z.clamp(-1.0, 1.0)) * DEG_PER_RAD;
        let is_in = |zone: &&Zone| {
            dec_deg >= zone.dec_deg && (zone.ra_deg[0]..zone.ra_deg[1]).contains(&ra_deg)
        };
        // The last zone has the south pole.
        let found = self.zones.iter().find(is_in).or(self.zones.last());
        found.map_or("", |zone| zone.abbreviation)
    }
}

fn zone(line: &'static str) -> Option<Zone> {
    let mut cells = line.split(',');
    let mut number = || cells.next()?.parse::<f64>().ok();
    let ra_deg = [number()? * DEG_PER_HOUR, number()? * DEG_PER_HOUR];
    let dec_deg = number()?;
    Some(Zone {
        ra_deg,
        dec_deg,
        abbreviation: cells.next()?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::units::RAD_PER_DEG;
    use crate::catalog::objects::constellations;
    use crate::catalog::{Catalog, StarIndex};
    use std::collections::BTreeSet;

    #[test]
    fn named_stars_lie_in_the_constellation_of_their_name() {
        let catalog = Catalog::built_in();
        let (mut same, mut all) = (0, 0);
        for index in (0..catalog.brighter_than(5.0)).map(StarIndex::new) {
            let Some(name) = catalog.name_of(index) else {
                continue;
            };
            let found = constellation_at(&catalog.star(index).direction);
            same += usize::from(name.split(' ').next_back() == Some(found));
            all += 1;
        }
        // A few stars have their letters from before the boundaries, or moved over them.
        assert!(all > 1300 && all - same <= 12, "{same} of {all}");
    }

    #[test]
    fn the_examples_of_the_paper_and_all_constellations_are_found() {
        for (ra_h, dec_deg, expected) in [
            (9.0, 65.0, "UMa"),
            (23.5, -20.0, "Aqr"),
            (5.12, 9.12, "Ori"),
            (9.4555, -19.9, "Hya"),
            (12.8888, 22.0, "Com"),
            (15.6687, -12.1234, "Lib"),
            (19.0, -40.0, "CrA"),
            (6.2222, -81.1234, "Men"),
        ] {
            // The paper's examples are of 1950, and far enough from a boundary for that of 2000.
            let direction =
                UnitVector::from_ra_dec(ra_h * 15.0 * RAD_PER_DEG, dec_deg * RAD_PER_DEG);
            assert_eq!(constellation_at(&direction), expected, "{ra_h} {dec_deg}");
        }
        let all: BTreeSet<&str> = Boundaries::read()
            .zones
            .iter()
            .map(|z| z.abbreviation)
            .collect();
        let figures: BTreeSet<&str> = constellations().iter().map(|c| c.abbreviation).collect();
        assert_eq!(all, figures);
        let poles = [1.0, -1.0].map(|z| UnitVector::from_vector(Vector3::new(0.0, 0.0, z)));
        assert_eq!(poles.map(|pole| constellation_at(&pole)), ["UMi", "Oct"]);
    }
}
