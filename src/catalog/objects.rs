//! What is in the sky beside stars: figures of constellations, and the brightest clusters, nebulae and galaxies.
//!
//! Positions are ICRS. `assets/README.md` says where the tables come from.

use crate::base::coords::{Icrs, UnitVector};
use crate::base::units::RAD_PER_DEG;
use std::sync::OnceLock;

const CONSTELLATIONS: &str = include_str!("../../assets/constellations.csv");
const DEEP_SKY: &str = include_str!("../../assets/deep-sky.csv");

/// A constellation; Serpens has two entries.
pub(crate) struct Constellation {
    /// The abbreviation of the IAU, as in `Ori`.
    pub(crate) abbreviation: &'static str,
    pub(crate) name: &'static str,
    /// The lines of its figure, from star to star.
    pub(crate) lines: Vec<Vec<UnitVector<Icrs>>>,
}

/// A cluster, nebula or galaxy.
pub(crate) struct DeepSkyObject {
    /// As in `M 42` or `NGC 869`.
    pub(crate) designation: &'static str,
    /// The name that people use, as in `Orion Nebula`; empty where there is none.
    pub(crate) name: &'static str,
    pub(crate) v_mag: f64,
    pub(crate) direction: UnitVector<Icrs>,
    /// Half of its longer side; 0 where this is unknown.
    pub(crate) radius_rad: f64,
}

/// All constellations.
pub(crate) fn constellations() -> &'static [Constellation] {
    static ALL: OnceLock<Vec<Constellation>> = OnceLock::new();
    ALL.get_or_init(|| rows(CONSTELLATIONS).filter_map(constellation).collect())
}

/// The 110 objects of Messier's list and the brightest others, brightest first.
pub(crate) fn deep_sky() -> &'static [DeepSkyObject] {
    static ALL: OnceLock<Vec<DeepSkyObject>> = OnceLock::new();
    ALL.get_or_init(|| rows(DEEP_SKY).filter_map(deep_sky_object).collect())
}

fn rows(table: &'static str) -> impl Iterator<Item = Vec<&'static str>> {
    table.lines().skip(1).map(|line| line.split(',').collect())
}

fn direction(ra_deg: &str, dec_deg: &str) -> Option<UnitVector<Icrs>> {
    let rad = |deg: &str| Some(deg.parse::<f64>().ok()? * RAD_PER_DEG);
    Some(UnitVector::from_ra_dec(rad(ra_deg)?, rad(dec_deg)?))
}

fn constellation(cells: Vec<&'static str>) -> Option<Constellation> {
    let [abbreviation, name, _, _, lines] = cells[..] else {
        return None;
    };
    let line = |text: &str| {
        let numbers: Vec<&str> = text.split(' ').collect();
        let points = numbers.chunks_exact(2);
        points
            .filter_map(|point| direction(point[0], point[1]))
            .collect()
    };
    Some(Constellation {
        abbreviation,
        name,
        lines: lines.split(';').map(line).collect(),
    })
}

fn deep_sky_object(cells: Vec<&'static str>) -> Option<DeepSkyObject> {
    let [designation, name, _, v_mag, size_arcmin, ra_deg, dec_deg] = cells[..] else {
        return None;
    };
    Some(DeepSkyObject {
        designation,
        name,
        v_mag: v_mag.parse().ok()?,
        direction: direction(ra_deg, dec_deg)?,
        radius_rad: size_arcmin.parse::<f64>().ok()? / 2.0 / 60.0 * RAD_PER_DEG,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalog::Catalog;

    #[test]
    fn figures_run_from_bright_star_to_bright_star() {
        let catalog = Catalog::built_in();
        let bright = &catalog.stars()[..catalog.brighter_than(6.6)];
        assert_eq!(constellations().len(), 89);
        for constellation in constellations() {
            let points = constellation.lines.iter().flatten();
            // The lines of both parts of Serpens are with its head.
            let has_lines = points.clone().count() > 1 || constellation.name == "Serpens Cauda";
            assert!(has_lines, "{}", constellation.name);
            for point in points {
                let is_star = bright
                    .iter()
                    .any(|star| star.direction.dot(point) > 1.0 - 2e-7);
                assert!(is_star, "{}: {:?}", constellation.name, point.to_ra_dec());
            }
        }
    }

    #[test]
    fn every_row_of_the_deep_sky_is_read_and_the_messier_objects_are_there() {
        assert_eq!(deep_sky().len(), rows(DEEP_SKY).count());
        let designations = deep_sky().iter().map(|object| object.designation);
        assert_eq!(
            designations.filter(|name| name.starts_with("M ")).count(),
            110
        );
        let find = |name| deep_sky().iter().find(|object| object.designation == name);
        let (ra_rad, dec_rad) = find("M 31").unwrap().direction.to_ra_dec();
        assert!(
            (ra_rad / RAD_PER_DEG - 10.68).abs() < 0.02
                && (dec_rad / RAD_PER_DEG - 41.27).abs() < 0.02
        );
    }
}
