//! All stars around an answer: those of the deep catalogue, with the names of the other one.

use crate::base::units::RAD_PER_ARCSEC;
use crate::catalog::deep::Region;
use crate::catalog::sky_grid::chord_of;
use crate::catalog::{Catalog, CatalogError, Star, StarFlags, StarId, StarIndex};

/// A star of both catalogues is one within this distance, and of about this brightness.
const SAME_RAD: f64 = 3.0 * RAD_PER_ARCSEC;
const SAME_MAG: f32 = 1.5;

/// The stars of a region: `deep` ones, of an epoch unless their proper motion is known, and those of `known` beside
/// them. A star of both has the
/// position of the deep one, and the name, the magnitude and the color of the other.
pub fn merged(
    title: String,
    mut deep: Vec<Star>,
    epoch_year: Option<f64>,
    known: &Catalog,
    region: &Region,
) -> Result<Catalog, CatalogError> {
    let years = epoch_year.map_or(0.0, |year| year - known.epoch_year());
    let mut names = Vec::new();
    let mut added = Vec::new();
    // By declination, so that those near a star are neighbors.
    deep.sort_by(|a, b| height(a).total_cmp(&height(b)));
    for (index, star) in known.stars().iter().enumerate() {
        if !region.contains(&star.direction) {
            continue;
        }
        match same_as(star, &deep, years) {
            Some(place) => deep[place] = both(star, &deep[place], years),
            None => added.push(*star),
        }
        if let Some(name) = known.name_of(StarIndex::new(index)) {
            names.push((star.id, name.to_owned()));
        }
    }
    deep.extend(added);
    // Two of one name: the deep catalogue has a pair where the other has one star.
    deep.sort_by_key(|star| star.id);
    deep.dedup_by_key(|star| star.id);
    Catalog::new(title, deep, names)
}

fn height(star: &Star) -> f64 {
    star.direction.as_vector().z
}

/// The place among `deep`, by declination, of the star that is nearest to a known one, if it may be the same.
fn same_as(star: &Star, deep: &[Star], years: f64) -> Option<usize> {
    let (now, there) = (star.direction, star.direction_at(years));
    let heights = [now.as_vector().z, there.as_vector().z];
    let lowest = heights[0].min(heights[1]) - SAME_RAD;
    let highest = heights[0].max(heights[1]) + SAME_RAD;
    let from = deep.partition_point(|other| height(other) < lowest);
    let near = deep[from..]
        .iter()
        .take_while(|other| height(other) <= highest);
    let limit = chord_of(SAME_RAD).powi(2);
    let distance_sq = |other: &Star| {
        // With proper motion it is where it was at the epoch of the known stars.
        let expected = match other.flags.contains(StarFlags::NO_PROPER_MOTION) {
            true => &there,
            false => &now,
        };
        (other.direction.as_vector() - expected.as_vector()).norm_squared()
    };
    near.enumerate()
        .filter(|(_, other)| (other.v_mag - star.v_mag).abs() < SAME_MAG)
        .filter(|(_, other)| !matches!(other.id, StarId::Skymap(_)))
        .map(|(place, other)| (from + place, distance_sq(other)))
        .filter(|(_, distance_sq)| *distance_sq <= limit)
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .map(|(place, _)| place)
}

/// A star of both catalogues.
fn both(known: &Star, deep: &Star, years: f64) -> Star {
    if !deep.flags.contains(StarFlags::NO_PROPER_MOTION) {
        return Star {
            direction: deep.direction,
            pm_ra_mas_per_yr: deep.pm_ra_mas_per_yr,
            pm_dec_mas_per_yr: deep.pm_dec_mas_per_yr,
            ..*known
        };
    }
    let at_epoch = Star {
        direction: deep.direction,
        ..*known
    };
    Star {
        direction: at_epoch.direction_at(-years),
        ..*known
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::coords::{Icrs, UnitVector};
    use crate::base::units::RAD_PER_DEG;
    use crate::catalog::PlaceId;

    fn at(ra_deg: f64, dec_deg: f64) -> UnitVector<Icrs> {
        UnitVector::from_ra_dec(ra_deg * RAD_PER_DEG, dec_deg * RAD_PER_DEG)
    }

    fn deep_star(ra_deg: f64, dec_deg: f64, v_mag: f32) -> Star {
        let direction = at(ra_deg, dec_deg);
        Star::new(StarId::Place(PlaceId::of(&direction)), direction, v_mag)
    }

    #[test]
    fn a_deep_star_with_proper_motion_is_compared_at_the_epoch_of_the_known_ones() {
        let motion = |star: Star| Star {
            pm_dec_mas_per_yr: 1000.0,
            flags: StarFlags::NONE,
            ..star
        };
        let fast = motion(Star::new(StarId::Skymap(7), at(20.0, 30.0), 6.0));
        let known = Catalog::new("known", vec![fast], Vec::new()).unwrap();
        let deep = motion(deep_star(20.0, 30.0 + 0.5 / 3600.0, 6.1));
        let region = Region {
            centre: at(20.0, 30.0),
            radius_rad: RAD_PER_DEG,
            per_sq_deg: 100.0,
        };
        let title = "both".to_owned();
        let both = merged(title, vec![deep], Some(2016.0), &known, &region).unwrap();
        assert_eq!(both.stars().len(), 1);
        assert_eq!(both.stars()[0].id, fast.id);
        assert_eq!(both.stars()[0].direction, deep.direction);
    }

    #[test]
    fn stars_of_both_catalogues_have_the_name_of_one_and_the_position_of_the_other() {
        let mut fast = Star::new(StarId::Skymap(7), at(20.0, 30.0), 6.0);
        fast.pm_dec_mas_per_yr = 1000.0;
        fast.flags = StarFlags::NONE;
        let lone = Star::new(StarId::Skymap(8), at(20.3, 30.0), 5.0);
        let outside = Star::new(StarId::Skymap(9), at(50.0, 30.0), 5.0);
        let names = vec![(StarId::Skymap(7), "7 And".to_owned())];
        let known = Catalog::new("known", vec![fast, lone, outside], names).unwrap();
        // 25″ north of where it was in 2000, and 0.3″ east.
        let moved = deep_star(20.0 + 0.3 / 3600.0 / 0.866, 30.0 + 25.0 / 3600.0, 6.1);
        let faint = deep_star(20.0, 30.0, 11.0);
        let region = Region {
            centre: at(20.0, 30.0),
            radius_rad: RAD_PER_DEG,
            per_sq_deg: 100.0,
        };
        let title = "both".to_owned();
        let both = merged(title, vec![faint, moved], Some(2025.0), &known, &region).unwrap();
        let ids: Vec<StarId> = both.stars().iter().map(|star| star.id).collect();
        assert_eq!(ids, [lone.id, fast.id, faint.id]);
        assert_eq!(both.name_of(StarIndex::new(1)), Some("7 And"));
        let star = both.stars()[1];
        assert_eq!(star.v_mag, 6.0);
        let off_arcsec = star.direction.angle_to(&fast.direction) / RAD_PER_ARCSEC;
        assert!((off_arcsec - 0.3).abs() < 0.02, "{off_arcsec}");
    }
}
