//! Proper names of bright stars, such as Rigel, as the International Astronomical Union has approved
//! them.
//!
//! # Reference
//! IAU Division C Working Group on Star Names, IAU Catalog of Star Names, 2022-04-04 (CC BY 4.0).
//! `assets/README.md` says how the table was made.

use super::StarId;
use super::id::HipparcosId;
use std::sync::OnceLock;

const TABLE: &str = include_str!("../../assets/star-names.csv");

/// A row of the table.
struct ProperName {
    skymap: u32,
    hipparcos: u32,
    name: &'static str,
}

/// The proper name of a star that is known by its Skymap or Hipparcos number.
pub(super) fn find(id: StarId) -> Option<&'static str> {
    match id {
        StarId::Skymap(number) => {
            let by_number = &names().by_skymap;
            let found = by_number.binary_search_by_key(&number, |star| star.skymap);
            found.ok().map(|at| by_number[at].name)
        }
        StarId::Hipparcos(id) => {
            let mut all = names().by_skymap.iter();
            let is_it = |star: &&ProperName| HipparcosId::new(star.hipparcos, None) == Some(id);
            all.find(is_it).map(|star| star.name)
        }
        _ => None,
    }
}

struct Names {
    by_skymap: Vec<ProperName>,
}

fn names() -> &'static Names {
    static NAMES: OnceLock<Names> = OnceLock::new();
    NAMES.get_or_init(|| {
        let rows = TABLE.lines().skip(1).filter_map(|line| {
            let mut cells = line.split(',');
            Some(ProperName {
                skymap: cells.next()?.parse().ok()?,
                hipparcos: cells.next()?.parse().ok()?,
                name: cells.next()?,
            })
        });
        let mut by_skymap: Vec<ProperName> = rows.collect();
        by_skymap.sort_by_key(|star| star.skymap);
        Names { by_skymap }
    })
}

#[cfg(test)]
mod tests {
    use super::super::Catalog;
    use super::*;
    use crate::base::coords::UnitVector;
    use crate::base::units::{ARCSEC_PER_RAD, RAD_PER_DEG};

    /// The table's positions have three decimals of a degree, 2.5″ in the corner; those of double
    /// stars are of the pair or of a component.
    const SAME_PLACE_ARCSEC: f64 = 16.0;
    /// Variable stars, and double stars that one of both catalogues does not part.
    const SAME_V_MAG: f64 = 1.0;
    /// Mira and its like are exempt.
    const LONG_PERIOD_VARIABLE: &str = "Mira";

    #[test]
    fn every_name_is_of_the_star_of_its_place_and_brightness() {
        let catalog = Catalog::built_in();
        let mut rows = 0;
        for line in TABLE.lines().skip(1) {
            let cells: Vec<&str> = line.split(',').collect();
            let number = |at: usize| cells[at].parse::<f64>().unwrap();
            let id = StarId::Skymap(cells[0].parse().unwrap());
            let star = catalog.star(catalog.find(id).unwrap());
            let place = UnitVector::from_ra_dec(number(5) * RAD_PER_DEG, number(6) * RAD_PER_DEG);
            let off_arcsec = star.direction.angle_to(&place) * ARCSEC_PER_RAD;
            assert!(off_arcsec < SAME_PLACE_ARCSEC, "{line}: {off_arcsec}″");
            let apart_mag = f64::from(star.v_mag) - number(4);
            let same = apart_mag.abs() < SAME_V_MAG || cells[2] == LONG_PERIOD_VARIABLE;
            assert!(same, "{line}: {}", star.v_mag);
            assert_eq!(find(id), Some(cells[2]));
            rows += 1;
        }
        assert_eq!(names().by_skymap.len(), rows);
        assert!(rows > 300);
    }

    #[test]
    fn designations_are_those_of_the_catalogue() {
        // The table spells letters and numbers as SIMBAD does: alf, ksi, tet, gam02.
        let catalog = Catalog::built_in();
        let mut compared = 0;
        for line in TABLE.lines().skip(1) {
            let cells: Vec<&str> = line.split(',').collect();
            let index = catalog
                .find(StarId::Skymap(cells[0].parse().unwrap()))
                .unwrap();
            let Some((letter, constellation)) = cells[3].split_once(' ') else {
                panic!("{line}");
            };
            let Some(known) = catalog.name_of(index) else {
                assert!(
                    constellation.parse::<u32>().is_ok() || letter.len() == 1,
                    "{line}"
                );
                continue;
            };
            if letter == "HR" {
                continue;
            }
            let letter = match letter.trim_end_matches(|c: char| c.is_ascii_digit()) {
                "alf" => "alp",
                "ksi" => "xi",
                "tet" => "the",
                "" => letter,
                other => other,
            };
            let is_it = |word: &str| word.trim_end_matches(|c: char| c.is_ascii_digit()) == letter;
            let mut words = known.split(' ');
            let same = words.clone().any(|word| is_it(word) || word == letter);
            // SKY2000 has no letter for upsilon 3 Eridani, which is 43 Eridani.
            assert!(same || cells[2] == "Beemim", "{line}: {known}");
            assert_eq!(words.next_back(), Some(constellation), "{line}: {known}");
            compared += 1;
        }
        assert!(compared > 300, "{compared}");
    }

    #[test]
    fn stars_are_known_by_their_hipparcos_number_too() {
        let rigel = HipparcosId::new(24436, None)
            .map(StarId::Hipparcos)
            .unwrap();
        assert_eq!(find(rigel), Some("Rigel"));
        assert_eq!(find(StarId::Skymap(5_140_095)), Some("Rigel"));
        for id in [
            StarId::Skymap(1),
            StarId::Number(24436),
            StarId::Named(5_140_095),
        ] {
            assert_eq!(find(id), None);
        }
    }
}
