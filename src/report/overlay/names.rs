//! The label of a star: its name and magnitude.

use super::options::LabelKind;
use crate::catalog::{Catalog, StarIndex};
use crate::ephemeris::solar_system::Body;

/// What is written beside a star.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct StarLabel {
    /// The star's name or number, and its V magnitude: `Sirius −1.4`, `α CMi 0.4`, `HD 12345 7.2`.
    pub(super) text: String,
    /// Whether it has a name or number of the kind that is wanted.
    pub(super) has_name: bool,
    /// How early it gets a place, least first: its V magnitude, less for stars with a name.
    pub(super) rank: f32,
}

impl StarLabel {
    /// The label of a star.
    pub(super) fn of_star(catalog: &Catalog, star: StarIndex, kind: LabelKind) -> Self {
        let name = || catalog.short_name(star);
        let numbers = catalog.numbers_of(star);
        let hd = || numbers.hd.map(|number| format!("HD {number}"));
        let hip = || numbers.hip.map(|number| format!("HIP {number}"));
        /// Proper names go before stars that are brighter by this, letters and numbers of constellations by that.
        const PROPER_MAG: f32 = 3.0;
        const LETTER_MAG: f32 = 1.5;
        let wanted = match kind {
            LabelKind::Name => name(),
            LabelKind::Hd => hd(),
            LabelKind::Hip => hip(),
        };
        let has_name = wanted.is_some();
        let called = wanted.unwrap_or_else(|| catalog.label(star));
        let v_mag = catalog.star(star).v_mag;
        let fame = if catalog.proper_name(star).is_some() {
            PROPER_MAG
        } else if catalog.name_of(star).is_some() {
            LETTER_MAG
        } else {
            0.0
        };
        Self {
            text: with_magnitude(&called, v_mag),
            has_name,
            rank: v_mag - fame,
        }
    }

    /// The label of the Moon or a planet.
    pub(super) fn of_body(body: &Body) -> Self {
        let v_mag = body.v_mag as f32;
        Self {
            text: with_magnitude(body.kind.name(), v_mag),
            has_name: true,
            // Before all stars.
            rank: v_mag - 20.0,
        }
    }
}

fn with_magnitude(called: &str, v_mag: f32) -> String {
    let rounded = format!("{v_mag:.1}");
    let rounded = if rounded == "-0.0" { "0.0" } else { &rounded };
    format!("{called} {}", rounded.replace('-', "−"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_star_is_called_by_what_is_wanted_and_else_by_the_next() {
        let catalog = Catalog::built_in();
        let called = |star, kind| StarLabel::of_star(catalog, star, kind);
        let sirius = StarIndex::new(0);
        assert_eq!(called(sirius, LabelKind::Name).text, "Sirius −1.4");
        assert_eq!(called(sirius, LabelKind::Hd).text, "HD 48915 −1.4");
        assert_eq!(called(sirius, LabelKind::Hip).text, "HIP 32349 −1.4");
        let stars = || (0..catalog.stars().len()).map(StarIndex::new);
        let is_lettered = |star: &StarIndex| {
            let letter = catalog
                .name_of(*star)
                .is_some_and(|name| name.contains("gam "));
            letter && catalog.proper_name(*star).is_none()
        };
        let lettered = stars().find(is_lettered).unwrap();
        assert!(called(lettered, LabelKind::Name).text.starts_with('γ'));
        let is_nameless = |star: &StarIndex| {
            let numbers = catalog.numbers_of(*star);
            catalog.name_of(*star).is_none() && numbers.hd.is_some() && numbers.hip.is_none()
        };
        let nameless = called(stars().find(is_nameless).unwrap(), LabelKind::Hip);
        assert!(nameless.text.starts_with("HD ") && !nameless.has_name);
        let without_numbers = |star: &StarIndex| {
            let numbers = catalog.numbers_of(*star);
            catalog.full_name(*star).is_none() && numbers.hd.is_none() && numbers.hip.is_none()
        };
        let last = called(stars().find(without_numbers).unwrap(), LabelKind::Name);
        assert!(last.text.starts_with("SKYMAP "));
    }
}
