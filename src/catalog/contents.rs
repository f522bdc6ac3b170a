//! The contents of a catalogue, validated.

use super::star::{MAG_LIMIT, PM_LIMIT_MAS_PER_YR, mmag};
use super::{CatalogError, Star, StarId};

/// The longest name that the compact form holds, in bytes.
pub(super) const NAME_BYTES_MAX: usize = 255;

/// What the compact form holds.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Contents {
    pub(super) title: String,
    pub(super) epoch_year: f64,
    /// Ordered by (V, identifier).
    pub(super) stars: Vec<Star>,
    /// Ordered by the index of the star.
    pub(super) names: Vec<StarName>,
}

/// The name of a star.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct StarName {
    pub(super) star_index: u32,
    pub(super) text: Box<str>,
}

impl Contents {
    /// Sorts and validates the stars and their names.
    pub(super) fn new(
        title: String,
        epoch_year: f64,
        mut stars: Vec<Star>,
        names: Vec<(StarId, String)>,
    ) -> Result<Self, CatalogError> {
        stars.iter().try_for_each(check_range)?;
        stars.sort_unstable_by_key(|star| (mmag(star.v_mag), star.id));
        let names = resolve_names(&stars, names)?;
        Ok(Self {
            title,
            epoch_year,
            stars,
            names,
        })
    }
}

fn check_range(star: &Star) -> Result<(), CatalogError> {
    let mag = (MAG_LIMIT, "-32 to 32 mag");
    let motion = (PM_LIMIT_MAS_PER_YR, "-32767 to 32767 mas/yr");
    let excess_length = star.direction.as_vector().norm() as f32 - 1.0;
    for (quantity, value, (limit, expected)) in [
        ("V", star.v_mag, mag),
        ("B-V", star.bv_mag.unwrap_or(0.0), mag),
        ("proper motion in RA", star.pm_ra_mas_per_yr, motion),
        ("proper motion in Dec", star.pm_dec_mas_per_yr, motion),
        (
            "length of the direction vector minus 1",
            excess_length,
            (1e-6, "0, within 1e-6"),
        ),
    ] {
        // NaN is out of range, too.
        let in_range = value.abs() <= limit;
        if !in_range {
            return Err(CatalogError::OutOfRange {
                id: star.id,
                quantity,
                value: f64::from(value),
                expected,
            });
        }
    }
    Ok(())
}

/// Replaces the identifiers of the named stars by their indices, and checks identifiers and names.
fn resolve_names(
    stars: &[Star],
    mut names: Vec<(StarId, String)>,
) -> Result<Vec<StarName>, CatalogError> {
    let mut by_id: Vec<(StarId, u32)> = stars.iter().map(|star| star.id).zip(0..).collect();
    by_id.sort_unstable();
    if let Some(pair) = by_id.windows(2).find(|pair| pair[0].0 == pair[1].0) {
        return Err(CatalogError::DuplicateStar { id: pair[0].0 });
    }
    names.sort_unstable();
    let mut resolved = Vec::with_capacity(names.len());
    let mut previous = None;
    for (id, name) in names {
        let bad = |name: String, expected| Err(CatalogError::BadName { id, name, expected });
        let Ok(position) = by_id.binary_search_by_key(&id, |entry| entry.0) else {
            return bad(name, "the name of a star in the catalog");
        };
        if previous.replace(id) == Some(id) {
            return bad(name, "one name per star");
        }
        if name.is_empty() || name.len() > NAME_BYTES_MAX {
            return bad(name, "a name of 1 to 255 bytes");
        }
        resolved.push(StarName {
            star_index: by_id[position].1,
            text: name.into(),
        });
    }
    resolved.sort_unstable_by_key(|name| name.star_index);
    Ok(resolved)
}
